# SPDX-License-Identifier: Apache-2.0
"""Calibration of focused cameras: grid and lens types, against what was rendered."""

from pathlib import Path

import numpy as np
import pytest
from focused_scenes import RAYTRIX_XML as XML
from focused_scenes import Scene, scene

from plenofir.camera.calibration import Calibration, calibrate, load_calibration
from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.moving import mapped, turning
from plenofir.camera.calibration.types_of_lenses import LensTypes, usual_order
from plenofir.camera.captures.prepare import prepared
from plenofir.camera.focused import (
    DepthScale,
    FocusedCapture,
    calibration_of_gaps,
    focused_capture,
    read_vendor_grid,
    types_by_sharpness,
)
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture
from plenofir_studies.synthetic.pattern import regular_grid

USUAL = {"x": 17.76, "y": 14.905, "diameter": 34.8647, "rotation": 0.0, "distortion": 0}


def off_the_truth(calibration: Calibration, truth: Scene) -> float:
    """Largest distance of a centre from a true one, in pixels."""
    centres = calibration.centres[~np.isnan(calibration.centres[..., 0])]
    return float(np.hypot(*truth.capture.grid.nearest(centres)[2].T).max())


def true_types(calibration: Calibration, truth: Scene) -> LensTypes:
    """The types as rendered, in the calibration's count."""
    types = LensTypes(pattern=(0, 1, 2), sharpest=DepthScale(truth.model).sharpest())
    return types.carried(truth.capture.grid, calibration.grid, np.eye(2), np.zeros(2))


def capture_of(calibration: Calibration, truth: Scene, types: LensTypes) -> FocusedCapture:
    of_types = calibration.model_copy(update={"lens_types": types})
    return focused_capture(prepared(Picture(truth.capture.raw, 65535, 1.0), of_types))


@pytest.mark.parametrize("seed", [3, 8])
def test_grid_and_types_are_those_that_were_rendered(seed: int) -> None:
    """By a white image, or by the gaps of the capture, with the camera's lengths."""
    rng = np.random.default_rng(seed)
    truth = scene(
        (2.2, 2.7, 3.4),
        pitch=float(rng.uniform(18, 30)),
        lenses=(20, 24),
        layout=("hexagonal-rows", "hexagonal-columns")[seed % 2],
        rotation_degrees=float(rng.uniform(-1.5, 1.5)),
        offset=tuple(rng.uniform(-9, 9, 2)),
        noise=0.01,
        seed=seed,
    )
    if seed == 3:
        calibration = calibrate(truth.capture.white)
        assert off_the_truth(calibration, truth) < 0.1
    else:
        calibration = calibration_of_gaps(grey(truth.capture.raw), "capture")
        assert off_the_truth(calibration, truth) < 0.2
    types = true_types(calibration, truth)
    capture = capture_of(calibration, truth, LensTypes(pattern=(0,), sharpest=(0.3,)))
    assert types_by_sharpness(capture, types.sharpest, 3, "capture") == types


def test_types_without_the_camera_are_numbered_from_near_to_far() -> None:
    truth = scene((2.45, 2.65, 3.6), noise=0.0, lenses=(34, 40))
    calibration = calibrate(truth.capture.white)
    types = true_types(calibration, truth)
    capture = capture_of(calibration, truth, LensTypes(pattern=(0,), sharpest=(0.3,)))
    measured = types_by_sharpness(capture, None, 3, "capture")
    from_near = np.argsort(np.argsort(-np.array(types.sharpest)))
    assert measured.pattern == tuple(from_near[list(types.pattern)])
    # Within half a pixel of blur of where they are sharp.
    off = np.sort(measured.sharpest)[::-1] - np.sort(types.sharpest)[::-1]
    assert np.abs(off).max() * capture.pitch < 1.5


def test_what_cannot_be_told_apart_is_refused() -> None:
    flat = scene((2.4,), noise=0.01, lenses=(20, 24))
    calibration = calibrate(flat.capture.white)
    capture = capture_of(calibration, flat, LensTypes(pattern=(0,), sharpest=(0.3,)))
    with pytest.raises(
        InputError, match=r"cannot be told apart: .* take a picture of fine texture"
    ):
        types_by_sharpness(capture, None, 3, "capture")
    grey_field = np.full_like(flat.capture.white, 20000)
    with pytest.raises(InputError, match="gaps between its micro images do not show"):
        calibration_of_gaps(grey(grey_field), "capture")
    alike = (0.4, 0.4, 0.4)
    with pytest.raises(InputError, match="two ways to number them"):
        types_by_sharpness(capture, alike, 3, "capture")


