# SPDX-License-Identifier: Apache-2.0
"""Real-time refocusing for standard and focused plenoptic cameras: golden model and tools."""

from plenofir.ground.errors import InputError

__all__ = ["InputError"]


def __getattr__(name: str) -> str:
    # Looked up when asked for: importlib.metadata takes as long to load as the command line.
    if name == "__version__":
        from importlib.metadata import version

        return version("plenofir")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
