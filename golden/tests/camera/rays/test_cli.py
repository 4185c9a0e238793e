# SPDX-License-Identifier: Apache-2.0
"""The commands of the ray model."""

import csv
import json
from math import inf
from pathlib import Path

import pytest
from in_process import plenofir
from matplotlib.figure import Figure

from plenofir.camera.plots import SharpRange, draw_ranges
from plenofir.camera.rays.camera import CAMERAS


def answer(*arguments: str):
    done = plenofir(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_distance() -> None:
    options = ("--camera", "f193-mla2", "--focus", "inf", "--micro-image", "13")
    found = answer("distance", *options, "--a", "1", "--a", "0", "--a", "-2/13", "--a", "4")
    assert found["camera"] == "f193-mla2"
    first, second, third, fourth = found["planes"]
    assert first["a"] == "1/1"
    assert first["state"] == "real"
    numbers = [first[key] for key in ("near_mm", "distance_mm", "far_mm")]
    assert [round(n, 4) for n in numbers] == [838.1359, 962.7459, 1110.0123]
    assert (second["state"], second["distance_mm"], second["far_mm"]) == ("infinity", None, None)
    assert round(second["near_mm"], 4) == 11081.3954
    assert third["a"] == "-2/13"
    assert (third["state"], third["distance_mm"]) == ("beyond infinity", None)
    assert (fourth["state"], fourth["near_state"]) == ("real", "inside lens")
    assert (second["alpha"], round(first["alpha"], 5)) == (1, 1.30121)
    assert found["diffraction_limited"]
    assert round(found["rayleigh_limit_mm"], 6) == 0.014762


def test_baseline() -> None:
    found = answer("baseline", "--camera", "f193-mla2", "--focus", "3000", "--gap", "6")
    assert found["gap"] == 6
    assert round(found["baseline_mm"], 4) == 4.2748
    assert round(found["tilt_deg"], 4) == -0.0816
    assert round(found["exit_pupil_baseline_mm"], 4) == 2.4556
    assert (found["outermost_view"], found["vignetted"]) == (None, False)
    assert answer("baseline", "--camera", "f193-mla2", "--gap", "6")["tilt_deg"] == 0


def test_views_beyond_the_entrance_pupil(tmp_path: Path) -> None:
    text = (CAMERAS / "f193-mla2.toml").read_text()
    camera = tmp_path / "camera.toml"
    camera.write_text(text.replace("[main_lens]", "[main_lens]\nentrance_pupil_diameter_mm = 7.0"))
    for command in (("baseline",), ("depth", "--disparity", "1")):
        for gap, beyond in (("5", False), ("6", True)):
            call = (*command, "--camera", str(camera), "--gap", gap)
            assert ("outside the entrance pupil" in plenofir(*call).stdout) == beyond
            assert answer(*call)["vignetted"] == beyond


def test_depth() -> None:
    options = ("--camera", "f197-mla2", "--gap", "4", "--disparity", "2", "--disparity", "0")
    near, far = answer("depth", *options)["objects"]
    assert round(near["depth_mm"]) == 2035
    assert near["distance_mm"] > near["depth_mm"]
    assert (far["state"], far["depth_mm"], far["distance_mm"]) == ("infinity", None, None)
    per_view = answer(
        "depth", "--camera", "f197-mla2", "--gap", "4", "--disparity", "0.5", "--per-view"
    )
    assert per_view["objects"][0]["depth_mm"] == pytest.approx(near["depth_mm"])


def test_slices() -> None:
    options = ("--camera", "f193-mla2", "--near", "500", "--far", "3000")
    found = answer("slices", *options)
    assert found["gaps"] == []
    assert found["slices"][0]["far_mm"] >= 3000
    assert found["slices"][-1]["near_mm"] <= 500
    whole = answer("slices", *options, "--whole")
    assert all(part["a"].endswith("/1") for part in whole["slices"])
    assert whole["gaps"]


def test_lens_and_cameras() -> None:
    found = answer("lens", "f100")
    assert round(found["focal_length_mm"], 4) == 99.5045
    assert round(found["principal_plane_separation_mm"], 4) == -33.4236
    assert "f193-mla2" in {camera["name"] for camera in answer("cameras")}


@pytest.mark.parametrize(
    "arguments",
    [
        ("distance", "--camera", "f90-mla2", "--focus", "3000", "--a", "2/3"),
        ("baseline", "--camera", "f90-mla1"),
        ("depth", "--camera", "f90-mla1", "--disparity", "1"),
        ("slices", "--camera", "f90-mla2", "--near", "500", "--far", "inf"),
        ("lens", "tronnier"),
        ("cameras",),
    ],
)
def test_tables(arguments: tuple[str, ...]) -> None:
    done = plenofir(*arguments)
    assert done.returncode == 0, done.stderr
    assert "mm" in done.stdout


def test_far_planes_show_the_digits_that_they_have() -> None:
    done = plenofir("distance", "--camera", "f193-mla2", "--focus", "1e15", "--a", "0")
    assert " 1e+15 " in done.stdout


F193 = ("--camera", "f193-mla2", "--focus", "3000")
# With the list in its JSON, and a format: all three are one function's.
DRAWN = {
    ("distance", *F193, "--a", "0", "--a", "1", "--a", "-2", "--a", "-1/3"): ("planes", "png"),
    ("baseline", *F193, "--gap", "6"): ("", "pdf"),
    ("depth", *F193, "--gap", "4", "--disparity", "0", "--disparity", "2"): ("objects", "svg"),
    ("slices", *F193, "--near", "500", "--far", "inf"): ("slices", "svg"),
}


@pytest.mark.parametrize("words", DRAWN, ids=lambda words: words[0])
def test_plots_and_csv(tmp_path: Path, words: tuple[str, ...]) -> None:
    part, suffix = DRAWN[words]
    file, table = tmp_path / f"plot.{suffix}", tmp_path / "numbers.csv"
    done = plenofir(*words, "--json", "--plot", str(file), "--csv", str(table))
    assert done.returncode == 0, done.stderr
    head = {"svg": b"<?xml", "pdf": b"%PDF", "png": b"\x89PNG"}[suffix]
    assert file.read_bytes().startswith(head)
    content = json.loads(done.stdout)
    rows = list(csv.DictReader(table.open()))
    if not part:
        # All gaps up to M - 1.
        assert [int(row["gap"]) for row in rows] == list(range(1, 13))
        assert float(rows[5]["baseline_mm"]) == content["baseline_mm"]
        return
    for row, item in zip(rows, content[part], strict=True):
        for name, text in row.items():
            value = item[name]
            assert text == ("" if value is None else str(value))


def test_endless_depths_of_field_are_drawn_as_such(tmp_path: Path) -> None:
    """An arrow to infinity, a state in words where nothing is sharp; else neither."""
    settings = {"0": False, "-5/13": True, "-2": False}
    for a, endless in settings.items():
        drawing = tmp_path / "bench.svg"
        done = plenofir("distance", *F193, "--a", a, "--plot", str(drawing))
        assert done.returncode == 0, done.stderr
        text = drawing.read_text()
        assert (">infinity</text>" in text) == endless
        assert ("beyond infinity" in text) == (a == "-2")
    axes = Figure().subplots()
    draw_ranges(axes, [SharpRange("a", 100.0, 200.0, 150.0), SharpRange("b", 150.0, inf)])
    low, high = axes.get_xlim()
    bars = [path.get_extents() for shape in axes.collections for path in shape.get_paths()]
    assert [(bar.x0, bar.x1) for bar in bars] == [(100.0, 200.0), (150.0, high)]
    assert low < 100 < 200 < high


def test_cameras_say_what_their_symbols_mean() -> None:
    done = plenofir("cameras")
    for symbol in ("f_U", "f_s", "p_M", "p_p"):
        assert f"\n{symbol}: " in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("distance", "--camera", "f50", "--a", "1"), "no such camera"),
        (("distance", "--camera", "f193-mla2", "--a", "x"), "--a"),
        (
            ("distance", "--camera", "f193-mla2", "--a", "1", "--focus", "100"),
            "at least 707.6177 mm",
        ),
        (("distance", "--camera", "f193-mla2", "--a", "1", "--focus", "nan"), "--focus"),
        (("distance", "--camera", "f193-mla2", "--a", "1", "--focus", "near"), "--focus"),
        (("distance", "--camera", "f193-mla2", "--a", "1", "-M", "1"), "--micro-image: '1'"),
        (("distance", "--camera", "f193-mla2", "--a", "1", "-M", "x"), "--micro-image"),
        (("distance", "--camera", "f193-mla2", "--a", "1", "--plot", "/none/x.png"), "/none/x.png"),
        (("depth", "--camera", "f193-mla2", "--disparity", "1", "--gap", "0"), "gap"),
        (("depth", "--camera", "f193-mla2", "--disparity", "inf"), "--disparity"),
        (("slices", "--camera", "f193-mla2", "--near", "9", "--far", "5"), "near < far"),
        (("lens", "none.csv"), "no such lens"),
        (("report", "rays", "--out", "/proc/none"), "cannot be written"),
    ],
)
def test_bad_input(arguments: tuple[str, ...], message: str) -> None:
    done = plenofir(*arguments)
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stderr


