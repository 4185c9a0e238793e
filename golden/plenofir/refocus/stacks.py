# SPDX-License-Identifier: Apache-2.0
"""Focal stacks at once, also on a GPU."""

from collections.abc import Iterable
from fractions import Fraction
from typing import Any, cast

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.refocus.checks import check_out, whole_number
from plenofir.refocus.first_calls import refocus_image
from plenofir.refocus.operator import Image
from plenofir.refocus.settings import checked
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
