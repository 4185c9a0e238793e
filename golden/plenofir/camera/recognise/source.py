# SPDX-License-Identifier: Apache-2.0
"""The answer to what a file is, and what a person may say about it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture

if TYPE_CHECKING:
    from plenofir.camera.calibration.inspection import WhiteInspection

Kind = Literal[
    "white image",
    "raw capture",
    "raw capture of a focused (2.0) camera",
    "aligned raster",
    "mosaic of views",
    "refocused picture",
    "folder of views",
    "video of views",
    "sequence of views",
    "array of views",
    "quilt of views",
    "elemental images",
    "film of frames",
    "folder of pictures",
    "folder of Lytro files",
    "Lytro capture",
    "Lytro file without a raw frame",
    "light field in a MATLAB file",
    "calibration",
    "no light field",
    "can't tell",
]
Confidence = Literal["told", "measured", "assumed", "unknown"]
Progress = Callable[[int, int], None]
Order = Literal["rows", "columns"]
Flip = Literal["none", "rows", "columns", "both"]
Layout = Literal["auto", "mosaic", "raster"]
Bayer = Literal["rggb", "grbg", "gbrg", "bggr", "none"]


_HELP = "give --white or --calib for a raw capture, or -M for an aligned raw image"


def quiet(done: int, total: int) -> None:
    """Progress that nobody looks at."""


class Hints(NamedTuple):
    """What a person says about a file; None and "auto" leave it to the file and its pixels."""

    micro_image: int | None = None  # M: pixels of a micro image, views along a side
    layout: Layout = "auto"  # of a picture: views side by side, or micro images
    order: Order | None = None  # what the first number of the views counts
    flip: Flip | None = None  # what is counted from the end
    bayer: Bayer | None = None  # colours of a sensor's first four pixels, or that it has none
    white_balance: str = "auto"  # auto, off, or gains of red and blue: `gains_of_text`
    white: Path | None = None  # white image
    white_calib: Path | None = None  # calibration file that was made of the white image
    calib: str | None = None  # calibration file
    dark: Path | None = None  # dark frame
    roi: str | None = None  # column and row of the white image at which a capture begins
    crop: str | None = None  # left, top, width, height of the part wanted: `as_asked`

    def check(self) -> None:
        """Refuse two calibrations: raises `InputError`."""
        if self.white is not None and self.calib is not None:
            raise InputError("cannot be combined with --calib; give one of them", where="white")


class Finding(NamedTuple):
    """One thing about a file, the reason for it, and how sure it is."""

    heading: str
    text: str
    confidence: Confidence = "measured"
    notable: bool = False  # whether a command that prints no findings tells it nevertheless


class Field(NamedTuple):
    """An aligned raw image with its M."""

    picture: Picture
    micro_image_size: int
    lines: tuple[Finding, ...] = ()  # what reading it told, besides what recognising did
    calibration: str | None = None  # text of a calibration that was made for it


@dataclass(frozen=True, eq=False)
class LightFieldSource:
    """Kind of a file; its pixels are read when they are asked for."""

    kind: Kind
    findings: tuple[Finding, ...]
    advice: tuple[str, ...] = ()  # command to go on with, or what to do
    micro_image_size: int | None = None  # M
    pitch_px: float | None = None
    white: "WhiteInspection | None" = None  # what a white image shows
    counts: tuple[int, int] | None = None  # rows and columns of views
    warnings: tuple[str, ...] = ()
    where: str = ""
    # Views in their right order, shape (v, u, t, s[, 3]); None if it has none.
    views: Callable[[Progress], Picture] | None = None
    # The aligned raw image, where there is one without `views`.
    raster: Callable[[Progress], Field] | None = field(default=None)

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Headings and texts of the findings, for people."""
        return tuple((one.heading, one.text) for one in self.findings)

    def field(self, progress: Progress = quiet, *, rectangles: bool = False) -> Field:
        """The aligned raw image; InputError with the kind and advice if there is none.

        `rectangles`: views (v, u, t, s[, 3]) that are no square are given as they are.
        """
        if self.raster is not None:
            return self.raster(progress)
        if self.views is None:
            raise self.refusal()
        if self.micro_image_size is None and self.counts is not None:
            rows, columns = self.counts
            if rectangles:
                return Field(self.views(progress), max(rows, columns))
            raise InputError(
                f"{columns} x {rows} views are no square, as an aligned raw image has them; "
                "develop, refocus, stack, depth-map, view, views, mosaic and quilt take them as "
                "they are",
                where=self.where,
            )
        from plenofir.camera.lightfield.indexing import compose

        picture = self.views(progress)
        return Field(picture.like(compose(picture.pixels)), picture.pixels.shape[0])

    def refusal(self) -> InputError:
        """Why there is no light field in it, and what helps."""
        reason = self.findings[-1].text if self.findings else ""
        reasoned = f"{self.kind}: {reason}" if reason else self.kind
        return InputError(
            f"{reasoned}; {self.advice[0] if self.advice else _HELP}", where=self.where
        )

    def all_views(self, progress: Progress = quiet) -> Picture:
        """The views, shape (v, u, t, s[, 3]); InputError if there are none."""
        from plenofir.camera.lightfield.indexing import views

        if self.views is not None:
            return self.views(progress)
        field = self.field(progress)
        return field.picture.like(views(field.picture.pixels, field.micro_image_size))
