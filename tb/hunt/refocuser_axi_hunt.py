# SPDX-License-Identifier: Apache-2.0
"""Hunt of `refocuser_axi`: streams as of `raster_refocuser`, and a rude master at its registers."""

import random
from typing import Any

from hunt import raster_refocuser_hunt as core

ENTITY = "refocuser_axi"
FAULTS = [
    # An event in the clock of its clearing write is lost.
    ("event_registers.vhd", "(held_happened and not clear_happened) or new_happened;",
     "(held_happened or new_happened) and not clear_happened;"),
    # The slice behind the input FIFO, late by what waits there.
    ("stream_shell.vhd", "resize(unsigned(slice_out), slice_t'length)",
     "resize(slice_in, slice_t'length)"),
    # A store of a byte ends in a bus error; a write without strobes does.
    ("axi_lite_slave.vhd", "if write_refused = '1' and writes_bytes = '1' then",
     "if write_refused = '1' then"),
    ("frame_gate.vhd", "s_axis_marks.tuser(0) and not start_lasts;", "s_axis_marks.tuser(0);"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    """A core that is small: accesses in every clock cost more than the core."""
    while core.work((design := core.draw(rng))["generics"]) > 1500:
        pass
    return design


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.axi_cores import AxiHunt

    g = bench.design["generics"]
    held = core.delay(g) + g["PARALLEL_ROWS"]
    await AxiHunt(
        bench,
        rng,
        core.words,
        {"refocuser"},
        channels=g["CHANNELS"],
        bits=g["PIXEL_BITS"],
        pixels=g["PIXELS_PER_CLOCK"],
        slices=len(g["SHIFTS"].split()),
        held=held,
        **core.sizes(g, held),
    ).run()
