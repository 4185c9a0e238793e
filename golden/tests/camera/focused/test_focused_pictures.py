# SPDX-License-Identifier: Apache-2.0
"""Pictures and depth of rendered captures of a focused camera, against what was rendered."""

from functools import cache

import numpy as np
import pytest
from focused_scenes import Floats, Scene, scene
from scipy import ndimage

from plenofir.camera.calibration import calibrate
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.camera.captures.prepare import prepared
from plenofir.camera.focused import (
    DepthScale,
    FocusedCapture,
    FocusedDepth,
    focused_capture,
    search_depth,
)
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture

DEPTHS = (2.3, 2.6, 3.1)
# As `plenofir_studies.synthetic.render` exposes.
WHITE = 0.9 * 65535


@cache
def rendered() -> tuple[Scene, FocusedCapture, FocusedDepth]:
    """A scene with its capture and the depth that is found."""
    truth = scene(DEPTHS)
    capture = captured(truth)
    return truth, capture, search_depth(capture)


def captured(truth: Scene) -> FocusedCapture:
    calibration = calibrate(truth.capture.white)
    types = LensTypes(pattern=(0, 1, 2), sharpest=DepthScale(truth.model).sharpest())
    types = types.carried(truth.capture.grid, calibration.grid, np.eye(2), np.zeros(2))
    of_types = calibration.model_copy(update={"lens_types": types})
    return focused_capture(prepared(Picture(truth.capture.raw, 65535, 1.0), of_types))


def inner(truth: Scene) -> Floats:
    """Places that are no nearer to the border than a micro image, and show something."""
    result = np.zeros(truth.depth.shape, bool)
    result[12:-12, 12:-12] = True
    return result & np.isfinite(truth.depth)


def textured(truth: Scene) -> Floats:
    """Places with slopes of brightness of more than 1.5 % of white within a third of a lens."""
    slopes = ndimage.gaussian_gradient_magnitude(truth.truth.mean(axis=2), 1.0)
    return inner(truth) & (np.sqrt(ndimage.gaussian_filter(slopes**2, 3.0)) > 0.015)


def decibels(image: Floats, truth: Scene, part: Floats) -> float:
    return -10 * float(np.log10(((image / WHITE - truth.truth)[part] ** 2).mean()))


def test_depth_is_within_a_tenth_of_virtual_depth() -> None:
    truth, capture, found = rendered()
    depth = DepthScale(truth.model).depth(found.at(capture.shape(), 2))
    off = np.abs(depth - truth.depth)
    assert textured(truth).mean() > 0.3
    assert (off < 0.1)[textured(truth)].mean() > 0.9
    sure = inner(truth) & (found.at(capture.shape(), 2, confidence=True) >= 0.5)
    assert sure.mean() > 0.5
    assert (off < 0.1)[sure].mean() > 0.85


def test_total_focus_takes_each_place_from_the_right_type() -> None:
    truth, capture, found = rendered()
    image = capture.refocused(found.at(capture.shape(), 2)).astype(float)
    assert decibels(image, truth, inner(truth)) > 34
    # With all types alike it is softer.
    alike = capture.calibration.model_copy(
        update={"lens_types": LensTypes(pattern=(0,), sharpest=(0.4,))}
    )
    softer = FocusedCapture(capture.picture, alike, capture.pixels, capture.light)
    other = softer.refocused(found.at(capture.shape(), 2)).astype(float)
    assert decibels(image, truth, inner(truth)) > decibels(other, truth, inner(truth)) + 0.3


@pytest.mark.parametrize("number", range(3))
def test_a_plane_is_sharp_at_its_depth_alone(number: int) -> None:
    truth, capture, _ = rendered()
    part = ndimage.binary_erosion(truth.depth == DEPTHS[number], iterations=20) & inner(truth)
    scale = DepthScale(truth.model)
    quality = [
        decibels(capture.refocused(scale.inverse(v)).astype(float), truth, part) for v in DEPTHS
    ]
    assert int(np.argmax(quality)) == number
    assert quality[number] > 34


def test_virtual_depth_and_distance_are_those_of_the_ray_model() -> None:
    truth, _, _ = rendered()
    scale = DepthScale(truth.model)
    inverse = scale.inverse(2.6)
    assert float(scale.depth(inverse)) == pytest.approx(2.6, rel=1e-12)
    distances = scale.distances(np.array([inverse, np.nan]))
    assert distances is not None
    a = 1 / (inverse * 23.0)
    assert float(distances.mm[0]) == pytest.approx(float(truth.model.distance(a).mm), rel=1e-9)
    assert np.isnan(distances.mm[1])
    assert DepthScale().inverse(-4.0) == -0.25
    assert DepthScale().distances(0.25) is None
    with pytest.raises(InputError, match=r"0\.5 is no virtual depth"):
        scale.inverse(0.5)


def test_keplerian_cameras_have_negative_depth() -> None:
    """A capture whose micro images are turned about their centres is one at -v."""
    truth, capture, _ = rendered()
    grid, shape = capture.calibration.grid, capture.light.shape
    places = np.stack(np.mgrid[0 : shape[0], 0 : shape[1]], axis=-1).astype(float)
    _, _, away = grid.nearest(places)
    turned = np.moveaxis(places - 2 * away, -1, 0)
    pixels = np.stack(
        [
            ndimage.map_coordinates(one, turned, order=1)
            for one in np.moveaxis(capture.pixels, 2, 0)
        ],
        axis=-1,
    )
    light = np.where(ndimage.map_coordinates(capture.light, turned, order=0) > 0, capture.light, 0)
    types = capture.calibration.lens_types
    assert types is not None
    negative = types.model_copy(update={"sharpest": tuple(-x for x in types.sharpest)})
    calibration = capture.calibration.model_copy(update={"lens_types": negative})
    other = FocusedCapture(capture.picture, calibration, pixels, light.astype(np.float32))
    depth = DepthScale().depth(search_depth(other).at(capture.shape(), 2))
    expected = -1 / np.array([DepthScale(truth.model).inverse(v) for v in DEPTHS])
    for v, negative_depth in zip(DEPTHS, expected, strict=True):
        part = textured(truth) & (truth.depth == v)
        assert np.median(depth[part]) == pytest.approx(negative_depth, abs=0.05)
