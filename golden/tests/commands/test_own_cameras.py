# SPDX-License-Identifier: Apache-2.0
"""Captures of cameras that someone built, through the commands: colours, and a grid that fits."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from camera.captures.own_camera import OwnCamera, mosaic, words
from in_process import plenofir
from tifffile import imwrite

from plenofir.camera.lightfield import sub_aperture
from plenofir.ground.images import read_picture, write_png

CAMERA = OwnCamera(shape=(160, 200), pitch=10.3)
M = 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """White images and captures as people save them, and a calibration."""
    path = tmp_path_factory.mktemp("own")
    images = dict(zip(("raw", "white"), map(words, CAMERA.take(3, 0.7)), strict=True))
    for name, image in images.items():
        imwrite(path / f"{name}_rgb.tif", image, photometric="rgb")
        bayer = mosaic(image)
        write_png(path / f"{name}_bayer16.png", bayer)
        write_png(path / f"{name}_bayer8.png", (bayer >> 8).astype(np.uint8))
        # As libcamera writes it: black 64, the sensor's picture in the first directory.
        tags = [
            (50706, 1, 4, (1, 4, 0, 0), True),
            (33421, 3, 2, (2, 2), True),
            (33422, 1, 4, (0, 1, 1, 2), True),
            (50714, 4, 1, 64, True),
            (50717, 4, 1, 4095, True),
        ]
        flat = np.minimum((bayer >> 4) + 64, 4095)
        imwrite(path / f"{name}_flat.dng", flat, photometric=32803, metadata=None, extratags=tags)
    raw = images["raw"]
    write_png(path / "raw_shifted.png", np.roll(raw, (3, -2), (0, 1)))
    write_png(path / "raw_turned180.png", raw[::-1, ::-1].copy())
    write_png(path / "raw_roi.png", raw[22:, 31:].copy())
    write_png(path / "raw_black.png", np.zeros_like(raw))
    done = plenofir("calibrate", "white_rgb.tif", cwd=path)
    assert done.returncode == 0, done.stderr
    return path


def decoded(folder: Path, raw: str, *options: str, code: int = 0) -> tuple[np.ndarray, str]:
    """Central view of a capture, and what was said on standard error."""
    calib = () if "--calib" in options else ("--calib", "calib.json")
    words_ = ("decode", raw, *calib, "-M", str(M), "--out", "out.png", *options)
    done = plenofir(*words_, cwd=folder)
    assert done.returncode == code, done.stderr
    view = np.zeros(0)
    if code == 0:
        picture = read_picture(folder / "out.png")
        view = sub_aperture(picture.pixels, M, M // 2, M // 2) / picture.full_scale
    return view, done.stderr


def psnr(one: np.ndarray, other: np.ndarray) -> float:
    """Of two pictures whose exposure may differ."""
    other = other * (one * other).sum() / (other * other).sum()
    return float(-10 * np.log10(np.mean((one - other) ** 2)))


def test_a_right_pair_says_nothing_and_white_is_white(folder: Path) -> None:
    view, said = decoded(folder, "raw_rgb.tif")
    assert "note" not in said
    assert "could" not in said
    colours = json.loads((folder / "calib.json").read_text())["colours"]
    assert colours == pytest.approx(CAMERA.colours, rel=0.01)
    cast, _ = decoded(folder, "raw_rgb.tif", "--white-balance", "off")
    gains = view.mean(axis=(0, 1)) / cast.mean(axis=(0, 1))
    assert gains / gains[1] == pytest.approx(1 / np.array(CAMERA.colours), rel=0.01)
    told, _ = decoded(folder, "raw_rgb.tif", "--white-balance", "1.5,0.75")
    gains = told.mean(axis=(0, 1)) / cast.mean(axis=(0, 1))
    assert gains == pytest.approx(np.array([2, 4 / 3, 1]), rel=0.01)
    _, said = decoded(
        folder, "raw_bayer16.png", "--bayer", "none", "--white-balance", "2,2", code=2
    )
    assert "the capture is grey" in said


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("flat.dng", ()),
        ("bayer8.png", ("--bayer", "RGGB")),
    ],
)
def test_mosaics_have_their_colours(folder: Path, kind: str, options: tuple[str, ...]) -> None:
    """From the white image on: the same picture as the same camera's RGB."""
    expected, _ = decoded(folder, "raw_rgb.tif")
    done = plenofir("calibrate", f"white_{kind}", "--out", "mosaic.json", *options, cwd=folder)
    assert done.returncode == 0, done.stderr
    view, said = decoded(folder, f"raw_{kind}", "--calib", "mosaic.json", *options)
    assert "note" not in said
    assert view.shape == expected.shape
    assert psnr(expected, view) > 32
    ratio = view.mean(axis=(0, 1)) / expected.mean(axis=(0, 1))
    assert ratio / ratio[1] == pytest.approx(np.ones(3), abs=0.03)


