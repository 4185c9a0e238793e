# SPDX-License-Identifier: Apache-2.0
"""Refocused pictures for people: any real a, sharp, without rings; round apertures, tilted planes.

Whole micro images are interpolated linearly, and what that and the refocusing blur is taken back by
taps a lens apart, along columns, then along rows: x + b (2 x - before - after). The result stays
within the range of x and what lies a lens and half a lens before and after. Only a peak, larger
than the pixels a lens away, may rise by twice its height over the higher one; a hollow likewise.
So there is no ring beside an edge, and texture is sharpened in full.
"""

from collections.abc import Callable
from fractions import Fraction
from math import floor
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.refocus import checks
from plenofir.refocus.border import Border, check_border
from plenofir.refocus.first_calls import soonest
from plenofir.refocus.operator import Image, clamped_shift, least_box
from plenofir.refocus.plain import plain_refocus
from plenofir.refocus.sharpening import derived_moment
from plenofir.refocus.slices import Slice
from plenofir.refocus.threads import in_threads, processors

Floats32 = npt.NDArray[np.float32]

WEIGHT = Fraction(7, 64)
"""b: least error over planes in focus, at whole and at fractional a (`plenofir report sharpening`).
"""

# Settings closer than this to the grid of M, in pixels, are on it.
_SNAP = 1e-6
# Largest rise of a from the middle of a picture to its edge; planes that a camera sees rise by a
# few.
_STEEPEST = 100
# Least pixels that are worth another thread.
_FOR_A_THREAD = 1 << 18
# NumPy takes 0.1 us for a sample of a view (Xeon of 2.5 GHz), so more of them take longer than the
# compiler, which is waited for then.
_SAMPLES_FOR_NUMPY = 1 << 25


class Aperture(NamedTuple):
    """A round aperture in the pupil, which the M x M views fill."""

    size: float  # its diameter, 1 for M views; 0 for a single view
    right: float = 0.0  # its centre, from -1 to 1 over the pupil
    down: float = 0.0

    def weights(self, micro_image_size: int) -> Floats32:
        """Share of each view, shape (v, u); views on the edge count in part."""
        m, c = micro_image_size, (micro_image_size - 1) / 2
        v, u = np.mgrid[:m, :m]
        # The centre stays among the views, so that there is always one.
        away = np.hypot(v - c - self.down * c, u - c - self.right * c)
        shares = np.clip(max(self.size * m / 2, 0.5) + 0.5 - away, 0, 1)
        return np.asarray(shares, np.float32)


def real_focus(a: object) -> Fraction:
    """A focus setting that may be any real number: int, float, `Fraction` or text.

    Raises `InputError` for what is none.
    """
    try:
        if isinstance(a, bool):
            raise TypeError
        if isinstance(a, str):
            return Fraction(a)
        if isinstance(a, Fraction):
            return a
        # Integers of any library stay exact; a float would round large ones.
        number: Any = a
        return Fraction(int(number)) if int(number) == number else Fraction(float(number))
    except (TypeError, ValueError, OverflowError, ZeroDivisionError):
        raise InputError(
            f"{a!r} is not a focus setting; use a number, such as 0.21, -3/5 or 1", where="a"
        ) from None


def best_picture(
    raw: Image,
    M: int,  # noqa: N803  (as `plenofir.refocus.refocus` has it)
    a: int | float | str | Fraction,
    *,
    aperture: Aperture | None = None,
    tilt: tuple[float, float] = (0.0, 0.0),
    box: int | None = None,
    border: Border = "normalise",
    region: checks.Region | None = None,
    threads: int | None = None,
) -> Image:
    """Refocus a calibrated raw image to a picture to look at, sharpened without rings.

    Commands and the viewer show this. `plenofir.refocus.refocus` is the operator of the thesis and
    the VHDL, to the bit.

    Parameters
    ----------
    raw
        As `refocus` takes it: (rows, columns[, 3]), uint8 or uint16, micro images of M x M pixels.
    M
        Micro image size in pixels.
    a
        Focus setting in micro lens pitches, any real number; between multiples of 1/M the pictures
        before and after are mixed.
    aperture
        Views that count; None for all M x M.
    tilt
        By how much a grows from the middle of the picture to its right edge, and to its bottom.
    box
        Samples B along a dimension that a pixel averages, from 1 to M (None), as `refocus` has it;
        a slice whose gcd(a M, M) does not divide B takes the next larger box that it can have, so
        that integer a keep M. The picture lies where it lies with M. Takes neither an aperture nor
        a tilt.
    border
        As `refocus` has it. "zero" takes neither an aperture nor a tilt.
    region
        Rows and columns of the result to compute, as slices.
    threads
        Number of threads; as many as there are processors if None.

    Returns
    -------
    numpy.ndarray
        Picture of the size and type of `raw`, or of the region.

    Raises
    ------
    InputError
        If the image, M, a or an option is not supported.
    """
    raw = checks.check_raw(raw, M)
    m, focus = int(M), real_focus(a)
    count = processors() if threads is None else checks.whole_number(threads, "threads", 1)
    rows, columns = checks.region_ranges(region, raw.shape[:2])
    if not all(abs(rise) <= _STEEPEST for rise in tilt):
        raise InputError(
            f"{tilt} is not a tilt; use two numbers from -{_STEEPEST} to {_STEEPEST}", where="tilt"
        )
    check_border(border)
    plain = aperture is None and not any(tilt)
    least_box(m, 1, box)
    if not plain and box not in (None, m):
        raise InputError("smaller than M takes neither an aperture nor a tilt", where="box")
    if not (plain or border == "normalise"):
        raise InputError("'zero' takes neither an aperture nor a tilt", where="border")
    # Farther out no view reaches the picture.
    far = sum(raw.shape[:2])
    plane = float(np.clip(float(focus), -far, far)), float(tilt[0]), float(tilt[1])
    weights = np.ones((m, m), np.float32) if aperture is None else aperture.weights(m)
    views = None if plain else _Views(plane, weights)
    picture = _Picture(m, _place(focus * m), box, border == "normalise", views)

    def by_compiled_code() -> Image:
        return picture.made(raw, rows, columns, count, compiled_loops())

    if not plain and np.count_nonzero(weights) * raw.size > _SAMPLES_FOR_NUMPY:
        return by_compiled_code()
    return soonest(
        picture.kind(raw),
        lambda: picture.made(np.zeros_like(raw[:m, :m]), range(m), range(m), 1, compiled_loops()),
        by_compiled_code,
        lambda: picture.made(raw, rows, columns, count, _numpy_loops()),
    )


