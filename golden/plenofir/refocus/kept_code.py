# SPDX-License-Identifier: Apache-2.0
"""Compiled code on disk: a damaged, truncated or stale file is ignored.

numba's cache files have no checksum, and depend only on the function's own source: a truncated file
makes every later call fail, flipped bits are executed, and changes of inlined functions in other
modules go unnoticed. Here each variant is one file that begins with a hash of all that it depends
on.
"""

import pickle
from collections.abc import Callable, Iterable
from contextlib import suppress
from hashlib import sha256
from inspect import getfile
from pathlib import Path
from typing import Any
from uuid import uuid4

import llvmlite
import numba
from numba.core.caching import FunctionCache
from numba.core.serialize import dumps

_HASH_BYTES = 32


class Files:
    """The variants of a function."""

    def __init__(self, folder: Path, name: str, made_from: bytes) -> None:
        self._folder, self._name, self._made_from = folder, name, made_from

    def _path(self, key: bytes) -> Path:
        return self._folder / f"{self._name}.{sha256(key).hexdigest()[:16]}.code"

    def _hash(self, key: bytes, content: bytes) -> bytes:
        whole = sha256(self._made_from)
        whole.update(b"%d " % len(key) + key + content)
        return whole.digest()

    def load(self, key: Any) -> Any:
        """What was saved; None if there is no valid file."""
        name = repr(key).encode()
        try:
            found = self._path(name).read_bytes()
        except OSError:
            return None
        content = found[_HASH_BYTES:]
        return pickle.loads(content) if found[:_HASH_BYTES] == self._hash(name, content) else None

    def save(self, key: Any, data: Any) -> None:
        """Save a variant; after an OSError the old file is still there."""
        name, content = repr(key).encode(), dumps(data)  # type: ignore[no-untyped-call]
        path = self._path(name)
        whole = path.with_suffix(f".{uuid4().hex}")
        try:
            whole.write_bytes(self._hash(name, content) + content)
            whole.replace(path)
        except OSError:
            with suppress(OSError):
                whole.unlink()
            raise


class KeptCode(FunctionCache):
    """Cache of a function's compiled variants, for a dispatcher of numba.

    Raises RuntimeError if there is no writable folder.
    """

    def __init__(self, function: Callable[..., Any], sources: Iterable[Path] = ()) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        versions = f"{numba.__version__} {llvmlite.__version__}"
        files = [Path(getfile(function)), *sources]
        made_from = versions.encode() + b"".join(sha256(f.read_bytes()).digest() for f in files)
        folder = Path(self.cache_path)
        self.files = Files(folder, self._impl.filename_base, made_from)
        self._cache_file: Any = self.files

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save it, or continue without (a full disk)."""
        with suppress(OSError):
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
