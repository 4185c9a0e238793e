# SPDX-License-Identifier: Apache-2.0
"""Videos, read and written by OpenCV, whose wheels bring FFmpeg: the extra `cameras`."""

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.images import Image

VIDEOS = (".mp4", ".webm", ".mkv", ".avi", ".mov")
"""Endings of videos that are read."""

_ADVICE = "give a video that OpenCV can read"


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Suppress what FFmpeg prints itself."""
    kept = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


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


def read_video(path: Path, most: int) -> list[Image]:
    """All frames of a video file, RGB of 8 bit; refused where there are more than `most`."""
    video, _ = opened(str(input_file(path)))
    frames: list[Image] = []
    try:
        with _quiet():
            while True:
                there, image = video.read()
                if not there:
                    return frames
                if len(frames) == most:
                    raise InputError(f"more than {most} frames", where=str(path))
                frames.append(np.ascontiguousarray(image[..., ::-1]))
    finally:
        video.release()


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
