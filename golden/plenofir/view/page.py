"""What a page of the viewer is made of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

ASSETS = Path(__file__).resolve().parent / "assets"
STYLE = "view.css"


class Part(NamedTuple):
    """Data that a page asks for.

    Attributes
    ----------
    content
        Bytes.
    kind
        Media type.
    size
        Rows and columns that the bytes don't tell, as ``ROWSxCOLUMNS``.
    """

    content: bytes
    kind: str
    size: str = ""


@dataclass(frozen=True)
class Page:
    """A page, independent of how it gets to the browser.

    Attributes
    ----------
    document
        HTML file of the folder ``assets``.
    scripts
        Modules of that folder, the main one last; it alone imports others.
    field
        What describes the page, for JSON.
    parts
        Data by name, made when they are asked for. The argument is the binning that a browser asks
        for: micro lenses that are made one, in each dimension.
    packed
        Makes the parts for an export of at most as many bytes, and the description that goes
        with them.
    """

    document: str
    scripts: tuple[str, ...]
    field: Mapping[str, Any]
    parts: Mapping[str, Callable[[int], Part]]
    packed: Callable[[int], tuple[Mapping[str, Any], Mapping[str, Part]]]

    def asset(self, name: str) -> bytes:
        """A file of the folder ``assets``."""
        return (ASSETS / name).read_bytes()
