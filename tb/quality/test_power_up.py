# SPDX-License-Identifier: Apache-2.0
"""Entities for users, from power-up on without a reset: no control output is undefined."""

import re

from plenofir.fpga import hdl
from plenofir_tb.runner import Case, run_cases
from plenofir_tb.wrapper import wrapper

CORE = {"MICRO_IMAGE_SIZE": 3, "SHIFTS": "1 -1", "MAX_COLUMNS": 12}
SENSOR = {"MICRO_IMAGE_SIZE": 2, "MAX_COLUMNS": 12}
ENTITIES: dict[str, dict[str, int | bool | str]] = {
    "raster_refocuser": CORE,
    "focal_stack": CORE,
    "depth_index": {"MICRO_IMAGE_SIZE": 3, "SLICES": 2, "MAX_COLUMNS": 12},
    "resampler": SENSOR,
    "colour_mosaic": {"MAX_COLUMNS": 12},
    "sensor_raster": SENSOR,
    "csi_receiver": {"LANES": 2, "PIXEL_BITS": 8},
    "dphy_lane": {},
    "sensor_setup": {"REGISTERS": "010001"},
    "refocuser_axi": CORE,
    "stack_axi": CORE,
    "sensor_axi": SENSOR | {"MOSAIC": True, "CHANNELS": 3},
    "wishbone_bridge": {},
    "parallel_to_stream": {"WIDTH": 8},
    "stream_to_parallel": {"WIDTH": 8, "MAX_COLUMNS": 12, "ROWS": 3},
    "video_to_stream": {"MAX_COLUMNS": 12, "DELAY_LINES": 1, "DELAY_PIXELS": 2},
    "stream_to_video": {},
    "tmds_receiver": {},
    "tmds_transmitter": {},
}
# Data, and what belongs to it.
DATA = re.compile(r"data|dat_r$|tid$|pixel$|resp$|addr$|strb$|prot$|timing$|words$")


def power_up(entity: str) -> Case:
    """A case with the ports by their directions; fields of records as the wrapper names them."""
    text = wrapper([(entity, ENTITIES[entity])], hdl.hdl_sources())
    source = next(s for s in hdl.hdl_sources() if s.stem == entity).read_text()
    ports = re.search(r"^  port \((.*?)^end entity", re.sub("--.*", "", source), re.M | re.S)
    assert ports
    inputs = set(re.findall(r"^ *(\w+) *: in ", ports[1], re.M))
    inputs |= set(re.findall(r"^ *\w+_record[.\w()]* <= (\w+);", text, re.M))
    signals = {
        name
        for name in re.findall(r"^ *signal (\w+) *:", text, re.M)
        if not name.endswith("_record")
    }
    clocks = {name for name in signals if name.endswith("clk")}
    outputs = {name for name in signals - inputs if not DATA.search(name)}
    lists = {"inputs": inputs & signals - clocks, "clocks": clocks, "outputs": outputs}
    case = {name: sorted(names) for name, names in lists.items()}
    return Case(entity, "quality.power_up_bench", ENTITIES[entity], case)


def test_control_outputs_without_a_reset() -> None:
    run_cases([power_up(entity) for entity in ENTITIES])
