# SPDX-License-Identifier: Apache-2.0
"""The gain of voting on a real light field: numbers of docs/stack.md."""

from fractions import Fraction

import numpy as np

from plenofir.camera.lightfield import FocalStack, light_field_disparity
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.refocus.sharpness import confidence_level, depth_index, local_sharpness

M = 5
SHIFTS = (-3, -1, 0, 1, 3)


def test_flat_areas_of_the_flower_agree_with_disparity() -> None:
    raw = read_image(project.DATA / "flower_5x5.png")
    settings = [Fraction(shift, M) for shift in SHIFTS]
    stack = np.stack(list(FocalStack(raw, M, settings)))
    disparity = light_field_disparity(
        np.ascontiguousarray(raw[..., 1]), M, search=(-4 / M, 4 / M)
    ).pixels_per_view
    nearest = np.abs(np.array(SHIFTS)[:, None, None] / M - disparity).argmin(0)
    confidence = confidence_level(6, M, 1, channels=3)
    energy = np.stack([local_sharpness(image, M, 1) for image in stack])
    inside = np.zeros(nearest.shape, bool)
    inside[5:-5, 5:-5] = True
    flat = (energy.max(0) - energy.min(0) < confidence) & inside
    alone = depth_index(stack, M).index
    voted = depth_index(stack, M, confidence=confidence, vote_radius=2).index
    wrong = {
        name: [round(float(np.mean((index != nearest)[part])), 3) for part in (flat, inside)]
        for name, index in (("alone", alone), ("voted", voted))
    }
    print(flat[inside].mean(), wrong)
    assert 0.3 < flat[inside].mean() < 0.4
    assert wrong["alone"][0] > 0.08
    assert wrong["alone"][1] > 0.03
    assert wrong["voted"][0] < 0.005
    assert wrong["voted"][1] < 0.006
