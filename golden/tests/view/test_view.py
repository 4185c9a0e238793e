# SPDX-License-Identifier: Apache-2.0
"""What a page of the viewer is made of: views, depth, distances, pictures."""

import json
import re
import zlib
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir
from lytro_writer import F01, write_capture
from scipy import ndimage

from plenofir import InputError
from plenofir.camera.calibration import calibrate, decode, load_calibration
from plenofir.camera.lightfield import Disparity, named_views
from plenofir.camera.lightfield import views as views_of
from plenofir.camera.rays import RayModel, load_camera
from plenofir.ground.files import checksum
from plenofir.ground.images import write_png
from plenofir.refocus.pictures import _STEEPEST
from plenofir.view import light_field_page, pictures_page
from plenofir.view.light_field import plane_table
from plenofir.view.page import PartRequest
from plenofir.view.views_and_depth import Depth, LightField, reduced

RNG = np.random.default_rng(3)
RAW = RNG.integers(0, 256, (23, 31, 3), dtype=np.uint8)


@pytest.mark.parametrize("step", [1, 2, 5, 40])
def test_reduced_pictures_are_means_of_what_there_is(step: int) -> None:
    rows, columns = RAW.shape[:2]
    for t, line in enumerate(small := reduced(RAW, step)):
        for s, pixel in enumerate(line):
            part = RAW[t * step : (t + 1) * step, s * step : (s + 1) * step]
            assert (pixel == np.rint(part.mean(axis=(0, 1)))).all()
    assert small.shape == (-(-rows // step), -(-columns // step), 3)


def test_views_are_those_of_the_raw_image_and_black_beyond_it() -> None:
    m = 4
    views = LightField(RAW, m).views()
    assert views.shape == (m, m, 6, 8, 3)
    for v, u in np.ndindex(m, m):
        part = RAW[v::m, u::m]
        assert (views[v, u, : part.shape[0], : part.shape[1]] == part).all()
        assert views[v, u].sum() == part.sum()


def test_binned_views_are_means_of_micro_lenses() -> None:
    m, binning = 3, 2
    raw = RAW[:18, :30]
    views, binned = LightField(raw, m).views(), LightField(raw, m).views(binning)
    means = views.reshape(m, m, 3, binning, 5, binning, 3).mean((3, 5))
    assert (binned == np.floor(means + 0.5)).all()


def test_the_table_of_distances_is_the_ray_model() -> None:
    m = 5
    model = RayModel.focused(load_camera("f193-mla2"), 3000, m)
    table = plane_table(model, (-1.0, 2.0))
    json.dumps(table, allow_nan=False)
    a = table["first"] + table["step"] * np.arange(len(table["alpha"]))
    assert a[0] == -1
    assert a[-1] == pytest.approx(2)
    # All of the grid is in it.
    assert np.isin(np.arange(-5, 11), np.rint(a * m * 1e6) / 1e6).all()
    for name, border in (("centre", "distance"), ("near", "near_border"), ("far", "far_border")):
        found = getattr(model, border)(a)
        mm = np.array([np.nan if x is None else x for x in table[name]["mm"]])
        np.testing.assert_allclose(mm, found.mm, atol=1e-4)
        assert table[name]["state"] == found.states.tolist()


def test_depth_is_the_disparity_that_was_drawn() -> None:
    m, a = 5, 0.75
    rng = np.random.default_rng(4)
    texture = rng.uniform(0, 255, (30, 30))
    raw = np.zeros((150, 150), np.uint8)
    t, s = np.indices((30, 30))
    for v, u in np.ndindex(m, m):
        place = (t + a * (v - 2) + 5) / 2, (s + a * (u - 2) + 5) / 2
        raw[v::m, u::m] = ndimage.map_coordinates(texture, place, order=1)
    page = light_field_page(raw, m, full_scale=255, title="")
    part = page.parts["depth"](1)
    values = np.frombuffer(zlib.decompress(part.content), "<u2").reshape(30, 30)
    assert part.facts["size"] == "30x30"
    low, high = (float(end) for end in part.facts["range"].split(","))
    depth = low + (high - low) * (values[5:-5, 5:-5] / 65535)
    assert abs(np.median(depth) - a) < 0.1


def test_depth_tells_what_is_sure_and_the_steepest_tilt_is_that_of_the_commands() -> None:
    disparity = Disparity(np.full((7, 10), 0.5), np.ones((7, 10)))
    disparity.confidence[2, 4] = 0.2
    page = light_field_page(RAW[:21, :30], 3, full_scale=255, title="", disparity=disparity)
    values = np.frombuffer(zlib.decompress(page.parts["depth"](PartRequest()).content), "<u2")
    assert np.flatnonzero(values % 2 == 0).tolist() == [24]
    assert f"STEEPEST = {_STEEPEST};" in page.asset("state.js").decode()


@pytest.mark.parametrize("m", [4, 5])
def test_depth_lies_where_pictures_have_it(m: int) -> None:
    """A thing at a = 1 in columns 10 to 19 of the central view, for even M half a lens aside."""
    settings = np.zeros((24, 30))
    settings[:, 10:20] = 1
    depth = Depth(settings, settings > 0, (0.0, 1.0), 1).in_pictures(m)
    moved = 0.5 if m % 2 == 0 else 0
    middle = (depth[12] * np.arange(30)).sum() / depth[12].sum()
    # Edges are half way between lenses there.
    assert middle == pytest.approx(14.5 + moved, abs=0.3)


def test_a_folder_of_views_needs_nothing_else(tmp_path: Path) -> None:
    folder, out = tmp_path / "views", tmp_path / "page.html"
    folder.mkdir()
    for name, image in named_views(views_of(RAW[:21, :30], 3)).items():
        write_png(folder / name, image)
    for options in ((), ("-M", "3")):
        done = plenofir("view", str(folder), *options, "--export", str(out))
        assert done.returncode == 0
        # Views of 10 x 7 pixels do not tell their order.
        assert re.fullmatch("note: axes: too little parallax to tell .*\n", done.stderr)
        assert '"30 x 21 pixels, M = 3, 8 bit."' in out.read_text()
    done = plenofir("view", str(folder), "-M", "4", "--export", str(out))
    assert done.stderr == "plenofir: --micro-image: 4 is not right: there are 3 x 3 views\n"
    # Slices of a stack have numbers in their names, too.
    for shift in range(9):
        write_png(tmp_path / f"refocused_{shift}_9.png", RAW)
    done = plenofir("view", str(tmp_path), "--export", str(out))
    assert '"pictures": ["refocused_0_9.png"' in out.read_text()


def test_pictures_of_another_run_are_refused(tmp_path: Path) -> None:
    for name in ("refocused", "golden"):
        write_png(tmp_path / f"{name}.png", RAW)
    known = {path.name: checksum(path) for path in tmp_path.glob("*.png")}
    (tmp_path / "report.json").write_text(json.dumps({"mismatches": 0, "sha256": known}))
    page = pictures_page(tmp_path)
    assert page.field["notes"] == ["0 pixels differ between VHDL and golden model."]
    write_png(tmp_path / "golden.png", RAW[::-1])
    with pytest.raises(InputError, match=r"golden.png: was changed since the run"):
        page.parts["golden.png"](PartRequest())
    done = plenofir("view", str(tmp_path), "--no-browser")
    assert done.returncode == 2
    assert "golden.png: was changed since the run that report.json tells of" in done.stderr
    write_png(tmp_path / "golden.png", RAW)
    write_png(tmp_path / "mine.png", RAW)
    with pytest.raises(InputError, match=r"mine.png: is not of the run"):
        pictures_page(tmp_path)


def test_depth_that_is_there_is_not_searched_again() -> None:
    disparity = Disparity(np.linspace(-0.5, 3, 70).reshape(7, 10), np.ones((7, 10)))
    # Nothing is seen there.
    disparity.pixels_per_view[2, 4], disparity.confidence[2, 4] = 30, 0
    told: list[int] = []
    page = light_field_page(
        RAW[:21, :30],
        3,
        full_scale=255,
        title="",
        disparity=disparity,
        progress=lambda done, _: told.append(done),
    )
    part = page.parts["depth"](PartRequest())
    low, high = (float(end) for end in part.facts["range"].split(","))
    values = np.frombuffer(zlib.decompress(part.content), "<u2").reshape(7, 10)
    settings = low + (high - low) * values / 65535
    assert settings[3, 5] == pytest.approx(disparity.pixels_per_view[3, 5], abs=1e-3)
    assert settings[2, 4] == pytest.approx(settings[2, 3:6].mean(), abs=0.2)
    assert told == []


def test_a_raw_capture_is_resampled_with_its_calibration(tmp_path: Path) -> None:
    y, x = np.mgrid[:90, :90]
    light = np.cos(np.pi * (y - 4.3) / 9) ** 2 * np.cos(np.pi * (x - 4.6) / 9) ** 2
    white = np.rint(20 + 220 * light).astype(np.uint8)
    write_png(tmp_path / "white.png", white)
    calibrate(white).save(tmp_path / "calib.json")
    out = tmp_path / "page.html"
    words = (str(tmp_path / "white.png"), "-M", "7", "--calib", str(tmp_path / "calib.json"))
    done = plenofir("view", *words, "--export", str(out))
    assert done.returncode == 0, done.stderr
    rows, columns = decode(white, load_calibration(tmp_path / "calib.json"), 7).shape
    assert f'"{columns} x {rows} pixels, M = 7, 8 bit."' in out.read_text()


def test_a_lytro_file_needs_nothing_else(tmp_path: Path) -> None:
    written = write_capture(F01, noise=0.003)
    file, out = tmp_path / "capture.lfp", tmp_path / "page.html"
    file.write_bytes(written.container())
    done = plenofir("view", str(file), "--export", str(out))
    assert done.returncode == 0, done.stderr
    found = re.search(r'"(\d+) x (\d+) pixels, M = 9, 16 bit."', out.read_text())
    assert found is not None
    assert all(int(n) % 9 == 0 and int(n) > 45 for n in found.groups())
