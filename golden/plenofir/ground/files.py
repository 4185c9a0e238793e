# SPDX-License-Identifier: Apache-2.0
"""Writing results: checked before any work is done, then all files appear at once or none.

Every file is written in full beside its destination, flushed to the disk, and then renamed, so that
after a full disk, a killed run or a lost network the old file is still there. A command's results
never replace a file that it has read (`inputs_kept`, `input_file`).
"""

import contextlib
import errno
import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextvars import ContextVar
from hashlib import file_digest
from pathlib import Path
from types import TracebackType

from plenofir.ground.errors import InputError

_REMEDIES = {
    errno.ENOSPC: "make room on the disk",
    errno.EDQUOT: "make room within the quota",
    errno.EFBIG: "raise the limit for files (ulimit -f)",
    errno.ENAMETOOLONG: "use a shorter name",
    errno.EROFS: "use a file system that can be written",
    errno.ENOTDIR: "name a folder",
    errno.EEXIST: "name a folder",
    errno.EISDIR: "name a file, or what does not exist yet",
}

_inputs: ContextVar[set[Path] | None] = ContextVar("_inputs", default=None)


@contextlib.contextmanager
def inputs_kept() -> Iterator[None]:
    """Within the block no result may replace a file that was read in it, see `input_file`."""
    before = _inputs.set(set())
    try:
        yield
    finally:
        _inputs.reset(before)


def as_text(name: str | Path) -> str:
    """A file's name for a report or a page; bytes that are no text are escaped."""
    return os.fsencode(name).decode(errors="backslashreplace")


def input_file(path: Path) -> Path:
    """Register an input file, so that no result can overwrite it."""
    inputs = _inputs.get()
    if inputs is not None:
        inputs.add(path)
    return path


def cannot_write(path: Path, error: OSError, where: str = "") -> InputError:
    """One line for a failed write: the file, the cause, what to do."""
    where = where or str(path)
    subject = "" if where == str(path) else f"{path} "
    return InputError(
        f"{subject}cannot be written ({error.strerror or error}); "
        f"{_REMEDIES.get(error.errno or 0, 'you need permission to write there')}",
        where=where,
    )


def unusable(error: OSError) -> InputError:
    """One line for a refusal of the system: the file, the cause, what to do."""
    return InputError(
        f"{error.strerror or error}; "
        f"{_REMEDIES.get(error.errno or 0, 'does it exist, and may you use it?')}",
        where=str(error.filename or "the system"),
    )


def check_result(target: Path, where: str = "", inputs: Iterable[Path] = ()) -> None:
    """Refuse a place for a result that is a folder, or a file that the result is made from.

    That is any `input_file` so far, and those of `inputs`, which will be read later.
    """
    where = where or str(target)
    if target.is_dir():
        raise InputError(f"{target} is a folder; a file is to be written there", where=where)
    for path in {*(_inputs.get() or ()), *inputs}:
        # If one of them does not exist, they are different files.
        with contextlib.suppress(OSError):
            if target.samefile(path):
                raise InputError(
                    f"{target} would replace what it is made from; give another name", where=where
                )


def remove_results(targets: Iterable[Path]) -> None:
    """Remove files and whole folders of an earlier run, none if an `input_file` is among them."""
    # Two passes: nothing is removed if any of them holds an input.
    there = [target for target in targets if target.exists()]
    for target in there:
        for path in _inputs.get() or ():
            if path.resolve().is_relative_to(target.resolve()):
                raise InputError(
                    f"would be removed, but {path} is read; give another folder for results",
                    where=str(target),
                )
    for target in there:
        try:
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)
            else:
                target.unlink()
        except OSError as error:
            raise cannot_write(target, error) from None


def write_flushed(path: Path, content: bytes | memoryview | str) -> None:
    """Write a file and flush it to the disk, so that a full one is noticed; raises OSError."""
    with path.open("wb") as file:
        file.write(content.encode() if isinstance(content, str) else content)
        file.flush()
        os.fsync(file.fileno())


