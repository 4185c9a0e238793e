# SPDX-License-Identifier: Apache-2.0
"""The viewer without a browser: its data, its server, its refusals."""

import http.client
import io
import json
import os
import re
import socket
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from discs import disc_views
from in_browser import served
from in_process import plenofir
from lytro_writer import F01, write_capture
from PIL import Image as PillowImage
from scipy import ndimage
from tifffile import imwrite

from plenofir import InputError
from plenofir.camera.calibration import calibrate, decode, load_calibration
from plenofir.camera.lightfield import Disparity, compose, named_views
from plenofir.camera.lightfield import views as views_of
from plenofir.camera.rays import RayModel, load_camera
from plenofir.commands import view as commands_view
from plenofir.ground.files import checksum
from plenofir.ground.images import Picture, encode_png, write_png
from plenofir.refocus.pictures import _STEEPEST
from plenofir.view import (
    Live,
    Page,
    export,
    folder_frames,
    light_field_page,
    live_page,
    pictures_page,
    video_frames,
)
from plenofir.view.light_field import plane_table
from plenofir.view.live import Captured
from plenofir.view.mosaic import packed_views
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


def test_large_grey_views_without_loss_are_png_which_is_quicker_for_them() -> None:
    views = RNG.integers(0, 200, (2, 2, 800, 800), dtype=np.uint8)
    kinds = {}
    for name, some in {"grey": views, "small": views[:, :, :90], "RGB": views[..., None]}.items():
        mosaic = packed_views(some.repeat(3, -1) if name == "RGB" else some, 1 << 24)
        kinds[name] = mosaic.part.kind
        picture = np.asarray(PillowImage.open(io.BytesIO(mosaic.part.content)))
        whole = np.moveaxis(some, (0, 1), (0, 2)).reshape(2 * some.shape[2], -1)
        assert ((picture if picture.ndim == 2 else picture[..., 0]) == whole).all()
    assert kinds == {"grey": "image/png", "small": "image/webp", "RGB": "image/webp"}


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


def asked(address: str, path: str, host: str | None = None) -> http.client.HTTPResponse:
    where = urlsplit(address)
    connection = http.client.HTTPConnection(where.hostname or "", where.port, timeout=10)
    connection.request("GET", path, headers={"Host": host or where.netloc})
    answer = connection.getresponse()
    answer.body = answer.read()  # type: ignore[attr-defined]
    connection.close()
    return answer


def test_only_what_was_named_is_served_and_only_to_who_has_the_address() -> None:
    page = light_field_page(RAW, 3, full_scale=255, title="")
    with served(page) as address:
        where = urlsplit(address)
        assert where.hostname == "127.0.0.1"
        assert len(where.path) > 20
        whole = asked(address, where.path)
        assert whole.status == 200
        assert "default-src 'none'" in (whole.getheader("Content-Security-Policy") or "")
        assert whole.getheader("Server") is None
        views = asked(address, f"{where.path}views?bin=1").body  # type: ignore[attr-defined]
        assert views == LightField(RAW, 3).views().tobytes()
        for path in ("/", "/views", "/x/views", f"{where.path[:-2]}x/views"):
            assert asked(address, path).status == 404, path
        for name in ("server.py", "..%2Fserver.py", "../server.py", "%2Fetc%2Fpasswd", "views/"):
            assert asked(address, where.path + name).status == 404, name
        for binning in ("0", "65", "-1", "x", "9" * 5000, "%C2%B2"):
            assert asked(address, f"{where.path}views?bin={binning}").status == 400, binning
        assert asked(address, where.path, "elsewhere.example").status == 403
        assert asked(address, where.path, f"localhost:{where.port}").status == 200


def test_names_that_are_no_text(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"\xfe")
    folder.mkdir()
    for name in (b"\xff.png", b"b.png"):
        write_png(folder / os.fsdecode(name), RAW)
    page = pictures_page(folder)
    assert r"\xff.png" in page.field["pictures"]
    with served(page) as address:
        part = asked(address, f"{urlsplit(address).path}%5Cxff.png")
        assert part.body == encode_png(RAW)  # type: ignore[attr-defined]
    for shown in (folder, folder / os.fsdecode(b"\xff.png")):
        options = () if shown == folder else ("-M", "5")
        done = plenofir("view", str(shown), *options, "--export", str(tmp_path / "x.html"))
        assert (done.returncode, done.stderr) == (0, "")


