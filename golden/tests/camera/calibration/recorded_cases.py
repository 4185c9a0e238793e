# SPDX-License-Identifier: Apache-2.0
"""The cases of the record: small white images, and single steps of the calibration."""

from collections.abc import Callable, Iterator
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
from distorted_white import distorted_centres, distorted_white, ideal_white, spots
from recorded import Case

from plenofir.camera.calibration import (
    bending,
    calibrate,
    calibration_of_grid,
    centroids,
    checks,
    decode,
    fit,
    focus_score,
    frames,
    growing,
    hexagonal_to_rectangular,
    infinity_focus,
    inspect_white,
    inspection,
    largest_odd_size,
    lattice,
    light,
    measure_spots,
    models,
    moire,
    moments,
    pictures,
    pixels,
    raster_window,
    redrawn,
    resample,
    robust,
    shading,
    thesis_calibration,
    thesis_method,
)
from plenofir.camera.calibration import (
    spots as spot_sizes,
)
from plenofir.camera.calibration.calibrate import _profile
from plenofir.camera.calibration.grid import Grid
from plenofir.camera.calibration.white import WhiteImage, enough
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.rays.measured import measure_pupil
from plenofir.camera.synthetic import centres_within, regular_grid, white_image
from plenofir.camera.synthetic.drawn import drawn_white
from plenofir.ground.errors import InputError

LAYOUTS = ("rectangular", "hexagonal-rows", "hexagonal-columns")


def calibrated(drawn: Any, **options: Any) -> dict[str, Any]:
    """What reports tell of a calibration, and some of its centres."""
    white, dark = drawn if isinstance(drawn, tuple) else (drawn, None)
    found = calibrate(white, dark, **options)
    evidence = found.evidence
    assert evidence is not None
    rows, columns = found.lenses
    return {
        "layout": found.grid.layout,
        "order": found.grid.order,
        "pitch": [*found.grid.pitch, found.grid.lens_pitch],
        "rotation": found.grid.rotation_degrees,
        "lenses": found.lenses,
        "used": found.used,
        "residual": found.residual_px,
        "missing": len(found.missing),
        "uneven": len(found.uneven),
        "clipped": found.clipped_share,
        "dark": found.dark_level,
        "shading": found.shading,
        "centres": [found.model_centres[t, s] for t in (0, rows - 1) for s in (0, columns - 1)],
        "evidence": evidence.model_dump(),
        "lines": evidence.lines(),
    }


def white(
    shape: tuple[int, int],
    pitch: float,
    rotation: float = 0.0,
    layout: Any = "rectangular",
    options: dict[str, Any] | None = None,
    change: Callable[[np.ndarray], Any] = lambda image: image,
    **drawn: Any,
) -> Case:
    """A white image with a regular grid; `options` are those of `calibrate`."""
    offset = drawn.pop("offset", (0.3, -0.2))

    def draw() -> Any:
        grid = regular_grid(shape, pitch, rotation_degrees=rotation, layout=layout, offset=offset)
        return change(white_image(shape, grid, **drawn))

    return Case(draw, lambda image: calibrated(image, **(options or {})))


def bent(shape: tuple[int, int], pitch: float, order: int | None = None, **drawn: Any) -> Case:
    """Discs through a lens that distorts."""
    return Case(
        lambda: ideal_white(shape, pitch, **drawn).image,
        lambda image: calibrated(image, order=order),
    )


def step(run: Callable[[], Any]) -> Case:
    """Steps on numbers that need no drawing."""
    return Case(lambda: None, lambda _: run())


