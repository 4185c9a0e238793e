"""Where results are written: refused before any work is done."""

import tempfile
from pathlib import Path

from plenofir.errors import InputError

_EXPECTED = "a folder that can be written"


def check_folder(folder: Path, where: str) -> None:
    """Refuse a folder for results that cannot be written, whether it exists or not.

    Parameters
    ----------
    folder
        The folder; nothing is left in it.
    where
        Name of the option or the path for messages.

    Raises
    ------
    InputError
        If it, or what stands in its place, cannot be written.
    """
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"{existing} is not a folder", where=where, expected=_EXPECTED)
    try:
        # A trial says more than the permission bits: root, read-only and full file systems.
        with tempfile.TemporaryDirectory(dir=existing, prefix=".plenofir-"):
            pass
    except OSError as error:
        what = f"{existing} cannot be written ({error.strerror})"
        raise InputError(what, where=where, expected=_EXPECTED) from None
