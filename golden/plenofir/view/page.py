# SPDX-License-Identifier: Apache-2.0
"""Parts of a page of the viewer."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

ASSETS = Path(__file__).resolve().parent / "assets"
STYLE = "view.css"


class PartRequest(NamedTuple):
    """Parameters of a page's request for a part."""

    binning: int = 1  # of micro lenses, in each dimension
    after: int = 0  # number of the frame that the page has
    query: Mapping[str, str] = MappingProxyType({})  # all parameters, unparsed


class Part(NamedTuple):
    """Data that a page asks for."""

    content: bytes
    kind: str  # media type
    facts: Mapping[str, str] = MappingProxyType({})  # headers that describe the bytes


@dataclass(frozen=True)
class Page:
    """A page, independent of how it gets to the browser."""

    document: str  # HTML file of the folder ``assets``
    scripts: tuple[str, ...]  # modules of that folder, the main one last
    field: Mapping[str, Any]  # description of the page, for JSON
    parts: Mapping[str, Callable[[PartRequest], Part]]  # data by name, made when requested
    # Description and parts of an export of at most a number of bytes.
    packed: Callable[[int], tuple[Mapping[str, Any], Mapping[str, Part]]]

    def asset(self, name: str) -> bytes:
        """A file of the folder ``assets``."""
        return (ASSETS / name).read_bytes()
