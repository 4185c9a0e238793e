# SPDX-License-Identifier: Apache-2.0
"""What a page of the viewer is made of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

ASSETS = Path(__file__).resolve().parent / "assets"
STYLE = "view.css"


class Wanted(NamedTuple):
    """What a page says with its request for a part.

    Attributes
    ----------
    binning
        Micro lenses to be made one, in each dimension.
    after
        Number of the frame that it has; the next ones are wanted.
    """

    binning: int = 1
    after: int = 0


class Part(NamedTuple):
    """Data that a page asks for.

    Attributes
    ----------
    content
        Bytes.
    kind
        Media type.
    facts
        What the bytes don't tell, by name.
    """

    content: bytes
    kind: str
    facts: Mapping[str, str] = MappingProxyType({})


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
        Data by name, made when they are asked for.
    packed
        Makes the parts for an export of at most as many bytes, and the description that goes
        with them.
    """

    document: str
    scripts: tuple[str, ...]
    field: Mapping[str, Any]
    parts: Mapping[str, Callable[[Wanted], Part]]
    packed: Callable[[int], tuple[Mapping[str, Any], Mapping[str, Part]]]

    def asset(self, name: str) -> bytes:
        """A file of the folder ``assets``."""
        return (ASSETS / name).read_bytes()
