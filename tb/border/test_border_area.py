# SPDX-License-Identifier: Apache-2.0
"""Resources of a normalised border, and that there are none without it."""

from pathlib import Path

import pytest

from netlist_parts import count_parts, needed_parts
from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.synthesis.spartan6 import synthesise
from plenofir.fpga.tools.synthesis import write_verilog

CORE = CoreConfiguration(
    micro_image_size=5, shifts=(-3, 2), max_columns=640, engine=MovingSumEngine()
)


def normalised(core: CoreConfiguration) -> CoreConfiguration:
    return core.model_copy(update={"border": "normalise"})


@pytest.mark.parametrize("core", [CORE, normalised(CORE)], ids=["zero", "normalise"])
def test_parts_are_those_needed(tmp_path: Path, core: CoreConfiguration) -> None:
    verilog = write_verilog(hdl.hdl_sources(), "raster_refocuser", core.generics(), tmp_path)
    found, needed = count_parts(verilog.read_text(), "raster_refocuser"), needed_parts(core)
    assert {name: found[name] for name in needed} == needed
    assert ("border_weights" in verilog.read_text()) == core.normalises
    assert ("divide_weighted" in verilog.read_text()) == core.normalises


@pytest.mark.slow
@pytest.mark.parametrize(
    "core",
    [
        CORE,
        CORE.model_copy(update={"micro_image_size": 9, "shifts": (5,), "order": 1}),
        CORE.model_copy(update={"engine": MovingSumEngine(pixels_per_clock=4), "channels": 3}),
    ],
    ids=["slices", "interpolation", "lanes"],
)
def test_estimate(tmp_path: Path, core: CoreConfiguration) -> None:
    plain, full = (
        synthesise(hdl.hdl_sources(), "raster_refocuser", c.generics(), tmp_path / c.border).figures
        for c in (core, normalised(core))
    )
    blocks = normalised(core).blocks
    usage, more = (
        estimate(chosen) for chosen in (blocks, [b for b in blocks if b.kind == "border"])
    )
    assert usage.dsp == full.dsp
    assert usage.block_rams == full.usage.block_rams
    margin = 0.25 if core.pixels_per_clock == 1 else 0.4
    assert full.lut - plain.lut == pytest.approx(more.lut, rel=margin)
    assert full.flip_flops - plain.flip_flops == pytest.approx(more.flip_flops, rel=margin)
