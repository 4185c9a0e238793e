# SPDX-License-Identifier: Apache-2.0
"""Resolution by place: a small box where a slice is in focus, all views elsewhere."""

import random
from fractions import Fraction
from math import gcd

import numpy as np
import pytest
from test_refocus import random_image

from plenofir.camera.lightfield.disparity import Disparity
from plenofir.camera.lightfield.small_boxes import refocused_by_place
from plenofir.camera.lightfield.stack import FocalStack, all_in_focus
from plenofir.ground.errors import InputError
from plenofir.refocus import ExactArithmetic, best_picture, refocus_by_place
from plenofir.refocus.sharpness import confidence_level, depth_index
from plenofir_studies import box_report
from plenofir_studies import sharpening as study


def test_each_pixel_is_that_of_one_box() -> None:
    seed = random.randrange(1 << 30)
    print("seed", seed)
    draw = random.Random(seed)
    for _ in range(20):
        m, shift = draw.randint(1, 7), draw.randint(-9, 12)
        shape = (draw.randint(m, 40), draw.randint(m, 40), *draw.choice([(), (3,)]))
        raw = random_image(shape, draw.choice([np.uint8, np.uint16]))
        how = {"border": draw.choice(["zero", "normalise"]), "align": "centred"}
        here = np.random.default_rng(draw.randint(0, 99)).random(
            (-(-shape[0] // m), -(-shape[1] // m))
        )
        here = here < draw.choice([0, 0.5, 1])
        box = draw.randint(1, m)
        got = refocus_by_place(raw, m, Fraction(shift, m), here, box=box, **how)
        size = next(b for b in range(box, m + 1) if b % gcd(m, shift) == 0)
        sharp, whole = (
            ExactArithmetic().refocus(raw, m, shift=shift, box=b, **how) for b in (size, m)
        )
        for y in range(shape[0]):
            for x in range(shape[1]):
                want = sharp if here[y // m, x // m] else whole
                assert np.array_equal(got[y, x], want[y, x]), (m, shift, box, y, x)


def test_the_depth_index_tells_where() -> None:
    """Each micro image of the picture in focus is that of its slice by place."""
    m, shifts = 5, (1, 2, 3, 5)
    raw, settings = (
        study.plane(m, 2, study.TEXTURES[1]).raw.copy(),
        [Fraction(k, m) for k in shifts],
    )
    raw[: raw.shape[0] // 3] //= 16
    stacks = [FocalStack(raw, m, settings, box=box) for box in (None, 3)]
    level = confidence_level(6.0, m, 1)
    index = depth_index(stacks[0], m, confidence=level, shifts=shifts, sharp=stacks[1])
    assert 0.2 < index.textured.mean() < 0.9
    for number, a in enumerate(settings):
        picture = refocus_by_place(raw, m, a, index.sharp_in(number), box=3)
        here = (index.index == number).repeat(m, 0).repeat(m, 1)
        assert np.array_equal(index.image[here], picture[here])


def test_what_is_refused() -> None:
    raw = random_image((20, 20), np.uint8)
    with pytest.raises(InputError, match=r"^here: .*\(4, 4\)"):
        refocus_by_place(raw, 5, "1/5", np.ones((4, 5), bool), box=3)
    with pytest.raises(InputError, match=r"^box: "):
        refocus_by_place(raw, 5, "1/5", np.ones((4, 4), bool), box=6)


def test_a_plane_keeps_the_sensors_resolution() -> None:
    m, shift = 7, 3
    field = study.plane(m, shift, study.TEXTURES[1], noise=2)
    ways = dict(box_report.WAYS)
    near = {
        name: box_report.decibels(field, ways[name](field.raw, m, shift))
        for name in ("B = M", "by place, 3", "best, 3", "all in focus, M", "all in focus, 3")
    }
    print(near)
    assert max(near["B = M"], near["all in focus, M"]) < 40
    assert min(near["by place, 3"], near["all in focus, 3"]) > 47
    assert near["best, 3"] > 50


def test_a_refocused_picture_has_small_boxes_where_it_is_in_focus() -> None:
    """Left half in focus, right half away by two steps of 1/M, and no step of depth beside."""
    m, a = 5, Fraction(2, 5)
    near, far = (study.plane(m, k, study.TEXTURES[1]).raw for k in (2, 4))
    raw = np.where(np.arange(near.shape[1]) < near.shape[1] // 2, near, far)
    settings = np.full((len(raw) // m,) * 2, 0.4)
    settings[:, settings.shape[1] // 2 :] = 0.8
    got = refocused_by_place(raw, m, a, 3, Disparity(settings, np.ones(settings.shape)))
    left, right = ((slice(50, -50), slice(k, k + 50)) for k in (50, 140))
    sharp, whole = (best_picture(raw, m, a, box=box) for box in (3, None))
    assert np.abs(got[left].astype(int) - sharp[left]).mean() < 0.3
    assert np.abs(got[left].astype(int) - whole[left]).mean() > 0.8
    assert np.array_equal(got[right], whole[right])
    assert np.abs(got[right].astype(int) - sharp[right]).mean() > 1.5


def test_an_edge_keeps_the_sensors_resolution() -> None:
    m, shift = 7, 3

    def everywhere(box: int | None) -> box_report.Way:
        return lambda raw, m, shift: all_in_focus(
            raw, m, np.full((len(raw) // m,) * 2, shift / m), box=box
        )

    ways = box_report.by_place, everywhere(3), everywhere(None)
    halves = [box_report.half_contrast(m, shift, way) for way in ways]
    print(halves)
    assert min(halves[:2]) > 0.55
    assert halves[2] < 0.5
