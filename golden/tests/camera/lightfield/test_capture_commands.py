# SPDX-License-Identifier: Apache-2.0
"""The commands from a raw capture to pictures."""

import json
import re
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from in_process import plenofir

from plenofir.camera.calibration import calibrate, decode, load_calibration
from plenofir.camera.lightfield import FocalStack, focal_stack
from plenofir.camera.rays import RayModel, load_camera
from plenofir.ground.images import Picture, encode_tiff, read_image, read_picture, write_png
from plenofir.refocus import Aperture, best_picture, refocus
from plenofir.refocus.sharpness import TEXTURE, confidence_level, depth_index
from plenofir_studies.calibration_report import MICROSCOPE, microscope_raster
from plenofir_studies.synthetic import (
    TexturedPlane,
    field_of_view,
    regular_grid,
    render,
    white_image,
)

M = 5
A = 0.4
PUPILS = "exit", "entrance"


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a capture of one plane that is sharp at 2/5."""
    folder = tmp_path_factory.mktemp("capture")
    model = RayModel.focused(load_camera("f197-mla2"), inf, M)
    distance = float(model.distance(A).mm)
    texture = np.kron(np.random.default_rng(2).random((50, 50)), np.ones((12, 12)))
    plane = TexturedPlane(texture, distance, field_of_view(model, distance, 80))
    taken = render(model, [plane], (24, 30), rotation_degrees=0.5, noise=0.005, dark_level=0.01)
    for name in ("raw", "white", "dark"):
        write_png(folder / f"{name}.png", getattr(taken, name))
    return folder


def test_pupils_of_a_white_image(capture: Path, tmp_path: Path) -> None:
    white = str(capture / "white.png")
    call = "calibrate", white, "--camera", "f197-mla2", "--out", "c.json"
    done = plenofir(*call, "--reversed-lens", white, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    exit_, entrance = (next(line for line in lines if f" {name} " in line) for name in PUPILS)
    assert "camera: 100.5000: agrees" in exit_
    assert float(exit_.split()[2]) == pytest.approx(100.5, rel=0.003)
    # Not taken with the lens reversed.
    assert "camera: 386.6549: disagrees by -74.0 %" in entrance
    wrong = {
        ("--camera", "lytro1-wide"): "--camera: the micro images are 14.27 pixels apart",
        ("--focus", "3000"): "--focus requires --camera",
        ("--reversed-lens", white): "--reversed-lens requires --camera",
        ("--camera", "f197-mla2", "--reversed-focus", "1e4"): "requires --reversed-lens",
        ("--camera", "f197-mla2", "--focus", "100"): "--focus: 100.0 mm is nearer",
    }
    for options, message in wrong.items():
        done = plenofir("calibrate", white, *options, "--out", "d.json", cwd=tmp_path)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert message in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.json"]


def test_inspect_a_white_image(capture: Path, tmp_path: Path) -> None:
    white = str(capture / "white.png")
    star = np.zeros(read_image(capture / "white.png").shape, np.uint16)
    star[200:206, 210:214] = 30000
    write_png(tmp_path / "star.png", star)
    call = "inspect", white, "--camera", "f197-mla2", "--collimator", "star.png"
    done = plenofir(*call, "--out", "seen", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = {line[:14].strip(): line[14:] for line in done.stdout.splitlines()}
    assert lines["kind"] == "white image"
    # The synthetic camera cuts micro images off where their neighbours begin.
    assert lines["micro images"] == "touching"
    assert lines["advice"].startswith("close the aperture a little")
    assert "of the micro lenses" in lines["f-number"]
    assert float(lines["f-number"].split()[0]) == pytest.approx(22 / 1.0274, rel=0.04)
    assert "agrees" in lines["exit pupil"]
    assert lines["infinity"].startswith("in focus")
    assert lines["pictures"] == "seen/: micro_image.png, chief_rays.png"
    for name in ("micro_image.png", "chief_rays.png"):
        assert min(read_image(tmp_path / "seen" / name).shape[:2]) > 300
    done = plenofir(*call, "--json", cwd=tmp_path)
    content = json.loads(done.stdout)
    assert content["micro_images"] == "touching"
    assert content["pitch_px"] == pytest.approx(14.2689, abs=1e-3)
    assert content["exit_pupil"]["agrees"]
    assert content["infinity"]["in_focus"]


def test_inspect_spots(tmp_path: Path) -> None:
    grid = regular_grid((110, 120), 14.2, rotation_degrees=0.4)
    files = []
    for number, radius in enumerate((0.16, 0.1, 0.16)):
        image = white_image((110, 120), grid, form="spot", radius=radius)
        write_png(tmp_path / f"{number}.png", image)
        files += [f"{number}.png", "--position", f"{number / 10}"]
    done = plenofir("inspect", *files, "--out", "seen", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    best = next(line for line in done.stdout.splitlines() if line.startswith("best"))
    assert float(best.split()[1]) == pytest.approx(0.1, abs=0.005)
    assert "put the micro lenses at 0.1" in done.stdout
    assert (tmp_path / "seen" / "focus.png").is_file()
    done = plenofir("inspect", *files[3:], "--json", cwd=tmp_path)
    assert "--position: needs at least 3 different" in done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("grey.png",), "grey.png: "),
        (("white.png", "white.png"), "several pictures require --position"),
        (
            ("white.png", "--position", "1", "--position", "2"),
            "2 positions do not match",
        ),
        (("white.png", "--position", "1", "--camera", "f197-mla2"), "--camera cannot be combined"),
        (("white.png", "--focus", "3000"), "--focus requires --camera"),
        (("white.png", "--camera", "lytro1-wide"), "micro images are 14.27 pixels apart"),
        (("white.png", "--collimator", "grey.png"), "grey.png: has 12 x 20 pixels"),
    ],
)
def test_inspect_refuses(capture: Path, words: tuple[str, ...], message: str) -> None:
    before = sorted(capture.iterdir())
    write_png(capture / "grey.png", np.arange(240, dtype=np.uint8).reshape(20, 12))
    done = plenofir("inspect", *words, "--out", "seen", cwd=capture)
    (capture / "grey.png").unlink()
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert message in done.stderr
    assert sorted(capture.iterdir()) == before


def test_chain(capture: Path) -> None:
    """Each command takes the files of the one before, which hold the functions' results."""
    done = plenofir(
        *("calibrate", "white.png", "--dark", "dark.png", "--out", "calib.json"),
        *("--picture", "grid.png"),
        cwd=capture,
    )
    assert done.returncode == 0, done.stderr
    assert "14.26" in done.stdout
    calibration = load_calibration(capture / "calib.json")
    white, dark, raw = (read_image(capture / f"{n}.png") for n in ("white", "dark", "raw"))
    assert calibration == calibrate(white, dark)
    picture = read_image(capture / "grid.png")
    crosses = (picture == (255, 0, 0)).all(axis=2).sum()
    assert crosses > 4 * (~np.isnan(calibration.centres[..., 0])).sum()

    for options, keywords in (
        ((), {}),
        (("--interpolation", "cubic", "--white", "white.png"), {"interpolation": "cubic"}),
        (("--scale", "fit", "--no-devignette", "--dark", "dark.png"), {"scale": "fit"}),
    ):
        done = plenofir(
            *("decode", "raw.png", "--calib", "calib.json", "-M", str(M)), *options, cwd=capture
        )
        assert done.returncode == 0, done.stderr
        want = decode(
            raw,
            calibration,
            M,
            white=white if "--white" in options else None,
            dark=dark if "--dark" in options else None,
            devignette="--no-devignette" not in options,
            **keywords,
        )
        aligned = read_image(capture / "aligned.png")
        assert aligned.dtype == np.uint16
        assert np.array_equal(aligned, want)
    write_png(capture / "aligned.png", decode(raw, calibration, M))
    aligned = read_image(capture / "aligned.png")

    done = plenofir("refocus", "aligned.png", "-M", "5", "-a", "2/5", cwd=capture)
    assert done.returncode == 0, done.stderr
    want = best_picture(aligned, M, "2/5")
    assert np.array_equal(read_image(capture / "refocused.png"), want)
    cases: list[tuple[tuple[str, ...], dict[str, Any]]] = [
        (("-a", "2/5", "--interpolation", "linear"), {"a": "2/5", "interpolation": 1}),
        (("-a", "1", "--no-upsample"), {"a": 1, "upsample": False}),
        (("-a", "1/5", "--interpolation", "nearest"), {"a": "1/5"}),
        (("-a", "2/5", "--interpolation", "nearest", "--box", "3"), {"a": "2/5", "box": 3}),
        (
            ("-a", "0", "--sharpen", "off", "--region", "5:,:20"),
            {"a": 0, "region": (slice(5, None), slice(20)), "interpolation": 1},
        ),
    ]
    for options, keywords in cases:
        done = plenofir("refocus", "aligned.png", "-M", "5", *options, cwd=capture)
        assert done.returncode == 0, done.stderr
        want = refocus(aligned, M, **{"border": "normalise", **keywords})
        assert np.array_equal(read_image(capture / "refocused.png"), want)
    for options, keywords in (
        (("-a", "1/5", "--border", "zero"), {"a": "1/5", "border": "zero"}),
        (("-a", "0.2062"), {"a": Fraction("0.2062")}),
        (("-a", "0", "--aperture", "0.4,0.5,0"), {"a": 0, "aperture": Aperture(0.4, 0.5)}),
        (("-a", "0", "--tilt", "0.3,-0.1"), {"a": 0, "tilt": (0.3, -0.1)}),
        (("-a", "2/5", "--box", "3"), {"a": "2/5", "box": 3}),
    ):
        done = plenofir("refocus", "aligned.png", "-M", "5", *options, cwd=capture)
        assert done.returncode == 0, done.stderr
        assert f"a = {options[1]}," in done.stdout
        want = best_picture(aligned, M, **keywords)
        assert np.array_equal(read_image(capture / "refocused.png"), want)
    for bad, where in (("5:,20", "--region"), ("900:,:", "--region")):
        done = plenofir(
            "refocus", "aligned.png", "-M", "5", "-a", "0", "--region", bad, cwd=capture
        )
        assert done.returncode == 2
        assert where in done.stderr

    done = plenofir("views", "aligned.png", "-M", "5", cwd=capture)
    assert done.returncode == 0, done.stderr
    assert np.array_equal(read_image(capture / "views" / "view_03_01.png"), aligned[3::5, 1::5])
    done = plenofir("compose", "views", "--out", "again.png", cwd=capture)
    assert done.returncode == 0, done.stderr
    assert np.array_equal(read_image(capture / "again.png"), aligned)

    done = plenofir(
        *("stack", "aligned.png", "-M", "5", "-a", "-1/5:1", "--all-in-focus", "--box", "3"),
        cwd=capture,
    )
    assert done.returncode == 0, done.stderr
    assert "sharpest: a = 2/5" in done.stdout
    larger = [line for line in done.stdout.splitlines() if line.startswith("box: ")]
    least = "the least that is a multiple of gcd(a M, M)"
    assert larger == [f"box: 5 in place of 3 at a = {a}, {least}" for a in (0, 1)]
    names = sorted(p.name for p in (capture / "stack").iterdir())
    slices = ("1_a-1_5", "2_a0", "3_a1_5", "4_a2_5", "5_a3_5", "6_a4_5", "7_a1")
    assert names == sorted(
        ["all_in_focus.png", "sharpness.png", *(f"refocused_{a}.png" for a in slices)]
    )
    found = read_image(capture / "stack" / "refocused_1_a-1_5.png")
    assert np.array_equal(found, best_picture(aligned, M, "-1/5", box=3))
    done = plenofir(
        *("stack", "aligned.png", "-M", "5", "--box", "3", "--tilt", "1,0"), cwd=capture
    )
    assert done.returncode == 2
    assert "--tilt cannot be combined with --box" in done.stderr

    options = ("stack", "aligned.png", "-M", "5", "-a", "0:1:2/5", "--out", "index")
    done = plenofir(*options, "--depth-index", "--radius", "2", "--box", "3", cwd=capture)
    assert done.returncode == 0, done.stderr
    settings = ("0", "2/5", "4/5")
    shifts = tuple(int(M * Fraction(a)) for a in settings)
    want = depth_index(
        focal_stack(aligned, M, settings),
        M,
        2,
        confidence=confidence_level(TEXTURE, M, 2, pixel_bits=16),
        shifts=shifts,
        sharp=FocalStack(aligned, M, settings, box=3),
    )
    assert want.textured.any()
    assert np.array_equal(read_image(capture / "index" / "all_in_focus.png"), want.image)
    levels = read_image(capture / "index" / "depth_index.png")[::M, ::M]
    assert np.array_equal(levels, np.array([0, 127, 255])[want.index])
    assert np.array_equal(np.load(capture / "index" / "depth.npy"), want.focus(shifts, M))
    done = plenofir(*options, "--depth-index", "--all-in-focus", cwd=capture)
    assert done.returncode == 2
    assert "--depth-index" in done.stderr
    done = plenofir(*options, "--depth-index", "--radius", "9", cwd=capture)
    assert done.returncode == 2
    assert "--radius" in done.stderr

    done = plenofir(
        *("depth-map", "aligned.png", "-M", "5", "--camera", "f197-mla2", "--focus", "inf"),
        cwd=capture,
    )
    assert done.returncode == 0, done.stderr
    warning = "warning: the micro images of f197-mla2 have 13.9 pixels, not 5; distances hold only"
    assert done.stderr.startswith(warning)
    assert done.stderr.count("\n") == 1
    distances = np.load(capture / "depth" / "distance_mm.npy")
    known, total = int((~np.isnan(distances)).sum()), distances.size
    share = f"({100 * known / total:.1f} %)"
    assert done.stdout.startswith(f"depth: distances of {known} of {total} pixels {share}, ")
    assert done.stdout.count("\n") == 1
    true = float(RayModel.focused(load_camera("f197-mla2"), inf, M).distance(A).mm)
    assert np.nanmedian(distances) == pytest.approx(true, rel=0.03)
    tenths = read_image(capture / "depth" / "distance_tenth_mm.png")
    assert np.array_equal(tenths, np.rint(10 * np.nan_to_num(distances)))
    assert min(read_image(capture / "depth" / "depth.png").shape[:2]) > 200

    # Without a camera; and objects beyond the range are reported.
    done = plenofir(*("depth-map", "aligned.png", "-M", "5", "--out", "a"), cwd=capture)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.fullmatch(r"a: disparities of .* %\), a = 0\.[34]\d to 0\.4\d\n", done.stdout)
    files = {"depth.png", "disparity.npy", "confidence.png"}
    assert {file.name for file in (capture / "a").iterdir()} == files
    disparity = np.load(capture / "a" / "disparity.npy")
    assert np.median(disparity) == pytest.approx(A, abs=0.02)
    confidence = read_image(capture / "a" / "confidence.png")
    assert confidence.shape == disparity.shape
    assert np.median(confidence) > 0.5 * 255
    done = plenofir(
        *("depth-map", "aligned.png", "-M", "5", "--near", "0.2", "--out", "a"), cwd=capture
    )
    note = "of the matched pixels lie at the near end of the search, 0.2 pixels per view; widen it"
    assert done.stdout.splitlines()[1].endswith(f" % {note} with --near")


