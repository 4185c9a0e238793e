# SPDX-License-Identifier: Apache-2.0
"""From the capture of a focused camera to its pictures, with the commands."""

import json
from pathlib import Path

import numpy as np
import pytest
from focused_scenes import FOCUS, model_of, scene
from in_process import plenofir
from tifffile import TiffFile, xml2dict

from plenofir.camera.rays import setting_of_virtual_depth
from plenofir.ground.images import read_image, write_png

CAMERA = ("--camera", "raytrix-r12", "--focus", str(FOCUS))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A capture, its white image, and their calibration."""
    path = tmp_path_factory.mktemp("focused")
    truth = scene((2.25, 2.6, 3.2), lenses=(20, 24))
    write_png(path / "raw.png", truth.capture.raw)
    write_png(path / "white.png", truth.capture.white)
    done = plenofir("calibrate", "white.png", "--lens-types", "raw.png", *CAMERA, cwd=path)
    assert done.returncode == 0, done.stderr
    assert "micro lenses  3 types, sharpest at v = 2.3" in done.stdout
    assert json.loads((path / "calib.json").read_text())["lens_types"]["pattern"]
    return path


def run(folder: Path, command: str, *arguments: str) -> str:
    done = plenofir(command, "raw.png", "--calib", "calib.json", *arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_planes_of_a_capture(folder: Path) -> None:
    told = run(folder, "refocus", "-v", "2.6", *CAMERA)
    assert "refocused.png: v = 2.6, 424 mm, 276 x 230 pixels" in told
    assert "2 slices" in run(folder, "stack", "-v", "2.25:3.2:0.95", "--all-in-focus")
    pictures = sorted(path.name for path in (folder / "stack").iterdir())
    assert pictures == ["all_in_focus.png", "refocused_1_v2.25.png", "refocused_2_v3.2.png"]
    sharp = read_image(folder / "stack" / "all_in_focus.png").astype(float)
    assert sharp.shape == (230, 276, 3)
    # Each plane of the stack is a part of what is sharp everywhere.
    off = [
        np.abs(read_image(folder / "stack" / name).astype(float) - sharp).mean(axis=2)
        for name in pictures[1:]
    ]
    assert (off[0] < off[1]).mean() > 0.3
    assert (off[1] < off[0]).mean() > 0.05


def test_volumes_of_planes(folder: Path) -> None:
    """Values are the capture's at each plane; z has mm where planes are equally far apart."""
    told = run(folder, "stack", "-v", "2.3 2.6 3.1", "--out", "v.ome.tif")
    assert told.strip() == "v.ome.tif: 3 slices of 276 x 230 pixels, 16 bit; without --camera no mm"
    values = imagej_or_ome(folder / "v.ome.tif")[0]
    assert (values.shape, values.dtype) == ((3, 3, 230, 276), np.uint16)
    # Pictures without an exposure have the capture's values, too.
    for number, v in enumerate(("2.3", "2.6", "3.1")):
        run(folder, "refocus", "-v", v, "--exposure", "off")
        shown = read_image(folder / "refocused.png")
        np.testing.assert_array_equal(values[number], shown.transpose(2, 0, 1))
    # Of 8 bits they are finer than the capture's.
    write_png(folder / "raw8.png", (read_image(folder / "raw.png") // 257).astype(np.uint8))
    calibrated = ("--calib", "calib.json", "-v", "2.3", "--out", "8.tif")
    assert plenofir("stack", "raw8.png", *calibrated, cwd=folder).returncode == 0
    coarse = imagej_or_ome(folder / "8.tif")[0]
    assert (coarse % 257 > 0).mean() > 0.9
    assert np.abs(coarse + 128.0 - values[0]).max() < 600
    # Equal steps of v are none of mm.
    told = run(folder, "stack", "-v", "2.3:3.1:0.4", *CAMERA, "--out", "v.ome.tif")
    assert "mm from the micro lenses in steps that differ or fall: the file has none" in told
    assert not {"PhysicalSizeX", "PhysicalSizeZ"} & set(imagej_or_ome(folder / "v.ome.tif")[1])


def test_volumes_by_distance(folder: Path) -> None:
    told = run(folder, "stack", "--z", "416:428:6", *CAMERA, "--out", "z.ome.tif")
    assert "z = 416 to 428 mm from the micro lenses in steps of 6" in told
    values, sizes = imagej_or_ome(folder / "z.ome.tif")
    assert (sizes["PhysicalSizeZ"], sizes["PhysicalSizeZUnit"]) == (pytest.approx(6), "mm")
    # A pixel shows more of a farther plane.
    assert "PhysicalSizeX" not in sizes
    run(folder, "stack", "--z", "416:428:6", *CAMERA, "--out", "z.tif")
    other, sizes = imagej_or_ome(folder / "z.tif")
    np.testing.assert_array_equal(other, values)
    assert (sizes["spacing"], sizes["zunit"]) == (pytest.approx(6), "mm")
    assert sizes["zorigin"] == pytest.approx(-416 / 6)
    assert "unit" not in sizes
    # The planes are those of the ray model.
    model = model_of()
    settings = model.focus_setting([416.0, 422.0, 428.0])
    places = [v for v in np.linspace(2, 4, 20001) if v]
    of_places = setting_of_virtual_depth(model, places)
    depths = [places[int(np.abs(of_places - a).argmin())] for a in settings]
    run(folder, "stack", "-v", " ".join(f"{v:.4f}" for v in depths), "--out", "v.tif", *CAMERA)
    same = imagej_or_ome(folder / "v.tif")[0]
    assert np.abs(same.astype(float) - values).mean() < 40
    one = run(folder, "stack", "--z", "420", *CAMERA, "--out", "one.ome.tif")
    assert one.endswith("1 slices of 276 x 230 pixels, 16 bit; z = 420 mm\n")


def imagej_or_ome(path: Path) -> tuple[np.ndarray, dict[str, object]]:
    """Values of a volume (z, channels, rows, columns), and what the file says of sizes."""
    with TiffFile(path) as file:
        values = file.asarray()
        if file.is_ome:
            return values, xml2dict(file.ome_metadata or "")["OME"]["Image"]["Pixels"]
        assert file.imagej_metadata is not None
        return values, file.imagej_metadata


def test_depth_in_virtual_depth_and_mm(folder: Path) -> None:
    told = run(folder, "depth-map", *CAMERA, "--near", "1.9", "--far", "5")
    assert "mm" in told
    virtual = np.load(folder / "depth" / "virtual_depth.npy")
    millimetres = np.load(folder / "depth" / "distance_mm.npy")
    assert (np.isnan(virtual) == np.isnan(millimetres)).all()
    # Nearer things have smaller distances and larger virtual depths.
    sure = ~np.isnan(virtual)
    order = np.argsort(virtual[sure])
    assert (np.diff(millimetres[sure][order]) <= 0).all()
    assert 414 < np.median(millimetres[sure]) < 430


def test_all_pictures_of_a_capture(folder: Path) -> None:
    told = run(folder, "develop", *CAMERA, "--slices", "2")
    assert "focused camera" in told
    assert "2 pictures" in told
    names = {path.name for path in (folder / "developed").iterdir()}
    assert {"all_in_focus.png", "depth.png", "distance_mm.npy", "virtual_depth.npy"} <= names
    assert {"focus.gif", "index.html"} <= names
    assert "viewer.html" not in (folder / "developed" / "index.html").read_text()
    assert "there already" in run(folder, "develop", *CAMERA, "--slices", "2")
    run(folder, "view", "--export", "page.html", "--limit", "20")
    assert (folder / "page.html").stat().st_size > 100_000


@pytest.mark.parametrize(
    ("command", "arguments", "problem"),
    [
        ("refocus", ("-a", "1"), "--a: is not for a capture of a focused camera"),
        ("refocus", (), "--virtual-depth: is missing"),
        ("refocus", ("-v", "2 3"), "takes one plane, not 2"),
        ("refocus", ("-v", "0.5"), "0.5 is no virtual depth"),
        ("refocus", ("-v", "2", "--box", "3"), "--box: is not for"),
        ("refocus", ("-v", "2", "--crop", "0,0,9,9"), "--crop: is not for"),
        ("refocus", ("-v", "2", "--camera", "f193-mla2"), "is a standard camera"),
        ("stack", ("-v", "2", "--depth-index"), "--depth-index: is not for"),
        ("stack", ("--out", "x.tif"), "--virtual-depth: is missing"),
        ("stack", ("-v", "2", "--z", "400"), "--z: is for volumes; give --out NAME.ome.tif"),
        ("stack", ("--z", "400", "--out", "x.tif"), "--z requires the focused camera as --camera"),
        ("stack", ("-v", "2", "--z", "400", "--out", "x.tif"), "--z cannot be combined with -v"),
        ("stack", ("--z", "100", "--out", "x.tif", *CAMERA), "--z: -1115.04 is no virtual"),
        ("stack", ("-v", "2", "-a", "1", "--out", "x.tif"), "--a: is not for a capture of a"),
        ("stack", ("-v", "2", "--all-in-focus", "--out", "x.tif"), "is for a folder of slices"),
        ("batch", ("--out", "x.tif"), "is a capture of a focused camera"),
        ("depth-map", ("--near", "2"), "give both of --near and --far"),
        ("depth-map", ("--near", "-2", "--far", "5"), "on one side of the micro lenses"),
        ("depth-map", ("--ply", *CAMERA), "--ply: is not for"),
        ("develop", ("--aperture", "0.5"), "--aperture, --tilt and --box are not for"),
    ],
)
def test_what_focused_cameras_do_not_take(
    folder: Path, command: str, arguments: tuple[str, ...], problem: str
) -> None:
    done = plenofir(command, "raw.png", "--calib", "calib.json", *arguments, cwd=folder)
    assert done.returncode == 2
    assert problem in done.stderr
    assert done.stderr.count("plenofir:") == 1
    assert not (folder / "x.tif").exists()


def test_decode_and_inspect(folder: Path) -> None:
    told = run(folder, "decode", "--out", "aligned.png")
    assert "micro images of 23 x 23 pixels" in told
    assert "aligned_lenses.png: type of the micro lens" in told
    lenses = read_image(folder / "aligned_lenses.png")
    assert lenses.shape == read_image(folder / "aligned.png").shape[:2]
    assert sorted(set(lenses.ravel().tolist())) == [0, 1, 2, 3]
    told = plenofir("inspect", "calib.json", cwd=folder).stdout
    assert "a focused (2.0) camera" in told
    assert "usable, blurred by a pixel at most: v = 2.1" in told
    assert "B = |v|, rounded: 2 to 3" in told
    done = plenofir("decode", "raw.png", "--calib", "calib.json", "--scale", "fit", cwd=folder)
    assert done.returncode == 2
    assert "are not for captures of focused cameras" in done.stderr


def test_virtual_depth_is_for_focused_cameras(folder: Path) -> None:
    done = plenofir("refocus", "white.png", "-M", "5", "-v", "2", cwd=folder)
    assert done.returncode == 2
    assert "--virtual-depth: is for a capture with the calibration of a focused" in done.stderr
    both = ("--lens-types", "raw.png", "--grid", "grid.xml")
    done = plenofir("calibrate", "white.png", *both, cwd=folder)
    assert done.returncode == 2
    assert "--grid cannot be combined with --lens-types" in done.stderr