class Results:
    """Files that appear in a folder (made if missing) all together, when the block ends well."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._staging: tempfile.TemporaryDirectory[str] | None = None

    def path(self, name: str) -> Path:
        """Where a tool may write the file itself before the block ends."""
        assert self._staging is not None, "outside of the block"
        return Path(self._staging.name) / name

    def write(self, name: str, content: bytes | memoryview | str) -> None:
        """Write a file and flush it to the disk."""
        try:
            write_flushed(self.path(name), content)
        except OSError as error:
            raise cannot_write(self.folder / name, error) from None

    def __enter__(self) -> "Results":
        """Make the folder and a hidden one in it, where the files wait."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            # Within one file system a move happens at once or not at all.
            self._staging = tempfile.TemporaryDirectory(dir=self.folder, prefix=".plenofir-")
        except OSError as error:
            raise cannot_write(self.folder, error) from None
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Put the files in their places, or drop them after an error."""
        assert self._staging is not None
        with self._staging:
            if kind is not None:
                return
            names = sorted(os.listdir(self._staging.name))
            for name in names:
                # All places are looked at before the first file is moved.
                check_result(self.folder / name)
            for name in names:
                try:
                    self.path(name).replace(self.folder / name)
                except OSError as failure:
                    raise cannot_write(self.folder / name, failure) from None


def publish(files: Mapping[str, bytes | str], out: Path) -> None:
    """Write files (name to content) into a folder, all or none, see `Results`."""
    with Results(out) as results:
        for name, content in files.items():
            results.write(name, content)


def _of_earlier_run(report: Path) -> set[str]:
    """Names of the files that a report lists, of those in its folder."""
    try:
        names = json.loads(report.read_bytes())["files"]
        # A report may come from anybody: a name with a path would remove files elsewhere.
        if isinstance(names, list):
            return {name for name in names if name == Path(name).name} - {"", ".", ".."}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        pass
    return set()


def checksum(path: Path) -> str:
    """SHA-256 of a file, as reports have it."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def publish_run(folder: Path, out: Path, report: str) -> None:
    """Copy the files of a run into another folder, replacing those of an earlier run.

    The report, a JSON object among the files, gets a list of all of them, ``files``, and ``sha256``
    of the others. Files that the old report in `out` lists and this run does not have are removed,
    except those that the command has read; other files stay.
    """
    names = sorted(file.name for file in folder.iterdir() if file.is_file())
    content = json.loads((folder / report).read_bytes()) | {"files": names}
    others = [name for name in names if name != report]
    content["sha256"] = {name: checksum(folder / name) for name in others}
    (folder / report).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    old = {out / name for name in _of_earlier_run(out / report).difference(names)}
    read = {path.resolve() for path in _inputs.get() or ()}
    remove_results(path for path in old if path.is_file() and path.resolve() not in read)
    publish_files(folder, out)


def publish_files(folder: Path, out: Path) -> None:
    """Copy the files of a folder into another one, all or none, see `Results`."""
    with Results(out) as results:
        for file in sorted(folder.iterdir()):
            if file.is_file():
                try:
                    with file.open("rb") as source, results.path(file.name).open("wb") as copy:
                        shutil.copyfileobj(source, copy)
                        copy.flush()
                        os.fsync(copy.fileno())
                except OSError as error:
                    raise cannot_write(out / file.name, error) from None


def write_file(path: Path, content: bytes | str) -> None:
    """Write a file into an existing folder in one step, see `Results`."""
    if not path.parent.is_dir():
        raise InputError(f"there is no folder {path.parent}", where=str(path))
    publish({path.name: content}, path.parent)


def check_folder(folder: Path, where: str, names: Iterable[str] = ()) -> None:
    """Refuse a folder for results that cannot be written, or in which these names cannot be used.

    It need not exist yet; for names see `check_result`.
    """
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"{existing} is not a folder; name one that can be written", where=where)
    try:
        # A trial write detects more than the permission bits: root, read-only and full file
        # systems.
        with tempfile.TemporaryDirectory(dir=existing, prefix=".plenofir-"):
            pass
    except OSError as error:
        raise cannot_write(existing, error, where) from None
    for name in names:
        check_result(folder / name, where)