def test_what_cannot_be_viewed_is_refused_in_one_line(tmp_path: Path) -> None:
    file, folder = tmp_path / "raw.png", tmp_path / "folder"
    folder.mkdir()
    write_png(file, RAW)
    text = tmp_path / "text.avi"
    text.write_text("no video")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        calls = (
            ((), "give either a raw image"),
            ((str(file), "--source", str(folder)), "give either a raw image"),
            (
                ("--source", str(folder), "-M", "3", "--export", "x.html"),
                "--export cannot be",
            ),
            (("--source", str(text), "-M", "3"), "cannot be opened|needs OpenCV"),
            (("--source", str(tmp_path / "none"), "-M", "3"), "no such file"),
            ((str(file), "-M", "3", "--calib", str(file)), "raw.png"),
            ((str(folder), "--calib", str(file)), "--calib is for a light field"),
            ((str(file),), "can't tell: too small .* or -M for an aligned raw image"),
            ((str(file), "-M", "24"), "less than one micro image"),
            ((str(tmp_path / "none.png"), "-M", "3"), "no such file"),
            ((str(file), "-M", "3", "--focus", "3000"), "--focus requires --camera"),
            ((str(file), "-M", "3", "--camera", "none"), "none"),
            ((str(file), "-M", "3", "--camera", "lfm-antleg-20x", "--focus", "9"), "by its stage"),
            ((str(file), "-M", "3", "-a", "1"), "FIRST:LAST"),
            ((str(file), "-M", "3", "-a", "2:1"), "--a: 2 to 1"),
            ((str(file), "-M", "3", "--export", "page.txt"), "must end in .html or .htm"),
            ((str(file), "-M", "3", "--export", str(tmp_path / "x.html"), "--limit", "0"), "limit"),
            ((str(folder),), "0 pictures"),
            ((str(folder), "-M", "3"), "no image files"),
            ((str(file), "-M", "3", "--port", port, "--no-browser"), f"--port: {port} cannot"),
        )
        for words, message in calls:
            done = plenofir("view", *words)
            assert done.returncode == 2, words
            assert re.search(message, done.stderr), (words, done.stderr)
            assert done.stderr.count("\n") == 1, words
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "raw.png", "text.avi"]


def test_an_export_keeps_to_its_size(tmp_path: Path) -> None:
    raw = np.random.default_rng(8).integers(0, 256, (150, 150, 3), dtype=np.uint8)
    page = light_field_page(raw, 3, full_scale=255, title="noise")
    for limit in (300_000, 200_000, 150_000):
        content = export(page, limit)
        assert len(content) <= limit
        assert b"Scaled down" in content if limit == 150_000 else b"Views" in content
    with pytest.raises(InputError, match="does not fit"):
        export(page, 130_000)
    assert packed_views(LightField(raw, 3).views(), 1000) is None
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "page.html"
    done = plenofir("view", str(tmp_path / "raw.png"), "-M", "3", "--export", str(out))
    assert done.stdout == f"{out}: {out.stat().st_size / 1e6:.1f} MB\n"
    assert done.returncode == 0


def test_16_bit_stay_in_an_export_or_become_steps_of_brightness() -> None:
    rng = np.random.default_rng(9)
    views = rng.integers(100, 4000, (3, 3, 20, 30), dtype=np.uint16)
    whole = packed_views(views, 1_000_000)
    assert whole is not None
    assert whole.codes is None
    assert "16 bit" in whole.words
    found = np.asarray(PillowImage.open(io.BytesIO(whole.part.content)).convert("L"), np.uint16)
    high, low = found[:60], found[60:]
    mosaic = np.moveaxis(views, (0, 1), (0, 2)).reshape(60, 90)
    assert np.array_equal(256 * high + low, mosaic)
    steps = packed_views(views, len(whole.part.content) - 1)
    assert steps is not None
    assert steps.codes is not None
    coded = np.asarray(PillowImage.open(io.BytesIO(steps.part.content)).convert("L"))
    values = np.array(steps.codes)[coded]
    # Steps are finer where it is dark.
    assert np.abs(values - mosaic).max() <= 18
    assert np.abs(values - mosaic)[mosaic < 300].max() <= 4


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


