# SPDX-License-Identifier: Apache-2.0
"""Videos, read and written by OpenCV, whose wheels bring FFmpeg: the extra `cameras`; GIF."""

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.images import Image

FILMS = (".mp4", ".webm", ".mkv", ".avi", ".mov", ".m4v", ".gif")
"""Endings of films that are read."""

# A file with fewer of the frames that it tells of, and two, is cut; some tell only about how many.
_SHARE = 0.9

_ADVICE = "give a video that OpenCV can read"


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Suppress what FFmpeg prints itself."""
    stderr = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)


def opened(path: str) -> tuple[Any, float]:
    """A video file, or a camera (``/dev/video0``), as OpenCV's VideoCapture; frames a second."""
    if not Path(path).exists():
        raise InputError(f"no such file; {_ADVICE}", where=path)
    try:
        import cv2
        from cv2.utils import logging
    except ModuleNotFoundError:
        raise InputError(
            "OpenCV is not installed, which reads videos; pip install opencv-python-headless",
            where=path,
        ) from None
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    with _quiet():
        video = cv2.VideoCapture(path)
    if not video.isOpened():
        raise InputError(f"cannot be opened; {_ADVICE}", where=path)
    return video, float(video.get(cv2.CAP_PROP_FPS))


def film_frames(path: Path) -> Iterator[Image]:
    """Frames of a film, one after the other, RGB of 8 bit; refused where the file is cut."""
    if path.suffix.lower() == ".gif":
        yield from _gif_frames(path)
        return
    video, _ = opened(str(input_file(path)))
    try:
        import cv2

        stated, count = float(video.get(cv2.CAP_PROP_FRAME_COUNT)), 0
        while True:
            with _quiet():
                there, image = video.read()
            if not there:
                break
            count += 1
            yield np.ascontiguousarray(image[..., ::-1])
        if count == 0 or count + 2 < _SHARE * stated:
            raise InputError(
                f"ends after {count} of {max(stated, 0):.0f} frames; copy it again",
                where=str(path),
            )
    finally:
        video.release()


def _gif_frames(path: Path) -> Iterator[Image]:
    from PIL import Image as Pillow
    from PIL import ImageSequence

    try:
        with Pillow.open(input_file(path)) as film:
            for frame in ImageSequence.Iterator(film):
                yield np.asarray(frame.convert("RGB"))
    except (OSError, ValueError, SyntaxError, EOFError) as error:
        raise InputError(f"is damaged ({error}); copy it again", where=str(path)) from None


def first_frames(path: Path, most_bytes: int) -> tuple[list[Image], bool]:
    """Frames of a film up to so many bytes of pixels, and whether these are all."""
    frames: list[Image] = []
    size = 0
    for frame in film_frames(path):
        if frames and size + frame.nbytes > most_bytes:
            return frames, False
        frames.append(frame)
        size += frame.nbytes
    if not frames:
        raise InputError(f"has no frames; {_ADVICE}", where=str(path))
    return frames, True


def write_webm(path: Path, frames: Sequence[Image], rate: float) -> bool:
    """Write pictures of one size, 8 bit grey or RGB, as WebM (VP8); False without OpenCV.

    Browsers play that. OpenCV's own FFmpeg has no encoder for H.264.
    """
    try:
        import cv2
        from cv2.utils import logging
    except ModuleNotFoundError:
        return False
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    # Colours are subsampled by two, so sizes are even.
    rows, columns = (n // 2 * 2 for n in frames[0].shape[:2])
    with _quiet():
        code = cv2.VideoWriter.fourcc(*"VP80")
        video = cv2.VideoWriter(str(path), code, rate, (columns, rows))
        if not video.isOpened():
            path.unlink(missing_ok=True)
            return False
        for frame in frames:
            part = frame[:rows, :columns]
            rgb = part if part.ndim == 3 else np.repeat(part[..., np.newaxis], 3, axis=2)
            video.write(np.ascontiguousarray(rgb[..., ::-1]))
        video.release()
    return True
