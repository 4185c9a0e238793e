# SPDX-License-Identifier: Apache-2.0
"""The page of a focused camera's capture: micro images for the browser's GPU to lay over."""

import zlib
from collections.abc import Callable, Mapping
from functools import cache
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.camera.exposure import Exposure, exposure
from plenofir.camera.focused.capture import LEAST, STEP
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture, encode_png
from plenofir.ground.orientation import turned
from plenofir.view.page import Page, Part, PartRequest

if TYPE_CHECKING:
    from plenofir.camera.focused import DepthScale, FocusedCapture

MOST = 20.0
"""Largest |v| on the page: the work for a pixel grows with its square."""
_SCRIPTS = ("shaders.js", "tone.js", "source.js", "pane.js", "focused_gpu.js", "focused.js")
_FULL = 65535
# Sides of cells in pitches: the diagonal is shorter than the distance of neighbours.
_CELL = 0.65
# Ends of the slider, in the least and largest |v| at which a type is sharpest.
_BELOW, _ABOVE = 0.6, 2.0
Floats32 = npt.NDArray[np.float32]


class _Cells(NamedTuple):
    lenses: Floats32  # (rows, columns, 4): x, y, 1 / v at which it is sharpest, 1 if there is one
    corner: tuple[float, float]  # (x, y) of the first
    side: float
    alike: bool  # all depths are, to all lenses


def _cells(capture: "FocusedCapture") -> _Cells:
    """Micro lenses in square cells, of which each has one at most."""
    lenses = capture.lenses()
    side = _CELL * capture.pitch
    corner = lenses[:, :2].min(axis=0)
    row, column = np.floor((lenses[:, :2] - corner) / side).astype(int).T
    cells = np.zeros((row.max() + 1, column.max() + 1, 4), np.float32)
    cells[row, column] = np.column_stack([lenses[:, [1, 0, 2]], np.ones(len(lenses))])
    assert np.count_nonzero(cells[..., 3]) == len(lenses)
    return _Cells(cells, (float(corner[1]), float(corner[0])), side, bool(lenses[0, 3]))


def _words_of(capture: "FocusedCapture") -> tuple[npt.NDArray[np.uint16], tuple[float, float]]:
    """Pixels and light in 16 bits, shape (rows, columns, 4); first value, and span of the values.

    Light of pixels that do not count is 0, that of all others is not.
    """
    low = float(capture.pixels.min())
    span = max(float(capture.pixels.max()) - low, 1e-6)
    words = np.empty((*capture.light.shape, 4), "<u2")
    words[..., :3] = np.rint((capture.pixels - low) * (_FULL / span))
    light = np.minimum(np.rint(capture.light * _FULL), _FULL)
    words[..., 3] = np.where(capture.light > 0, np.maximum(light, 1), 0)
    return words, (low, span)


def _turn(orientation: int) -> dict[str, Any]:
    """How the page turns a picture: whether rows become columns, and which axes are mirrored."""
    corners = turned(np.arange(4, dtype=np.uint8).reshape(2, 2), orientation)
    first, beside = int(corners[0, 0]), int(corners[0, 1])
    return {
        "swapped": abs(beside - first) == 2,
        "mirrored": [first % 2 == 1, first >= 2],
    }


def _range(capture: "FocusedCapture", scale: "DepthScale") -> tuple[tuple[float, float], float]:
    """First and last virtual depth of the slider, and the one in its middle that it starts with."""
    types = capture.calibration.lens_types
    assert types is not None
    sharpest = np.array(types.sharpest)
    side = -1.0 if sharpest.mean() < 0 else 1.0
    inverse = np.clip(
        np.abs([sharpest.max(), sharpest.min(), sharpest.mean()]), 1 / MOST, 1 / LEAST
    )
    ends = max(_BELOW / inverse[:2].max(), LEAST), min(_ABOVE / inverse[:2].min(), MOST)
    depths = sorted(float(scale.depth(side / v)) for v in ends)
    return (max(depths[0], -MOST), min(depths[1], MOST)), float(scale.depth(side * inverse[2]))


def focused_page(
    capture: "FocusedCapture",
    scale: "DepthScale",
    field: Picture,
    *,
    title: str,
    look: Exposure | None,
    pictures: Mapping[str, Callable[[], Image]],
) -> Page:
    """Make the page of a capture, on which a slider of virtual depth refocuses it.

    `field`: a picture of the capture that its exposure is taken from; `look`: the exposure that
    the page starts with, None for values as they are. `pictures`: those of 8 bits, upright, that
    the page shows as they are: "sharp" and "depth".
    """
    cells, orientation = _cells(capture), capture.picture.orientation
    rows, columns = capture.shape()
    words, values = _words_of(capture)
    deep = capture.picture.pixels.dtype.itemsize > 1
    unit = 1 if deep else 256
    turn = _turn(orientation)
    # 1 / v between micro images is a line over that between micro lenses.
    half, third = scale.inverse(2.0), scale.inverse(3.0)
    limits, start = _range(capture, scale)
    stored = exposure(field, 1, "off")
    height, width = capture.light.shape
    described: dict[str, Any] = {
        "title": title,
        "notes": [
            f"Capture of a focused camera, {width} x {height} pixels, "
            f"{capture.pitch:.2f} pixels a micro lens."
        ],
        "capture_size": [width, height],
        "plane_size": [columns, rows],
        "columns": rows if turn["swapped"] else columns,
        "rows": columns if turn["swapped"] else rows,
        "channels": capture.pixels.shape[2],
        "cells": [cells.lenses.shape[1], cells.lenses.shape[0]],
        "corner": cells.corner,
        "side": cells.side,
        "alike": cells.alike,
        "reach": capture.reach,
        "pitch": capture.pitch,
        "step": STEP,
        "scale": values,
        "unit": unit,
        "top": min(capture.picture.full_scale * unit, _FULL),
        "of_inverse": [3 * third - 2 * half, 6 * (half - third)],
        "range": limits,
        "start": start,
        "limits": [LEAST, MOST],
        "exposure": {"start": (look or stored)._asdict(), "stored": stored._asdict()},
        **turn,
    }

    def deflated(content: bytes) -> Part:
        return Part(zlib.compress(content, 1), "application/octet-stream")

    # Several requests come at once.
    lock = Lock()

    @cache
    def encoded(name: str) -> Part:
        return Part(encode_png(pictures[name]()), "image/png")

    def shown(name: str) -> Callable[[PartRequest], Part]:
        def part(_: PartRequest) -> Part:
            with lock:
                return encoded(name)

        return part

    parts: dict[str, Callable[[PartRequest], Part]] = {
        "capture": lambda _: deflated(words.tobytes()),
        "lenses": lambda _: deflated(cells.lenses.astype("<f4").tobytes()),
        **{name: shown(name) for name in pictures},
    }

    def packed(_: int) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
        raise InputError("--export of a focused camera's capture writes pictures two at a time")

    return Page("focused.html", _SCRIPTS, described, parts, packed)
