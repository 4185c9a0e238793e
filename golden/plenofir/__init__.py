"""Real-time refocusing for standard plenoptic cameras: golden model and tools."""

from importlib.metadata import version

__version__ = version("plenofir")
