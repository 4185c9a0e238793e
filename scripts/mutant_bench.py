# SPDX-License-Identifier: Apache-2.0
"""The small cores that `mutate.py` simulates in the file bench, against the golden model."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.simulate import file_bench
from plenofir.fpga.tools.simulators import SimulationError, find_simulator
from plenofir.refocus import StoredProductArithmetic

STALLS = 25


@dataclass(frozen=True)
class Case:
    """One run of the suite."""

    core: CoreConfiguration
    columns: int
    rows: int
    frames: int


def _core(**values: object) -> CoreConfiguration:
    return CoreConfiguration.model_validate({"max_columns": 24, **values})


CASES = (
    Case(_core(micro_image_size=3, shifts=(2,)), 20, 9, 3),
    Case(_core(micro_image_size=3, shifts=(-2, 1, 3), channels=3), 17, 7, 4),
    # Frames of a band and a line.
    Case(_core(micro_image_size=3, shifts=(3,), engine=FirEngine(parallel_rows=3)), 14, 4, 3),
    Case(
        _core(micro_image_size=4, shifts=(2, -3), engine=MovingSumEngine(pixels_per_clock=4)),
        *(22, 9, 4),
    ),
    Case(
        _core(
            micro_image_size=5,
            shifts=(-5, 0, 5),
            engine=FirEngine(hold=True),
            arithmetic=StoredProductArithmetic(fraction_bits=4, guard_bits=2),
        ),
        23,
        11,
        4,
    ),
    Case(
        _core(micro_image_size=3, shifts=(0,), order=1, engine=FirEngine(broadcast_taps=2)),
        16,
        9,
        2,
    ),
    Case(_core(micro_image_size=4, shifts=(1,), max_columns=6, align="causal"), 3, 5, 3),
    Case(_core(micro_image_size=3, shifts=(-2, 1, 3), engine=MovingSumEngine()), 17, 10, 4),
    Case(
        _core(
            micro_image_size=4,
            shifts=(1,),
            channels=3,
            engine=MovingSumEngine(),
            arithmetic=StoredProductArithmetic(fraction_bits=4, guard_bits=2),
        ),
        19,
        9,
        2,
    ),
)


def frames_of(case: Case) -> np.ndarray:
    """Random frames, white among them."""
    channels = (case.core.channels,) if case.core.channels > 1 else ()
    shape = (case.frames, case.rows, case.columns, *channels)
    frames = np.random.default_rng(3).integers(0, 256, shape, dtype=np.uint8)
    frames[-1] = 255
    return frames


def wanted(case: Case, frames: np.ndarray) -> np.ndarray:
    """What must come out: a slice for each frame, in turn."""
    slices = len(case.core.shifts)
    return np.array(
        [case.core.golden(frame)[number % slices] for number, frame in enumerate(frames)]
    )


def pixels_of(case: Case) -> int:
    """Pixels that come out; lines are filled up to whole tokens."""
    line = case.core.line_tokens(case.columns) * case.core.pixels_per_clock
    return line * case.rows * case.frames


def refuse_excess(pixels: int, received: int) -> None:
    """End the simulation of a core that does not stop giving pixels."""
    if received > pixels:
        raise SimulationError(f"{received} pixels for {pixels}")


def bench_notices(sources: Sequence[Path], folder: Path) -> str:
    """What of the small suite in the file bench notices a change, or nothing."""
    simulator = find_simulator("ghdl")
    folder.mkdir()
    # A core that hangs is given up sooner than one that works might need.
    *_, design, patient_bench = file_bench.bench_sources()
    bench = folder / patient_bench.name
    text = patient_bench.read_text()
    patient, impatient = "IDLE_LIMIT : positive := 100000", "IDLE_LIMIT : positive := 3000"
    assert patient in text
    bench.write_text(text.replace(patient, impatient))
    names = {source.name for source in hdl.hdl_sources()}
    core = [source for source in sources if source.name in names]
    for command in simulator.build_commands([*core, design, bench], file_bench.TOP):
        simulator.run(command, folder)
    for number, case in enumerate(CASES):
        frames = frames_of(case)
        sweep = 1 if len(case.core.shifts) > 1 else 0
        limit = partial(refuse_excess, pixels_of(case))
        for stalls in (0, STALLS):
            try:
                result = file_bench.run_bench(
                    simulator,
                    case.core,
                    frames,
                    folder,
                    sweep_frames=sweep,
                    stall_percent=stalls,
                    built=True,
                    progress=limit,
                )
            except (SimulationError, KeyError, OSError, ValueError):
                return f"bench {number}: simulation"
            if not np.array_equal(result.frames, wanted(case, frames)):
                return f"bench {number}: pixels"
            if stalls == 0 and result.latency_clocks != case.core.latency_clocks(
                case.columns, case.rows, case.frames
            ):
                return f"bench {number}: latency"
    return ""
