# SPDX-License-Identifier: Apache-2.0
"""Compiled code on disk: a damaged, truncated or stale file is ignored.

numba's cache files have no checksum, and depend only on the function's own source: a truncated file
makes every later call fail, flipped bits are executed, and changes of inlined functions in other
modules go unnoticed. Here each variant is one file that begins with a hash of the sources it was
made from and one of its content.
"""

import pickle
from collections.abc import Callable, Iterable
from contextlib import suppress
from hashlib import sha256
from inspect import getfile
from pathlib import Path
from typing import Any, TypeVar, cast
from uuid import uuid4

import llvmlite
import numba
from numba.core.caching import FunctionCache, NullCache
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps

from plenofir.ground import compiling

Work = TypeVar("Work", bound=Callable[..., Any])

_HASH_BYTES = 32


class Files:
    """The variants of a function."""

    def __init__(self, folder: Path, name: str, made_from: bytes) -> None:
        self._folder, self._name = folder, name
        self._made_from = sha256(made_from).digest()

    def _path(self, key: bytes) -> Path:
        return self._folder / f"{self._name}.{sha256(key).hexdigest()[:16]}.code"

    def _head(self, key: bytes, content: bytes) -> bytes:
        whole = sha256(self._made_from)
        whole.update(b"%d " % len(key) + key + content)
        return self._made_from + whole.digest()

    def load(self, key: Any) -> Any:
        """What was saved; None if there is no valid file, so that it must be compiled."""
        name = repr(key).encode()
        path, kept = self._path(name), b""
        with suppress(OSError):
            kept = path.read_bytes()
        head, content = kept[: 2 * _HASH_BYTES], kept[2 * _HASH_BYTES :]
        if head == self._head(name, content):
            return pickle.loads(content)
        # Code of other sources is stale, and no damage.
        if head.startswith(self._made_from):
            compiling.hindered("damaged", f"{path} is damaged; it is compiled again")
        return None

    def save(self, key: Any, data: Any) -> None:
        """Save a variant; after an OSError the old file is still there."""
        name, content = repr(key).encode(), dumps(data)  # type: ignore[no-untyped-call]
        path = self._path(name)
        whole = path.with_suffix(f".{uuid4().hex}")
        try:
            whole.write_bytes(self._head(name, content) + content)
            whole.replace(path)
        except OSError as error:
            with suppress(OSError):
                whole.unlink()
            reason = error.strerror or str(error)
            compiling.hindered("unkept", f"code cannot be kept in {path.parent}: {reason}")
            raise


class KeptCode(FunctionCache):
    """Cache of a function's compiled variants, for a dispatcher of numba.

    Raises RuntimeError or OSError if there is no writable folder.
    """

    def __init__(self, function: Callable[..., Any], sources: Iterable[Path] = ()) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        versions = f"{numba.__version__} {llvmlite.__version__}"
        files = [Path(getfile(function)), *sources]
        made_from = versions.encode() + b"".join(sha256(f.read_bytes()).digest() for f in files)
        folder = Path(self.cache_path)
        self.files = Files(folder, self._impl.filename_base, made_from)
        self._cache_file: Any = self.files
        self._function = function.__name__

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The variant, or None: numba compiles it then."""
        # Numba loads its whole compiler first, which takes longer than all code of ours. What is on
        # disk needs no more than the memory of its arrays.
        rtsys.initialize(target_context)
        loaded = self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        if loaded is None:
            compiling.begin(self._function)
        return loaded

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save it, or continue without (a full disk)."""
        compiling.end(self._function)
        with suppress(OSError):
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


class Unkept(NullCache):
    """In the place of `KeptCode` where no folder can be written."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function.__name__
        nowhere_to_keep()

    def load_overload(self, sig: Any, target_context: Any) -> None:
        """Nothing: numba compiles the variant."""
        compiling.begin(self._function)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Forget it."""
        compiling.end(self._function)


def nowhere_to_keep() -> None:
    """Say that each process compiles anew."""
    compiling.hindered(
        "unkept",
        "no folder can be written that keeps compiled code, so each run compiles anew; set "
        "NUMBA_CACHE_DIR to one",
    )


def compiled(work: Work, fastmath: bool | set[str] = False, inlined: Iterable[Path] = ()) -> Work:
    """Compile for this machine at the first call; kept on disk if possible.

    `inlined`: other sources whose functions and numbers become part of the code.
    """
    dispatcher: Any = numba.njit(nogil=True, fastmath=fastmath)(work)
    try:
        dispatcher._cache = KeptCode(work, inlined)
    except (RuntimeError, OSError):
        dispatcher._cache = Unkept(work)
    return cast("Work", dispatcher)


def inner(work: Work) -> Work:
    """Compile for compiled functions only: without the way from Python, which takes longer."""
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast("Work", numba.njit(nogil=True, **options)(work))


def borrowing(work: Work) -> Work:
    """As `inner`, for functions that allocate nothing and are called by their like or by one owner.

    Numba counts the references of every array that is handed on, also as a part of a tuple: that
    takes a quarter of a picture's time. Only the owner of the arrays needs to count.
    """
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False}
    return cast("Work", numba.njit(nogil=True, **cast("Any", options))(work))
