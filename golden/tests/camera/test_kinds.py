# SPDX-License-Identifier: Apache-2.0
"""What light fields come as: lines, rectangles, quilts, films, pages, arrays, archives, folders."""

import json
import zipfile
from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest
import tifffile
from drawn_views import drawn, fourier, snr, texture
from in_process import plenofir
from PIL import Image as Pillow
from scipy.io import savemat

from plenofir.camera.lightfield import compose
from plenofir.camera.recognise import LightFieldSource, recognise
from plenofir.ground.errors import InputError
from plenofir.ground.images import encode_png, read_image, write_png

RECTANGLE, TRUTH = drawn(3, 5)
LINE = drawn(1, 9)[0]
SQUARE = drawn(5, 5)[0]


def folder(path: Path, views: np.ndarray, name: str = "view_{v}_{u}.png") -> Path:
    for number, (v, u) in enumerate(np.ndindex(*views.shape[:2])):
        file = path / name.format(v=v, u=u, n=number)
        file.parent.mkdir(parents=True, exist_ok=True)
        write_png(file, np.ascontiguousarray(views[v, u]))
    return path


def film(path: Path, frames: np.ndarray) -> Path:
    size = frames.shape[2], frames.shape[1]
    code = cv2.VideoWriter.fourcc(*("MJPG" if path.suffix == ".avi" else "mp4v"))
    video = cv2.VideoWriter(str(path), code, 10, size)
    for frame in frames:
        video.write(np.ascontiguousarray(frame[..., ::-1]))
    video.release()
    return path


def mosaic(views: np.ndarray) -> np.ndarray:
    v, u, t, s = views.shape[:4]
    return np.moveaxis(views, 2, 1).reshape(v * t, u * s, 3)


def check(source: LightFieldSource, views: np.ndarray, kind: str) -> None:
    assert source.kind == kind
    assert source.counts == views.shape[:2]
    assert np.array_equal(source.all_views().pixels, views)


@pytest.mark.parametrize("name", ["view_{v}_{u}.png", "{v:02}/{u:02}.png", "a/b/{v}-{u}.png"])
def test_rectangles_in_folders(tmp_path: Path, name: str) -> None:
    check(recognise(folder(tmp_path / "views", RECTANGLE, name)), RECTANGLE, "folder of views")


@pytest.mark.parametrize("views", [LINE, RECTANGLE, SQUARE, drawn(9, 1)[0]])
def test_running_numbers_in_every_container(tmp_path: Path, views: np.ndarray) -> None:
    run = views.reshape(-1, *views.shape[2:])
    check(recognise(folder(tmp_path / "run", views, "c_{n:03}.png")), views, "folder of views")
    np.save(tmp_path / "run.npy", run)
    tifffile.imwrite(tmp_path / "pages.tif", run, photometric="rgb")
    tifffile.imwrite(
        tmp_path / "t.ome.tif", run, photometric="rgb", ome=True, metadata={"axes": "TYXS"}
    )
    for name in ("run.npy", "pages.tif", "t.ome.tif"):
        check(recognise(tmp_path / name), views, "sequence of views")
    tifffile.imwrite(tmp_path / "imagej.tif", run[..., 1], imagej=True)
    check(recognise(tmp_path / "imagej.tif"), views[..., 1], "sequence of views")
    for name in ("film.avi", "film.mp4"):
        source = recognise(film(tmp_path / name, run))
        assert source.kind == "video of views"
        assert source.counts == views.shape[:2]
    first, *others = [Pillow.fromarray(one) for one in run]
    first.save(tmp_path / "film.gif", save_all=True, append_images=others)
    assert recognise(tmp_path / "film.gif").counts == views.shape[:2]


@pytest.mark.parametrize("views", [LINE, RECTANGLE, drawn(3, 4)[0]])
def test_mosaics_of_any_shape(tmp_path: Path, views: np.ndarray) -> None:
    write_png(tmp_path / "mosaic.png", mosaic(views))
    check(recognise(tmp_path / "mosaic.png"), views, "mosaic of views")


