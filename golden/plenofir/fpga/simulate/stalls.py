# SPDX-License-Identifier: Apache-2.0
"""A part of the picture once more, with random stalls at the source and at the sink.

The first run has none, so that its clocks are the same each time.
"""

from collections.abc import Callable, Sequence

from plenofir.fpga.compare import compare_frames
from plenofir.fpga.simulate.file_bench import BenchResult
from plenofir.fpga.simulate.report import StallReport
from plenofir.fpga.tools.simulators import SimulationError
from plenofir.refocus.operator import Image

STALL_PERCENT = 60
"""Share of the clocks in which one side stalls, the other one in a third of it, in turn."""
# Some lines fill and empty every FIFO; a whole picture with stalls would take many times longer.
_PIXELS = 4096


def stalled_part(raw: Image, micro_image_size: int) -> Image:
    """The first lines of a picture: some thousand pixels, two micro images and a line at least."""
    lines = max(2 * micro_image_size + 1, -(-_PIXELS // raw.shape[1]))
    return raw[:lines]


def run_stalled(
    seed: int,
    run: Callable[[int, int], BenchResult],
    pairs: Callable[[BenchResult], Sequence[tuple[Image, Image]]],
) -> StallReport:
    """Run with a share of stalls and a seed, and compare the `pairs` of frames of the result.

    SimulationError, which names the seed, if the simulation fails.
    """
    try:
        result = run(STALL_PERCENT, seed)
        comparisons = [compare_frames(got, want) for got, want in pairs(result)]
    except SimulationError as error:
        raise SimulationError(
            f"with stalls in up to {STALL_PERCENT} % of the clocks, seed {seed}: {error}"
        ) from None
    return StallReport(
        seed=seed,
        percent=STALL_PERCENT,
        pixels_compared=sum(part.pixels for part in comparisons),
        mismatches=sum(part.mismatches for part in comparisons),
        first_mismatch=next((part.first for part in comparisons if part.mismatches), None),
    )