def test_overlaps_are_noted(tmp_path: Path) -> None:
    """Round micro images of 1.6 pitches repeat half a pitch off the lenses."""
    for radius in (0.45, 0.8):
        shape = (120, 130)
        grid = regular_grid(shape, 11.3, rotation_degrees=0.7)
        write_png(tmp_path / "white.png", white_image(shape, grid, radius=radius, mixed=True))
        done = plenofir("calibrate", "white.png", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert ("centres may be half a pitch off" in done.stdout) == (radius > 0.5)


def test_bytes_and_colours(tmp_path: Path) -> None:
    """8 bit RGB captures give 8 bit RGB rasters."""
    shape = (160, 200)
    white = white_image(shape, regular_grid(shape, 11.03), bits=8)
    write_png(tmp_path / "white.png", np.stack([white] * 3, axis=2))
    assert plenofir("calibrate", "white.png", cwd=tmp_path).returncode == 0
    done = plenofir(
        *("decode", "white.png", "--calib", "calib.json", "-M", "8", "--out", "new/a.png"),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    raster = read_image(tmp_path / "new" / "a.png")
    assert raster.dtype == np.uint8
    assert raster.shape[2] == 3
    assert raster.shape[0] % 8 == raster.shape[1] % 8 == 0


@pytest.mark.parametrize(("bits", "colour"), [(10, False), (12, True), (14, False)])
def test_captures_of_fewer_bits_keep_their_numbers(tmp_path: Path, bits, colour) -> None:
    shape, full = (60, 70), (1 << bits) - 1
    white = white_image(shape, regular_grid(shape, 9.03), noise=0)
    calibrate(white).save(tmp_path / "calib.json")
    raw = np.minimum(white.astype(np.int64) * full * 3 // (2 * int(white.max())), full)
    raw = raw.astype(np.uint16)
    if colour:
        raw = np.stack([raw, raw // 2, raw // 3], axis=2)
    (tmp_path / "raw.tif").write_bytes(encode_tiff(Picture(raw, full)))
    how = ("decode", "raw.tif", "--calib", "calib.json", "-M", "7", "--out")
    for name in ("a.png", "a.tif"):
        done = plenofir(*how, name, cwd=tmp_path)
        # A capture of so few micro images cannot show whether the calibration fits.
        assert (done.returncode, done.stderr.count("\n")) == (0, 1)
        assert "raw.tif: micro images are not seen" in done.stderr
        assert f"in linear light, white is {full}" in done.stdout
    want = decode(raw, load_calibration(tmp_path / "calib.json"), 7, full_scale=full)
    assert want.max() == full
    png, tiff = (read_picture(tmp_path / name) for name in ("a.png", "a.tif"))
    assert np.array_equal(png.pixels, want)
    assert np.array_equal(tiff.pixels, want)
    assert (png.full_scale, tiff.full_scale) == (full, full)
    assert (png.gamma, tiff.gamma) == (1, 1)
    # What the file holds is 10, 12 or 14 bits a sample.
    assert (tmp_path / "a.tif").stat().st_size < want.size * bits / 8 + 1000
    done = plenofir(
        "refocus",
        "a.tif",
        "-M",
        "7",
        "-a",
        "1/7",
        "--out",
        "b.png",
        "--exposure",
        "off",
        cwd=tmp_path,
    )
    assert done.returncode == 0
    assert np.array_equal(read_image(tmp_path / "b.png"), best_picture(want, 7, "1/7"))


def test_microscope_capture() -> None:
    """The vesicle is a sharp ring at a = 0, blurred before and behind."""
    white, dark = (read_image(MICROSCOPE / f"{n}.png") for n in ("white", "dark"))
    calibration = calibrate(white, dark)
    assert calibration.lenses == (28, 28)
    assert calibration.grid.pitch == pytest.approx((15.40, 15.39), abs=0.02)
    assert calibration.missing == ()
    # The dim micro image is known.
    assert min(calibration.uneven, key=lambda lens: lens[2])[:2] == (16, 24)
    raster = microscope_raster()
    largest = [
        float(refocus(raster, 13, f"{k}/13")[60:-60, 60:-60].max()) for k in (-10, -5, 0, 5, 10)
    ]
    assert max(largest) == largest[2]


def test_endings_tell_the_kind_of_file(tmp_path: Path) -> None:
    levels = np.linspace(100, 400, 400).reshape(20, 20).astype(np.uint16)
    write_png(tmp_path / "raw.png", levels.repeat(5, 0).repeat(5, 1))
    for name in ("a.png", "a.tif", "a.jpg"):
        done = plenofir(
            *("refocus", "raw.png", "-M", "5", "-a", "1/5", "--out", name, "--exposure", "auto"),
            cwd=tmp_path,
        )
        assert (done.returncode, done.stderr) == (0, "")
    png, tiff, jpeg = (read_image(tmp_path / f"a.{end}") for end in ("png", "tif", "jpg"))
    assert np.array_equal(png, tiff)
    assert jpeg.dtype == np.uint8
    assert np.abs(jpeg.astype(int) - (png >> 8)).max() < 12


@pytest.mark.slow
def test_report(tmp_path: Path) -> None:
    spots = tmp_path / "spots"
    spots.mkdir()
    shape = (200, 220)
    grid = regular_grid(shape, 11.03)
    write_png(spots / "mine.png", white_image(shape, grid, form="spot", radius=0.2, bits=8))
    np.savetxt(spots / "mine.txt", grid.centres(*np.mgrid[-7:8, -7:8]).reshape(-1, 2))
    done = plenofir("report", "calibration", "--out", "r", "--spots", "spots", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "r" / "report.md").read_text()
    for head in ("Micro image centres", "Rotation", "predicted distances", "Baselines", "run time"):
        assert head in text
    assert "mine.png, 1 % noise" in text
    for picture in ("sharpness_a.png", "sharpness_b.png", "sharpness_c.png", "microscope.png"):
        assert picture in text
        assert (tmp_path / "r" / picture).stat().st_size > 5000
