# SPDX-License-Identifier: Apache-2.0
"""A calibration that does not fit a capture is noticed by the capture's own pixels."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from own_camera import Floats, OwnCamera, words

from plenofir.camera.calibration import Calibration, Grid, calibration_of_grid, decode
from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.moving import mapped, turning
from plenofir.camera.captures.fit import fitted
from plenofir.camera.patterns.match import match_capture
from plenofir.ground.errors import InputError
from plenofir.ground.orientation import turned

SEED = 20_261_127
PAIRS = 6


def levels(image: Floats) -> np.ndarray:
    return grey(words(image))


def drawn(number: int) -> OwnCamera:
    """A camera of 14 to 24 lenses a side, of any pitch, layout, rotation, aperture and noise."""
    draw = np.random.default_rng((SEED, number))
    pitch = float(np.exp(draw.uniform(np.log(5), np.log(16))))
    rows = int(draw.uniform(15, 24) * pitch)
    return OwnCamera(
        shape=(rows, int(rows * draw.uniform(1.1, 1.4))),
        pitch=pitch,
        turn_degrees=float(draw.uniform(0.8, 2) * draw.choice([-1, 1])),
        offset=(float(draw.uniform(-0.4, 0.4) * pitch), float(draw.uniform(-0.4, 0.4) * pitch)),
        hexagonal=number % 3 == 1,
        fill=float(draw.uniform(0.4, 0.5)),
        noise=float(draw.uniform(0.001, 0.015)),
    )


def capture_of(camera: OwnCamera, number: int) -> Floats:
    draw = np.random.default_rng((SEED, 1, number))
    return camera.take(number, draw.uniform(0.2, 0.9), draw.uniform(0.3, 0.9))[0]


def off(calibration: Calibration, grid: Grid) -> float:
    """Largest distance of a calibration's centres from the nearest ones of a grid."""
    return float(
        np.linalg.norm(grid.nearest(calibration.centres[calibration.inside])[2], axis=-1).max()
    )


@pytest.mark.parametrize("number", range(PAIRS))
def test_drawn_pairs(number: int) -> None:
    """A right pair says nothing; each misfit is told, and the grid moved to the pixels' own."""
    print("seed", SEED, number)
    camera = drawn(number)
    calibration = calibration_of_grid(camera.grid(), camera.shape)
    image = capture_of(camera, number)
    found = fitted(levels(image), calibration)
    assert found.notes == ()
    assert found.calibration == calibration
    for changed, words_ in (
        ({"offset": (camera.offset[0] + 0.3 * camera.pitch, camera.offset[1])}, "-"),
        ({"pitch": camera.pitch * 1.015}, "farther apart"),
        ({"turn_degrees": camera.turn_degrees + 0.6}, "rotated by"),
    ):
        other = replace(camera, **changed)
        found = fitted(levels(capture_of(other, number)), calibration)
        (note,) = found.notes
        assert words_ in note
        assert "moved" in note
        assert off(found.calibration, other.grid()) < 0.05 * camera.pitch


@pytest.mark.parametrize(
    ("flip", "words_"),
    [
        (lambda image: image[::-1, ::-1], "turned by 180 degrees"),
        (lambda image: image[:, ::-1], "mirrored from left to right"),
        (lambda image: image[::-1], "mirrored from top to bottom"),
        (lambda image: np.rot90(image, -1), "turned by 90 degrees to the right"),
        (lambda image: np.rot90(image), "turned by 90 degrees to the left"),
        (lambda image: image.swapaxes(0, 1), "mirrored with rows and columns exchanged"),
        (lambda image: np.rot90(image, 2).swapaxes(0, 1), "mirrored and turned by 90 degrees"),
    ],
)
@pytest.mark.parametrize("number", [0, 1])
def test_turned_and_mirrored_sensors(
    flip: Callable[[np.ndarray], np.ndarray], words_: str, number: int
) -> None:
    camera = drawn(number)
    camera = replace(camera, offset=(0.21 * camera.pitch, -0.32 * camera.pitch))
    calibration = calibration_of_grid(camera.grid(), camera.shape)
    image = capture_of(camera, number)
    found = fitted(levels(flip(image)), calibration)
    assert len(found.notes) == 1
    assert words_ in found.notes[0]
    # What is decoded is what comes of the right pair, turned.
    right = decode(words(image)[..., 1], calibration, 5)
    turned = decode(words(flip(image))[..., 1], found.calibration, 5)
    if camera.hexagonal:  # Resampled rows begin elsewhere.
        assert abs(flip(right).shape[0] - turned.shape[0]) <= 5
    else:
        assert np.abs(flip(right).astype(int) - turned).max() <= 2


