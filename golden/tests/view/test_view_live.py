# SPDX-License-Identifier: Apache-2.0
"""The viewer's frames: live sources, films and pages that are played."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from discs import disc_views
from in_process import plenofir
from tifffile import imwrite

from plenofir import InputError
from plenofir.camera.lightfield import compose
from plenofir.camera.lightfield import views as views_of
from plenofir.commands import view as commands_view
from plenofir.ground.images import Picture, encode_png, write_png
from plenofir.view import Live, Page, folder_frames, live_page, video_frames
from plenofir.view.live import Captured
from plenofir.view.page import PartRequest

RNG = np.random.default_rng(3)
RAW = RNG.integers(0, 256, (23, 31, 3), dtype=np.uint8)


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


def test_the_reader_ends_before_python_does() -> None:
    """A thread that comes back from OpenCV while Python ends aborts the process."""
    program = """
import atexit, itertools, threading, time
import numpy as np
from plenofir.ground.images import Picture
from plenofir.view.live import Captured, Live

def frames():
    for number in itertools.count():
        yield Captured(Picture(np.zeros((6, 6), np.uint8), 255), 0.0)
        time.sleep(0.01)

# Functions run in the opposite order.
atexit.register(lambda: print(threading.active_count()))
Live(frames(), lambda picture: picture, 3, "test")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.stdout, done.stderr, done.returncode) == ("1\n", "", 0)


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
