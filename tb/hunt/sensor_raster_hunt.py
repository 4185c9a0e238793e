# SPDX-License-Identifier: Apache-2.0
"""Hunt of `sensor_raster`: `resampler`, and with a mosaic `colour_mosaic` in front of it."""

import random
from typing import Any

from hunt.resampler_hunt import draw_generics

ENTITY = "sensor_raster"
FAULTS = [
    ("sensor_raster.vhd", "resampler_flags or ('0' & mosaic_flags)", "resampler_flags"),
    ("mosaic_engine.vhd", "centre.even_line xor red_line;", "centre.even_line;"),
]


def draw(rng: random.Random) -> dict[str, Any]:
    mosaic = rng.random() < 0.8
    generics = draw_generics(rng) | {"MOSAIC": mosaic}
    if mosaic:
        generics["CHANNELS"] = 3
    return {"generics": generics}


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.sensors import SensorHunt

    await SensorHunt(bench, rng, mosaic=bench.design["generics"]["MOSAIC"]).run()
