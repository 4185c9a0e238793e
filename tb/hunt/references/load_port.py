# SPDX-License-Identifier: Apache-2.0
"""Answers of `load_port` with `command_line` behind it to a line, from their headers.

Blanks are ignored. A line that begins with l is a word (16 hexadecimal digits, kind 0 to 3) or the
question; others are commands: a letter, for most with a decimal number up to 255.
"""

DIGITS = "0123456789"
LIMITS = {"s": 3, "w": 256, "p": 2, "t": 2, "o": 1, "h": 1}
"""Letters with a number, and what it has to be below in `load_ports`."""
Word = tuple[int, int, int]


def answer(line: str, description: str, *, busy: bool) -> tuple[str | None, Word | None]:
    """The answer to a line, if there is one, and the word that it writes."""
    text = line.replace(" ", "")
    if not text:
        return None, None
    letter, rest = text[0], text[1:]
    if letter == "l":
        if rest == "?":
            return description, None
        good = (
            len(rest) == 16
            and all(c in f"{DIGITS}abcdefABCDEF" for c in rest)
            and rest[0] in "0123"
        )
        if busy or not good:
            return "error", None
        return "ok", (int(rest[0]), int(rest[1:6], 16), int(rest[6:], 16))
    if letter == "?" and not rest:
        return "slices=3", None
    if letter == "c" and not rest:
        return "ok", None
    digits = rest != "" and all(c in DIGITS for c in rest)
    return "ok" if digits and int(rest) < LIMITS.get(letter, 0) else "error", None
