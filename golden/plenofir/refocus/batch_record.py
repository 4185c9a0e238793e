# SPDX-License-Identifier: Apache-2.0
"""Record of a batch: a line is appended for each finished frame; one run at a time.

A run that is killed while it writes leaves an incomplete line, which the next run removes.
"""

import os
from hashlib import file_digest
from pathlib import Path
from types import TracebackType

from pydantic import BaseModel, ConfigDict, ValidationError

from plenofir.ground.errors import InputError
from plenofir.ground.files import cannot_write
from plenofir.ground.locks import lock_file

RECORD = "batch.jsonl"
_OLD_RECORD = "batch.json"


class Content(BaseModel):
    """Content of a file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    size: int
    sha256: str

    def is_in(self, path: Path) -> bool:
        """Whether a file has this content; reads the whole file."""
        try:
            with path.open("rb") as file:
                return (
                    os.fstat(file.fileno()).st_size == self.size
                    and file_digest(file, "sha256").hexdigest() == self.sha256
                )
        except OSError:
            return False


class Entry(BaseModel):
    """A frame that is done."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    source: str
    mark: str  # changes with the frame's file and with what is done to it
    results: dict[str, Content]  # by their names


class Record:
    """The record in a folder, created if missing, and locked during the block.

    `entries` are the last ones of each mark.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / RECORD
        self.entries: dict[str, Entry] = {}
        self._file = -1

    def __enter__(self) -> "Record":
        """Lock and read it."""
        old = self.path.with_name(_OLD_RECORD)
        if old.exists():
            raise InputError(
                "is the record of an earlier version, which does not tell what the results "
                "hold; delete it, and all frames are made again",
                where=str(old),
            )
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            # Windows would write "\r\n" for "\n".
            flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
            self._file = os.open(self.path, flags, 0o666)
            try:
                self._lock()
                self._read()
            except BaseException:
                os.close(self._file)
                raise
        except OSError as error:
            raise cannot_write(self.path, error) from None
        return self

    def _lock(self) -> None:
        try:
            lock_file(self._file, wait=False)
        except BlockingIOError:
            raise InputError(
                "another run is writing here; let it end first", where=str(self.path.parent)
            ) from None

    def _read(self) -> None:
        data = self.path.read_bytes()
        *lines, half = data.split(b"\n")
        for number, line in enumerate(lines, 1):
            try:
                entry = Entry.model_validate_json(line)
            except ValidationError:
                raise InputError(
                    f"line {number} is damaged; delete the file to make all frames again",
                    where=str(self.path),
                ) from None
            self.entries[entry.mark] = entry
        if half:
            os.ftruncate(self._file, len(data) - len(half))

    def add(self, entry: Entry) -> None:
        """Append a frame that is done."""
        # Not flushed to the disk: a lost line only costs making its frame again.
        rest = memoryview(entry.model_dump_json().encode() + b"\n")
        try:
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError as error:
            raise cannot_write(self.path, error) from None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it, which unlocks it."""
        os.close(self._file)