class PictureLoops(NamedTuple):
    """What pictures are made by: compiled code, or its equal in NumPy."""

    refocus: Callable[..., Image]
    means_of_four: Callable[..., None]
    views_of_lines: Callable[..., None]
    sharpened_bytes: Callable[..., None]
    sharpened_lines: Callable[..., None]


def compiled_loops() -> PictureLoops:
    """Compiled code, which is loaded only when needed."""
    from plenofir.refocus import compiled
    from plenofir.refocus.compiled import picture_lines

    return _loops_of(compiled.compiled_refocus, picture_lines)


def _numpy_loops() -> PictureLoops:
    from plenofir.refocus import plain_pictures

    return _loops_of(plain_refocus, plain_pictures)


def _loops_of(refocus: Callable[..., Image], module: ModuleType) -> PictureLoops:
    return PictureLoops(refocus, *(getattr(module, name) for name in PictureLoops._fields[1:]))


class _Views(NamedTuple):
    """A plane through the light field, and the views that see it."""

    plane: tuple[float, float, float]  # a in the middle, and how much it grows right and down
    weights: Floats32  # share of each view, shape (v, u)


class _Picture(NamedTuple):
    """What is made of a raw image."""

    m: int
    shift: Fraction
    box: int | None
    normalise: bool
    views: _Views | None  # None for slices of all views, which need fewer additions

    def kind(self, raw: Image) -> tuple[object, ...]:
        """What the compiled code depends on."""
        beside, even = self.shift.denominator > 1, self.m % 2 == 0 and floor(self.shift) % 2 == 0
        pixels = raw.dtype.itemsize, raw.shape[2:]
        loops = self.views is None, beside, even, self.weight == WEIGHT
        return "picture", *pixels, self.m, self.box, *loops

    @property
    def weight(self) -> Fraction:
        """The sharpening's b: `WEIGHT` for M, and less by as much as a smaller box blurs less."""
        m, first = self.m, floor(self.shift)
        if self.box in (None, m):
            return WEIGHT
        blurs = [
            derived_moment(m, k, 1, least_box(m, k, self.box)) / derived_moment(m, k, 1)
            for k in (first, first + 1)
        ]
        return WEIGHT * (blurs[0] + (blurs[1] - blurs[0]) * (self.shift - first))

    def made(
        self, raw: Image, rows: range, columns: range, threads: int, loops: PictureLoops
    ) -> Image:
        """Rows and columns of the picture."""
        m, shift, weight = self.m, self.shift, self.weight
        # Steps from line to line, and along one.
        lens = m, m * (raw.shape[2] if raw.ndim > 2 else 1)
        # Taps of sharpening reach a lens farther.
        left, right = max(columns.start - m, 0), min(columns.stop + m, raw.shape[1])
        most = float(np.iinfo(raw.dtype).max)
        picture = np.empty((len(rows), right - left, *raw.shape[2:]), raw.dtype)

        def slice_at(shift: int, part: tuple[slice, slice]) -> npt.NDArray[Any]:
            return registered_slice(raw, m, shift, part, self.normalise, 1, self.box, loops)

        def band(first: int, last: int) -> None:
            """Lines `first` to `last` - 1 of the region."""
            top = max(rows.start + first - m, 0)
            bottom = min(rows.start + last + m, raw.shape[0])
            part = slice(top, bottom), slice(left, right)
            share = 0.0
            if self.views is None:
                low = high = slice_at(floor(shift), part)
                if shift.denominator > 1:
                    high = slice_at(floor(shift) + 1, part)
                    share = float(shift % 1)
                    if low.dtype != high.dtype:
                        low, high = (image.astype(np.float32) for image in (low, high))
            else:
                low = high = _mean_of_views(raw, m, self.views, part, loops)
            one, other = (image.reshape(image.shape[0], -1) for image in (low, high))
            out = picture[first:last].reshape(last - first, -1)
            start = rows.start + first - top
            # The usual picture has loops of its own, in whole numbers of 16 bits with this weight.
            if share == 0 and one.dtype == np.uint8 and weight == WEIGHT:
                loops.sharpened_bytes(one, *lens, start, out)
            else:
                loops.sharpened_lines(one, other, share, *lens, start, float(weight), most, out)

        if picture.size:
            _in_bands(band, picture.shape, threads)
        return picture[:, columns.start - left : columns.start - left + len(columns)]