def test_report(tmp_path: Path) -> None:
    done = plenofir("report", "rays", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "report.md").read_text()
    heads = "The thesis's predictions", "Real rays", "virtual cameras", "stability", "run time"
    for head in heads:
        assert head in text
    assert "differs" not in text
    for name in ("real_rays", "stability", "run_time", "meetings", "distances", "dispersion"):
        picture = f"{name}.png"
        assert picture in text
        assert (tmp_path / picture).stat().st_size > 5000


@pytest.mark.filterwarnings("error")
def test_plots_of_a_camera_at_the_ends_of_what_is_possible(tmp_path: Path) -> None:
    camera = tmp_path / "odd.toml"
    camera.write_text(
        'name = "odd"\n[main_lens]\nfocal_length_mm = 1e9\nexit_pupil_mm = inf\n'
        "[micro_lenses]\nfocal_length_mm = 1e-6\npitch_mm = 0.1\n[sensor]\npixel_pitch_mm = 1e-3\n"
    )
    plot = tmp_path / "plot.svg"
    # A telecentric lens has no baseline at its pupil, and these disparities no real object.
    for words in (("baseline", "--gap", "0"), ("depth", "--disparity", "-1")):
        done = plenofir(*words, "--camera", str(camera), "--plot", str(plot))
        assert done.returncode == 0, done.stderr
        assert plot.read_bytes().startswith(b"<?xml")
        plot.unlink()


@pytest.mark.parametrize("words", [("--near", "1e200"), ("--near", "nan")])
def test_distances_beyond_any_are_refused(words: tuple[str, ...]) -> None:
    done = plenofir("slices", "--camera", "f193-mla2", "--far", "1e300", *words)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1


def test_neither_plot_nor_csv_is_written_if_one_cannot(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    for words in (("distance", "--a", "1"), ("design",)):
        done = plenofir(
            *words,
            "--camera",
            "f193-mla2",
            "--plot",
            str(tmp_path / "none/x.svg"),
            "--csv",
            f"{table}",
        )
        assert done.returncode == 2
        assert "there is no folder" in done.stderr
        assert list(tmp_path.iterdir()) == []
