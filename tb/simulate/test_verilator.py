# SPDX-License-Identifier: Apache-2.0
"""The core as synthesised: GHDL's Verilog, and the Spartan-6 netlist of Yosys, in Verilator."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import PixelsPerClock
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.simulate.file_bench import CORE, core_generics, core_sources, run_bench
from plenofir.fpga.synthesis.spartan6 import cell_models, synthesise
from plenofir.fpga.tools.simulators import Simulator, find_simulator
from plenofir.fpga.tools.synthesis import yosys_version
from plenofir.refocus import StoredProductArithmetic
from plenofir.refocus.sharpness import has_order
from plenofir_tb.tools import or_skip

STORED = StoredProductArithmetic(fraction_bits=4, guard_bits=2)


@pytest.fixture(scope="module")
def simulator() -> Simulator:
    with or_skip():
        find_simulator("ghdl")
        return find_simulator("verilator")


def random_frames(core: CoreConfiguration, count: int, rows: int, columns: int) -> np.ndarray:
    shape = (count, rows, columns) + ((core.channels,) if core.channels > 1 else ())
    dtype = np.uint8 if core.pixel_bits <= 8 else np.uint16
    return np.random.default_rng(1).integers(0, 1 << core.pixel_bits, shape, dtype)


def golden(core: CoreConfiguration, frames: np.ndarray) -> np.ndarray:
    """Expected frames of a sweep with one frame for each slice."""
    slices = len(core.shifts)
    return np.array([core.golden(frame)[number % slices] for number, frame in enumerate(frames)])


@pytest.mark.drawn(2)
@pytest.mark.parametrize(
    "core",
    [
        CoreConfiguration(micro_image_size=3, shifts=(-2, 1, 3), max_columns=40, channels=3),
        CoreConfiguration(
            micro_image_size=5,
            shifts=(-5, 0, 5),
            max_columns=40,
            arithmetic=STORED,
            engine=FirEngine(hold=True),
        ),
        CoreConfiguration(micro_image_size=5, shifts=(8,), max_columns=40),
        CoreConfiguration(
            micro_image_size=4,
            shifts=(2, 4, 0),
            max_columns=40,
            engine=MovingSumEngine(any_rows=True),
        ),
        CoreConfiguration(
            micro_image_size=3,
            shifts=(-2, 3),
            max_columns=40,
            engine=MovingSumEngine(pixels_per_clock=8),
        ),
        pytest.param(
            CoreConfiguration(
                micro_image_size=5,
                shifts=tuple(range(-5, 11)),
                max_columns=100,
                channels=3,
                engine=MovingSumEngine(pixels_per_clock=16, any_rows=True),
            ),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(
                micro_image_size=11,
                shifts=(-3, 11),
                max_columns=130,
                channels=3,
                engine=MovingSumEngine(),
            ),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(
                micro_image_size=5,
                shifts=tuple(range(-5, 11)),
                max_columns=60,
                engine=MovingSumEngine(),
            ),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(
                micro_image_size=3, shifts=(2,), max_columns=41, engine=FirEngine(parallel_rows=3)
            ),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(micro_image_size=2, shifts=(-1, 2), max_columns=40, order=1),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(
                micro_image_size=4,
                shifts=(3,),
                max_columns=40,
                pixel_bits=16,
                engine=FirEngine(broadcast_taps=2),
            ),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(micro_image_size=1, shifts=(0,), max_columns=40, align="causal"),
            marks=pytest.mark.slow,
        ),
    ],
    ids=lambda core: (
        f"{core.engine}_M{core.micro_image_size}_rows{core.parallel_rows}_order{core.order}"
    ),
)
def test_ghdl_verilog_equals_golden_model(
    tmp_path: Path, simulator: Simulator, core: CoreConfiguration
) -> None:
    frames = random_frames(core, 4, 23, 37)
    sweep = 1 if len(core.shifts) > 1 else 0
    result = run_bench(simulator, core, frames, tmp_path, sweep_frames=sweep, stall_percent=20)
    assert np.array_equal(result.frames, golden(core, frames))
    assert result.slices == tuple(n % len(core.shifts) for n in range(4))


def test_benches_agree(tmp_path: Path, simulator: Simulator) -> None:
    # The bench in C++ stalls and counts as the one in VHDL does.
    core = CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=20)
    frames = random_frames(core, 2, 9, 20)
    for seed, part in ((7, frames), (8, frames[:1, :4])):
        # What the first run has built is run again, with other frames.
        results = [
            run_bench(
                *(tool, core, part, tmp_path / tool.name),
                stall_percent=25,
                seed=seed,
                built=part is not frames,
            )
            for tool in (find_simulator("ghdl"), simulator)
        ]
        assert np.array_equal(results[0].frames, results[1].frames)
        assert results[0].clocks == results[1].clocks
        assert results[0].latency_clocks == results[1].latency_clocks
        assert results[0].input_clocks == results[1].input_clocks


def index_of(
    core: CoreConfiguration, radius: int, *, between: bool = True
) -> DepthIndexConfiguration:
    """The depth index behind a stack, with depth between the slices if they are in order."""
    return DepthIndexConfiguration(
        micro_image_size=core.micro_image_size,
        slices=len(core.shifts),
        radius=radius,
        max_columns=core.max_columns,
        pixels_per_clock=core.pixels_per_clock,
        channels=core.channels,
        pixel_bits=core.pixel_bits,
        shifts=core.shifts if between and has_order(core.shifts) else (),
    )


def check_stack(
    tool: Simulator,
    core: CoreConfiguration,
    index_core: DepthIndexConfiguration,
    rows: int,
    directory: Path,
    verilog: Sequence[Path] | None = None,
) -> tuple[int, int]:
    """Compare all outputs of a stack and its index; result: clocks of both ends."""
    m = core.micro_image_size
    raw = random_frames(core, 1, rows, core.max_columns)[0]
    want_slices = core.golden(raw)
    want = index_core.golden(want_slices)
    assert want.index.min() < want.index.max()
    result = run_bench(
        tool,
        core,
        raw[np.newaxis],
        directory,
        index=index_core,
        stall_percent=20,
        seed=9,
        verilog=verilog,
    )
    assert result.stacks is not None
    assert result.index is not None
    assert np.array_equal(result.stacks[0], want_slices)
    assert np.array_equal(result.frames[0], want.image)
    index = want.index.repeat(m, 0).repeat(m, 1)
    assert np.array_equal(result.index[0], index[:rows, : core.max_columns])
    if want.fraction is not None and want.confidence is not None:
        assert result.depth is not None
        assert np.array_equal(result.depth[0][::m, ::m] & 255, want.fraction)
        assert np.array_equal(result.depth[0][::m, ::m] >> 8, want.confidence)
    return result.clocks, result.input_clocks


def test_stack_as_verilog_equals_golden_model(tmp_path: Path, simulator: Simulator) -> None:
    # The bench in VHDL stalls and counts alike. A slice that holds outputs, cut micro images.
    core = CoreConfiguration(
        micro_image_size=3, shifts=(-3, -1, 3), max_columns=22, engine=StackEngine()
    )
    clocks = [
        check_stack(tool, core, index_of(core, 1), 16, tmp_path / tool.name)
        for tool in (simulator, find_simulator("ghdl"))
    ]
    assert clocks[0] == clocks[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("core", "radius"),
    [
        (
            CoreConfiguration(
                micro_image_size=5,
                shifts=(5, -3, 0, 2),
                max_columns=52,
                channels=3,
                engine=StackEngine(input_lines=5, pixels_per_clock=4),
            ),
            2,
        ),
        (
            CoreConfiguration(
                micro_image_size=4,
                shifts=(1, 4),
                max_columns=37,
                pixel_bits=16,
                align="causal",
                engine=StackEngine(),
            ),
            0,
        ),
        (
            CoreConfiguration(
                micro_image_size=2, shifts=(-3, 0, 1, 2), max_columns=33, engine=StackEngine()
            ),
            3,
        ),
    ],
    ids=["rgb", "16_bit", "M2"],
)
def test_more_stacks_as_verilog(
    tmp_path: Path, simulator: Simulator, core: CoreConfiguration, radius: int
) -> None:
    rows = 7 * core.micro_image_size + 1
    check_stack(simulator, core, index_of(core, radius), rows, tmp_path)


@pytest.mark.parametrize(
    "core",
    [
        CoreConfiguration(micro_image_size=3, shifts=(-1, 2), max_columns=30),
        pytest.param(
            CoreConfiguration(
                micro_image_size=3,
                shifts=(-1, 2),
                max_columns=30,
                pixel_bits=4,
                engine=MovingSumEngine(pixels_per_clock=4),
            ),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(
                micro_image_size=2,
                shifts=(1,),
                max_columns=30,
                channels=3,
                # Its products have eight bits: more make Yosys take block RAM.
                arithmetic=StoredProductArithmetic(fraction_bits=0, guard_bits=0),
            ),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(micro_image_size=2, shifts=(1, 2), max_columns=12, sharpening=(3, 0)),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CoreConfiguration(
                micro_image_size=3, shifts=(-1, 2), max_columns=20, pixel_bits=4, border="normalise"
            ),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["exact", "lanes", "stored", "sharpened", "normalised"],
)
def test_netlist_equals_golden_model(
    tmp_path: Path, simulator: Simulator, core: CoreConfiguration
) -> None:
    # Small enough for memories of LUTs: Yosys has no model of Spartan-6's block RAM.
    with or_skip():
        yosys_version()
    netlist = synthesise(core_sources(), CORE, core_generics(core), tmp_path)
    assert netlist.figures.usage.block_rams == 0
    frames = random_frames(core, 4, 17, core.max_columns)
    result = run_bench(
        simulator,
        core,
        frames,
        tmp_path / "bench",
        sweep_frames=1 if len(core.shifts) > 1 else 0,
        stall_percent=20,
        verilog=[netlist.verilog, cell_models()],
    )
    assert np.array_equal(result.frames, golden(core, frames))


@pytest.mark.slow
@pytest.mark.parametrize(("pixels", "columns", "bits"), [(1, 9, 8), (2, 21, 2)])
def test_netlist_of_stack_equals_golden_model(
    tmp_path: Path, simulator: Simulator, pixels: PixelsPerClock, columns: int, bits: int
) -> None:
    with or_skip():
        yosys_version()
    core = CoreConfiguration(
        micro_image_size=2,
        shifts=(-1, 2),
        max_columns=columns,
        pixel_bits=bits,
        engine=StackEngine(pixels_per_clock=pixels),
    )
    # With depth between slices results wait in a block RAM, of which there is no model.
    index = index_of(core, 0, between=False)
    netlist = synthesise(core_sources(), CORE, core_generics(core, index), tmp_path)
    assert netlist.figures.usage.block_rams == 0
    verilog = [netlist.verilog, cell_models()]
    check_stack(simulator, core, index, 9, tmp_path / "bench", verilog)