def test_quilts_by_name_and_by_motion(tmp_path: Path) -> None:
    line = drawn(1, 24, step=0.25)[0]
    # View 0 at the bottom left, rows go up.
    quilt = mosaic(line.reshape(4, 6, *line.shape[2:])[::-1])
    for name in ("scene_qs6x4a1.33.png", "scene_qs6x4.png", "scene.png"):
        write_png(tmp_path / name, quilt)
        check(recognise(tmp_path / name), line, "quilt of views")
    # A round size leaves some pixels above and to the right.
    wide = np.zeros((quilt.shape[0] + 3, quilt.shape[1] + 5, 3), np.uint8)
    wide[3:, :-5] = quilt
    write_png(tmp_path / "wide_qs6x4a0.75.png", wide)
    source = recognise(tmp_path / "wide_qs6x4a0.75.png")
    check(source, line, "quilt of views")
    (told,) = (finding for finding in source.findings if finding.heading == "aspect")
    assert told.notable
    assert "0.75 times as wide as high" in told.text
    write_png(tmp_path / "small_qs900x900a1.png", quilt)
    with pytest.raises(InputError, match="no quilt has 900 x 900 views"):
        recognise(tmp_path / "small_qs900x900a1.png")


def test_arrays_and_archives_of_any_shape(tmp_path: Path) -> None:
    np.savez(tmp_path / "views.npz", lf=RECTANGLE)
    with h5py.File(tmp_path / "lf.h5", "w") as file:
        file["LF"] = RECTANGLE
    savemat(tmp_path / "lf.mat", {"LF": RECTANGLE.astype(float)})
    for name, kind in (
        ("views.npz", "array of views"),
        ("lf.h5", "array of views"),
        ("lf.mat", "light field in a MATLAB file"),
    ):
        check(recognise(tmp_path / name), RECTANGLE, kind)
    lens_mask = np.ones((3, 5, 1, 1, 1))
    lens_mask[0, 0] = np.nan
    savemat(tmp_path / "nan.mat", {"LF": RECTANGLE / 255 * lens_mask})
    source = recognise(tmp_path / "nan.mat")
    assert any("no numbers: black" in f.text and f.notable for f in source.findings)
    assert not source.all_views().pixels[0, 0].any()
    with zipfile.ZipFile(tmp_path / "views.zip", "w") as archive:
        for v, u in np.ndindex(3, 5):
            archive.writestr(f"scene/v_{v}_{u}.png", encode_png(RECTANGLE[v, u]))
        archive.writestr("scene/.DS_Store", b"x")
        archive.writestr("__MACOSX/scene/v_0_0.png", b"x")
    check(recognise(tmp_path / "views.zip"), RECTANGLE, "folder of views")
    with zipfile.ZipFile(tmp_path / "one.zip", "w") as archive:
        archive.write(tmp_path / "lf.mat", "lf.mat")
    check(recognise(tmp_path / "one.zip"), RECTANGLE, "array of views")


def test_as_data_sets_and_programs_leave_them(tmp_path: Path) -> None:
    """Names and arrays that documentation of data sets, readers and viewers describes."""
    # Light field superpixels: a running number, and an array of (y, x, colour, v, u).
    path = folder(tmp_path / "superpixels", SQUARE, "lf{n:03}.png")
    (path / "config.txt").write_text("48 64 5 5")
    check(recognise(path), SQUARE, "folder of views")
    savemat(tmp_path / "superpixels.mat", {"any": SQUARE.transpose(2, 3, 4, 0, 1)})
    check(recognise(tmp_path / "superpixels.mat"), SQUARE, "light field in a MATLAB file")
    # The interpolation benchmark: scene, frame and disparity are folders, beside them other files.
    path = folder(tmp_path / "cambridge", SQUARE, "kitchen/001/1.0/{v}_{u}.png")
    np.save(path / "kitchen" / "001" / "1.0" / "disparity.npy", TRUTH)
    (path / "kitchen" / "kitchen.blend").write_bytes(b"BLENDER")
    check(recognise(path), SQUARE, "folder of views")
    # UrbanLF: labels and disparity of the central view beside the views.
    path = folder(tmp_path / "urban", SQUARE, "{v}_{u}.png")
    write_png(path / "label.png", SQUARE[0, 0])
    np.save(path / "3_3_disparity.npy", TRUTH)
    check(recognise(path), SQUARE, "folder of views")
    # The light field library: names with dots.
    check(
        recognise(folder(tmp_path / "lion", SQUARE, "lion.{v}.{u}.png")), SQUARE, "folder of views"
    )
    # INRIA's: the prefix has a number of its own.
    path = folder(tmp_path / "inria", RECTANGLE, "Totoro2_{v}_{u}.png")
    check(recognise(path), RECTANGLE, "folder of views")
    # Readers that take sorted files for one line.
    path = folder(tmp_path / "line", LINE, "{n:04}.png")
    check(recognise(path), LINE, "folder of views")


