# SPDX-License-Identifier: Apache-2.0
"""Pages that people write, with parts between marks that are built."""


def between_marks(text: str, name: str, content: str) -> str:
    """Replace what stands between two marks of a page."""
    before, rest = text.split(f"<!-- {name} -->\n")
    after = rest.split(f"<!-- end of {name} -->\n")[1]
    return f"{before}<!-- {name} -->\n{content}\n<!-- end of {name} -->\n{after}"