def test_another_camera_is_refused() -> None:
    camera = drawn(0)
    calibration = calibration_of_grid(camera.grid(), camera.shape)
    wider = replace(camera, pitch=camera.pitch * 1.2)
    with pytest.raises(
        InputError, match=r"pixels have micro images .* apart .*the calibration has"
    ):
        fitted(levels(capture_of(wider, 0)), calibration)
    other = replace(camera, hexagonal=not camera.hexagonal)
    with pytest.raises(InputError, match=r"micro images .* apart \((hexagonal|rectangular)"):
        fitted(levels(capture_of(other, 0)), calibration)


@pytest.mark.parametrize(
    "dark",
    [
        lambda shape: np.zeros(shape),
        lambda shape: np.random.default_rng(SEED).normal(0.01, 0.003, shape),
        lambda shape: np.full(shape, 0.5),
    ],
    ids=["black", "noise", "even"],
)
def test_what_shows_no_micro_images_is_not_checked(dark: Callable[..., Floats]) -> None:
    camera = drawn(0)
    calibration = calibration_of_grid(camera.grid(), camera.shape)
    found = fitted(levels(np.clip(dark((*camera.shape, 3)), 0, 1)), calibration)
    assert found.calibration == calibration
    assert "could not be checked" in found.notes[0]


def test_a_part_of_the_sensor() -> None:
    camera = drawn(2)
    calibration = calibration_of_grid(camera.grid(), camera.shape)
    part = capture_of(camera, 2)[11:-20, 17:-8]
    with pytest.raises(InputError, match=r"part of the sensor \(ROI\).*--roi 12,15 "):
        fitted(levels(part), calibration)
    found = fitted(levels(part), calibration, roi=(17, 11))
    assert found.notes == ()
    moved = camera.grid().mapped(np.eye(2), np.array([-11.0, -17.0]))
    assert off(found.calibration, moved) < 1e-9
    assert "moved" in fitted(levels(part), calibration, roi=(20, 11)).notes[0]
    with pytest.raises(InputError, match="does not lie at 30,20"):
        fitted(levels(part), calibration, roi=(30, 20))


