# SPDX-License-Identifier: Apache-2.0
"""Single steps of the calibration that the record runs."""

from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
from recorded_drawn import LAYOUTS, bent_grid, flat, tried

from plenofir.camera.calibration import (
    bending,
    calibration_of_grid,
    centroids,
    checks,
    fit,
    growing,
    inspection,
    lattice,
    light,
    models,
    moire,
    moments,
    raster_window,
    redrawn,
    robust,
    shading,
)
from plenofir.camera.calibration.calibrate import _profile
from plenofir.camera.calibration.white import WhiteImage, enough
from plenofir.camera.synthetic import centres_within, regular_grid, white_image


def lattice_steps() -> Any:
    rng = np.random.default_rng(11)
    result: list[Any] = []
    for angle, length, turn in product(
        (-70, -40, -8, 3, 29, 44, 61, 88), (1.02, 1.1), (91, 61, 71)
    ):
        first, second = np.radians(angle), np.radians(angle + turn)
        a = 9 * np.array([np.sin(first), np.cos(first)])
        b = 9 * length * np.array([np.sin(second), np.cos(second)])
        for vectors in (np.array([a, b]), np.array([b + 2 * a, -a])):
            result.append(lattice.reduced(*vectors))
            result.append(lattice.layout_misfits(vectors))
            for layout in (None, *LAYOUTS):
                result.append(lattice.classified(vectors, layout))
    for _ in range(40):
        one = rng.normal(0, 5, (2, 2))
        other = np.rint(rng.normal(0, 1.2, (2, 2))) @ one + rng.normal(0, 0.4, (2, 2))
        if abs(np.linalg.det(other)) > 1:
            result.append([lattice._part(one, other), lattice._part(other, one)])
            result.append([lattice._same(one, other), lattice._same(other, one)])
    return [n for part in result for n in flat(part)]


def guessed(image: np.ndarray) -> Any:
    """All lattices of an image, and first grids."""
    signal = image.astype(np.float32)
    found = lattice.lattices(signal)
    result = [[one.vectors, one.score] for one in found]
    grids = [lattice.guess(signal, one.vectors) for one in found[:2]]
    return [
        result,
        [grid.coefficients for grid in grids],
        [lattice.primitive_vectors(g) for g in grids],
    ]


