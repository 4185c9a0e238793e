# SPDX-License-Identifier: Apache-2.0
"""Links between the pages that people read."""

import re
from pathlib import Path

import pytest

from plenofir.ground import project

ROOT = project.root()
WRITTEN = (*ROOT.glob("*.md"), ROOT / "hdl/README.md")
PAGES = sorted(path.relative_to(ROOT) for path in (*WRITTEN, *ROOT.glob("docs/**/*.md")))
LINK = re.compile(r"\]\(([^()\s]+)\)")


def anchors(page: Path) -> set[str]:
    """Anchors that code hosts give the headings of a page."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def broken(page: Path) -> list[str]:
    """Relative links of a page whose file or heading is not there."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    found = []
    for link in LINK.findall(text):
        target, _, anchor = link.partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        path = page.parent / target if target else page
        if not path.exists() or (anchor and anchor not in anchors(path)):
            found.append(link)
    return found


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_relative_links_lead_somewhere(page: Path) -> None:
    assert broken(ROOT / page) == []


def test_broken_links_are_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A page\n[a](#a-page) [b](#b) [c](missing.md) [d](https://example.org)\n")
    assert broken(page) == ["#b", "missing.md"]


def test_every_page_is_in_the_index() -> None:
    for index in (ROOT / "docs" / "README.md", ROOT / "docs" / "boards" / "README.md"):
        pages = [path.name for path in index.parent.glob("*.md") if path != index]
        assert [name for name in pages if f"({name})" not in index.read_text()] == []
