# SPDX-License-Identifier: Apache-2.0
"""Lattices: shortest vectors, layouts from angles, and those that images show."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from plenofir.camera.calibration.grid import Grid
from plenofir.camera.calibration.lattice import (
    classified,
    guess,
    lattices,
    layout_misfits,
    primitive_vectors,
    reduced,
    reduced_lengths,
)
from plenofir_studies.synthetic import regular_grid, white_image

SHAPE = (84, 92)
LAYOUTS = ("rectangular", "hexagonal-rows", "hexagonal-columns")
turns = st.floats(-180, 180)
steps = st.integers(-3, 3)


def vector(length: float, degrees: float) -> np.ndarray:
    """A vector (y, x), 0 degrees to the right."""
    return length * np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def lengths(vectors) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1)


def is_same(vectors: np.ndarray, others: np.ndarray) -> bool:
    """Whether two pairs of vectors make the same lattice, to a tenth of a step."""
    change = np.asarray(vectors) @ np.linalg.inv(others)
    whole = np.rint(change)
    return np.abs(change - whole).max() < 0.1 and round(abs(np.linalg.det(whole))) == 1


@given(st.floats(1, 30), st.floats(1, 1.8), turns, st.floats(75, 105), steps, steps, steps)
def test_reduced_vectors_are_the_shortest_of_the_same_lattice(
    length, ratio, angle, between, one, two, three
) -> None:
    shortest = np.array([vector(length, angle), vector(length * ratio, angle + between)])
    changes = [np.array([[1, one], [0, 1]]), np.array([[1, 0], [two, 1]])]
    basis = np.array([[0, 1], [-1, three]]) @ changes[1] @ changes[0] @ shortest
    found = np.array(reduced(*basis))
    assert is_same(found, shortest)
    assert np.sort(lengths(found)) == pytest.approx(lengths(shortest), rel=1e-9)
    assert lengths(found)[0] <= lengths(found)[1] * (1 + 1e-9)


@given(turns, st.floats(1, 50), st.floats(0, 0.2), st.floats(-9, 9), steps)
def test_misfits_are_distances_to_a_square_and_a_hexagon(angle, pitch, stretch, shear, n) -> None:
    """In pitches, of the mean length: one vector stretched as the other shrinks, or turned."""
    even = np.array([vector(1 - stretch, 0), vector(1 + stretch, 90)])
    square, hexagon = np.hypot(stretch, stretch), (0.5, 1 + stretch - np.sqrt(0.75), stretch)
    turned = np.array([vector(1, 0), vector(1, 90 - shear)])
    away = np.sin(abs(np.radians(shear))), np.cos(np.radians(shear))
    for vectors, expected in (
        (even, (square, np.linalg.norm(hexagon))),
        (turned, (np.hypot(away[0], away[1] - 1), np.hypot(away[0] - 0.5, away[1] - 0.75**0.5))),
    ):
        turn = np.array([vector(pitch, angle), vector(pitch, angle + 90)])
        basis = np.array([[1, 0], [n, 1]]) @ vectors @ turn
        for mirror in (1, -1):
            assert layout_misfits(basis * (1, mirror)) == pytest.approx(expected, abs=1e-6)


@given(st.sampled_from(LAYOUTS), st.floats(-14.5, 14.5), st.booleans(), steps, st.booleans())
@example("hexagonal-rows", 0.0, False, 0, False)
@example("rectangular", 0.0, False, 0, False)
def test_layout_follows_from_the_angle_of_the_rows(layout, rotation, is_told, n, swapped) -> None:
    grid = regular_grid(SHAPE, 9.3, rotation_degrees=rotation, layout=layout)
    basis = np.array([[1, 0], [n, 1]]) @ primitive_vectors(grid)
    found, down, right = classified(basis[::-1] if swapped else basis, layout if is_told else None)
    assert found == layout
    assert np.array([down, right]) == pytest.approx(grid.vectors, abs=1e-9)


@given(st.sampled_from((-1, 1)), st.floats(0.1, 14))
def test_a_layout_that_is_told_is_taken(sign, turn) -> None:
    """Of the six neighbours' directions those nearest to rows, or to columns."""
    rotation = sign * turn
    rows = regular_grid(SHAPE, 9.3, rotation_degrees=rotation, layout="hexagonal-rows")
    found, down, right = classified(primitive_vectors(rows), "hexagonal-columns")
    assert found == "hexagonal-columns"
    steepest = vector(9.3, rotation + (60 if rotation >= 0 else 120))
    assert abs(down @ steepest) == pytest.approx(9.3**2)
    assert down[0] > 0 < right[1]
    assert [down @ right, right @ right] == pytest.approx([0, 0.75 * 9.3**2], abs=1e-9)
    found, down, right = classified(primitive_vectors(rows), "rectangular")
    assert found == "rectangular"
    assert lengths([down, right]) == pytest.approx(9.3)
    assert abs(right[1]) >= abs(down[1])


