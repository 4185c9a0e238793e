# SPDX-License-Identifier: Apache-2.0
"""Raw frames in files: containers, .raw files with metadata beside them, and sets of white images.

A set of white images is a folder, the .tar that the Illum's calibration data come in, or a storage
container of the first camera (data.C.0 and so on): pictures MOD_0000.RAW with MOD_0000.TXT beside.
"""

import tarfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path, PurePosixPath

from plenofir.camera.lytro.container import (
    Json,
    file_bytes,
    is_container,
    part_of,
    read_container,
    read_json,
)
from plenofir.camera.lytro.metadata import FrameMetadata, frame_metadata, steps_apart, steps_text
from plenofir.camera.lytro.sensor import Mosaic, packed_size, unpack
from plenofir.ground.errors import InputError

_METADATA_SUFFIXES = (".txt", ".TXT", ".json", ".JSON")
_CONTAINERS = (".lfp", ".lfr")
# Raw frames have no header: their size alone says which camera and packing they are of.
_CAMERA_OF_SIZE = {7728 * 5368 * 10 // 8: "Illum", 3280 * 3280 * 12 // 8: "F01"}
# A folder named by mistake (a home, a disk) is left after this many files.
_MOST_FILES = 20_000
# A member of an archive is unpacked into memory, whatever size its header claims.
_LARGEST_MEMBER = 1 << 28
FRAME_ADVICE = "give a Lytro .lfp or .lfr, or a .raw with its .txt or .json beside it"

Entries = Mapping[str, Callable[[], bytes]]


@dataclass(frozen=True, eq=False)
class Frame:
    """A raw frame: its metadata and its packed pixels."""

    where: str
    metadata: FrameMetadata
    data: bytes = field(repr=False)

    def mosaic(self) -> Mosaic:
        """Pixels, see `unpack`."""
        return unpack(self.data, self.metadata, self.where)


def is_lytro(path: Path) -> bool:
    """Whether a file is a container, or a .raw file as large as a Lytro's."""
    if is_container(path):
        return True
    try:
        fits = path.stat().st_size in _CAMERA_OF_SIZE
        return path.suffix.lower() == ".raw" and path.is_file() and (fits or bool(_beside(path)))
    except (OSError, ValueError):
        return False


def _beside(path: Path) -> Path | None:
    """Metadata beside a .raw file."""
    names = (path.with_suffix(suffix) for suffix in _METADATA_SUFFIXES)
    return next((name for name in names if name.is_file()), None)


def read_frame(path: Path) -> Frame:
    """Read a raw frame.

    `path`: a container, or a .raw file with metadata beside it (.txt, .json). Result: metadata, and
    as many bytes of pixels as they say. Raises `InputError` if there is no raw frame, no metadata,
    or they contradict each other.
    """
    where = str(path)
    if not is_container(path):
        data = file_bytes(path, FRAME_ADVICE)
        if path.suffix.lower() != ".raw":
            raise InputError(f"is not a Lytro file; {FRAME_ADVICE}", where=where)
        beside = _beside(path)
        if beside is None:
            camera = _CAMERA_OF_SIZE.get(len(data))
            problem = f"as large as a frame of an {camera}, but" if camera else "a .raw file, but"
            names = ", ".join(path.with_suffix(suffix).name for suffix in _METADATA_SUFFIXES)
            raise InputError(
                f"{problem} the metadata are missing; put one of {names} beside it, which tells "
                "where the micro lenses are",
                where=where,
            )
        content = read_json(file_bytes(beside, "the metadata of the frame"), str(beside))
        return _checked(where, frame_metadata(content, str(beside)), data)
    container = read_container(path)
    references = container.frame
    if references is None:
        problem = {
            "stack": "no raw frame: a stack of refocused pictures",
            "depth": "no raw frame: a depth map",
            "storage": "no raw frame: files stored by a camera (white images, for --white)",
        }.get(container.contents, "no raw frame")
        raise InputError(f"{problem}; give the .lfp or .lfr as it left the camera", where=where)
    text = container.named(references.get("metadataRef"))
    if text is None:
        raise InputError(f"its raw frame has no metadata; {FRAME_ADVICE}", where=where)
    private = container.named(references.get("privateMetadataRef"))
    data = container.named(references.get("imageRef")) or b""
    numbers: Json | None = read_json(private, where) if private else None
    return _checked(where, frame_metadata(read_json(text, where), where, numbers), data)


def _checked(where: str, metadata: FrameMetadata, data: bytes) -> Frame:
    """Frame whose bytes are as many as the metadata say."""
    if len(data) != packed_size(metadata):
        size = f"{metadata.width} x {metadata.height} pixels of {metadata.packing.bitsPerPixel} bit"
        raise InputError(
            f"has {len(data)} bytes of pixels; {size}, as the metadata say, take "
            f"{packed_size(metadata)}",
            where=where,
        )
    return Frame(where, metadata, data)


def _member(path: Path, name: str) -> bytes:
    with tarfile.open(path) as archive:
        member = archive.getmember(name)
        if member.size > _LARGEST_MEMBER:
            raise InputError(
                f"is too large: {member.size >> 20} MiB, at most 256 are read",
                where=f"{path}/{name}",
            )
        file = archive.extractfile(member)
        return file.read() if file is not None else b""


def _entries(path: Path) -> Entries:
    """Files of a set, by name."""
    advice = "give a folder, a .tar or a Lytro file with white images"
    try:
        if path.is_dir():
            files = [file for file in sorted(path.rglob("*")) if file.is_file()][:_MOST_FILES]
            entries: dict[str, Callable[[], bytes]] = {}
            for file in files:
                # Camera backups hold archives and containers with white images within folders.
                if file.suffix.lower() == ".tar" or (is_container(file) and not _raw_frame(file)):
                    entries |= _entries(file)
                else:
                    entries[str(file)] = partial(file_bytes, file, advice)
            return entries
        if path.suffix.lower() == ".tar":
            with tarfile.open(path) as archive:
                names = [member.name for member in archive if member.isfile()][:_MOST_FILES]
            return {f"{path}/{name}": partial(_member, path, name) for name in names}
    except (OSError, tarfile.TarError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"cannot be read ({reason}); {advice}", where=str(path)) from None
    if is_container(path) and not _raw_frame(path):
        container = read_container(path)
        stored: dict[str, Callable[[], bytes]] = {}
        for file in part_of(container.table, "files") or ():
            name, data = part_of(file, "name"), container.named(part_of(file, "dataRef"))
            if isinstance(name, str) and data is not None:
                stored[f"{path}/{name.replace(chr(92), '/')}"] = partial(bytes, data)
        return stored
    return {str(path): partial(file_bytes, path, advice)}


def _raw_frame(path: Path) -> bool:
    """Whether a container has a raw frame, by its name: those of a camera's storage do not."""
    return path.suffix.lower() in _CONTAINERS and not path.stem.lower().startswith("data.c")


@dataclass(frozen=True)
class White:
    """A white image that was chosen."""

    frame: Frame
    count: int  # number of the frames that fit, of which this one was taken
    apart: tuple[float, float]  # How far its zoom and focus steps are from the capture's.

    def described(self) -> str:
        """One line for people."""
        steps = steps_text(self.frame.metadata.lens)
        zoom, focus = self.apart
        text = f"{self.frame.where} ({steps}"
        if max(zoom, focus) < float("inf"):
            text += f"; {zoom:g} and {focus:g} from the capture's"
        return text + (f"), the nearest of {self.count}" if self.count > 1 else ")")


def nearest_white(path: Path, capture: FrameMetadata) -> White:
    """Take the white image that is nearest to a capture in zoom, then in focus.

    `path`: a white image as a raw frame, or a set of them. Raises `InputError` if none has the
    capture's size; the message tells what was looked for.
    """
    if not path.exists():
        raise InputError(f"no such file; {FRAME_ADVICE}", where=str(path))
    entries = _entries(path)
    candidates: list[tuple[tuple[float, float], str, FrameMetadata]] = []
    others, strangers = 0, set[str]()
    for name in entries:
        metadata = _white_metadata(name, entries, sole=len(entries) == 1)
        if metadata is None:
            continue
        if (metadata.width, metadata.height) != (capture.width, capture.height):
            others += 1
            continue
        # Another camera's array lies elsewhere on its sensor: the grid would be off at every lens.
        if capture.serial and metadata.serial and metadata.serial != capture.serial:
            strangers.add(metadata.serial)
            continue
        candidates.append((steps_apart(metadata.lens, capture.lens), name, metadata))
    if not candidates:
        problem = f"no white image among {len(entries)} files"
        if others:
            problem += f" ({others} of another size)"
        if strangers:
            problem += f" (those of {', '.join(sorted(strangers)[:3])} are another camera's)"
        looked = f"{capture.width} x {capture.height} pixels, {steps_text(capture.lens)}"
        if capture.serial:
            looked += f", camera {capture.serial}"
        raise InputError(
            f"{problem}; one of {looked} is needed (MOD_*.RAW with .TXT, .lfp or .lfr)",
            where=str(path),
        )
    apart, name, metadata = min(candidates, key=lambda one: one[:2])
    if Path(name).suffix.lower() in _CONTAINERS:
        frame = read_frame(Path(name))
    else:
        frame = _checked(name, metadata, entries[name]())
    return White(frame, len(candidates), apart)


def _white_metadata(name: str, entries: Entries, *, sole: bool) -> FrameMetadata | None:
    """Metadata of a file of a set, None where it is no white image."""
    pure = PurePosixPath(name)
    if pure.suffix.lower() in _CONTAINERS:
        return read_frame(Path(name)).metadata
    if pure.suffix.lower() != ".raw":
        if sole:
            raise InputError(f"has no raw frame; {FRAME_ADVICE}", where=name)
        return None
    if sole:  # A single .raw file: what is beside it is not among the entries.
        return read_frame(Path(name)).metadata
    for suffix in _METADATA_SUFFIXES:
        beside = str(pure.with_suffix(suffix))
        if beside in entries:
            return frame_metadata(read_json(entries[beside](), beside), beside)
    return None