def test_types_follow_the_lenses_when_a_capture_is_turned(tmp_path: Path) -> None:
    grid = regular_grid((300, 400), 23.0, layout="hexagonal-rows", rotation_degrees=0.7)
    path = tmp_path / "grid.xml"
    path.write_text(XML.format(**USUAL))
    calibration = read_vendor_grid(path).calibration((300, 400))
    assert calibration.lens_types is not None
    assert calibration == load_calibration(_saved(calibration, tmp_path))
    place = turning((300, 400), 6)
    turned = mapped(calibration, place)
    assert turned.lens_types is not None
    t, s = np.mgrid[0:5, 0:6]
    old = calibration.lens_types.at(calibration.grid, t, s)
    centres = calibration.grid.centres(t, s) @ place.matrix.T + place.shift
    new = turned.lens_types.at(turned.grid, *turned.grid.nearest(centres)[:2])
    assert (old == new).all()
    assert sorted(set(usual_order(grid, t, s, 3).ravel().tolist())) == [0, 1, 2]


def _saved(calibration: Calibration, folder: Path) -> Path:
    calibration.save(folder / "calib.json")
    return folder / "calib.json"


@pytest.mark.parametrize("rotation", [0.0, 0.01, np.pi / 6])
def test_a_makers_grid_is_that_of_its_file(rotation: float, tmp_path: Path) -> None:
    """Lenses where offset, bases and rotation say, each of the type of its offset."""
    path = tmp_path / "grid.xml"
    path.write_text(XML.format(**{**USUAL, "rotation": rotation}))
    shape = (670, 964)
    calibration = read_vendor_grid(path).calibration(shape)
    layout = "hexagonal-columns" if rotation > 0.5 else "hexagonal-rows"
    assert calibration.grid.layout == layout
    middle = np.array([(670 - 1) / 2 - 14.905, (964 - 1) / 2 + 17.76])
    # Counter-clockwise: to the right is up a little.
    right = 34.8647 * np.array([-np.sin(rotation), np.cos(rotation)])
    places = middle + np.array([[0], [1], [-1], [3]]) * right
    t, s, off = calibration.grid.nearest(places)
    assert np.abs(off).max() < 1e-3
    assert calibration.lens_types is not None
    assert calibration.lens_types.at(calibration.grid, t, s).tolist() == [0, 1, 2, 0]
    assert calibration.lens_types.sharpest == pytest.approx((2 / 3, 17 / 56, 0.13657894))
    profile = np.array(calibration.profile)
    assert profile[30, 30] == 1
    assert profile[0, 30] == 0


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<a/>", "is a a, not the RayCalibData"),
        ("{", "is no XML"),
        ("<!DOCTYPE a><RayCalibData/>", "is no plain XML"),
        ("<RayCalibData/>", "has no number diameter"),
        (XML.format(**{**USUAL, "diameter": -3}), "lenses of -3 pixels"),
        (XML.format(**{**USUAL, "diameter": "nan"}), "has no number diameter"),
        (XML.format(**{**USUAL, "distortion": "0.1"}), "has a distortion"),
        (XML.format(**USUAL).replace("<x>0.5</x>", "<x>0.1</x>"), "not those of a hexagonal grid"),
        (XML.format(**USUAL).replace('id="2"><offset><x>-1', 'id="2"><offset><x>2'), ""),
        (XML.format(**USUAL).replace('id="2"><offset><x>-1', 'id="2"><offset><x>1'), "offsets"),
        (XML.format(**USUAL).replace("<min>2.8", "<min>5"), "virtual depths from 5 to 4"),
    ],
)
def test_makers_files_that_are_refused(text: str, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "grid.xml"
    path.write_text(text)
    if not problem:
        # A lens two steps to the right is of the type one step to the left.
        read_vendor_grid(path).calibration((300, 400))
        return
    with pytest.raises(InputError, match=problem):
        read_vendor_grid(path).calibration((300, 400))
