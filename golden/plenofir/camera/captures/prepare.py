# SPDX-License-Identifier: Apache-2.0
"""A capture made ready to be decoded: colours, hot pixels, white balance, a grid that fits."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from plenofir.camera.calibration.calibrate import calibrate
from plenofir.camera.calibration.frames import check_same_size
from plenofir.camera.calibration.grid import Layout
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.calibration.resample import Interpolation, Scale, decode, largest_odd_size
from plenofir.camera.captures.colours import (
    Colours,
    colours_of_white,
    developed,
    even_mosaic,
    gains_for,
    gains_of_text,
    grey_of,
    noticed_mosaic,
    order_before,
    order_of_mosaic,
    without_hot_pixels,
)
from plenofir.camera.captures.fit import fitted
from plenofir.camera.resampling.mosaic import BayerOrder
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture, upright
from plenofir.ground.whole_numbers import whole_numbers


class CaptureHints(NamedTuple):
    """Hints of a person on a sensor's captures."""

    bayer: str | None = None  # order of the colour mosaic, or "none"
    white_balance: str = "auto"  # auto, off, or gains of red and blue: `gains_of_text`
    roi: str | None = None  # column and row of the white image at which captures begin

    def corner(self) -> tuple[int, int] | None:
        """Column and row of `roi`."""
        if self.roi is None:
            return None
        corner = whole_numbers(self.roi, 2)
        if corner is None:
            raise InputError(
                f"{self.roi!r} is no column and row; write them as in --roi 200,100", where="roi"
            )
        return corner[0], corner[1]


_NO_HINTS = CaptureHints()


@dataclass(frozen=True, eq=False)
class Prepared:
    """A capture with what `plenofir.camera.calibration.decode` takes."""

    picture: Picture  # grey or RGB
    calibration: Calibration  # where the capture's pixels have the micro images
    dark: Image | None
    divisor: Image | None  # the white image in the capture's pixels
    gains: Colours | None  # white balance
    notes: tuple[str, ...]  # what changes the result beyond what is asked for, for people
    lines: tuple[tuple[str, str], ...]  # what else was done, headings and texts
    mosaic: BayerOrder | None = None  # that the picture had

    def of(self, capture: Picture) -> "Prepared":
        """Another capture of the same camera, prepared like this one."""
        pixels = developed(capture.pixels, self.mosaic, "raw capture")
        return replace(self, picture=capture._replace(pixels=pixels))

    def decoded(
        self,
        micro_image: int | None,
        where: str,
        *,
        interpolation: Interpolation = "bilinear",
        scale: Scale = "native",
        devignette: bool = True,
        progress: Callable[[int, int], None] | None = None,
    ) -> tuple[Picture, int]:
        """The aligned raw image, upright, and its M: the largest odd size that fits if None.

        Raises `InputError` for a focused camera: `plenofir.camera.focused` has its pictures.
        """
        if self.calibration.lens_types is not None:
            raise InputError(
                "is a capture of a focused camera by its calibration; decode, develop, refocus, "
                "stack, depth-map and view take one",
                where=where,
            )
        m = micro_image or largest_odd_size(self.calibration)
        raster = decode(
            self.picture.pixels,
            self.calibration,
            m,
            dark=self.dark,
            white=self.divisor,
            interpolation=interpolation,
            scale=scale,
            devignette=devignette,
            gains=self.gains,
            full_scale=self.picture.full_scale,
            where=where,
            progress=progress,
        )
        picture = upright(self.picture.like(raster))
        pixels = np.ascontiguousarray(picture.pixels)
        # A camera's pixels count light, unless the file says otherwise.
        gamma = self.picture.gamma or 1.0
        return picture._replace(pixels=pixels, gamma=gamma, mosaic=None, neutral=None), m


