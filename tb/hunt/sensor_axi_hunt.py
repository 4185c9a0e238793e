# SPDX-License-Identifier: Apache-2.0
"""Hunt of `sensor_axi`: frames and calibrations as of `sensor_raster`, a rude master beside."""

import random
from typing import Any

from hunt import sensor_raster_hunt

ENTITY = "sensor_axi"
FAULTS = [
    # A part of a word is taken as a whole one.
    ("refocuser_registers.vhd", "if written(AT_LOAD_WORD) = '1' and whole = '1' then",
     "if written(AT_LOAD_WORD) = '1' then"),
    # A commit by a byte that the bus does not write.
    ("refocuser_registers.vhd", "written(AT_COMMAND) = '1' and ones(COMMAND_COMMIT) = '1'",
     "written(AT_COMMAND) = '1' and whole = '1'"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    return sensor_raster_hunt.draw(rng)


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.axi_sensors import SensorAxiHunt

    await SensorAxiHunt(bench, rng, mosaic=bench.design["generics"]["MOSAIC"]).run()
