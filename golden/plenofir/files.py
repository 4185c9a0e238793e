"""Writing results: refused before any work is done, then all files at once or none."""

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from plenofir.errors import InputError


def _cannot_write(out: Path, error: OSError) -> InputError:
    return InputError(
        f"cannot write: {error.strerror}",
        where=f"OUT ({out})",
        expected="a folder that can be written, with enough room",
    )


def publish(texts: Mapping[str, str], out: Path) -> None:
    """Write text files into a folder, each replacing its predecessor in one step."""
    try:
        with tempfile.TemporaryDirectory(prefix="plenofir-") as staging:
            for name, text in texts.items():
                (Path(staging) / name).write_text(text)
            publish_files(Path(staging), out)
    except OSError as error:
        raise _cannot_write(out, error) from None


def publish_files(results: Path, out: Path) -> None:
    """Copy the files of a folder into another, each replacing its predecessor in one step."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out, prefix=".plenofir-") as staging:
            for file in results.iterdir():
                if file.is_file():
                    shutil.copy(file, staging)
            for file in sorted(Path(staging).iterdir()):
                file.replace(out / file.name)
    except OSError as error:
        raise _cannot_write(out, error) from None


_FOLDER = "a folder that can be written"


def check_folder(folder: Path, where: str) -> None:
    """Refuse a folder for results that cannot be written, whether it exists or not."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"{existing} is not a folder", where=where, expected=_FOLDER)
    try:
        # A trial says more than the permission bits: root, read-only and full file systems.
        with tempfile.TemporaryDirectory(dir=existing, prefix=".plenofir-"):
            pass
    except OSError as error:
        what = f"{existing} cannot be written ({error.strerror})"
        raise InputError(what, where=where, expected=_FOLDER) from None
