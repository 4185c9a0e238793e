# SPDX-License-Identifier: Apache-2.0
"""Messages about tools that fail."""

from pathlib import Path

import pytest

from plenofir.fpga.tools.synthesis import run_tool
from plenofir.ground.errors import ToolError

REFUSED = """\
a.vhd:9:1:warning: a port is open
math_pkg.vhd:74:5:(assertion failure): text_overlay: COLOURS must be six digits
math_pkg.vhd:74:5: error due to assertion failure
    assert condition
    ^
"""
UNKNOWN = """\
a.vhd:3:8:error: no declaration for "m"
a.vhd:3:8:   ^
"""


@pytest.mark.parametrize(
    ("log", "reason"),
    [
        (REFUSED, "text_overlay: COLOURS must be six digits"),
        # As GHDL 5 writes it.
        (REFUSED.replace("(assertion", "(assert"), "text_overlay: COLOURS must be six digits"),
        (UNKNOWN, 'a.vhd:3:8:error: no declaration for "m"'),
        ("nothing said\n", "nothing said"),
    ],
)
def test_the_last_line_has_the_reason(log: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "text").write_text(log)
    with pytest.raises(ToolError) as raised:
        run_tool(["sh", "-c", "cat text; exit 3"], tmp_path / "tool.log")
    assert str(raised.value).splitlines()[0] == "sh failed with status 3:"
    assert str(raised.value).splitlines()[-1].endswith(reason)