def tried(work: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """A result, or the text of the refusal."""
    try:
        return work(*arguments, **options)
    except InputError as error:
        return str(error)


# Damage and light.


def without(share: float, dim: float = 0.0, pitch: int = 9) -> Callable[[np.ndarray], np.ndarray]:
    """Some squares of an image as good as dark."""

    def change(image: np.ndarray) -> np.ndarray:
        rng = np.random.default_rng(4)
        gain = np.where(rng.random([n // pitch + 1 for n in image.shape]) < share, dim, 1.0)
        gain = np.kron(gain, np.ones((pitch, pitch)))[: image.shape[0], : image.shape[1]]
        return np.asarray(image * gain).astype(image.dtype)

    return change


def fading(low: float, high: float = 1.0) -> Callable[[np.ndarray], np.ndarray]:
    """Light that rises along the columns, all shares between two equally often."""
    return lambda image: (image * np.linspace(low, high, image.shape[1])).astype(image.dtype)


def clipping(gain: float) -> Callable[[np.ndarray], np.ndarray]:
    """Overexposed."""
    return lambda image: np.minimum(image * gain, 65535).astype(np.uint16)


def striped(period: int, share: float) -> Callable[[np.ndarray], np.ndarray]:
    """Every second band of rows darker."""

    def change(image: np.ndarray) -> np.ndarray:
        rows = np.arange(len(image)) // period % 2
        return (image * np.where(rows, share, 1.0)[:, np.newaxis]).astype(image.dtype)

    return change


def with_dark(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """In colours, with a dark frame."""
    colours = np.stack([image // 2, image // 3, image // 4], axis=2) + 900
    dark = np.random.default_rng(1).integers(850, 950, colours.shape)
    return colours.astype(np.uint16), dark.astype(np.uint16)


def scattered(share: float, side: int, seed: int = 0) -> Case:
    """Lenses that are off by a share of the pitch."""

    def draw() -> np.ndarray:
        centres = distorted_centres((side, side), 9.3)
        centres = centres + np.random.default_rng(seed).normal(0, 9.3 * share, centres.shape)
        light = np.clip(spots((side, side), centres, 2.8, 0.7), 0, 1)
        return np.asarray(np.rint(50000 * light)).astype(np.uint16)

    return Case(draw, calibrated)


def mixed(radius: float, layout: Any = "rectangular", pitch: float = 9.3) -> np.ndarray:
    """Micro images that overlap."""
    shape = (84, 92)
    grid = regular_grid(shape, pitch, rotation_degrees=0.7, layout=layout, offset=(1.2, 3.4))
    return white_image(shape, grid, radius=radius, mixed=True)


def inspected(image: np.ndarray) -> Any:
    """What an inspection tells."""
    found = inspect_white(image)
    fill = found.fill
    numbers = [fill.diameter, fill.share, fill.between, fill.darkest, fill.stops_to_touch]
    return [fill.verdict, *numbers, found.unevenness, found.darkest_lens, found.mean.values.sum()]


# Single steps.


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
    return [n for part in result for n in _flat(part)]


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, list | tuple):
        for part in value:
            yield from _flat(part)
    elif isinstance(value, np.ndarray):
        yield from value.ravel().tolist()
    else:
        yield value


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
    for count, probed, every, spread in product((9, 24, 30, 70, 200), (0, 1), (0, 1), (0.004, 0.1)):
        places = rng.uniform(0, 1, (count, 2)) * (90, 120)
        away = ((places - (45, 60)) ** 2).sum(axis=1) / 75**2
        level = (1 - 0.5 * away) * np.exp(rng.normal(0, spread, count)) * 900
        probes = np.zeros(count)
        if probed:
            probes[np.arange(count) % 5 != 0] = 1.0
            level = level * np.where(probes, 0.9, 1.0)
        found = light.fitted_light(places, level, probes, (91, 121), every=bool(every))
        result.append(found)
        result.append(light.counting(level))
        result.append(shading.shading_at(found, places * 1.4 - 20, (91, 121)))
    # Which order is fitted, near the limits at which it changes.
    draws = product((24, 25, 26, 70), (0, 1), (0.05, 0.1), (0.1, 0.3, 0.6), range(3))
    for count, probed, spread, loss, seed in draws:
        rng = np.random.default_rng([count, seed])
        places = rng.uniform(0, 1, (count, 2)) * (90, 120)
        away = ((places - (45, 60)) ** 2).sum(axis=1) / 75**2
        level = (1 - loss * away) * np.exp(rng.normal(0, spread, count)) * 900
        probes = np.where(np.arange(count) % 5, 1.0, 0.0) * probed
        level = level * np.where(probes, 0.9, 1.0)
        found = light.fitted_light(places, level, probes, (91, 121), every=False)
        result.append([len(found), float(found.sum())])
    image = rng.uniform(20, 900, (70, 45)).astype(np.float32)
    for coefficients in ([0.0, -0.5, 0.3], [-0.2, 0.1, 0.3, -1.0, 0.4, -3.0]):
        even = np.empty_like(image)
        light.divide_by_light(image, 15.0, np.array(coefficients), even)
        result.append([even.sum(), *even[::23, ::17].ravel()])
    return [n for part in result for n in _flat(part)]


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
    redrawn.add_spots(
        lone, np.array([[0.0, 0.0], [8.4, 10.2], [4.0, 5.0], [20.0, 3.0]]),
        np.array([1.0, 0.5, 2.0, 1.0]), np.array([1.0, 0.6, 0.3, 0.0]), 1.25,
    )  # fmt: skip
    return [n for part in [*result, lone] for n in _flat(part)]


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
    return [n for part in result for n in _flat(part)]


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
    return [n for part in result for n in _flat(part)]


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
    return [
        n for part in parts for n in _flat(part if isinstance(part, list) else np.asarray(part))
    ]


def spot_steps() -> Any:
    result: list[Any] = []
    z = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.9])
    rng = np.random.default_rng(2)
    for count, vertex in product((3, 4, 7), (-0.2, 0.05, 0.27)):
        radii = np.sqrt(0.01 + 0.2 * (z - vertex) ** 2) * (1 + rng.normal(0, 0.01, len(z)))
        best = spot_sizes.best_position(z[:count].tolist(), radii[:count].tolist())
        result.append([best.position, best.error or 0.0, best.bracketed] if best else ["none"])
    result.append([str(spot_sizes.best_position(z.tolist(), [0.3] * 7))])
    result.append([tried(spot_sizes.best_position, [0.0, 0.0, 1.0], [1.0, 1.0, 2.0])])
    grid = regular_grid((90, 100), 12.3, rotation_degrees=1)
    known = calibration_of_grid(grid, (90, 100))
    y, x = np.indices((90, 100))
    for width, a, noise in ((1.0, 0.0, 0.0), (3.0, 0.2, 1.0), (4.0, -0.4, 2.0), (4.0, 0.3, 9.0)):
        _, _, off = grid.nearest(np.stack([y, x], axis=-1).astype(np.float64))
        lens = (np.stack([y, x], axis=-1) - off - (44, 50)) / 12.3
        light = 3000 * np.exp(-((off + (lens / a if a else 0.0)) ** 2).sum(axis=-1) / width)
        light = light * (np.hypot(*np.moveaxis(lens, -1, 0)) < 3 * abs(a) * 4 + 0.7)
        picture = np.clip(np.rint(light + rng.normal(40, noise, light.shape)), 0, 65535)
        for dark in (None, np.full((90, 100), 30, np.uint16)):
            state = tried(infinity_focus, picture.astype(np.uint16), known, 9.0, dark)
            if isinstance(state, str):
                result.append([state])
            else:
                result.append(
                    [state.a, state.error, state.resolution, state.lenses, state.in_focus]
                )
    return result


def drawn_curves(figure: Any) -> list[Any]:
    """What the axes of a figure show."""
    result: list[Any] = []
    for axes in figure.axes:
        result += [axes.get_title(), axes.get_xlabel(), axes.get_ylabel(), axes.get_ylim()[0]]
        for line in axes.lines:
            x, y = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
            result += [line.get_label(), len(x), x[0], x[-1], x.sum(), y[0], y[-1], y.sum()]
        for image in axes.images:
            result += [*image.get_extent(), *image.get_clim(), float(image.get_array().sum())]
        for part in axes.collections:
            result += [len(path.vertices) for path in part.get_paths()]
        result += [text.get_text() for text in axes.texts]
        legend = axes.get_legend()
        result += [text.get_text() for text in legend.get_texts()] if legend else []
    pictures.plt.close(figure)
    return result


def picture_steps(images: list[np.ndarray]) -> Any:
    """Curves of an inspection's pictures."""
    drawing, pictures.figure_pixels = pictures.figure_pixels, drawn_curves
    try:
        result = [pictures.micro_image_picture(inspect_white(image)) for image in images]
        rays = RayModel.focused(load_camera("f197-mla2"), float("inf"), 11)
        for pitch in (14.0, 13.95, 60.0, 9.0):
            pupil = measure_pupil(rays, pitch, 0.01)
            result.append(pictures.chief_ray_picture(rays, pupil, 31))
        for squares in ((9.0, 4.0, 5.0, 8.0), (4.0, 8.0, 9.0, 4.0)):
            sizes = [np.sqrt(n) / 20 for n in squares]
            spots_found = [
                spot_sizes.Spots(0.1 * n, 9 * r, r, {side: r + 0.01 for side in spot_sizes.SIDES})
                for n, r in enumerate(sizes)
            ]
            result.append(pictures.focus_picture(focus_score(spots_found)))
    finally:
        pictures.figure_pixels = drawing
    return [n for part in result for n in _flat(part)]


def drawn_spots() -> list[np.ndarray]:
    grid = regular_grid((80, 84), 11.2, rotation_degrees=0.4, offset=(2.0, 1.0))
    return [
        white_image((80, 84), grid, form="spot", radius=radius, noise=0.01, seed=seed)
        for seed, radius in enumerate((0.15, 0.11, 0.1, 0.13))
    ]


def focus_steps(images: list[np.ndarray]) -> Any:
    known = calibrate(images[2])
    found = [measure_spots(frames.grey(i), known, 0.3 * n) for n, i in enumerate(images)]
    score = focus_score(found)
    sides = [[one.radius_px, one.radius, *one.sides.values()] for one in score.spots]
    return [sides, *([b.position, b.error] for b in (score.best, *score.sides.values()) if b)]


def resampled() -> Any:
    """Resampled pictures of all layouts, sizes, interpolations and scales."""
    rng = np.random.default_rng(6)
    shape = (70, 84)
    y, x = np.indices(shape)
    raw = (20000 + 9000 * np.sin(y / 3) * np.cos(x / 4) + rng.uniform(0, 900, shape)).astype(
        np.uint16
    )
    colour = np.stack([raw, raw // 2, raw // 3], axis=2)
    light = (45000 - 9 * ((y - 30) ** 2 + (x - 40) ** 2)).astype(np.uint16)
    result: list[Any] = []
    for layout, stagger in product(LAYOUTS, (0, 1)):
        grid = regular_grid(shape, 9.3, rotation_degrees=2, layout=layout)  # type: ignore[arg-type]
        grid = grid.model_copy(update={"stagger": stagger})
        known = calibration_of_grid(grid, shape)
        side = 1 - np.abs(np.linspace(-1, 1, 13)) ** 3 * 0.8
        known = known.model_copy(
            update={
                "profile": tuple(map(tuple, np.outer(side, side))),
                "shading": (0.0, 0.1, -0.3),
                "uneven": ((2, 3, 0.8), (4, 4, 1.1)),
                "dark_level": 200.0,
            }
        )
        result.append([largest_odd_size(known), *resample.profile_at(known, 7, "fit")[3]])
        for m, how, scale in (
            (1, "nearest", "native"), (5, "bilinear", "native"), (6, "cubic", "fit"),
            (8, "nearest", "fit"), (4, "cubic", "native"),
        ):  # fmt: skip
            picture = decode(raw, known, m, interpolation=how, scale=scale)  # type: ignore[arg-type]
            result.append(_sums(picture))
        result.append(_sums(decode(colour, known, 5)))
        result.append(_sums(decode(colour, known, 5, white=light, dark=raw // 90, full_scale=9000)))
        result.append(_sums(decode(raw, known, 5, white=np.stack([light] * 3, axis=2))))
        result.append(_sums(decode(raw, known, 3, devignette=False, white=light)))
    for m in (0, 9, 10, 11, 40, 41):
        result += [
            tried(resample.check_micro_image_size, known, m, s) for s in ("native", "fit", "x")
        ]
    result.append([resample.odd_size_within(p) for p in np.arange(1.0, 30.0, 0.35)])
    samples = rng.uniform(0, 1, (5, 7))
    for first, order in product((0, 1), (0, 1, 3)):
        result.append(_sums(hexagonal_to_rectangular(samples, first, order=order)))
        result.append(_sums(hexagonal_to_rectangular(samples[:, :6], first, 0.8, order=order)))
    for lenses, order in ((1, 0), (1, 1), (2, 1), (3, 3), (4, 3)):
        result.append(
            tried(
                lambda n, k: _sums(hexagonal_to_rectangular(samples[:, :n], 0, order=k)),
                lenses,
                order,
            )
        )
    return result


def _sums(picture: np.ndarray) -> list[Any]:
    """Shape and sums of a picture."""
    values = picture.astype(np.float64)
    weights = np.arange(values.size).reshape(values.shape) % 17
    return [
        *picture.shape,
        float(values.sum()),
        float((values * weights).sum()),
        float((values**2).sum()),
    ]


def signal_of(white: np.ndarray, dark: np.ndarray | None = None) -> float:
    return float(frames.white_signal(white, dark, where="white", dark_where="dark").sum())


def frame_steps() -> Any:
    rng = np.random.default_rng(12)
    base = rng.integers(0, 12, (12, 12)).astype(np.uint8)
    result: list[Any] = []
    colour = np.stack([base, base // 2, base // 3], axis=2)
    result.append(frames.grey(colour).sum())
    for top, side, count in product((15, 16, 17, 255), (11, 12), (1, 2, 70, 74)):
        image = base.copy()
        image.ravel()[:count] = top
        result.append(tried(signal_of, image[:side]))
        result.append(frames.clipped_level(image, image.astype(np.float32)))
    words = (base.astype(np.uint16) * 340).clip(0, 4095)
    words.ravel()[:9] = 4095
    for largest, scale in product((1023, 4095, 16383, 65535, 4000), (None, 4095, 65535, 3000)):
        image = np.where(words == 4095, largest, words).astype(np.uint16)
        result.append(
            [frames.clipped_share(image, scale), frames.clipped_level(image, image * 1.0, scale)]
        )
        both = np.stack([image, image // 2, image], axis=2)
        result.append(frames.clipped_share(both, scale))
    signal = words.astype(np.float32)
    few = np.zeros((50, 100), np.uint8)
    for count in (9, 10, 11):
        few.ravel()[:count] = 255
        result.append(frames.clipped_level(few, np.arange(5000, dtype=np.float32).reshape(50, 100)))
    dark = np.full((12, 12), 100, np.uint16)
    result.append(tried(signal_of, words, dark))
    result.append(tried(signal_of, dark, dark + 5))
    result.append(tried(signal_of, dark, dark[:5]))
    result.append([float(signal.sum()), frames._size(words[:5])])
    return result


def thesis_steps(image: np.ndarray) -> Any:
    found = thesis_calibration(frames.grey(image))
    line = thesis_method.regression(np.array([[1.0, 0.0], [3.5, 1.0], [5.0, 2.0]]))
    turned = thesis_method.rotated(np.array([[3.0, 9.0]]), 20.0, (10, 30))
    one = thesis_calibration(np.eye(3, dtype=np.float32) * 9)
    flat = thesis_method.normalised(np.ones((2, 2), np.float32), 100)
    whole = [found.row, found.rotation_degrees, found.pitch, found.centroids.sum(axis=0)]
    ramp = thesis_method.normalised(np.arange(4, dtype=np.float32), 9)
    return [*whole, line, turned, one.row, one.pitch, flat, ramp]


def pixel_steps(images: list[np.ndarray]) -> Any:
    """Grids fitted to pixels, all centres alike between them."""
    result = []
    for image, square in zip(images, (True, False), strict=True):
        layout = "rectangular" if square else "hexagonal-rows"
        grid = regular_grid(image.shape, 4.0, layout=layout, offset=(0.3, -0.2))  # type: ignore[arg-type]
        t, s = (n.ravel() for n in np.mgrid[-5:6, -5:6])
        lattice_places = grid.lattice(t, s)
        places = grid.positions(lattice_places)
        terms = np.zeros((len(t), 2, 6))
        terms[:, 0, 0] = terms[:, 1, 1] = 1.0
        for axis in (0, 1):
            terms[:, axis, 2 + axis] = lattice_places[:, 0]
            terms[:, axis, 4 + axis] = lattice_places[:, 1]
        weights = np.where(np.arange(len(t)) % 9 == 0, 0.0, 1.0)
        found = pixels.pixel_fit(
            np.pad(image.astype(np.float32) / 1000, 6, mode="edge"), 6,
            lattice.primitive_vectors(grid), places + 6 + 0.05, terms, np.full(6, 0.002), weights,
            square=square,
        )  # fmt: skip
        result += [found.factors, np.sqrt(np.diagonal(found.covariance))]
    return result


def drawn_small(layouts: Any = ("rectangular", "hexagonal-rows")) -> list[np.ndarray]:
    return [
        white_image(
            (60, 64), regular_grid((60, 64), 4.0, layout=layout, offset=(0.3, -0.2)), radius=0.4
        )
        for layout in layouts
    ]


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


def bent_grid(order: int) -> Grid:
    """A grid of an order, almost even."""
    terms = [(0.01, -0.01)] * ((order + 1) * (order + 2) // 2)
    terms[:3] = [(20.0, 20.0), (9.0, 0.1), (-0.1, 9.0)]
    return Grid(
        layout="rectangular", order=order, middle=(0.0, 0.0), scale=1.0, coefficients=tuple(terms)
    )


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
    return [n for part in [*result, [distance, *spot]] for n in _flat(part)]


CASES: dict[str, Case] = {
    "steps: checks": step(check_steps),
    "steps: lit": step(lit_steps),
    "steps: corrected": step(corrected_steps),
    "steps: numbers": step(enough_steps),
    "steps: lattices": step(lattice_steps),
    "steps: light": step(light_steps),
    "steps: windows": step(window_steps),
    "steps: redrawn": step(redrawn_steps),
    "steps: robust": step(robust_steps),
    "steps: places": step(place_steps),
    "steps: models": step(model_steps),
    "steps: spots": step(spot_steps),
    "steps: frames": step(frame_steps),
    "steps: pictures": Case(lambda: [mixed(0.42), mixed(0.4, "hexagonal-rows")], picture_steps),
    "steps: pixels": Case(drawn_small, pixel_steps),
    "steps: resampled": step(resampled),
    "steps: focus": Case(drawn_spots, focus_steps),
    "steps: thesis": Case(
        lambda: white_image((90, 100), regular_grid((90, 100), 9.3, rotation_degrees=1.0)),
        thesis_steps,
    ),
    "bent: even": step(lambda: bent_lenses(8, 9)),
    "bent: all": step(lambda: bent_lenses(14, 13, tilt=(0.02, -0.03), bend=0.015)),
    "bent: pulled": step(lambda: bent_lenses(12, 15, bend=-0.02, pulled=True, pitch=4.0)),
    "bent: few": step(lambda: bent_lenses(5, 6, tilt=(0.02, 0.0))),
    "bent: order 3": step(lambda: bent_lenses(11, 12, order=3, layout="hexagonal-rows")),
    "bent: order 2": step(lambda: bent_lenses(7, 7, order=2, tilt=(0.03, 0.02))),
    "bent: many": step(lambda: bent_lenses(64, 64, bend=0.003, noise=0.1)),
    "lattices: rectangular": Case(lambda: mixed(0.42), guessed),
    "lattices: hexagonal": Case(lambda: mixed(0.42, "hexagonal-columns"), guessed),
    "lattices: long": Case(
        lambda: white_image((28, 1100), regular_grid((28, 1100), 5.3, rotation_degrees=0.4)),
        guessed,
    ),
    "lattices: overlapping": Case(lambda: mixed(0.62), guessed),
    "inspected: gaps": Case(lambda: mixed(0.36), inspected),
    "inspected: touching": Case(lambda: mixed(0.5, "hexagonal-rows"), inspected),
    "inspected: overlapping": Case(lambda: mixed(0.8), inspected),
    "inspected: uneven": white((90, 90), 9.3, 1.0, change=without(0.3, 0.8)),
    "refused: overlaps": Case(lambda: mixed(0.6), calibrated),
    "hexagonal rows": white((90, 92), 9.1, -2.0, "hexagonal-rows", shading=0.8),
    "hexagonal columns": white((80, 92), 8.4, 3.0, "hexagonal-columns", noise=0.05),
    "pitch 4, hexagonal": white((84, 90), 4.0, 0.0, "hexagonal-rows", radius=0.4),
    "pitch 18": white((120, 130), 18.2, 1.0, noise=0.02),
    "pitch 20, hexagonal": white((130, 150), 20.3, 1.0, "hexagonal-columns", shading=0.7),
    "pitch 18, spots": white((110, 120), 18.4, 0.3, form="spot", radius=0.1),
    "barrel": bent((90, 150), 9.3, bend=-0.02, rotation_degrees=0.6, offset=(0.7, 2.1)),
    "tilt": bent((90, 100), 8.3, tilt=(0.03, 0.01), rotation_degrees=1.0),
    "order 2": white((84, 92), 8.3, 1.0, options={"order": 2}),
    "as hexagonal": white((84, 92), 8.3, 1.0, options={"layout": "hexagonal-rows"}),
    "few": white((60, 60), 10.4, 2.0),
    "missing, grey ground": white(
        (90, 99), 9.0, 0.4, level=0.7, change=lambda image: without(0.2)(image) + np.uint16(4000)
    ),
    "missing": white((90, 99), 9.0, 0.4, change=without(0.2)),
    "dark rows": white((90, 99), 9.0, 0.0, change=striped(9, 0.3)),
    "fading": white((70, 140), 7.3, 0.5, change=fading(0.0)),
    "clipped": white((90, 100), 8.8, 1.0, shading=0.7, change=clipping(1.5)),
    "dark frame and colours": white((80, 90), 9.3, 1.0, change=with_dark),
    "eight bits": white((80, 90), 8.3, 1.0, bits=8, level=0.3, noise=0.1),
    "scattered by 6 %": scattered(0.06, 84),
    "scattered by 10 %": scattered(0.1, 84),
    "scattered by 13 %": scattered(0.13, 84),
    "few, scattered by 2 %": scattered(0.02, 58, 1),
    "few, scattered by 3 %": scattered(0.03, 58, 1),
    "noise": Case(
        lambda: np.random.default_rng(0).integers(0, 255, (80, 80)).astype(np.uint8), calibrated
    ),
    "pitch 2.6": white((80, 90), 2.6, 0.3),
    "strip": white((32, 110), 9.3, 0.3),
}
for seed in (2, 5, 8, 10, 16):
    CASES[f"drawn {seed}"] = Case(lambda seed=seed: drawn_white(seed, 12000).image, calibrated)
for seed in (3, 5, 9, 16):
    CASES[f"distorted {seed}"] = Case(
        lambda seed=seed: distorted_white(seed, 12000).image, calibrated
    )