@settings(max_examples=10)
@given(
    st.sampled_from(LAYOUTS), st.floats(4.0, 17), st.floats(-14, 14), st.floats(0.3, 0.48),
    st.tuples(st.floats(-4, 4), st.floats(-4, 4)),
)  # fmt: skip
def test_lattice_of_a_drawn_image(layout, pitch, rotation, radius, offset) -> None:
    grid = regular_grid(SHAPE, pitch, rotation_degrees=rotation, layout=layout, offset=offset)
    image = white_image(SHAPE, grid, radius=radius).astype(np.float32)
    found = lattices(image)
    assert is_same(found[0].vectors, primitive_vectors(grid))
    assert lengths(found[0].vectors) == pytest.approx(reduced_lengths(grid), abs=0.15)
    assert found[0].score > 0.6
    for one, other in pairwise(found):
        assert not is_same(other.vectors, one.vectors)
    # A first grid: its layout, directions and a lens of it near the middle.
    first = guess(image, found[0].vectors)
    assert first.layout == layout
    assert first.vectors == pytest.approx(grid.vectors, abs=0.3)
    origin = first.centres(0, 0)
    assert np.linalg.norm(grid.nearest(origin)[2]) < max(0.3, 0.05 * pitch)
    assert np.linalg.norm(origin - (np.array(SHAPE) - 1) / 2) < pitch


def test_lattices_of_every_second_lens_stand_behind() -> None:
    grid = regular_grid(SHAPE, 8.0)
    found = lattices(white_image(SHAPE, grid).astype(np.float32))
    areas = [abs(np.linalg.det(one.vectors)) for one in found]
    assert areas[0] == pytest.approx(64, rel=0.02)
    assert max(areas) > 100
    # If every second lens is dark, the coarser lattice scores more, and is the first.
    t, s, _ = grid.nearest(np.moveaxis(np.indices(SHAPE), 0, -1).astype(float))
    dim = white_image(SHAPE, grid) * np.where((t + s) % 2, 0.2, 1.0)
    first = lattices(dim.astype(np.float32))[0]
    assert abs(np.linalg.det(first.vectors)) == pytest.approx(128, rel=0.05)


def test_large_and_long_images() -> None:
    """Middles of images suffice; pitches above the coarsest version's are seen in smaller ones."""
    for shape, pitch in (((28, 1100), 5.3), ((300, 310), 47.0), ((60, 64), 3.0)):
        grid = regular_grid(shape, pitch, rotation_degrees=0.4)
        image = white_image(shape, grid).astype(np.float32)
        assert is_same(lattices(image)[0].vectors, primitive_vectors(grid))


def test_other_lattices_than_square_and_hexagonal_need_a_layout() -> None:
    down, right = (11.5, 0.0), (0.0, 8.0)
    grid = Grid(
        layout="rectangular", order=1, middle=(0, 0), scale=1, coefficients=((42, 46), down, right)
    )
    image = white_image(SHAPE, grid, radius=0.3).astype(np.float32)
    oblong = np.array([down, right])
    assert not any(is_same(one.vectors, oblong) for one in lattices(image))
    assert is_same(lattices(image, "rectangular")[0].vectors, oblong)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_primitive_vectors_lead_to_neighbours(layout) -> None:
    grid = regular_grid(SHAPE, 7.0, rotation_degrees=5, layout=layout)
    t, s = np.mgrid[-3:4, -3:4]
    around = (grid.centres(t, s) - grid.centres(0, 0)).reshape(-1, 2)
    for step in primitive_vectors(grid):
        assert np.linalg.norm(around - step, axis=1).min() < 1e-9
    assert reduced_lengths(grid) == pytest.approx((7.0, 7.0))