def test_binned_pixels() -> None:
    camera = replace(drawn(3), pitch=15.0)
    rows, columns = (n // 2 * 2 for n in camera.shape)
    camera = replace(camera, shape=(rows, columns))
    calibration = calibration_of_grid(camera.grid(), camera.shape)
    image = capture_of(camera, 3)
    binned = image.reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3))
    found = fitted(levels(binned), calibration)
    assert len(found.notes) == 1
    assert "taken as binned 2 x 2" in found.notes[0]
    half = camera.grid().mapped(np.eye(2) / 2, np.full(2, -0.25))
    assert off(found.calibration, half) < 1e-9
    again = fitted(levels(image), calibration_of_grid(half, (rows // 2, columns // 2)))
    assert "white image is taken as binned 2 x 2" in again.notes[0]
    assert off(again.calibration, camera.grid()) < 1e-9


def test_other_sizes_are_refused() -> None:
    camera = drawn(0)
    calibration = calibration_of_grid(camera.grid(), camera.shape)
    rows, columns = camera.shape
    with pytest.raises(InputError, match="turned by 90 degrees"):
        fitted(np.zeros((columns, rows), np.float32), calibration)
    with pytest.raises(InputError, match="same camera and mode"):
        fitted(np.zeros((rows + 5, columns + 9), np.float32), calibration)


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows", "hexagonal-columns"])
@pytest.mark.parametrize("way", range(2, 9))
def test_all_of_a_calibration_is_mapped(layout: str, way: int) -> None:
    """Bent grids too, with the light, dark lenses and profile at their places."""
    draw = np.random.default_rng(SEED)
    terms = np.array([(40.0, 60.0), (9.0, 0.3), (-0.2, 10.0), *draw.normal(0, 0.02, (7, 2))])
    grid = Grid.model_validate(
        {
            "layout": layout,
            "stagger": 1,
            "order": 3,
            "middle": (4.0, 6.0),
            "scale": 1.0,
            "coefficients": [tuple(map(float, pair)) for pair in terms],
        }
    )
    shape = (90, 130)
    base = calibration_of_grid(grid, shape)
    calibration = base.model_copy(
        update={
            "missing": ((2, 3),),
            "uneven": ((4, 5, 0.5),),
            "shading": (-0.1, 0.2, -0.3, -0.2, 0.1, -0.1),
            "profile": ((0.1, 0.2, 0.3), (0.4, 1.0, 0.6), (0.7, 0.8, 0.9)),
        }
    )
    place = turning(shape, way)
    found = mapped(calibration, place)
    # Where the map says that pixels are, they are.
    image = np.arange(90 * 130, dtype=np.uint16).reshape(shape)
    assert np.array_equal(place.image(image), turned(image, way))
    assert found.lenses == calibration.lenses[:: -1 if way > 4 else 1]
    assert found.profile == tuple(map(tuple, turned(np.array(calibration.profile), way).tolist()))

    def lenses(one: Calibration) -> np.ndarray:
        """Centres of lit lenses with their brightness, in the order of their places."""
        lit = ~np.isnan(one.centres[..., 0])
        rows = np.column_stack([one.centres[lit], one.lens_brightness[lit]])
        return rows[np.lexsort(np.round(rows[:, 1::-1], 6).T)]

    rows = lenses(calibration)
    rows[:, :2] = rows[:, :2] @ place.matrix.T + place.shift
    rows = rows[np.lexsort(np.round(rows[:, 1::-1], 6).T)]
    assert np.allclose(lenses(found), rows, atol=1e-6)


def test_a_bent_grid_is_matched_where_it_is() -> None:
    """Distortion bends the grid; a block sees it straight at its own pitch."""
    camera = OwnCamera(shape=(300, 380), pitch=10.0, distortion=0.012, noise=0.002)
    # p (1 + k |p|^2 / R^2) = q, so p = q (1 - k |q|^2 / R^2), nearly, with q = p_M L.
    half = np.array(camera.shape) / 2
    straight = replace(camera, distortion=0.0).grid()
    bend = -camera.distortion * camera.pitch**3 / float(half @ half)
    vectors = np.array(straight.coefficients[1:])
    cubes = [
        bend / camera.pitch * part for part in (vectors[0], vectors[1], vectors[0], vectors[1])
    ]
    origin = np.array(straight.coefficients[0])
    offset = half - origin
    centre = np.linalg.solve(vectors.T, offset)
    grid = Grid(
        layout="rectangular",
        order=3,
        middle=(float(centre[0]), float(centre[1])),
        scale=1.0,
        coefficients=tuple(
            (float(y), float(x)) for y, x in (half, *vectors, *np.zeros((3, 2)), *cubes)
        ),
    )
    image = camera.take(3, 0.6)[0]
    match = match_capture(levels(image), grid)
    assert match.fits
    assert match.moved_px < 0.3
    assert match_capture(levels(image), straight).moved_px > match.moved_px
