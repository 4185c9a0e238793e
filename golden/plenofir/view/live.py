# SPDX-License-Identifier: Apache-2.0
"""Live frames from a growing folder, a video or a camera; a slow viewer skips some."""

import atexit
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.films import FILMS, film_frames, opened
from plenofir.ground.images import Picture, read_picture
from plenofir.ground.pages import Pages

_SUFFIXES = {".png", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".bmp", ".jpg", ".jpeg"}
# Folders on a network report no changes, so they are looked into: the delay is at most this.
_POLL_SECONDS = 0.02
# Time that a file may take to be written before it counts as unreadable.
_WRITING_SECONDS = 2.0
_FIRST_SECONDS = 10.0
# A page asks again after each answer: the wait bounds how long a closed page holds its thread.
_WAIT_SECONDS = 10.0
# A camera gives its next frame sooner; a reader that only sleeps may stay behind.
_CLOSE_SECONDS = 1.0


class Captured(NamedTuple):
    """A frame of a source."""

    picture: Picture  # as the camera stored it
    captured: float  # time in seconds since 1970


class Frame(NamedTuple):
    """A frame that is ready to be shown."""

    number: int  # from 1; a page does not get dropped numbers
    captured: float  # time in seconds since 1970
    picture: Picture  # aligned


def folder_frames(folder: Path, rate: float) -> Iterator[Captured]:
    """Frames of a folder, in the order of their names, then those that are added, without end.

    `rate`: frames a second for those present at the start. Files that cannot be read are left out.
    """
    handled: set[Path] = set()
    start = time.time()
    old = True
    while True:
        there = (path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES)
        added = sorted(path for path in there if path not in handled)
        for path in added:
            written = time.time()
            try:
                written = path.stat().st_mtime
                picture = read_picture(path, as_stored=True)
            except (InputError, OSError):
                if not path.exists() or time.time() - written > _WRITING_SECONDS:
                    handled.add(path)
                continue
            handled.add(path)
            if old:
                yield Captured(picture, time.time())
                start += 1 / rate
                time.sleep(max(start - time.time(), 0))
            else:
                yield Captured(picture, written)
        old = False
        time.sleep(_POLL_SECONDS)


def film_file_frames(path: Path, rate: float) -> Iterator[Captured]:
    """Frames of a film or pages of a TIFF file, `rate` a second, over and over."""
    while True:
        pages = None if path.suffix.lower() in FILMS else Pages(path)
        pictures: Iterator[Picture]
        if pages is None:
            pictures = (Picture(frame, 255) for frame in film_frames(path))
        else:
            pictures = iter(pages)
        for picture in pictures:
            yield Captured(picture, time.time())
            time.sleep(1 / rate)


def video_frames(path: str) -> Iterator[Captured]:
    """Frames of a video file at its own rate, or of a camera (``/dev/video0``), by OpenCV."""
    video, rate = opened(path)
    if Path(path).is_char_device():
        rate = 0.0
    start = time.time()
    try:
        while True:
            there, image = video.read()
            if not there:
                return
            yield Captured(Picture(np.ascontiguousarray(image[..., ::-1]), 255), time.time())
            if rate > 0:
                start += 1 / rate
                time.sleep(max(start - time.time(), 0))
    finally:
        video.release()


class Live:
    """The newest frame of a source, prepared when it is requested.

    A thread reads the source at its own rate; `prepare` converts a frame's picture to an aligned
    raw image, `where` is the source's name in messages. InputError if there is no frame within ten
    seconds, or it cannot be used. When Python ends, the thread ends first.
    """

    def __init__(
        self,
        frames: Iterator[Captured],
        prepare: Callable[[Picture], Picture],
        micro_image_size: int,
        where: str,
    ) -> None:
        self.micro_image_size, self._prepare, self._where = micro_image_size, prepare, where
        self._newest: tuple[int, Captured] | None = None
        self._failure: Exception | None = None
        self._ended = False
        self._changed = threading.Condition()
        self._shape: tuple[tuple[int, ...], np.dtype[np.integer]] | None = None
        self._closing = False
        self._reader = threading.Thread(target=self._read, args=(frames,), daemon=True)
        self._reader.start()
        # Python stops a thread that comes back to it at its end; inside OpenCV that is an abort.
        atexit.register(self._close)
        first = self._wait(0, _FIRST_SECONDS)
        if first is None:
            raise InputError("no frame came within ten seconds", where=where)
        self.first = first

    def _read(self, frames: Iterator[Captured]) -> None:
        try:
            for number, frame in enumerate(frames, 1):
                if self._closing:
                    break
                with self._changed:
                    self._newest = number, frame
                    self._changed.notify_all()
        except Exception as error:
            self._failure = error
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _close(self) -> None:
        self._closing = True
        self._reader.join(_CLOSE_SECONDS)

    def _wait(self, after: int, seconds: float) -> Frame | None:
        def there() -> bool:
            return self._ended or (self._newest is not None and self._newest[0] > after)

        with self._changed:
            self._changed.wait_for(there, seconds)
            newest, failure = self._newest, self._failure
        if newest is None or newest[0] <= after:
            if failure is not None:
                raise failure
            return None
        number, (picture, captured) = newest
        raw = self._prepare(picture)
        shape = raw.pixels.shape, raw.pixels.dtype
        if self._shape not in (None, shape):
            raise InputError(
                f"frame {number} has another size or depth than the first one", where=self._where
            )
        self._shape = shape
        return Frame(number, captured, raw)

    @property
    def ended(self) -> bool:
        """Whether no more frames will come."""
        return self._ended

    def newest(self, after: int) -> Frame | None:
        """The newest frame; None if none follows `after` in ten seconds, or the source ended."""
        return self._wait(after, _WAIT_SECONDS)
