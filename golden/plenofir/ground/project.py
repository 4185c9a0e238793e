# SPDX-License-Identifier: Apache-2.0
"""Where the files are that the package reads: in a checkout, or in a plain installation."""

from pathlib import Path

from plenofir.ground.errors import InputError

_PACKAGE = Path(__file__).resolve().parents[1]
_CHECKOUT = _PACKAGE.parents[1]
# Folder in the wheel with its copy of the VHDL and related files, see pyproject.toml.
_COPY = _PACKAGE / "_project"

DATA = _PACKAGE / "data"
"""Data files that the package ships."""


def in_checkout() -> bool:
    """Whether the package runs from its repository, and may keep files in ``build``."""
    return (_CHECKOUT / "hdl" / "sources.txt").is_file()


def root() -> Path:
    """Folder of ``hdl``, ``scenes``, ``constraints``, ``scripts/ise`` and ``tb/file_bench``.

    The repository, or the copy that a wheel installs.
    """
    if in_checkout():
        return _CHECKOUT
    if not _COPY.is_dir():
        raise InputError("the VHDL sources are missing; install plenofir by pip", where=str(_COPY))
    return _COPY
