"""The timing diagrams are those of the present sources, and what they show is right."""

import numpy as np
import pytest

from plenofir import project
from plenofir.errors import InputError
from plenofir.refocus import filter_lines, switch_matrix
from plenofir.refocus.arithmetic import scaled_quotient
from plenofir.simulation.module_waves import (
    MICRO_IMAGE_SIZE,
    PIXELS,
    SHIFTS,
    RowBench,
    module_diagram,
    simulation_diagram,
    timing_diagrams,
)
from plenofir_tb.runner import draw_seed

DOCS = project.root() / "docs"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> RowBench:
    try:
        return RowBench(tmp_path_factory.mktemp("bench"))
    except InputError as error:
        pytest.skip(str(error))


def golden_row(pixels, micro_image_size: int, shift: int) -> list[int]:
    products = scaled_quotient(np.array(pixels, dtype=np.int64), 0, micro_image_size)
    return [int(s) for s in next(filter_lines([products], micro_image_size, shift, align="causal"))]


def test_the_drawings_are_those_of_a_new_simulation(bench: RowBench) -> None:
    drawings = timing_diagrams(bench)
    committed = {path.name: path.read_text() for path in (DOCS / "images" / "waves").iterdir()}
    stale = {
        name for name in drawings.keys() | committed if drawings.get(name) != committed.get(name)
    }
    assert not stale, "run make waves"
    page = (DOCS / "waves.md").read_text()
    assert all(f"(images/waves/{name})" in page for name in drawings)


@pytest.mark.parametrize("shift", SHIFTS)
def test_what_a_diagram_shows(bench: RowBench, shift: int) -> None:
    diagram = module_diagram(bench.run(shift=shift))
    lanes: dict[str, dict] = {}
    for entry in diagram["signal"]:
        for lane in entry[1:] if isinstance(entry, list) else [entry]:
            lanes[lane["name"]] = lane
    m = MICRO_IMAGE_SIZE
    colours = "537" * (len(PIXELS) // m)
    assert lanes["E_fs[x_k]"]["data"] == [str(p) for p in PIXELS]
    assert lanes["E_fs[x_k] / 3"]["data"] == [str(p // m) for p in PIXELS]
    assert lanes["p"]["data"] == [str(k % m) for k in range(len(PIXELS))]
    assert lanes["E'[x_k]"]["data"] == [str(s) for s in golden_row(PIXELS, m, shift)]
    for name in ("E_fs[x_k]", "E_fs[x_k] / 3", "p"):
        assert lanes[name]["wave"].strip("x") == colours
    begin = lanes["p"]["wave"].index("5")
    for tap, column in enumerate(switch_matrix(m, shift).T):
        drawn = ""
        for state in lanes[f"S(p, {tap})"]["wave"]:
            drawn += drawn[-1] if state == "." else state
        want = "".join(str(int(column[k % m])) for k in range(len(PIXELS)))
        assert drawn[begin : begin + len(PIXELS)] == want
    widths = {len(lane["wave"]) for lane in lanes.values()}
    assert len(widths) == 1


def test_times_of_the_simulation(bench: RowBench) -> None:
    lanes = simulation_diagram(bench.run(shift=1))["signal"]
    times = [int(t) for t in lanes[0]["data"]]
    assert lanes[0]["name"] == "t / ns"
    assert times == [30 + 60 * n for n in range(len(times))]


@pytest.mark.parametrize(
    ("micro_image_size", "shift"), [(3, 0), (3, 1), (3, 2), (3, -1), (5, 3), (2, 4), (1, 1)]
)
def test_any_row_equals_the_golden_model(bench: RowBench, micro_image_size, shift) -> None:
    seed = draw_seed()
    print(f"SEED={seed}")
    rng = np.random.default_rng(seed)
    pixels = rng.integers(0, 255, int(rng.integers(1, 40)), endpoint=True).tolist()
    run = bench.run(pixels, micro_image_size, shift)
    assert run.outputs == golden_row(pixels, micro_image_size, shift)
