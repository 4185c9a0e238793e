# SPDX-License-Identifier: Apache-2.0
"""Results of an earlier run, reused where nothing has changed that they were made from."""

import json
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from uuid import uuid4

import plenofir
from plenofir.ground.files import Results, as_text, checksum

_FAULTS = (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError)


def content_mark(path: Path) -> str:
    """What changes with the content of a file, or of a folder with all that is in it.

    Of anything else (a pipe, a folder with links to folders) it is never the same.
    """
    # What can't be read is never the same.
    with suppress(OSError):
        if path.is_file():
            return checksum(path)
        if path.is_dir():
            return sha256(repr(list(_contents(path))).encode()).hexdigest()
    return uuid4().hex


def _contents(folder: Path) -> Iterator[tuple[str, str]]:
    """Names and marks of what is in a folder, but for Python's own files."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if path.is_dir() and path.is_symlink():
            raise OSError(f"{path} is a link to a folder")
        if not path.is_dir() and "__pycache__" not in name.parts:
            yield as_text(name), content_mark(path)


@cache
def program_mark() -> str:
    """Version of this program, and whether films can be written."""
    # Files are compared, not numbers: a checkout changes without a new one.
    return f"{content_mark(Path(plenofir.__file__).parent)} {find_spec('cv2') is not None}"


def key_of(*facts: object) -> str:
    """Key of a result: all that it is made from, by this program."""
    return sha256(repr((program_mark(), *facts)).encode()).hexdigest()


class Earlier:
    """Files of an earlier run in a folder, by the keys that its report has of them."""

    def __init__(self, folder: Path, report: str) -> None:
        self.folder = folder
        self.report: dict[str, Any] = {}
        self.names: dict[str, str] = {}  # of its files, by their keys
        # Keys of the files of this run, and which of them were reused.
        self.keys: dict[str, str] = {}
        self.reused: list[str] = []
        # A report that is absent or damaged has nothing to reuse.
        with suppress(*_FAULTS):
            self.report = json.loads((folder / report).read_bytes())
            self.names = {key: Path(name).name for name, key in self.report["keys"].items()}

    def take(self, name: str, key: str, results: Results) -> bool:
        """Put the file with a key among the results; False if there is none, or it was changed."""
        self.keys[name] = key
        try:
            old = self.names[key]
            content = (self.folder / old).read_bytes()
            if sha256(content).hexdigest() != self.report["sha256"][old]:
                return False
        except _FAULTS:
            return False
        results.write(name, content)
        self.reused.append(name)
        return True

    def forget(self, name: str, results: Results) -> None:
        """Note that this run has no such file, so none of an earlier run either."""
        self.keys.pop(name, None)
        if name in self.reused:
            self.reused.remove(name)
            results.path(name).unlink()
