# SPDX-License-Identifier: Apache-2.0
"""Pictures for people: near to the object at every a, without rings, seen through any aperture."""

from fractions import Fraction

import numpy as np
import numpy.typing as npt
import pytest

from plenofir.ground.errors import InputError
from plenofir.refocus import Aperture, best_picture, refocus
from plenofir.refocus.pictures import WEIGHT
from plenofir.refocus.sharpening import derived_moment
from plenofir_studies import sharpening as study

ALL = Aperture(3.0)
"""Wider than the pupil: all views, by the loops for apertures."""


def plane(m: int, shift: int, away: Fraction = Fraction(0)) -> study.Plane:
    return study.plane(m, shift, study.TEXTURES[1], away=away)


def decibels(field: study.Plane, picture: npt.NDArray[np.generic]) -> float:
    inside = slice(field.border, -field.border)
    return study.decibels(picture[inside, inside], field.pixels[inside, inside])


@pytest.mark.parametrize(
    ("m", "shift", "away", "least"),
    [
        (5, 5, Fraction(0), 36.0),
        (3, 1, Fraction(0), 42.7),
        (9, 3, Fraction(0), 42.7),
        (5, 3, Fraction(0), 42.7),
        # Between multiples of 1/M.
        (5, 2, Fraction(1, 10), 42.0),
    ],
)
def test_every_pixel_is_near_to_the_object(
    m: int, shift: int, away: Fraction, least: float
) -> None:
    field, a = plane(m, shift, away), Fraction(shift, m) + away
    assert decibels(field, best_picture(field.raw, m, a)) >= least
    assert decibels(field, best_picture(field.raw, m, float(a), aperture=ALL)) >= least


@pytest.mark.parametrize(("m", "shift"), [(4, 3), (6, 2), (6, 1)])
def test_even_micro_images_are_centred(m: int, shift: int) -> None:
    field = plane(m, shift)
    for aperture in (None, ALL):
        assert (
            decibels(field, best_picture(field.raw, m, Fraction(shift, m), aperture=aperture)) > 42
        )


def spot(m: int, d: float, at: tuple[float, float]) -> npt.NDArray[np.uint16]:
    """Light field of a soft spot at disparity d: pixel u of lens j sees M j + c + d M (u - c)."""
    c, k = (m - 1) / 2, np.arange(30 * m)
    seen = k // m * m + c + d * m * (k % m - c)
    down, across = (np.exp(-(((seen - x) / (1.5 * m)) ** 2)) for x in at)
    return np.rint(40_000 * np.outer(down, across)).astype(np.uint16)


@pytest.mark.parametrize("m", [4, 5, 6, 8])
@pytest.mark.parametrize(("aperture", "box"), [(None, None), (None, 2), (None, 3), (ALL, None)])
def test_planes_of_a_stack_lie_over_each_other(
    m: int, aperture: Aperture | None, box: int | None
) -> None:
    at = 14.2 * m, 15.6 * m
    raw = spot(m, 0.3, at)
    k = np.arange(30 * m)
    for shift in (-2, -1, 0, 3, 0.5) if aperture is None else (-1, 2):
        got = best_picture(raw, m, shift / m, aperture=aperture, box=box).astype(float)
        middle = (got.sum(1) * k).sum() / got.sum(), (got.sum(0) * k).sum() / got.sum()
        assert middle == pytest.approx(at, abs=0.05), shift