def test_an_unnamed_mosaic_is_noticed(folder: Path) -> None:
    _, said = decoded(folder, "raw_bayer16.png", code=2)
    assert "colour mosaic" in said
    assert "--bayer rggb or bggr" in said
    done = plenofir("inspect", "raw_bayer16.png", cwd=folder)
    assert "raw capture" in done.stdout
    assert "--bayer rggb or bggr" in done.stdout
    grey, _ = decoded(folder, "raw_bayer16.png", "--bayer", "none")
    assert grey.ndim == 2


def test_inspect_names_the_mosaic_of_a_dng(folder: Path) -> None:
    done = plenofir("inspect", "raw_flat.dng", cwd=folder)
    assert "raw capture" in done.stdout
    assert "RGGB by its file" in done.stdout


@pytest.mark.parametrize(
    ("capture", "note"),
    [
        ("raw_shifted.png", "3.0. pixels lower and -[12].\\d\\d to the right"),
        ("raw_turned180.png", "turned by 180 degrees"),
        ("raw_black.png", "could not be checked"),
    ],
)
def test_a_grid_that_does_not_fit_is_told(folder: Path, capture: str, note: str) -> None:
    view, said = decoded(folder, capture)
    assert re.search(note, said), said
    if capture != "raw_black.png":
        expected, _ = decoded(folder, "raw_rgb.tif")
        if "turned" in capture:
            view = view[::-1, ::-1]
        rows, columns = (min(view.shape[axis], expected.shape[axis]) for axis in (0, 1))
        assert (
            psnr(expected[2 : rows - 2, 2 : columns - 2], view[2 : rows - 2, 2 : columns - 2]) > 25
        )


def test_a_part_of_the_sensor(folder: Path) -> None:
    _, said = decoded(folder, "raw_roi.png", code=2)
    assert "part of the sensor (ROI)" in said
    view, said = decoded(folder, "raw_roi.png", "--roi", "31,22")
    assert "note" not in said
    expected, _ = decoded(folder, "raw_rgb.tif")
    rows, columns = view.shape[:2]
    assert psnr(expected[-rows:, -columns:], view) > 40


def test_a_film_of_captures(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of captures are played with their calibration; what does not fit is told once."""
    from plenofir.commands import view
    from plenofir.view import Page
    from plenofir.view.page import PartRequest

    raw = read_picture(folder / "raw_shifted.png").pixels
    imwrite(folder / "pages.tif", np.stack([raw, raw // 2]), photometric="rgb")
    pages: list[Page] = []
    monkeypatch.setattr(view, "serve_page", lambda page, *_: pages.append(page))
    done = plenofir(
        "view", str(folder / "pages.tif"), "--calib", str(folder / "calib.json"), "-M", str(M)
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("did not fit") == 1
    assert pages[0].parts["frame"](PartRequest(1, 0)).content


def test_batch_tells_what_it_changes(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Notes of each capture, by its name; the pictures themselves are left out here."""
    from distributed import LocalCluster

    from plenofir.commands import album, app

    monkeypatch.setattr(album.Album, "make", lambda *_: [])
    monkeypatch.setattr(album.Album, "viewer", lambda *_: None)
    monkeypatch.chdir(folder)
    with LocalCluster(
        n_workers=1, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        frames = ["raw_shifted.png", "raw_rgb.tif"]
        words = ["--calib", "calib.json", "--scheduler", cluster.scheduler_address]
        assert app.run(["batch", *frames, *words, "--out", "developed"]) == 0
    captured = capfd.readouterr()
    assert "2 captures developed" in captured.out
    notes = [line for line in captured.err.splitlines() if line.startswith("note: ")]
    assert len(notes) == 1
    assert notes[0].startswith("note: raw_shifted.png: calibration: the calibration did not fit")


def test_develop_view_batch_and_simulation_tell_it(folder: Path) -> None:
    from plenofir.plan.sensor.sensor_run import load_sensor

    out = ("--export", "x.html", "-M", str(M), "--calib", "calib.json")
    done = plenofir("view", "raw_shifted.png", *out, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "did not fit" in done.stderr
    calib = ("--calib", "calib.json", "-M", str(M), "--slices", "1", "--out", "developed")
    done = plenofir("develop", "raw_shifted.png", *calib, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "did not fit" in done.stdout + done.stderr
    sensor = load_sensor(folder / "raw_shifted.png", folder / "calib.json", M)
    assert "did not fit" in sensor.notes[0]
    right = load_sensor(folder / "raw_rgb.tif", folder / "calib.json", M)
    assert right.notes == ()
    assert sensor.calibration.grid.coefficients[0] != right.calibration.grid.coefficients[0]