def _place(shift: Fraction) -> Fraction:
    """A shift in pixels; what is close to a whole number is that number."""
    nearest = round(shift)
    return Fraction(nearest) if abs(shift - nearest) < _SNAP else shift


def registered_slice(
    raw: Image,
    m: int,
    shift: int,
    region: tuple[slice, slice],
    normalise: bool = True,
    threads: int | None = None,
    box: int | None = None,
    loops: PictureLoops | None = None,
) -> npt.NDArray[Any]:
    """A region of a picture, not sharpened, at a whole shift, at the exact place for every M and B.

    For even M the operator rounds offsets down (`plenofir.refocus.operator.output_offset`), so that
    its pictures lie half a pixel right and below for even shifts, and a whole one for odd shifts.
    Where M - B is odd, they lie a pixel left and above that, half of it by either moving sum.
    Linear interpolation has its knots at whole pixels, so the mean of four pixels is exact between
    them. Result: type of `raw`, or 32 bit floats for such means. Lines and columns at the edge of
    the picture, which the operator has no pixels beyond, stay where they are. `box`: see
    `plenofir.refocus.operator.least_box`. `loops`: compiled ones if None.
    """
    loops = loops or compiled_loops()
    beyond = 0 if m % 2 else 1
    size = least_box(m, shift, box)
    back = (m - size) % 2
    first = [part.start + beyond * (shift % 2) - back for part in region]
    last = [part.stop + beyond - back for part in region]
    rows, columns = (
        range(min(max(a, 0), n - 1), max(1, min(b, n)))
        for a, b, n in zip(first, last, raw.shape, strict=False)
    )
    slice_ = Slice(
        raw.shape,
        8 * raw.itemsize,
        m,
        clamped_shift(m, shift, raw.shape),
        (rows, columns),
        order=1,
        normalise=normalise,
        box_samples=size,
    )
    image = loops.refocus(raw, slice_, threads=threads)
    for axis, part in enumerate((rows, columns)):
        if (first[axis], last[axis]) != (part.start, part.stop):
            there = np.arange(first[axis], last[axis]).clip(part.start, part.stop - 1)
            image = image.take(there - part.start, axis)
    if not beyond or shift % 2:
        return image
    means = np.empty((image.shape[0] - 1, image.shape[1] - 1, *raw.shape[2:]), np.float32)
    lines = image.reshape(image.shape[0], -1)
    samples = raw.shape[2] if raw.ndim > 2 else 1
    loops.means_of_four(lines, samples, means.reshape(len(means), -1))
    return means


def _in_bands(work: Callable[[int, int], None], shape: tuple[int, ...], threads: int) -> None:
    """Work on all lines, each thread on a band of its own, which needs 2 M lines more."""
    threads = max(1, min(threads, shape[0] * shape[1] // _FOR_A_THREAD))
    lines = max(-(-shape[0] // threads), 1)
    bands = iter(range(0, shape[0], lines))

    def some() -> None:
        for first in bands:
            work(first, min(first + lines, shape[0]))

    in_threads(some, threads)


def _mean_of_views(
    raw: Image, m: int, views: _Views, region: tuple[slice, slice], loops: PictureLoops
) -> Floats32:
    """Weighted mean of the views that reach each pixel, each interpolated linearly."""
    rows, columns = (part.stop - part.start for part in region)
    cube = np.ascontiguousarray(raw).reshape(*raw.shape[:2], -1)
    # One variant of compiled code, whether the caller may write there or not.
    cube.flags.writeable = False
    means = np.empty((rows, columns, cube.shape[2]), np.float32)
    v, u = np.nonzero(views.weights)
    shares, begin = views.weights[v, u], (region[0].start, region[1].start)
    loops.views_of_lines(cube, m, *views.plane, v, u, shares, *begin, means)
    return means.reshape(rows, columns, *raw.shape[2:])