def limited(
    picture: npt.NDArray[np.float64], m: int, b: float = float(WEIGHT)
) -> npt.NDArray[np.float64]:
    """The sharpening as its equation has it."""
    for axis in (0, 1):
        own = np.arange(picture.shape[axis])
        before, near, next_, after = (
            picture.take(np.where((own + k < 0) | (own + k >= own.size), own, own + k), axis)
            for k in (-m, -(m // 2), m // 2, m)
        )
        if axis == 1:
            # Near the ends of a line nothing is sharpened.
            inside = (own >= m) & (own < own.size - m)
            inside = inside.reshape(1, -1, *[1] * (picture.ndim - 2))
        else:
            inside = np.ones((), bool)
        large, small = np.maximum(before, after), np.minimum(before, after)
        high = np.maximum.reduce([large, near, next_]) - picture
        low = np.minimum.reduce([small, near, next_]) - picture
        high = np.maximum(high, 2 * (picture - large))
        low = np.minimum(low, 2 * (picture - small))
        more = np.clip(b * (2 * picture - before - after), low, high)
        picture = picture + np.where(inside, more, 0)
    return picture


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(40, 33), (26, 41, 3), (6, 5)])
def test_is_the_mixture_sharpened_up_to_its_neighbours(
    dtype: type[np.integer], shape: tuple[int, ...]
) -> None:
    raw = np.random.default_rng(7).integers(0, np.iinfo(dtype).max + 1, shape, dtype=dtype)
    for a in (Fraction(-2, 5), Fraction(1), 0.27, "-0.27", Fraction(1000)):
        shift = Fraction(a) * 5
        first, share = shift // 1, float(shift % 1)
        low, high = (
            refocus(raw, 5, Fraction(n, 5), interpolation=1, border="normalise").astype(float)
            for n in (first, first + 1)
        )
        want = limited(low + share * (high - low), 5).clip(0, np.iinfo(dtype).max)
        got = best_picture(raw, 5, a)
        assert got.dtype == dtype
        # 8 bits are computed in 32nds of a grey level.
        assert abs(got - want).max() < 0.6
        # Of 3 instead of 5 samples, but for a = 1.
        sizes = [5 if n % 5 == 0 else 3 for n in (first, first + 1)]
        low, high = (
            refocus(raw, 5, Fraction(n, 5), interpolation=1, border="normalise", box=box)
            for n, box in zip((first, first + 1), sizes, strict=True)
        )
        b = [
            float(WEIGHT) * (derived_moment(5, n, 1, box) / derived_moment(5, n, 1))
            for n, box in zip((first, first + 1), sizes, strict=True)
        ]
        want = limited(low + share * (high.astype(float) - low), 5, b[0] + share * (b[1] - b[0]))
        small = best_picture(raw, 5, a, box=3)
        assert abs(small - want.clip(0, np.iinfo(dtype).max)).max() < 0.6
        part = slice(1, None), slice(2, 30)
        assert (best_picture(raw, 5, a, region=part, threads=1) == got[part]).all()


def test_no_ring_round_bright_and_dark_things() -> None:
    lenses = np.full((30, 30), 60, np.uint8)
    lenses[8:16, 8:16], lenses[20:24, 6:25] = 220, 10
    raw = lenses.repeat(5, 0).repeat(5, 1)
    for aperture in (None, ALL):
        got = best_picture(raw, 5, 0, aperture=aperture)
        assert (got.min(), got.max()) == (10, 220)
        # Near to the bright square, far from the dark bar.
        assert got[:85].min() == 60
    assert refocus(raw, 5, 0, interpolation=1, sharpen=WEIGHT).max() > 230


def test_an_aperture_takes_the_views_in_it() -> None:
    rng = np.random.default_rng(3)
    levels = rng.integers(0, 256, (5, 5), dtype=np.uint8)
    raw = np.tile(levels, (9, 9))
    one = Aperture(0, right=0.5, down=-1)
    assert (best_picture(raw, 5, "1/5", aperture=one) == levels[0, 3]).all()
    wide = Aperture(0.6).weights(5)
    assert wide[2, 2] == 1
    assert wide[0, 0] == 0
    assert 0 < wide[1, 1] < 1
    inside = best_picture(raw, 5, 0, aperture=Aperture(0.6))[20:25, 20:25]
    assert abs(inside - (levels * wide).sum() / wide.sum()).max() <= 1


def test_a_tilted_plane_has_the_focus_of_each_place() -> None:
    field = plane(5, 2)
    tilted = best_picture(field.raw, 5, 0, tilt=(0.8, 0))
    # From the middle of the picture to its right edge a rises to 0.8: half of that is in focus.
    column = field.raw.shape[1] * 3 // 4
    place = slice(40, -40), slice(column - 2, column + 3)
    sharp = best_picture(field.raw, 5, "2/5", aperture=ALL)
    assert np.abs(tilted[place].astype(float) - sharp[place]).mean() < 2
    there = slice(40, -40), slice(60, 65)
    assert np.abs(tilted[there].astype(float) - sharp[there]).mean() > 8
    down = best_picture(field.raw.T.copy(), 5, 0, tilt=(0, 0.8))
    # Columns are sharpened before rows.
    assert abs(down.T.astype(int) - tilted).mean() < 0.2


def test_refuses_what_is_no_focus_aperture_or_tilt() -> None:
    raw = np.zeros((10, 10), np.uint8)
    for a in (float("nan"), float("inf"), "x", None, True, "1/0"):
        with pytest.raises(InputError, match="focus setting"):
            best_picture(raw, 5, a)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="tilt"):
        best_picture(raw, 5, 0, tilt=(float("nan"), 0))
    with pytest.raises(InputError, match="aperture"):
        best_picture(raw, 5, 0, aperture=ALL, border="zero")
    assert best_picture(raw, 5, 1e30, aperture=ALL).shape == raw.shape
    with pytest.raises(InputError, match=r"^box: must be 5 samples or fewer"):
        best_picture(raw, 5, 0, box=6)
    with pytest.raises(InputError, match=r"^box: smaller than M takes neither an aperture"):
        best_picture(raw, 5, 0, box=3, tilt=(0.5, 0))
