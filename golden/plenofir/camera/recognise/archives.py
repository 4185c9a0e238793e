# SPDX-License-Identifier: Apache-2.0
"""Archives: unpacked into a temporary folder and read as what they hold."""

import zipfile
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from plenofir.camera.recognise.source import LightFieldSource
from plenofir.camera.recognise.storage import Stored
from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.images import Picture

# Kilobytes can unpack to any size, so the promised sizes are summed before a byte is written.
_LARGEST, _MOST_FILES = 4 << 30, 20_000


def read_archive(
    path: Path, read: Callable[[Path], Stored | LightFieldSource]
) -> Stored | LightFieldSource:
    """What a .zip file holds: views in folders, or one file.

    The temporary folder goes with the pixels. Raises `InputError` for archives that are damaged,
    encrypted, or unpack to more than 4 GiB.
    """
    # The folder is removed with this object, which the pixels refer to.
    temporary = TemporaryDirectory(prefix="plenofir-")
    folder = Path(temporary.name)
    try:
        _unpack(input_file(path), folder)
    except InputError:
        raise
    except (OSError, ValueError, RuntimeError, NotImplementedError, zlib.error) as error:
        reason = " ".join(str(error).replace(str(folder), "").split()) or type(error).__name__
        raise InputError(
            f"cannot be unpacked ({reason[:200]}); copy it again, or unpack it and give the folder",
            where=str(path),
        ) from None
    except zipfile.BadZipFile as error:
        raise InputError(f"is damaged ({error}); copy it again", where=str(path)) from None
    files = [each for each in folder.rglob("*") if each.is_file()]

    def outside(text: str) -> str:
        return text.replace(str(folder), str(path))

    try:
        held = read(files[0] if len(files) == 1 else folder)
    except InputError as error:
        raise InputError(outside(error.problem), where=outside(error.where)) from None
    if isinstance(held, LightFieldSource):
        return held
    at, name_at = held.at, held.name_at

    def picture_at(place: tuple[int, ...]) -> Picture:
        assert temporary.name  # Which keeps the folder.
        return at(place)

    return replace(
        held,
        path=path,
        at=picture_at,
        name_at=lambda place: outside(name_at(place)),
        findings=tuple(f._replace(text=outside(f.text)) for f in held.findings),
    )


def _unpack(path: Path, folder: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        members = [one for one in archive.infolist() if not one.is_dir()]
        members = [one for one in members if not Path(one.filename).name.startswith(".")]
        if not members:
            raise InputError("is an archive without files", where=str(path))
        total = sum(one.file_size for one in members)
        if total > _LARGEST or len(members) > _MOST_FILES:
            raise InputError(
                f"unpacks to {len(members)} files of {total >> 20} MiB; at most {_MOST_FILES} and "
                "4 GiB are read: unpack what belongs to the light field",
                where=str(path),
            )
        for one in members:
            # Reads no more than the size that was told, and compares the checksum.
            archive.extract(one, folder)