def test_an_export_of_pictures_fits_or_tells_the_limit_that_does(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        write_png(tmp_path / name, RNG.integers(0, 256, (150, 150, 3), dtype=np.uint8))
    page = pictures_page(tmp_path)
    whole = len(export(page, 1_000_000))
    # All of the limit is used.
    assert len(export(page, whole + 5000)) == whole
    # Close to it, and far from it.
    for limit in (whole - 5000, 100_000):
        with pytest.raises(InputError, match=r"limit: 0.1 MB of pictures .* give 2 or more"):
            export(page, limit)


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


def frames_of(count: int, wait: float = 0.0) -> Iterator[Captured]:
    for number in range(count):
        yield Captured(Picture(np.full((6, 6), number, np.uint8), 255), time.time())
        time.sleep(wait)


def test_the_newest_frame_is_shown_and_the_others_are_dropped() -> None:
    live = Live(frames_of(30, 0.01), lambda picture: picture, 3, "test")
    last, seen = 0, 0
    while (frame := live.newest(last)) is not None:
        assert frame.number > last
        assert (frame.picture.pixels == frame.number - 1).all()
        assert time.time() >= frame.captured
        last, seen = frame.number, seen + 1
        time.sleep(0.05)
    assert live.ended
    assert last == 30
    assert seen < 30


def test_a_source_that_changes_or_fails_is_refused() -> None:
    def changing() -> Iterator[Captured]:
        yield from frames_of(1, 0.2)
        yield Captured(Picture(np.zeros((9, 6), np.uint8), 255), 0)

    live = Live(changing(), lambda picture: picture, 3, "test")
    with pytest.raises(InputError, match="another size"):
        live.newest(1)
    with pytest.raises(InputError, match="no frame"):
        Live(frames_of(0), lambda picture: picture, 3, "test")
    page = live_page(Live(frames_of(2), lambda picture: picture, 3, "test"), title="")
    found = page.parts["frame"](PartRequest(1, 0))
    assert len(found.content) == 36
    assert page.parts["frame"](PartRequest(1, 2)).facts == {"ended": "1"}


def test_each_live_frame_has_its_own_levels() -> None:
    ramp = np.linspace(0, 1, 900).reshape(30, 30)

    def frames() -> Iterator[Captured]:
        for white in (300, 900):
            picture = Picture((white * ramp).astype(np.uint16), 65535, 1.0)
            yield Captured(picture, time.time())
            time.sleep(0.2)

    live = Live(frames(), lambda picture: picture, 3, "test")
    page = live_page(live, title="")
    levels = []
    for last in (0, 1):
        facts = page.parts["frame"](PartRequest(1, last)).facts
        levels.append([float(level) for level in facts["levels"].split(",")])
    assert [round(white, -2) for _, white, _ in levels] == [300, 900]
    assert page.field["exposure"]["start"]["gamma"] == 2.2


def test_a_folder_gives_what_is_there_and_what_is_added(tmp_path: Path) -> None:
    write_png(tmp_path / "b.png", RAW)
    write_png(tmp_path / "a.png", RAW[:6])
    (tmp_path / "note.txt").write_text("no picture")
    frames = folder_frames(tmp_path, 1000)
    assert [next(frames).picture.pixels.shape[0] for _ in range(2)] == [6, 23]
    # First partly written, then complete.
    whole = encode_png(RAW[:9])
    (tmp_path / "c.png").write_bytes(whole[:100])
    later = threading.Timer(0.05, (tmp_path / "c.png").write_bytes, (whole,))
    later.start()
    assert next(frames).picture.pixels.shape[0] == 9
    later.join()


@pytest.fixture
def page_of(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Page]:
    """The page that the command would serve."""

    def view(*words: str) -> Page:
        pages: list[Page] = []
        with monkeypatch.context() as patched:
            patched.setattr(commands_view, "serve_page", lambda page, *_: pages.append(page))
            done = plenofir("view", *words)
        assert done.returncode == 0, done.stderr
        return pages[0]

    return view


def test_films_and_pages_are_played(page_of: Callable[..., Page], tmp_path: Path) -> None:
    """Frames of a film of rasters, pages of rasters, and of captures with a calibration."""
    raster = compose(disc_views(5, 48, 64))
    frames = np.stack([raster, raster // 2])
    imwrite(tmp_path / "pages.tif", frames, photometric="rgb")
    page = page_of(str(tmp_path / "pages.tif"), "--rate", "20")
    seen: dict[int, bytes] = {}
    while len(set(seen.values())) < 2 and len(seen) < 20:
        part = page.parts["frame"](PartRequest(1, max(seen, default=0)))
        seen[int(part.facts["number"])] = bytes(part.content)
    assert set(seen.values()) == {
        np.ascontiguousarray(views_of(frame, 5)).tobytes() for frame in frames
    }
    cv2 = pytest.importorskip("cv2")
    film = cv2.VideoWriter(
        str(tmp_path / "film.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 25, (320, 240)
    )
    # A film has one colour for several pixels.
    grey = np.repeat(raster[..., 1:2], 3, axis=2)
    for _ in range(3):
        film.write(grey)
    film.release()
    content = page_of(str(tmp_path / "film.avi")).parts["frame"](PartRequest(1, 0)).content
    shown = np.frombuffer(content, np.uint8).astype(int)
    assert np.abs(shown - views_of(grey, 5).ravel()).mean() < 12


def test_a_film_that_lies_otherwise_is_refused(tmp_path: Path) -> None:
    imwrite(tmp_path / "f.tif", np.stack(2 * [compose(disc_views(5, 48, 64)[::-1])]))
    done = plenofir("view", "f.tif", "--no-browser", cwd=tmp_path)
    assert done.returncode == 2
    assert "f.tif: rows count from below; the frames of a film are shown as" in done.stderr


def test_a_video_is_read_by_opencv(tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2")
    file = str(tmp_path / "video.avi")
    video = cv2.VideoWriter(file, cv2.VideoWriter_fourcc(*"MJPG"), 50, (32, 24))
    for number in range(5):
        video.write(np.full((24, 32, 3), (0, 0, 50 * number), np.uint8))
    video.release()
    found = [frame.picture.pixels for frame in video_frames(file)]
    assert len(found) == 5
    # Red first.
    assert np.abs(found[4][0, 0] - np.array([200, 0, 0])).max() < 12
