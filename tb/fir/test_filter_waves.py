# SPDX-License-Identifier: Apache-2.0
"""The timing diagrams are up to date with the sources, and correct."""

import re

import numpy as np
import pytest

from module_waves import (
    MARKED_OUTPUT,
    MICRO_IMAGE_SIZE,
    PIXELS,
    SHIFTS,
    RowBench,
    module_diagram,
    simulation_diagram,
    timing_diagrams,
)
from plenofir.ground import project
from plenofir.refocus import FilterLayout, filter_lines
from plenofir.refocus.arithmetic import round_saturate, scaled_quotient
from plenofir_tb.runner import draw_seed
from plenofir_tb.tools import or_skip

DOCS = project.root() / "docs"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> RowBench:
    with or_skip():
        return RowBench(tmp_path_factory.mktemp("bench"))


def lanes_of(diagram: dict) -> dict[str, dict]:
    lanes = {}
    for entry in diagram["signal"]:
        for lane in entry[1:] if isinstance(entry, list) else [entry]:
            lanes[lane["name"]] = lane
    return lanes


def golden_row(pixels, layout: FilterLayout) -> list[int]:
    products = scaled_quotient(np.array(pixels, dtype=np.int64), 0, layout.micro_image_size)
    sums = next(filter_lines([products], layout))
    return round_saturate(sums, 0, 8).tolist()


def test_the_drawings_are_those_of_a_new_simulation(bench: RowBench) -> None:
    drawings = timing_diagrams(bench)
    committed = {path.name: path.read_text() for path in (DOCS / "images" / "waves").iterdir()}
    stale = {
        name for name in drawings.keys() | committed if drawings.get(name) != committed.get(name)
    }
    assert not stale, "run make waves"
    page = (DOCS / "fir-array.md").read_text()
    assert all(f"(images/waves/{name})" in page for name in drawings)


@pytest.mark.parametrize("shift", SHIFTS)
def test_what_a_diagram_shows(bench: RowBench, shift: int) -> None:
    run = bench.run(shift=shift, hold=shift == 0)
    layout = run.layout
    # The matrices that the thesis prints: Eqs. (6.7), (6.8), (6.9).
    assert layout.taps == (3, 3, 5)[shift]
    lanes = lanes_of(module_diagram(run))
    assert {len(lane["wave"]) for lane in lanes.values()} == {len(lanes["PCLK"]["wave"])}
    m = MICRO_IMAGE_SIZE
    assert lanes["E_fs[x_k]"]["data"] == [str(p) for p in PIXELS]
    assert lanes["E_fs[x_k] / 3"]["data"] == [str(p // m) for p in PIXELS]
    assert lanes["p"]["data"] == [str(k % m) for k in range(len(PIXELS))]
    assert lanes["E'[x_k]"]["data"] == [str(s) for s in golden_row(PIXELS, layout)]
    for name in ("E_fs[x_k]", "E_fs[x_k] / 3", "p"):
        assert lanes[name]["wave"].strip("x") == "537" * (len(PIXELS) // m)

    def levels(name: str) -> str:
        drawn = ""
        for state in lanes[name]["wave"]:
            drawn += drawn[-1] if state == "." else state
        begin = lanes["p"]["wave"].index("5")
        return drawn[begin : begin + len(PIXELS)]

    for tap, column in enumerate(layout.switches[0].T):
        want = "".join(str(int(column[k % m])) for k in range(len(PIXELS)))
        assert levels(f"S(p, {tap})") == want
    assert ("we" in lanes) == (shift == 0)
    if shift == 0:
        assert levels("we") == "001" * (len(PIXELS) // m)


@pytest.mark.parametrize("shift", SHIFTS)
def test_arrows_follow_an_output(bench: RowBench, shift: int) -> None:
    """Arrows from products lead to the partial sums that add them, up to the output."""
    diagram = module_diagram(bench.run(shift=shift, hold=shift == 0))
    place: dict[str, tuple[str, int, int]] = {}
    for name, lane in lanes_of(diagram).items():
        texts = iter(lane.get("data", []))
        values = [0 if c in "x." else int(next(texts)) for c in lane["wave"] if "data" in lane]
        for cell, marks in enumerate(re.findall(r"<(.)\.\.(.)>|\.", lane.get("node", ""))):
            place |= {mark: (name, cell, values[cell]) for mark in marks if mark not in ("", ".")}
    grown: dict[tuple[str, int], int] = {}
    sums: dict[tuple[str, int], int] = {}
    for edge in diagram["edge"]:
        (_, begin, value), (name, end, total) = place[edge[0]], place[edge[-1]]
        assert end == begin + 1
        grown[name, end] = grown.get((name, end), 0) + value
        sums[name, end] = total
    assert grown == sums
    assert len(sums) > MICRO_IMAGE_SIZE
    output = golden_row(PIXELS, bench.run(shift=shift).layout)[MARKED_OUTPUT]
    assert [total for (name, _), total in sums.items() if name == "E'[x_k]"] == [output]


def test_times_of_the_simulation(bench: RowBench) -> None:
    lanes = simulation_diagram(bench.run(shift=1))["signal"]
    times = [int(t) for t in lanes[0]["data"]]
    assert lanes[0]["name"] == "t / ns"
    assert times == [30 + 60 * n for n in range(len(times))]


@pytest.mark.parametrize(
    ("micro_image_size", "shift", "hold"),
    [
        *((3, 0, True), (3, 0, False), (3, 1, False), (3, 2, False)),
        *((3, -1, False), (5, 3, False), (2, 4, True), (2, 3, False), (1, 1, False)),
    ],
)
def test_any_row_equals_the_golden_model(bench: RowBench, micro_image_size, shift, hold) -> None:
    seed = draw_seed()
    print(f"SEED={seed}")
    rng = np.random.default_rng(seed)
    pixels = rng.integers(0, 255, int(rng.integers(1, 40)), endpoint=True).tolist()
    run = bench.run(pixels, micro_image_size, shift, hold=hold)
    assert run.outputs == golden_row(pixels, run.layout)
