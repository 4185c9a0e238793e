# SPDX-License-Identifier: Apache-2.0
"""Resolution by place: a small box where a slice is in focus, all views elsewhere."""

import random
from fractions import Fraction
from math import gcd

import numpy as np
import pytest
from test_refocus import random_image

from plenofir.camera.lightfield.stack import FocalStack
from plenofir.ground.errors import InputError
from plenofir.refocus import ExactArithmetic, best_picture
from plenofir.refocus.by_place import blended, refocus_by_place
from plenofir.refocus.sharpness import confidence_level, depth_index
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


def test_what_is_refused() -> None:
    raw = random_image((20, 20), np.uint8)
    with pytest.raises(InputError, match=r"^here: .*\(4, 4\)"):
        refocus_by_place(raw, 5, "1/5", np.ones((4, 5), bool), box=3)
    with pytest.raises(InputError, match=r"^box: "):
        refocus_by_place(raw, 5, "1/5", np.ones((4, 4), bool), box=6)


def test_a_plane_keeps_the_sensors_resolution() -> None:
    m, shift = 7, 3
    field = study.plane(m, shift, study.TEXTURES[1], noise=2)
    settings = [Fraction(k, m) for k in range(shift - 2, shift + 3)]
    stacks = [FocalStack(field.raw, m, settings, border="normalise", box=box) for box in (None, 3)]
    level = confidence_level(6.0, m, 1)
    inside = slice(field.border, -field.border)
    pictures = {
        "all views": depth_index(stacks[0], m, confidence=level).image,
        "by place": depth_index(stacks[0], m, confidence=level, sharp=stacks[1]).image,
        "to look at": best_picture(field.raw, m, Fraction(shift, m), box=3),
    }
    near = {
        name: study.decibels(picture[inside, inside], field.pixels[inside, inside])
        for name, picture in pictures.items()
    }
    print(near)
    assert near["all views"] < 40
    assert near["by place"] > 47
    assert near["to look at"] > 50


def test_shares_go_from_one_picture_to_the_other() -> None:
    whole, sharp = np.zeros((20, 30), np.uint16), np.full((20, 30), 1000, np.uint16)
    shares = np.random.default_rng(1).random((4, 6))
    got = blended(sharp, whole, shares, 5)
    assert np.array_equal(got[2::5, 2::5], np.rint(1000 * shares))
    assert np.array_equal(got[2, 2:8], np.rint(1000 * np.interp(range(6), [0, 5], shares[0, :2])))
    assert np.array_equal(blended(sharp, whole, np.ones((4, 6)), 5), sharp)
