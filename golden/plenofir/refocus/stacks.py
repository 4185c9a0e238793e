# SPDX-License-Identifier: Apache-2.0
"""Focal stacks at once, and what is sharpest in them, also on a GPU."""

from collections.abc import Iterable
from fractions import Fraction
from typing import Any, cast

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.refocus.checks import check_out, whole_number
from plenofir.refocus.first_calls import refocus_image
from plenofir.refocus.operator import Image
from plenofir.refocus.settings import checked
from plenofir.refocus.sharpness import DepthIndex, LazySlices, Search, depth_index
from plenofir.refocus.shifts import focus_to_shift
from plenofir.refocus.slices import Slice


def _slices(
    raw: Any, m: int, settings: Iterable[int | str | Fraction], how: dict[str, Any]
) -> tuple[Any, list[Slice]]:
    """The image as it is read, and its slices."""
    both = [checked(raw, m, a, **how) for a in settings]
    if not both:
        raise InputError("no focus settings were given; give one or more")
    return both[0][0], [slice_ for _, slice_ in both]


def refocus_stack(
    raw: Image,
    M: int,  # noqa: N803  (as `refocus` has it)
    settings: Iterable[int | str | Fraction],
    *,
    out: Image | None = None,
    threads: int | None = None,
    **how: Any,
) -> Image:
    """Refocus a calibrated raw image to several planes.

    On an NVIDIA GPU one kernel makes 16 slices of the frame, which is read from memory once.

    Parameters
    ----------
    raw, M, out, threads
        As `refocus` takes them.
    settings
        Focus settings a in micro lens pitches, one or more.
    how
        Further options of `refocus`: align, interpolation, sharpen, border, box, region, upsample.

    Returns
    -------
    numpy.ndarray
        Shape (slices, rows, columns[, 3]); each slice is what `refocus` makes, to the bit.

    Raises
    ------
    InputError
        For what `refocus` refuses, and if there are no settings.
    """
    raw, slices = _slices(raw, M, settings, how)
    shape = (len(slices), *slices[0].result_shape)
    if threads is not None:
        threads = whole_number(threads, "threads", 1)
    if not isinstance(raw, np.ndarray):
        from plenofir.refocus.arrays import device_stack

        return cast("Image", device_stack(raw, slices, shape, out))
    if out is None:
        out = np.empty(shape, raw.dtype)
    else:
        check_out(out, raw, shape)
    for slice_, picture in zip(slices, out, strict=True):
        refocus_image(raw, slice_, out=picture, threads=threads)
    return out


def sharpest_slices(
    raw: Image,
    M: int,  # noqa: N803  (as `refocus` has it)
    settings: Iterable[int | str | Fraction],
    *,
    radius: int = 1,
    confidence: int = 0,
    vote_radius: int = 0,
    between: bool = False,
    **how: Any,
) -> DepthIndex:
    """Find the slice in which each micro image is sharpest, and the picture in focus.

    An NVIDIA GPU makes each slice in its shared memory, once for the sums of micro images and once
    for the picture, so that slices are never written; the second time only where one is sharpest.

    Parameters
    ----------
    raw, M, settings
        As `refocus_stack` takes them; up to 256 settings.
    radius, confidence, vote_radius
        As `plenofir.refocus.sharpness.depth_index` takes them.
    between
        Whether to find depth between slices too; settings must be in ascending or descending order.
    how
        Further options of `refocus`: align, interpolation, sharpen, border, box.

    Returns
    -------
    DepthIndex
        To the bit what `depth_index` finds in these slices, on every device; arrays of the library
        of `raw`.

    Raises
    ------
    InputError
        For what `refocus` and `depth_index` refuse, and for parts of a picture.
    """
    for name in ("region", "upsample"):
        if how.get(name, True) not in (None, True):
            raise InputError("depth is found in whole pictures of the raw image's size", where=name)
    settings = list(settings)
    raw, slices = _slices(raw, M, settings, how)
    m = slices[0].micro_image_size
    shifts = tuple(focus_to_shift(a, m) for a in settings) if between else ()
    search = Search(radius, confidence, vote_radius, shifts)
    search.check(len(slices))
    if not isinstance(raw, np.ndarray):
        from plenofir.refocus.arrays import device_depth

        return device_depth(raw, slices, search)
    lazy = LazySlices(slices, lambda slice_: refocus_image(raw, slice_))
    return depth_index(lazy, m, **search._asdict())
