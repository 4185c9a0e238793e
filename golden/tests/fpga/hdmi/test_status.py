# SPDX-License-Identifier: Apache-2.0
"""The status line's list of fields and its parser."""

import re

import pytest

from plenofir.ground.errors import InputError
from plenofir_tb.hdmi.status import FIELDS, example_line, parse_status, status_package


def test_example_is_read() -> None:
    status = parse_status(example_line())
    assert status == {field.name: field.example for field in FIELDS}
    assert status["taps"] == (3, -1, 2)


def test_package_has_a_number_for_each_mark() -> None:
    text = status_package()
    line = "".join(re.findall(r'"(.*?)"', text))
    assert [word.split("=")[0] for word in line.split()] == [field.name for field in FIELDS]
    numbers = int(re.findall(r"STATUS_NUMBERS : positive := (\d+)", text)[0])
    assert line.count("#") == numbers == sum(len(field.example) for field in FIELDS)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("slice=0 ", "", f"{len(FIELDS) - 1} fields"),
        ("clock=743", "clock=", "'clock=' in place of clock=#"),
        ("clock=743", "clocks=743", "'clocks=743' in place of clock=#"),
        ("taps=3/-1/2", "taps=3/-1", "'taps=3/-1' in place of taps=#/#/#"),
        ("rows=720", "rows=720/1", "rows=720/1"),
    ],
)
def test_other_lines_are_refused(old: str, new: str, told: str) -> None:
    line = example_line()
    assert old in line
    with pytest.raises(InputError, match=re.escape(told)):
        parse_status(line.replace(old, new))