def bent_lenses(
    rows: int, columns: int, *, tilt: tuple[float, float] = (0.0, 0.0), bend: float = 0.0,
    noise: float = 0.02, pulled: bool = False, order: int | None = None, pitch: float = 9.3,
    layout: Any = "rectangular", chosen: tuple[models.Model, ...] = models.MODELS,
) -> Any:  # fmt: skip
    """A fit of models to given centres."""
    rng = np.random.default_rng(rows)
    t, s = (n.ravel() for n in np.mgrid[:rows, :columns])
    shape = (int(rows * pitch), int(columns * pitch))
    grid = regular_grid(shape, pitch, rotation_degrees=1.0, layout=layout)
    grid = grid.moved(-(rows // 2), -(columns // 2))
    points = grid.lattice(t, s)
    middle = (np.array(shape) - 1) / 2
    half = float(np.hypot(*middle))
    flat = (grid.positions(points) - middle) / half
    away = flat / (1 + flat @ np.array(tilt))[:, np.newaxis]
    away = away * (1 + bend * (away**2).sum(axis=1))[:, np.newaxis]
    centres = away * half + middle
    if pulled:
        centres = centres + 0.01 * np.sin(2 * np.pi * centres)
    values = centres + rng.normal(0, noise, centres.shape)
    values[rng.random(len(values)) < 0.04] += (0.4, 0.3)
    origin = np.array(points.mean(axis=0))
    lenses = bending.Lenses(
        frame=models.Frame(grid.jacobian(grid.inverse(middle)), grid.inverse(middle), middle, half),
        points=(points - np.round(origin)) / 7.0,
        lattice=points,
        values=values,
        prior=rng.uniform(0.4, 1.0, len(values)),
        floor=1e-3,
        pitch=pitch,
        pulled=pulled,
        scale=(7.0, np.round(origin)),
    )
    found = lenses.fit(chosen, order)
    return {
        "order": [found.order, found.covariance_order, *found.untried],
        "factors": found.factors,
        "coefficients": found.coefficients,
        "scatter": found.scatter,
        "gains": found.gains,
        "weights": [(found.weights > 0).sum(), found.weights.sum()],
        "covariance": [np.einsum("aiai->a", c) for c in (found.covariance, found.own)],
    }


def light_steps() -> Any:
    rng = np.random.default_rng(5)
    result: list[Any] = [[light.light_order(n) for n in range(80)]]
    result.append([shading.order_of(np.zeros(n)) for n in (1, 3, 6, 10, 15, 21)])
    for count, probed, spread in product((9, 24, 30, 70, 200), (0, 1), (0.004, 0.1)):
        places = rng.uniform(0, 1, (count, 2)) * (90, 120)
        away = ((places - (45, 60)) ** 2).sum(axis=1) / 75**2
        level = (1 - 0.5 * away) * np.exp(rng.normal(0, spread, count)) * 900
        probes = np.zeros(count)
        if probed:
            probes[np.arange(count) % 5 != 0] = 1.0
            level = level * np.where(probes, 0.9, 1.0)
        found, covariance = light.fitted_light(places, level, probes, (91, 121))
        result.append([found, np.sqrt(covariance.diagonal())])
        result.append(light.counting(level))
        result.append(shading.shading_at(found, places * 1.4 - 20, (91, 121)))
    image = rng.uniform(20, 900, (70, 45)).astype(np.float32)
    for coefficients in ([0.0, -0.5, 0.3], [-0.2, 0.1, 0.3, -1.0, 0.4, -3.0]):
        even = np.empty_like(image)
        light.divide_by_light(image, 15.0, np.array(coefficients), even)
        result.append([even.sum(), *even[::23, ::17].ravel()])
    return [n for part in result for n in flat(part)]


def window_steps() -> Any:
    """Windows on an image without pattern, from their definitions in the compiled loops."""
    rng = np.random.default_rng(8)
    image = rng.uniform(0, 900, (60, 70)).astype(np.float32)
    places = rng.uniform(15, 44, (30, 2))
    result: list[Any] = []
    for pitch, half in product(((3.0, 3.0), (6.2, 8.3), (13.0, 12.0)), (0.35, 0.6)):
        found = centroids.windowed_moments(image, places, pitch, half)
        result += [found.sums, found.offsets, found.variances]
        result.append(centroids.response(image, places, pitch, half))
        result.append(centroids.core_brightness(image, places, pitch))
    result += [[centroids.reach(p) for p in (3.0, 9.9, 20.0)]]
    result += [centroids._between(p) for p in (3.0, 11.0, 30.0)]
    for down in (np.array([-3.0, -0.5, 2.25]), np.array([-50.0, 0.0, 60.0])):
        sampled = np.empty((len(places), 12), np.float32)
        moments.sample(image, places, down, np.array([-60.0, -1.5, 0.4, 55.0]), sampled)
        result.append(sampled)
    for edge in (1, 2):
        sampled = np.empty((2, 4), np.float32)
        moments.sample(image[:edge, :edge], places[:2], np.zeros(2), np.zeros(2), sampled)
        result.append(sampled)
    smooth = white_image((90, 95), regular_grid((90, 95), 19.0), noise=0.05).astype(np.float32)
    expected = centres_within(regular_grid((90, 95), 19.0, offset=(0.4, -0.3)), (58, 60)) + 16
    result.append(centroids.matched_offsets(smooth, expected, (19.0, 19.0)))
    result.append(centroids.matched_offsets(smooth, expected, (19.0, 17.0)))
    many = np.tile(places, (67, 1)) + 1e-3 * np.arange(2010)[:, np.newaxis]
    result.append(centroids.response(image, many, (6.2, 6.2)))
    result.append(centroids.matched_offsets(image, many, (6.2, 6.2)).sum(axis=0))
    more = np.tile(places, (100, 1)) + 1e-3 * np.arange(3000)[:, np.newaxis]
    result += [centroids.response(image, more[:count], (3.0, 3.0)) for count in (2000, 2997)]
    for far in ((4.0, 30.0), (30.0, 66.0), (55.9, 30.0)):
        try:
            centroids.windowed_moments(image, np.array([far]), (6.0, 6.0))
            result.append([0.0])
        except ValueError:
            result.append([1.0])
    return [[float(np.sum(part)), float(np.sum(np.square(part)))] for part in result]


def redrawn_steps() -> Any:
    rng = np.random.default_rng(9)
    result: list[Any] = []
    for pitch, count in ((5.0, 9), (9.3, 7), (40.0, 2)):
        t, s = np.mgrid[:count, :count]
        places = np.stack([t, s], axis=-1).reshape(-1, 2) * pitch + 1.1 * pitch
        side = int((count + 1.3) * pitch)
        image = rng.uniform(0, 1, (side, side)).astype(np.float32)
        levels = np.where(rng.random(len(places)) < 0.2, 0.0, rng.uniform(0.7, 1.2, len(places)))
        found = redrawn.redrawn(image, places, levels, levels > 0, pitch)
        spot, distance = redrawn.usual_spot(image, places, levels, places[levels > 0], pitch)
        result.append([distance, *spot.tolist(), float(found.sum()), float((found**2).sum())])
        result.append(found[:: max(1, side // 7), :: max(1, side // 7)])
    result.append(redrawn.redrawn(image, places, levels, levels > 9, pitch)[0])
    lone = np.zeros((9, 11), np.float32)
    moments.add_spots(
        lone, np.array([[0.0, 0.0], [8.4, 10.2], [4.0, 5.0], [20.0, 3.0]]),
        np.array([1.0, 0.5, 2.0, 1.0]), np.array([1.0, 0.6, 0.3, 0.0]), 1.25,
    )  # fmt: skip
    return [n for part in [*result, lone] for n in flat(part)]


def robust_steps() -> Any:
    rng = np.random.default_rng(3)
    result: list[Any] = []
    for count, prior, rounds in product((5, 12, 60), (False, True), (1, 12)):
        x = np.linspace(-1, 1, count)
        terms = np.stack([np.ones(count), x, x**2], axis=1)
        values = terms @ np.array([[1.0, 2.0], [0.5, -1.0], [0.1, 0.2]])
        values = values + rng.standard_t(2, values.shape) * 0.05
        weights = rng.uniform(0.2, 1, count) if prior else None
        result.append(robust.robust_fit(terms, values, 1e-9, weights, rounds))
        result.append(robust.robust_fit(terms, np.ones((count, 1)), 0.01, weights))
    return [n for part in result for n in flat(part)]


def place_steps() -> Any:
    """Which lenses lie in an image, of grids of all layouts."""
    result: list[Any] = []
    for layout, stagger in product(LAYOUTS, (0, 1)):
        grid = regular_grid((61, 80), 7.3, rotation_degrees=8, layout=layout)  # type: ignore[arg-type]
        stretched = tuple((1.02 * y, x) for y, x in grid.coefficients)
        grid = grid.model_copy(update={"stagger": stagger, "coefficients": stretched})
        found = calibration_of_grid(grid, (61, 80))
        result.append([*found.lenses, found.used, *found.grid.middle, found.grid.stagger])
        result.append([shading.extents(grid), grid.pitch, grid.lens_pitch, grid.rotation_degrees])
        window = raster_window(found)
        result.append([window[0].start, window[0].stop, window[1].start, window[1].stop])
        result.append(lattice.primitive_vectors(grid))
        result.append(lattice.reduced_lengths(grid))
        t, s = shading.lens_indices(grid, (61, 80))
        result.append([t.min(), t.max(), s.min(), s.max()])
        result.append(np.stack(checks.primitive_indices(grid, t, s)).sum(axis=(1, 2)))
    end = np.array([[-0.53, 3], [-0.52, 3], [-0.51, 3], [60.51, 79.51], [60.53, 3], [3, 79.53]])
    result.append(shading.within(end, (61, 80)).tolist())
    result.append(shading.outline(np.array([1.0, 2.0]), np.array([5.0, 9.0])))
    result.append(shading.unit_positions(np.array([[-5.0, 0.0], [30, 39.5], [90, 79]]), (61, 80)))
    result.append(shading.shading_at(np.array([40.0, 90.0, -9.0]), end, (61, 80)))
    return [n for part in result for n in flat(part)]


def model_steps() -> Any:
    z = np.array([0.3 + 0.2j, -0.5 + 0.7j, 0.9 - 0.1j])
    result = [
        models.columns(z, tuple(models.GROUPS)),
        models.beyond(z, np.array([0.03, -0.02]), 0.02),
    ]
    parts = [part for one in result for part in (one.real, one.imag)]
    parts += [models.SPREADS[6:], *(models.places_of(m.groups) for m in models.MODELS)]
    parts += [[m.order, m.perspective, *m.needs] for m in models.MODELS]
    centres = np.array([[0.1, 0.2], [0.35, 0.8]])
    parts += [*moire.waves(centres), moire.USUAL]
    return [n for part in parts for n in flat(part if isinstance(part, list) else np.asarray(part))]


def check_steps() -> Any:
    """What is refused, from outliers, brightness of rows and shapes just inside and outside."""
    result: list[Any] = []
    grid = regular_grid((90, 90), 9.0)
    t, s = (n.ravel() for n in np.mgrid[-4:5, -4:5])
    rng = np.random.default_rng(1)
    for off, count, ratio, turn, dim in (
        (0.5, 6, 1.0, 0.0, 1.0), (0.5, 4, 1.0, 0.0, 1.0), (0.5, 5, 1.0, 0.0, 1.0),
        (0.08, 8, 1.0, 0.0, 1.0), (0.1, 8, 1.0, 0.0, 1.0), (0.5, 8, 1.9, 0.0, 1.0),
        (0.5, 8, 2.1, 0.0, 1.0), (0.5, 8, 1.0, 24.0, 1.0), (0.5, 8, 1.0, 28.0, 1.0),
        (0.5, 8, 1.0, 0.0, 0.92), (0.5, 8, 1.0, 0.0, 0.88), (0.5, 8, 1.0, 0.0, 1.12),
    ):  # fmt: skip
        measured = grid.centres(t, s)
        odd = np.arange(count) % 2
        angle = np.radians(turn) * odd
        moves = off * np.where(odd, ratio, 1.0)[:, np.newaxis]
        measured[10 : 10 + count] += moves * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        level = np.ones(len(t))
        level[10 : 10 + count] = dim
        weights = np.ones(len(t))
        weights[10 : 10 + count] = 0.0
        fitter = SimpleNamespace(
            measured=measured, grid=grid, fitted=grid.lattice(t, s), weights=weights,
            core=lambda places, level=level: level,
        )  # fmt: skip
        result.append(tried(checks.check_outliers, fitter))
    for layout, dark, share in product(LAYOUTS, range(6), (0.38, 0.42)):
        grid = regular_grid((90, 90), 9.0, layout=layout)  # type: ignore[arg-type]
        m, n = checks.primitive_indices(grid, t, s)
        rows = (m % 2, m % 3, n % 2, n % 3, (m + n) % 3, (m - n) % 3)[dark]
        level = np.where(rows == 0, share, 1.0) + rng.uniform(0, 1e-3, len(t))
        result.append(tried(checks.check_classes, grid, t, s, level))
        result.append(tried(checks.check_classes, grid, t[:9], s[:9], level[:9]))
    for layout, second, moved in product(LAYOUTS[:2], (0.0, 0.5), ((0, 4), (4, 4), (0, 5))):
        image = white_image(
            (90, 96), regular_grid((90, 96), 9.0, layout=layout), form="spot", radius=0.1
        )  # type: ignore[arg-type]
        image = image + second * np.roll(image, moved, (0, 1))
        grid = regular_grid((90, 96), 9.0, layout=layout)  # type: ignore[arg-type]
        padded = np.pad(image.astype(np.float32), 9, mode="edge")
        fitter = SimpleNamespace(grid=grid, margin=9, padded=padded)
        result.append(checks.cell_margin(fitter, grid.centres(t, s)))
        result.append(checks.unlikeness(fitter, t, s, grid.centres(t, s)))
        result.append(checks.unlikeness(fitter, t[:7], s[:7], grid.centres(t[:7], s[:7])))
        dark = SimpleNamespace(grid=grid, margin=9, padded=padded.max() - padded)
        result.append(checks.cell_margin(dark, grid.centres(t, s)))  # type: ignore[arg-type]
        lines = t % 2 == 0
        two = t[lines], s[lines]
        result.append(checks.unlikeness(fitter, *two, grid.centres(*two)))
        many = np.tile(t, 9), np.tile(s, 9)
        near = grid.centres(*many) + rng.normal(0, 0.1, (len(many[0]), 2))
        result.append(checks.cell_margin(fitter, near))
        result.append(checks.unlikeness(fitter, *many, near))
    return result


def lit_steps() -> Any:
    """Lenses of all brightnesses, many of them near the shares at which they count as lit."""
    gains = [(0.0, 2.0, 180), (0.030, 0.042, 60), (0.2, 0.32, 70), (1.6, 1.95, 50)]
    levels = np.concatenate([np.linspace(*part) for part in gains])
    levels = np.random.default_rng(3).permutation(levels).reshape(12, 30)
    image = np.kron(levels, np.ones((10, 10), np.float32)).astype(np.float32) * 1000
    white = WhiteImage(image, regular_grid(image.shape, 10.0, offset=(5.0, 5.0)))
    t, s, centres = white.lenses(max(image.shape), 0.0)
    result: list[Any] = [white.core(centres).sum(), white.base(), white.light(centres).sum()]
    result += np.packbits(white.lit(t, s, centres)).tolist()
    white.shading = np.zeros(1)
    result += np.packbits(white.lit(t, s, centres)).tolist()
    result += [white.large, *white.windows(), *white.missed.shape]
    result.append(fit._shading(white).tolist())  # type: ignore[arg-type]
    for clipped in (None, 1500.0):
        white = WhiteImage(image, white.grid, clipped)
        white.flatten()
        result += [float(white.padded.sum()), float(white.redrawn.sum()), *white.shading]
        result += white.as_drawn(centres)[::9].tolist()
    return result


def corrected_steps() -> Any:
    """Corrections by the drawn image, of as many lenses as terms of an order take or fewer."""
    rng = np.random.default_rng(10)
    result: list[Any] = []
    for order, count, worse in product((1, 2, 5), (9, 15, 16, 17, 23, 24, 25), (0.01, 0.2)):
        t, s = np.divmod(np.arange(count), 5)
        grid = bent_grid(order)
        drawn = grid.centres(t, s)
        errors = rng.normal(0, worse, drawn.shape)
        fitter = SimpleNamespace(
            drawn_grid=grid, grid=grid, end=np.full(2, 90.0), stretch=np.zeros(2), redrawn=None,
            measure=lambda _, places, errors=errors: places + errors,
        )  # fmt: skip
        points = grid.lattice(t, s) / 5
        measured = drawn + rng.normal(0, 0.02, drawn.shape)
        found = growing.GrowingFit.corrected(fitter, measured, t, s, points)  # type: ignore[arg-type]
        result.append("worse" if found is None else found.sum())
    return result


def enough_steps() -> Any:
    """As many lenses as a step takes, and one more or less."""
    result: list[Any] = [enough(12000) == slice(None), len(enough(12001))]
    result.append(np.asarray(enough(12001))[:9])
    rng = np.random.default_rng(7)
    lone = regular_grid((40, 40), 2.0)
    for count, rows in product(
        (23, 24, 25, 99, 100, 101, 159, 160, 161), (3, 4, 9, 10, 11, 12, 13)
    ):
        places = np.stack([np.arange(count) % rows, np.arange(count) // rows], axis=1) * 1.0
        lenses = SimpleNamespace(lattice=places, points=places)
        result.append([bending.Lenses.tried(lenses, order) for order in (2, 3, 4, 5)])  # type: ignore[arg-type]
    for pitch, side in ((4.0, 106), (21.3, 90), (84.0, 250)):
        signal = rng.uniform(0, 900, (side, side)).astype(np.float32)
        known = calibration_of_grid(
            regular_grid(signal.shape, pitch, rotation_degrees=1), signal.shape
        )
        mean = inspection.mean_micro_image(signal, known)
        result.append([*mean.values.shape, mean.values.sum(), mean.cell.sum()])
        fill = inspection.fill_factor(mean, pitch)
        result.append([fill.verdict, fill.diameter, fill.share, fill.between, fill.darkest])
    signal = rng.uniform(0, 900, (126, 126)).astype(np.float32)
    for count in (2998, 3000):
        grid = lone.moved(-29, -29)
        present = (np.arange(60 * 60) < count + 59 * 4).reshape(60, 60)
        present[0] = present[-1] = present[:, 0] = present[:, -1] = False
        present[present] = np.arange(present.sum()) < count
        found = SimpleNamespace(grid=grid.moved(-12, -12), present=present)
        result.append(_profile(signal, found, np.ones(present.shape)).sum())  # type: ignore[arg-type]
    wide = rng.uniform(0, 900, (420, 420)).astype(np.float32)
    t, s = np.mgrid[:16, :16]
    places = np.stack([t, s], axis=-1).reshape(-1, 2) * 24.5 + 20.3
    result.append(redrawn.usual_spot(wide, places, np.ones(256), places, 24.5))
    t, s = np.mgrid[:21, :21]
    places = np.stack([t, s], axis=-1).reshape(-1, 2) * 7.0 + 9.3
    spot, distance = redrawn.usual_spot(
        signal[:160], places[:, ::-1] % 110 + 7, np.ones(441), places % 110 + 7, 7.0
    )
    return [n for part in [*result, [distance, *spot]] for n in flat(part)]
