# SPDX-License-Identifier: Apache-2.0
"""Whole numbers in a text, as people write places and sizes in pixels."""

import re


def whole_numbers(text: str, count: int) -> tuple[int, ...] | None:
    """`count` numbers in a row, such as "200,100", of at most nine digits; None for other texts.

    Digits are those of ASCII: Python counts a superscript two among the digits, too.
    """
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != count or not all(re.fullmatch("[0-9]{1,9}", part) for part in parts):
        return None
    return tuple(map(int, parts))
