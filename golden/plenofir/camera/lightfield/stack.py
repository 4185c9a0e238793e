"""Focal stacks, how sharp their parts are, and the picture that is sharp everywhere."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.errors import InputError
from plenofir.refocus import check_raw, focus_to_shift, refocus
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]
Focus = int | str | Fraction


def focal_stack(
    raw: Image,
    micro_image_size: int,
    settings: Iterable[Focus],
    progress: Callable[[int, int], None] | None = None,
) -> Image:
    """Refocus a raw image to several planes.

    Parameters
    ----------
    raw
        Raw image.
    micro_image_size
        M in pixels.
    settings
        Focus settings a, as `plenofir.refocus.refocus` takes them.
    progress
        Called with the slices done and to do.

    Returns
    -------
    Image
        Shape (slices, rows, columns[, 3]).
    """
    chosen = list(settings)
    if not chosen:
        raise InputError("no focus settings", where="a", expected="one or more")
    check_raw(raw, micro_image_size)
    for a in chosen:
        focus_to_shift(a, micro_image_size)
    slices = np.empty((len(chosen), *raw.shape), raw.dtype)
    for number, a in enumerate(chosen):
        refocus(raw, micro_image_size, a, out=slices[number])
        if progress is not None:
            progress(number + 1, len(chosen))
    return slices


def sharpness(region: Image | Floats, micro_image_size: int = 1, low: float = 0.01) -> float:
    """Sharpness of a region of interest (Eqs. 5.20-5.23): energy of high frequencies over all.

    Parameters
    ----------
    region
        Grey or RGB image.
    micro_image_size
        Pixels for each micro lens: M for pictures of the raw image's size. Frequencies above half a
        cycle a micro lens are left out; there are only replicas of lower ones, more or less of
        them depending on how the views' samples fall, not on the focus.
    low
        Q / Omega: share of the frequencies, from zero on, that count as low (at least the first
        two); the text takes 1/100.

    Returns
    -------
    float
        HE / TE, 0 for an even region.

    Raises
    ------
    InputError
        If the region has less than 4 x 4 micro lenses.
    """
    m = micro_image_size
    if min(region.shape[:2]) < 4 * m:
        raise InputError(
            f"{region.shape[1]} x {region.shape[0]} pixels",
            where="region",
            expected=f"at least {4 * m} x {4 * m} pixels",
        )
    energy = np.abs(np.fft.fft2(grey(region).astype(np.float64))) ** 2
    ends = [-(-n // (2 * m)) for n in energy.shape]
    quarter = energy[: ends[0], : ends[1]]
    limits = [min(max(1, round(n * low)), n - 1) for n in ends]
    total = float(quarter.sum())
    lows = float(quarter[: limits[0] + 1, : limits[1] + 1].sum())
    return (total - lows) / total if total > 0 else 0.0


def sharpness_curve(
    stack: Image,
    region: tuple[slice, slice] = (slice(None), slice(None)),
    micro_image_size: int = 1,
    low: float = 0.01,
) -> Floats:
    """Sharpness of a region in each slice of a focal stack.

    Parameters
    ----------
    stack
        Shape (slices, rows, columns[, 3]).
    region
        Rows and columns of the region of interest.
    m, low
        See `sharpness`.

    Returns
    -------
    Floats
        Shape (slices,), divided by its largest value as in Fig. 5.16.
    """
    curve = np.array([sharpness(image[region], micro_image_size, low) for image in stack])
    return np.asarray(curve / curve.max() if curve.max() > 0 else curve)


def peak(positions: Sequence[float] | Floats, curve: Floats) -> float:
    """Position of a curve's maximum, between samples: a parabola through the highest three.

    Parameters
    ----------
    positions
        Equally spaced positions of the samples.
    curve
        Samples.

    Returns
    -------
    float
        Position; that of the sample if the highest one is the first or the last.
    """
    places = np.asarray(positions, dtype=np.float64)
    k = int(np.argmax(curve))
    if k in (0, len(curve) - 1):
        return float(places[k])
    before, here, after = curve[k - 1 : k + 2]
    bend = before - 2 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float(places[k] + shift * (places[k + 1] - places[k]))


@dataclass(frozen=True)
class AllInFocus:
    """Picture that is sharp everywhere.

    Attributes
    ----------
    image
        Type and size of the stack's slices.
    slices
        Slice that each micro lens was taken from, fractions between slices, shape (t, s).
    """

    image: Image
    slices: Floats


def all_in_focus(stack: Image, micro_image_size: int, window: float = 2.0) -> AllInFocus:
    """Take every part of a picture from the slice in which it is sharpest.

    Parameters
    ----------
    stack
        Focal stack, shape (slices, rows, columns[, 3]).
    micro_image_size
        M: sharpness is judged between micro lenses, of which each fills M pixels.
    window
        Standard deviation of the window that sharpness is averaged over, in micro lenses.

    Returns
    -------
    AllInFocus
        Picture and slices.
    """
    m = micro_image_size
    rows, columns = (n // m for n in stack.shape[1:3])
    if min(rows, columns) < 1:
        raise InputError("less than one micro image", where="stack", expected="a larger image")
    energies = []
    for image in stack:
        # Frequencies of more than a cycle a micro lens are replicas, not detail.
        smooth = ndimage.gaussian_filter(grey(image), m / 2, mode="nearest")
        lenses = smooth[m // 2 :: m, m // 2 :: m][:rows, :columns]
        detail = ndimage.laplace(lenses.astype(np.float64), mode="nearest") ** 2
        energies.append(ndimage.gaussian_filter(detail, window, mode="nearest"))
    energy = np.stack(energies)
    best = np.argmax(energy, axis=0)
    # Even parts have no sharpest slice: what is around them decides.
    strength = energy.max(axis=0)
    weight = strength / (strength + np.median(strength) + 1e-12)
    votes = ndimage.gaussian_filter(best * weight, window, mode="nearest")
    slices = votes / np.maximum(ndimage.gaussian_filter(weight, window, mode="nearest"), 1e-12)
    slices = np.clip(slices, 0, len(stack) - 1)
    y = (np.arange(stack.shape[1]) - (m - 1) / 2) / m
    x = (np.arange(stack.shape[2]) - (m - 1) / 2) / m
    place = np.stack(np.meshgrid(y, x, indexing="ij"))
    depth = ndimage.map_coordinates(slices, place, order=1, mode="nearest")
    below = np.clip(np.floor(depth).astype(np.int64), 0, len(stack) - 1)
    above = np.minimum(below + 1, len(stack) - 1)
    share = (depth - below).reshape(depth.shape + (1,) * (stack.ndim - 3))
    line, column = np.ogrid[: stack.shape[1], : stack.shape[2]]
    image = (1 - share) * stack[below, line, column] + share * stack[above, line, column]
    return AllInFocus(np.floor(image + 0.5).astype(stack.dtype), slices)
