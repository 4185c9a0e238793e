# SPDX-License-Identifier: Apache-2.0
"""The container of Lytro's files (.lfp, .lfr): sections with a magic number, a length and a name.

After a header of 16 bytes come sections. Each begins with 12 bytes that tell its kind (LFM: a table
of contents in JSON; LFC: content), 4 bytes of length (big endian), and, if that is not 0, the name
of the content, its SHA-1, padded with zeros to 80 bytes. Zeros fill the space after the content.
The format is not published; this is what N. Patel's lfptools and the readers of imageio know of it.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file

MAGIC = b"\x89LFP\r\n\x1a\n"
_KINDS = {b"\x89LFM\r\n\x1a\n": "table", b"\x89LFC\r\n\x1a\n": "content"}
_HEAD, _NAME = 16, 80
# A foreign file of many gigabytes is refused by its size, before it fills the memory.
_LARGEST_FILE = 1 << 30
# A parser needs many times a text's size in memory: a damaged size must not decide that.
_LARGEST_JSON = 1 << 24
_COPY = "copy the file again"

Json = Mapping[str, Any]
Contents = Literal["raw", "stack", "depth", "storage", "other"]


@dataclass(frozen=True, eq=False)
class Container:
    """Kind of a container's content."""

    where: str
    table: Json  # Table of contents.
    sections: Mapping[str, bytes]  # Name (``sha1-...``) to content, in the order of the file.

    @property
    def frame(self) -> Json | None:
        """References of the first raw frame, where there is one."""
        for path in (("picture", "frameArray", 0, "frame"), ("frames", 0, "frame")):
            frame = part_of(self.table, *path)
            if isinstance(frame, Mapping) and self.named(frame.get("imageRef")) is not None:
                return frame
        return None

    @property
    def contents(self) -> Contents:
        """Kind of content: raw frame, refocused pictures, only their depth, stored files, other."""
        if self.frame is not None:
            return "raw"
        if "files" in self.table:
            return "storage"
        # Pictures are JPEGs, or frames of an H.264 stream that only the table of contents names.
        parts = part_of(self.table, "picture", "accelerationArray")
        kinds = {part_of(part, "type") for part in parts} if isinstance(parts, list) else set()
        jpeg = any(part.startswith(b"\xff\xd8\xff") for part in self.sections.values())
        if jpeg or "com.lytro.acceleration.refocusStack" in kinds:
            return "stack"
        return "depth" if "com.lytro.acceleration.depthMap" in kinds else "other"

    def named(self, name: object) -> bytes | None:
        """Content with a name."""
        return self.sections.get(name) if isinstance(name, str) else None


def part_of(content: Any, *path: str | int) -> Any:
    """A part of nested objects and lists, or None if it does not exist."""
    for step in path:
        if isinstance(step, str) and isinstance(content, Mapping):
            content = content.get(step)
        elif isinstance(step, int) and isinstance(content, list) and len(content) > step:
            content = content[step]
        else:
            return None
    return content


def read_json(data: bytes, where: str) -> Json:
    """Object in JSON, which cameras may end with zeros."""
    if len(data) > _LARGEST_JSON:
        raise InputError(
            f"has {len(data) >> 20} MiB of metadata, more than the 16 that a camera writes",
            where=where,
        )
    try:
        content = json.loads(data.rstrip(b"\0").decode("utf-8"))
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, Mapping):
        raise InputError(f"its metadata are not a JSON object; {_COPY}", where=where)
    return content


def is_container(path: Path) -> bool:
    """Whether a file begins like a container."""
    try:
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except (OSError, ValueError):
        return False


def file_bytes(path: Path, advice: str) -> bytes:
    """Content of an input file."""
    where = str(path)
    try:
        if not path.is_file():
            problem = "is no file" if path.exists() else "no such file"
            raise InputError(f"{problem}; {advice}", where=where)
        if path.stat().st_size > _LARGEST_FILE:
            size = f"{path.stat().st_size >> 20} MiB"
            raise InputError(f"is too large ({size}); {advice} of at most 1024 MiB", where=where)
        return input_file(path).read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot be read ({reason}); {advice}", where=where) from None


def read_container(path: Path) -> Container:
    """Read a container.

    `path`: file ending in .lfp or .lfr, whatever its name. Result: table of contents and sections;
    each is what its SHA-1 says. Raises `InputError` if it is no container, is cut off, or a section
    is damaged.
    """
    where = str(path)
    data = file_bytes(path, "give a Lytro file (.lfp, .lfr)")
    if not data.startswith(MAGIC):
        raise InputError(
            "is not a Lytro file: it does not begin with the bytes 89 LFP", where=where
        )
    tables: list[bytes] = []
    sections: dict[str, bytes] = {}
    place, number = _HEAD, 0
    while place < len(data):
        kind = _KINDS.get(data[place : place + 8])
        if kind is None:
            # Zeros up to the next section, or to the end of the file.
            if data[place] == 0:
                place += len(data) - place - len(data[place:].lstrip(b"\0"))
                continue
            raise InputError(f"has no section at byte {place}; {_COPY}", where=where)
        size = int.from_bytes(data[place + 12 : place + _HEAD], "big")
        begin = place + _HEAD + (_NAME if size else 0)
        content = data[begin : begin + size]
        if len(data) < place + _HEAD or len(content) < size:
            problem = f"ends in section {number}: {len(content)} of {size} bytes"
            raise InputError(f"{problem}; {_COPY}", where=where)
        name = data[place + _HEAD : begin].rstrip(b"\0").decode("ascii", "replace")
        # The format's own checksum, which systems that forbid SHA-1 for signatures allow.
        digest = hashlib.sha1(content, usedforsecurity=False).hexdigest()
        if size and name != f"sha1-{digest}":
            problem = f"section {number} is damaged (its SHA-1 is not {name[:16]!r}...)"
            raise InputError(f"{problem}; {_COPY}", where=where)
        if kind == "table":
            tables.append(content)
        elif size:
            sections[name] = content
        place, number = begin + size, number + 1
    if not tables:
        raise InputError(f"has no table of contents; {_COPY}", where=where)
    return Container(where, read_json(tables[0], where), sections)
