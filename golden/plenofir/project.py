"""Where the parts of the repository are."""

from pathlib import Path

from plenofir.errors import InputError

_ROOT = Path(__file__).resolve().parents[2]

DATA = Path(__file__).resolve().parent / "data"
"""Data files that the package ships."""


def root() -> Path:
    """Root of the repository that this package is installed from."""
    if not (_ROOT / "hdl" / "sources.txt").is_file():
        raise InputError(
            "the VHDL sources are missing",
            where=str(_ROOT),
            expected="plenofir installed from its repository (make venv)",
        )
    return _ROOT