def calibrated(
    white: Picture,
    dark: Image | None = None,
    *,
    bayer: str | None = None,
    layout: Layout | None = None,
    order: int | None = None,
    where: str = "white image",
    dark_where: str = "dark frame",
) -> Calibration:
    """Calibration of a white image as its file has it: grey, RGB, or a colour mosaic.

    `bayer`: order of the mosaic, or "none"; None leaves it to the file. Of a mosaic all pixels
    count, its colours made equally bright. Raises `InputError` as `calibrate` does.
    """
    pixels, full_scale = white.pixels, white.full_scale
    mosaic = _order_of_white(white, bayer)
    unnamed = mosaic is None and bayer is None and bool(noticed_mosaic(pixels))
    if mosaic is None and not unnamed:
        calibration = calibrate(
            pixels,
            dark,
            layout=layout,
            order=order,
            full_scale=full_scale,
            where=where,
            dark_where=dark_where,
        )
        colours = colours_of_white(pixels, None, full_scale, dark)
        of_white = {"colours": colours, "orientation": _if_turned(white)}
        return calibration.model_copy(update=of_white)
    if dark is not None:
        check_same_size(dark, pixels.shape, dark_where, f"the white image {where}")
        less = np.clip(pixels.astype(np.int64) - dark, 0, None)
    else:
        less = pixels
    levels = even_mosaic(less.astype(pixels.dtype), full_scale)
    calibration = calibrate(levels, layout=layout, order=order, full_scale=full_scale, where=where)
    colours = colours_of_white(pixels, mosaic, full_scale, dark)
    level = 0.0 if dark is None else float(np.median(dark))
    return calibration.model_copy(
        update={"colours": colours, "dark_level": level, "orientation": _if_turned(white)}
    )


def _if_turned(white: Picture) -> int | None:
    return white.orientation if white.orientation != 1 else None


def _order_of_white(white: Picture, bayer: str | None) -> BayerOrder | None:
    """Order of a white image's mosaic: as its file says, or as told."""
    if white.pixels.ndim != 2 or bayer == "none" or (white.mosaic or bayer) is None:
        return None
    return order_of_mosaic(white, white.mosaic or bayer, "white image")


def prepared(
    capture: Picture,
    calibration: Calibration,
    hints: CaptureHints = _NO_HINTS,
    *,
    white: Picture | None = None,
    dark: Picture | None = None,
    where: str = "raw capture",
) -> Prepared:
    """Make a capture ready to be decoded with a calibration.

    `white`: white image to divide by. `dark`: dark frame. Raises `InputError` if the calibration
    does not fit the capture, or its colours are not known.
    """
    bayer, white_balance, _ = hints
    corner = hints.corner()
    full_scale = capture.full_scale
    mosaic = order_of_mosaic(capture, bayer, where)
    same = dark is not None and dark.pixels.shape[:2] == capture.pixels.shape[:2]
    pixels, hot = without_hot_pixels(
        capture.pixels,
        full_scale,
        mosaic=mosaic is not None,
        dark=dark.pixels if same and dark is not None else None,
    )
    fit = fitted(
        grey_of(pixels, mosaic, full_scale),
        calibration,
        roi=corner,
        orientation=capture.orientation,
        where=where,
    )
    image = developed(pixels, mosaic, where)
    of_white = bayer if mosaic is None else order_before(mosaic, fit.place)

    def in_its_pixels(other: Picture | None, name: str) -> Image | None:
        if other is None:
            return None
        if other is dark and same:
            return developed(other.pixels, mosaic if other.pixels.ndim == 2 else None, name)
        white_levels = developed(other.pixels, _order_of_white(other, of_white), name)
        check_same_size(
            white_levels, calibration.image_shape, name, "the calibration's white image"
        )
        same_pixels = fit.as_it_was and white_levels.shape[:2] == image.shape[:2]
        return white_levels if same_pixels else fit.place.image(white_levels)

    divisor, black = in_its_pixels(white, "white image"), in_its_pixels(dark, "dark frame")
    lines: list[tuple[str, str]] = []
    if mosaic is not None:
        source = "as told" if bayer else "by its file"
        lines.append(("colours", f"of a mosaic {mosaic.upper()}, {source}"))
    if hot:
        by = "their neighbours" if not same else "the dark frame"
        lines.append(("hot pixels", f"{hot} by {by}, replaced by the median around them"))
    gains, source = gains_of_text(white_balance), "--white-balance"
    if gains is not None and image.ndim < 3:
        raise InputError("is for colours, and the capture is grey", where="white_balance")
    if image.ndim == 3 and white_balance == "auto":
        # What the sensor sees of white, by the white image if it has colours.
        colours, source = calibration.colours, "the white image"
        if colours is None and white is not None and divisor is not None:
            colours = colours_of_white(divisor, None, white.full_scale, black)
        if colours is None:
            colours, source = capture.neutral, "the neutral of its file"
        if colours is not None:
            gains = gains_for(colours)
    if gains is not None:
        words = ", ".join(f"{gain:.3f}" for gain in gains)
        lines.append(("white balance", f"red, green, blue times {words}, by {source}"))
    return Prepared(
        capture._replace(pixels=image),
        fit.calibration,
        black,
        divisor,
        gains,
        (*capture.notes, *fit.notes),
        tuple(lines),
        mosaic,
    )
