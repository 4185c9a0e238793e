# SPDX-License-Identifier: Apache-2.0
"""What the tests of generics share."""

from pathlib import Path

import pytest

from plenofir.fpga.tools.simulators import find_simulator
from plenofir_tb.refusals import Elaborator
from plenofir_tb.tools import or_skip

TB = Path(__file__).parents[1]


@pytest.fixture(scope="session", params=["ghdl", "nvc"])
def elaborator(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Elaborator:
    """A library of all sources, with a bench that checks cores without building them."""
    with or_skip():
        find_simulator(request.param)
    folder = tmp_path_factory.mktemp(request.param)
    places = ("quality/verdicts", "quality/picture_ports", "video/video_ports", "video/mode_ports")
    benches = [TB / f"{place}.vhd" for place in (*places, "moving_sum/control_ports")]
    return Elaborator(request.param, folder, *benches)
