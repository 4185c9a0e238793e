# SPDX-License-Identifier: Apache-2.0
"""Maps of depth in colours, with a scale."""

from typing import Literal

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from plenofir.ground.viridis import VIRIDIS
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]
Unit = Literal["a", "mm", "um", "v"]
"""What a map counts in: pixels per view, distances, a microscope's heights, or virtual depth."""

# Grey of pixels without a value, paper, ink.
_UNKNOWN, _PAPER, _INK = (153, 153, 153), (255, 255, 255), (0, 0, 0)
# In pixels: most columns and rows of the map, least rows of the scale, space around and between,
# width of the scale, a tick, size of the letters.
_COLUMNS, _ROWS, _LEAST_ROWS, _SPACE, _BAR, _TICK, _LETTERS = 660, 1500, 260, 14, 22, 5, 14
_NAMES = {
    "a": "a, pixels per view; larger is nearer",
    "mm": "mm from the micro lenses",
    "um": "z / \N{MICRO SIGN}m over the plane in focus, towards the objective",
    "v": "virtual depth v",
}
_REASONS = {
    "a": "unknown: no sure match",
    "mm": "no distance: no sure match, or not in front of the camera",
    "um": "unknown: no sure match",
    "v": "unknown: no sure match",
}


def depth_picture(depth: Floats, unit: Unit = "a") -> Image:
    """A map of depth (rows, columns) in colours with a scale, RGB of 8 bit; grey where unknown.

    Of distances colours are linear in 1/distance, which resolves near and far equally well.
    """
    values, name = depth, _NAMES[unit]
    if unit == "mm":
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            values = np.where(depth > 0, 1 / depth, np.nan)
    has_depth = np.isfinite(values)
    low, high = np.percentile(values[has_depth], [2, 98]) if has_depth.any() else (0.001, 0.01)
    high = max(high, low + 0.01 * (low if unit == "mm" else 1))
    shares = np.where(has_depth, (values - low) / (high - low), 0.0)
    colours = VIRIDIS[np.clip(256 * shares, 0, 255).astype(np.uint8)]
    colours[~has_depth] = _UNKNOWN
    if unit == "mm":
        ticks = distance_ticks(1 / high, 1 / low)
        of_metres, name = (1000, name[1:]) if 1 / low >= 10_000 else (1, name)
        marks = {f"{tick / of_metres:g}": 1 / tick for tick in ticks}
    else:
        marks = {f"{tick:g}": tick for tick in _round_steps(low, high, 8)}
    places = {text: (value - low) / (high - low) for text, value in marks.items()}
    return _with_scale(colours, places, name, "" if has_depth.all() else _REASONS[unit])


def _with_scale(colours: Image, marks: dict[str, float], name: str, reason: str) -> Image:
    """A picture, and beside it the scale: marks at shares of its height, and its name."""
    rows, columns = colours.shape[:2]
    scale = min(_COLUMNS / columns, _ROWS / rows)
    size = max(1, round(scale * columns)), max(1, round(scale * rows))
    picture = Pillow.fromarray(colours).resize(size, Pillow.Resampling.BOX)
    font = ImageFont.load_default(_LETTERS)
    letters = sum(font.getmetrics()) if isinstance(font, ImageFont.FreeTypeFont) else _LETTERS
    widest = max((font.getbbox(text)[2] for text in marks), default=0)
    title = Pillow.new("RGB", (round(font.getlength(name)) + 1, letters), _PAPER)
    ImageDraw.Draw(title).text((0, 0), name, _INK, font)
    # Two points of the scale stand for what lies beyond its ends.
    height = max(size[1], _LEAST_ROWS, title.width)
    top, bottom = _SPACE + _BAR, _SPACE + height - _BAR
    left = size[0] + 2 * _SPACE
    right = left + _BAR
    beside = right + _TICK + round(widest) + _SPACE
    legend = letters + _SPACE if reason else 0
    paper = Pillow.new("RGB", (beside + letters + _SPACE, height + 2 * _SPACE + legend), _PAPER)
    paper.paste(picture, (_SPACE, _SPACE))
    bar = Pillow.fromarray(np.ascontiguousarray(VIRIDIS[::-1, np.newaxis]))
    paper.paste(bar.resize((_BAR, bottom - top), Pillow.Resampling.BOX), (left, top))
    draw = ImageDraw.Draw(paper)
    for ending, point, colour in ((top - 1, _SPACE, -1), (bottom, _SPACE + height - 1, 0)):
        corners = [(left, ending), (right - 1, ending), ((left + right) / 2, point)]
        draw.polygon(corners, tuple(VIRIDIS[colour].tolist()))
    for text, share in marks.items():
        y = bottom - share * (bottom - top)
        draw.line([(right, y), (right + _TICK, y)], _INK)
        draw.text((right + 2 * _TICK, y), text, _INK, font, "lm")
    paper.paste(title.rotate(90, expand=True), (beside, _SPACE + (height - title.width) // 2))
    if reason:
        y = 2 * _SPACE + height
        draw.rectangle([_SPACE, y, _SPACE + _BAR, y + _LETTERS], _UNKNOWN)
        draw.text((2 * _SPACE + _BAR, y + _LETTERS / 2), reason, _INK, font, "lm")
    return np.asarray(paper)


def _round_steps(low: float, high: float, most: int) -> list[float]:
    """Multiples of a round step from `low` to `high`, so many at most."""
    least = (high - low) / (most - 1)
    decade = 10.0 ** np.floor(np.log10(least))
    step = next(n * decade for n in (1, 2, 2.5, 5, 10) if n * decade >= least * (1 - 1e-9))
    count = np.arange(np.ceil(low / step), np.floor(high / step) + 1)
    return [float(step * n) for n in count]


def distance_ticks(near: float, far: float) -> list[float]:
    """Round distances for a scale that is linear in 1/distance."""
    decades = 10.0 ** np.arange(np.floor(np.log10(near)), np.ceil(np.log10(far)))
    round_ones = np.outer(decades, [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8]).ravel()
    inside = round_ones[(near <= round_ones) & (round_ones <= far)].tolist()
    if len(inside) < 4:
        inside = _round_steps(near, far, 7)
    # Far ones lie close together.
    apart = (1 / near - 1 / far) / 15
    ticks: list[float] = []
    for tick in inside:
        if not ticks or 1 / ticks[-1] - 1 / tick > apart:
            ticks.append(tick)
    return ticks
