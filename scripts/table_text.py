# SPDX-License-Identifier: Apache-2.0
"""Tables in Markdown, and their place in a page."""

from collections.abc import Iterable

from marks import between_marks


def table(heads: str, rows: Iterable[Iterable[object]]) -> list[str]:
    """Lines of a table of Markdown; heads have strokes between them."""
    columns = heads.count("|") + 1
    lines = [f"| {' | '.join(map(str, row))} |" for row in rows]
    return [f"| {heads} |", "| --- " * columns + "|", *lines]


def put(text: str, name: str, lines: Iterable[str]) -> str:
    """Put lines between their marks in a page."""
    return between_marks(text, name, "\n".join(lines))