def test_damaged_and_hostile_archives(tmp_path: Path) -> None:
    whole = folder(tmp_path / "views", SQUARE[:, :, :8, :8])
    path = tmp_path / "views.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for file in sorted(whole.iterdir()):
            archive.write(file, f"../../outside/{file.name}")
    assert recognise(path).counts == (5, 5)
    assert not (tmp_path.parent / "outside").exists()
    content = path.read_bytes()
    for end in (0, 30, len(content) // 2, len(content) - 4):
        path.write_bytes(content[:end])
        with pytest.raises(InputError, match=r"views\.zip: "):
            recognise(path)
    damaged = bytearray(content)
    damaged[len(content) // 3] ^= 255
    path.write_bytes(damaged)
    with pytest.raises(InputError, match=r"views\.zip"):
        recognise(path).all_views()
    bomb = tmp_path / "bomb.zip"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(5):
            with archive.open(f"v_{number}.png", "w", force_zip64=True) as file:
                for _ in range(64):
                    file.write(bytes(1 << 20))
    # The sizes that it tells are enough to refuse it.
    told = (64 << 20).to_bytes(4, "little")
    bomb.write_bytes(bomb.read_bytes().replace(told, (1 << 30).to_bytes(4, "little")))
    with pytest.raises(InputError, match=r"at most 20000 and 4 GiB are read|cannot be unpacked"):
        recognise(bomb)


def test_what_is_odd_or_missing_is_named(tmp_path: Path) -> None:
    path = folder(tmp_path / "views", SQUARE)
    (path / "notes.txt").write_text("x")
    write_png(path / "depth.png", SQUARE[0, 0])
    source = recognise(path)
    check(source, SQUARE, "folder of views")
    (told,) = (finding for finding in source.findings if finding.heading == "files")
    assert told.notable
    assert told.text.startswith("left alone: depth.png")
    for odd, text in (
        (SQUARE[0, 0, :, :60], "60 x 48 pixels, RGB, uint8; the other views have 64 x 48"),
        (SQUARE[0, 0, ..., 0], "64 x 48 pixels, grey, uint8; the other views have 64 x 48"),
    ):
        write_png(path / "view_0_0.png", np.ascontiguousarray(odd))
        with pytest.raises(InputError, match=rf"view_0_0\.png: has {text}"):
            recognise(path).all_views()
    (path / "view_0_0.png").unlink()
    done = plenofir("develop", str(path), "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert "of 5 x 5 views view_0_0.png is missing" in done.stderr


def test_films_of_rasters_are_frames(tmp_path: Path) -> None:
    raster = compose(SQUARE)
    # Each frame is moved by a micro image: so do views of one distant plane.
    frames = np.stack([np.roll(raster, 5 * n, 1) for n in range(9)])
    film(tmp_path / "film.mp4", frames)
    tifffile.imwrite(tmp_path / "time.tif", frames[..., 1], photometric="minisblack")
    for name in ("film.mp4", "time.tif"):
        path = tmp_path / name
        source = recognise(path)
        assert (source.kind, source.micro_image_size) == ("film of frames", 5)
        assert source.advice == (f"plenofir batch {path} -M 5 -a 0",)
        done = plenofir("develop", str(path), "--out", str(tmp_path / "out"))
        assert done.returncode == 2
        assert source.advice[0] in done.stderr
    still = np.repeat(SQUARE[:1, 0], 9, 0)
    film(tmp_path / "still.avi", still)
    done = plenofir("develop", str(tmp_path / "still.avi"), "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert "9 pictures that are no captures, and no views" in done.stderr


def test_batch_takes_films_and_pages(tmp_path: Path) -> None:
    raster = compose(SQUARE)
    pages = np.stack([np.roll(raster, 5 * n, 1) for n in range(3)])
    path = tmp_path / "time.tif"
    tifffile.imwrite(path, pages, photometric="rgb")
    call = ("batch", str(path), "-M", "5", "--out", str(tmp_path / "out"), "--workers", "1")
    done = plenofir(*call)
    assert done.returncode == 0
    assert "3 frames refocused, 0 there already" in done.stdout
    unpacked = tmp_path / "out" / "frames_of_time.tif"
    assert json.loads((unpacked / "frames.json").read_text())["frames"][2] == "time_00003.png"
    assert (read_image(unpacked / "time_00003.png") == pages[2]).all()
    assert "0 frames refocused, 3 there already" in plenofir(*call).stdout
    film(tmp_path / "cut.mp4", pages)
    (tmp_path / "cut.mp4").write_bytes((tmp_path / "cut.mp4").read_bytes()[:2000])
    done = plenofir("batch", str(tmp_path / "cut.mp4"), "-M", "5", "--out", str(tmp_path / "no"))
    assert done.returncode == 2
    assert "cut.mp4" in done.stderr


def test_a_rectangle_through_the_commands(tmp_path: Path) -> None:
    path = str(folder(tmp_path / "views", RECTANGLE))
    out = tmp_path / "out"
    for call in (
        ("depth-map", path, "--out", str(out)),
        ("stack", path, "-a", "-1:1:1", "--all-in-focus", "--out", str(out / "stack")),
        ("mosaic", path, "--out", str(out / "mosaic.png")),
        ("views", path, "--out", str(out / "views")),
        ("view", path, "--export", str(out / "page.html"), "--no-browser"),
    ):
        done = plenofir(*call)
        assert done.returncode == 0, done.stderr
    depth = np.load(out / "disparity.npy")
    assert (np.abs(depth - TRUTH) < 0.15).mean() > 0.98
    assert snr(read_image(out / "stack" / "all_in_focus.png"), RECTANGLE[1, 2]) > 40
    near = read_image(next((out / "stack").glob("refocused_*_a1.png")))
    assert snr(near[TRUTH == 1], RECTANGLE[1, 2][TRUTH == 1]) > 30
    assert (read_image(out / "mosaic.png") == mosaic(RECTANGLE)).all()
    assert (read_image(out / "views" / "view_02_04.png") == RECTANGLE[2, 4]).all()
    page = (out / "page.html").read_text()
    assert '"view_rows":3,"view_columns":5,"first_view":[0,1]' in page.replace(" ", "")
    done = plenofir("refocus", path, "-a", "1", "--out", str(out / "near.png"))
    assert done.returncode == 0, done.stderr
    assert (read_image(out / "near.png") == near).all()
    done = plenofir("refocus", path, "-a", "1", "--tilt", "0.1,0", "--out", str(out / "no.png"))
    assert done.returncode == 2
    assert "--tilt: is for a square of views" in done.stderr
    done = plenofir("compose", path, "--out", str(out / "no.png"))
    assert done.returncode == 2
    assert "5 x 3 views are no square" in done.stderr
    assert not (out / "no.png").exists()


def test_a_line_is_developed(tmp_path: Path) -> None:
    path, out = folder(tmp_path / "rail", drawn(1, 5)[0], "IMG_{n:04}.png"), tmp_path / "out"
    done = plenofir("develop", str(path), "--slices", "3", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert "5 views in one line, by their motion" in done.stdout
    names = {file.name for file in out.iterdir()}
    assert {"mosaic.png", "viewer.html", "all_in_focus.png", "depth.png"} <= names
    assert (np.abs(np.load(out / "disparity.npy") - TRUTH) < 0.15).mean() > 0.97


def test_quilts_with_views_between(tmp_path: Path) -> None:
    path = str(folder(tmp_path / "views", drawn(1, 5)[0]))
    done = plenofir(
        *("quilt", path, "--columns", "11", "--rows", "6", "--out", str(tmp_path / "go"))
    )
    assert done.returncode == 0
    assert "interpolated between 5 views" in done.stdout
    source = recognise(tmp_path / "go_qs11x6a1.333.png")
    assert source.counts == (1, 66)
    fine = drawn(1, 66, step=4 / 65)[0]
    # Places of both start with the same view and end with the same one.
    shift = 2 - 33 * 4 / 65
    assert abs(shift) < 0.05
    views = source.all_views().pixels
    assert min(snr(views[0, n], fine[0, n]) for n in range(66)) > 28
    assert (views[0, 0] == drawn(1, 5)[0][0, 0]).all()


def test_fourier_light_field_microscope(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "square.tif", fourier(3, 3, hexagonal=False))
    source = recognise(tmp_path / "square.tif")
    assert (source.kind, source.counts) == ("elemental images", (3, 3))
    views = source.all_views().pixels
    assert abs(views.shape[2] - np.sqrt(2) * 56 * 0.95) < 3
    assert views.max() > 40000
    assert views.min() > 3000
    tifffile.imwrite(tmp_path / "hexagonal.tif", fourier(3, 4, hexagonal=True))
    source = recognise(tmp_path / "hexagonal.tif")
    assert (source.kind, source.counts) == ("elemental images", (1, 4))
    assert any(f.notable and "the 4 in the fullest row" in f.text for f in source.findings)
    y, x = np.mgrid[:390, :390]
    lenses = np.hypot(y % 130 - 64.5, x % 130 - 64.5) < 56
    write_png(tmp_path / "white.png", np.where(lenses, 200, 0).astype(np.uint8))
    assert recognise(tmp_path / "white.png").kind != "elemental images"
    coins = np.rint(255 * texture(*np.mgrid[:200, :300].astype(float), 4)).astype(np.uint8)
    write_png(tmp_path / "picture.png", coins)
    assert recognise(tmp_path / "picture.png").kind != "elemental images"
