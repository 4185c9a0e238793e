# SPDX-License-Identifier: Apache-2.0
"""Reference of `text_overlay`, from its header and `overlay_pkg`: texts, labels, a ruler."""

GLYPH, HEIGHT, RULER, MARGIN = 8, 16, 8, 8
ROWS = 2 * HEIGHT + RULER
# Characters that fit the widest picture.
MOST_COLUMNS = 511


def place(g: dict, rows: int, y: int, x: int, *, bottom: int) -> tuple[int, int] | None:
    """Line and column in the overlay; None outside of it."""
    columns = max(g["TEXT_COLUMNS"] + 11, g["SLICES"] * g["LABEL_COLUMNS"])
    oy, ox = y - (rows - ROWS - MARGIN if bottom else MARGIN), x - MARGIN
    inside = 0 <= oy < ROWS and 0 <= ox < GLYPH * min(columns, MOST_COLUMNS)
    return (oy, ox) if inside else None


def drawn(g: dict, oy: int, ox: int, pixel: int, *, slice_: int, kind: int, raw: int,
          errors: int) -> int:  # fmt: skip
    """The pixel of the overlay over a pixel of the picture; red in the low bits."""
    slices, width = g["SLICES"], g["LABEL_COLUMNS"]
    if oy >= 2 * HEIGHT:
        field, within = divmod(ox, GLYPH * width)
        if field >= slices or within >= GLYPH * width - 2:
            return 0
        if kind == 2 and not raw:
            colour = g["COLOURS"][6 * field : 6 * field + 6] or "000000"
            return int.from_bytes(bytes.fromhex(colour), "little")
        lit = not raw and (kind == 1 or field == slice_)
        return 0xFFFFFF if lit else 0x404040
    if oy >= HEIGHT:
        text = g["LABELS"]
    else:
        entry = slice_ if slice_ < slices else 0
        if raw or kind:
            entry = slices + 2 if raw else slices + kind - 1
        text = g["TEXTS"][entry * g["TEXT_COLUMNS"] : (entry + 1) * g["TEXT_COLUMNS"]]
        text += f"  errors {errors:02d}" if errors else ""
    number, bit = divmod(ox, GLYPH)
    if number < len(text):
        at = 2 * (HEIGHT * (ord(text[number]) - 32) + oy % HEIGHT)
        if int(g["FONT"][at : at + 2], 16) >> (7 - bit) & 1:
            return 0xFFFFFF
    return sum((pixel >> n & 0xFF) >> 2 << n for n in (0, 8, 16))
