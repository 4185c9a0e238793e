# SPDX-License-Identifier: Apache-2.0
"""The schedule of moving sums in VHDL (sum_schedule_pkg) and Python (SumLayout), side by side."""

import math
import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from stepped_sums import initial_index, is_initial, lane_is_initial

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.tools.simulators import Simulator
from plenofir.refocus import StoredProductArithmetic
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.operator import Align
from plenofir.refocus.sum_lanes import LaneLayout
from plenofir_tb.runner import draw_seed, vhdl_simulator

TOP = "moving_sum_schedule"
PACKAGES = (
    "math_pkg",
    "number_set_pkg",
    "refocus_pkg",
    "arithmetic_pkg",
    "core_pkg",
    "sum_schedule_pkg",
    "moving_sum_pkg",
    "sum_lanes_pkg",
    "sum_plan_pkg",
)
LANES = (2, 8, 32)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Simulator, Path]:
    """The bench, analysed."""
    simulator = vhdl_simulator()
    folder = tmp_path_factory.mktemp(TOP)
    sources = [file for file in hdl.hdl_sources() if file.stem in PACKAGES]
    assert len(sources) == len(PACKAGES)
    sources.append(Path(__file__).with_name(f"{TOP}.vhd"))
    for command in simulator.build_commands(sources, TOP):
        simulator.run(command, folder)
    return simulator, folder


def schedule(
    m: int, shifts: tuple[int, ...], align: Align, boxes: tuple[int, ...]
) -> Iterator[tuple[str, int]]:
    """Yield the lines that the bench should write, from SumLayout and CoreConfiguration."""
    layout = SumLayout(m, shifts, align, boxes=boxes)

    def core(*, any_rows: bool = False, **options: object) -> CoreConfiguration:
        engine = MovingSumEngine(any_rows=any_rows)
        values = {"micro_image_size": m, "shifts": shifts, "boxes": boxes, "align": align}
        values["engine"] = engine
        return CoreConfiguration.model_validate({**values, "max_columns": 64, **options})

    yield "output_delay", layout.delay
    yield "reach", layout.reach
    yield "holds_outputs", layout.holds_outputs
    yield "pixels_leave", layout.pixels_leave
    yield "alternates", layout.alternates
    yield "begins_within_group", layout.begins_within_group
    for any_rows in (False, True):
        columns = SumLayout(m, shifts, align, any_rows, boxes)
        for v in range(m):
            yield f"ring_lines {any_rows:d} {v}", columns.ring_lines[v]
        for g, lines in enumerate(columns.bank_lines[:: 1 + layout.alternates]):
            yield f"bank_lines {any_rows:d} {g}", lines
        for order in (0, 1):
            # Where rows are a multiple of M it is that of the sequencer's MIN_BANDS.
            lines = core(order=order, any_rows=True).frame_lines(1)
            least = lines if any_rows else core(order=order).delay + 1
            yield f"least_frame {any_rows:d} {order}", least
    for stored in (False, True):
        arithmetic = {"arithmetic": StoredProductArithmetic()} if stored else {}
        for order in (0, 1):
            stages = core(order=order, **arithmetic)
            clocks = stages.engine.stages_clocks(stages) + 2 * stages.passes * stored
            yield f"sum_clocks {stored:d} {order}", clocks
    for p in LANES:
        lanes = LaneLayout(layout, p)
        wide = {"engine": MovingSumEngine(pixels_per_clock=p)}
        yield f"lane_delay {p}", lanes.delay
        yield f"bank_count {p}", lanes.banks
        yield f"bank_rows {p}", lanes.rows
        yield f"line_tokens {p}", max(core(**wide).line_tokens(37), 2)
        for order in (0, 1):
            linear = core(order=order, **wide)
            yield f"row_tokens {p} {order}", linear.engine.row_tokens(linear)
            yield f"lanes_clocks {p} {order}", linear.engine.stages_clocks(linear)
        places = range(lanes.banks)
        rows = [lanes.row(s, place) for s in range(len(shifts)) for place in places]
        yield f"lowest_row {p}", min(rows)
        yield f"highest_row {p}", max(rows)
        for s in range(len(shifts)):
            for place in places:
                yield f"entering_bank {p} {s} {place}", lanes.bank(s, place)
                yield f"entering_row {p} {s} {place}", lanes.row(s, place)
                left = place - layout.box(s)
                yield f"left_bank {p} {s} {place}", lanes.bank(s, left)
                rows_back = lanes.row(s, left) - lanes.row(s, place)
                yield f"left_rows {p} {s} {place}", rows_back
            for index in range(p):
                for held in (False, True):
                    name = f"is_ahead {p} {s} {index} {held:d}"
                    yield name, lane_is_initial(lanes, s, index, held=held)
    yield from ((f"bank_group {v}", group) for v, group in enumerate(layout.bank_groups))
    for s in range(len(shifts)):
        yield f"group_size {s}", layout.group_size(s)
        for v in range(m):
            yield f"entering_phase {s} {v}", layout.entering_phase(s, v)
            yield f"entering_age {s} {v}", layout.entering_age(s, v)
            yield f"leaving_phase {s} {v}", layout.leaving_phase(s, v)
            yield f"leaving_age {s} {v}", layout.leaving_age(s, v)
            yield f"begins_group {s} {v}", layout.begins_group(s, v)
            for held in (False, True):
                index = initial_index(layout, s, v, held=held)
                name = str(held).lower()
                yield f"initial_index {name} {s} {v}", -1 if index is None else index
                yield f"is_initial {name} {s} {v}", is_initial(layout, s, v, held=held)


def test_vhdl_and_python_have_one_schedule(built: tuple[Simulator, Path]) -> None:
    simulator, folder = built
    rng = random.Random(draw_seed())
    cases = [(m, tuple(range(-m, 2 * m + 1))) for m in (1, 2, 3, 4, 5, 6)]
    cases += [(11, tuple(range(-11, 12)))]
    cases += [
        (m, tuple(rng.sample(range(-3 * m, 3 * m + 2), rng.randint(1, 4))))
        for m in rng.choices(range(1, 17), k=14)
    ]
    for number, (m, shifts) in enumerate(cases):
        boxes: tuple[int, ...] = ()
        if number % 2:
            steps = (math.gcd(shift, m) for shift in shifts)
            boxes = tuple(step * rng.randint(1, m // step) for step in steps)
        aligns: tuple[Align, ...] = ("centred", "causal")
        for align in aligns:
            generics: dict[str, int | bool | str] = {
                "MICRO_IMAGE_SIZE": m,
                "SHIFTS": " ".join(map(str, shifts)),
                "CENTRED": align == "centred",
                "BOX": " ".join(map(str, boxes)) or " ",
            }
            simulator.run(simulator.run_command(TOP, generics), folder)
            lines = (folder / "schedule.txt").read_text().splitlines()
            got = {name: int(value) for name, value in (line.rsplit(" ", 1) for line in lines)}
            want = {name: int(value) for name, value in schedule(m, shifts, align, boxes)}
            wrong = {k: (got.get(k), want.get(k)) for k in got | want if got.get(k) != want.get(k)}
            assert not wrong, f"M = {m}, {shifts}, {boxes}, {align}, VHDL and Python: {wrong}"
