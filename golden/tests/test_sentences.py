# SPDX-License-Identifier: Apache-2.0
"""Pages that people write have one sentence a line, so that a change shows what it changes."""

import re
from pathlib import Path

import pytest

from plenofir.ground import project

ROOT = project.root()
WRITTEN = ("README.md", "CONTRIBUTING.md", "hdl/README.md", "docs/*.md", "docs/boards/*.md")
PAGES = sorted(path.relative_to(ROOT) for pattern in WRITTEN for path in ROOT.glob(pattern))
# Parts that are built, and code.
OTHER_PARTS = r"^<!-- ([a-z -]+) -->\n.*?^<!-- end of \1 -->$|^( *)```.*?^\2```$"
# Headings, tables, pictures, comments: lines of their own kind.
OTHER = re.compile(r" *(#|\||!\[|<!--|$)")
ITEM = re.compile(r" *([-*]|\d+\.) +")
# What may contain the end of a sentence: bold words in front, code, addresses, asides.
WITHIN = (r"^ *\*\*[^*]+\*\*", r"`[^`]*`", r"\]\([^)]*\)", r"\([^()]*\)", r"\([^()]*\)", r"Figs?\.")


def wrong_lines(text: str) -> list[int]:
    """Lines of a page with a second sentence, or in which a sentence goes on."""
    wrong, before = [], ""
    text = re.sub(OTHER_PARTS, lambda part: "\n" * part[0].count("\n"), text, flags=re.M | re.S)
    for number, line in enumerate(text.splitlines(), 1):
        if OTHER.match(line) or (line.startswith("    ") and not before):
            before = ""
            continue
        item, plain = ITEM.match(line), ITEM.sub("", line, count=1)
        for pattern in WITHIN:
            plain = re.sub(pattern, "x", plain)
        goes_on = before and not item and not re.search(r"[.!?:]\W*$", before)
        if goes_on or re.search(r"\w[.!?][\"*]* +[A-Z\[*]", plain):
            wrong.append(number)
        before = line
    return wrong


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_a_line_is_a_sentence(page: Path) -> None:
    assert wrong_lines((ROOT / page).read_text()) == []


def test_other_lines_are_told() -> None:
    page = (
        "# A. B\n\nOne `a. B` (so. So). Two.\nHalf a\nline.\n1. **A lead.** One.\n   Two. Three.\n"
    )
    assert wrong_lines(page) == [3, 5, 7]
    assert wrong_lines("    code. Code\n\n```\nA. B.\n```\n\n| A. B. |\n") == []
