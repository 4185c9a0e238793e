# SPDX-License-Identifier: Apache-2.0
"""Steps of the record that make or measure pictures."""

from itertools import product
from typing import Any

import numpy as np
from recorded_drawn import LAYOUTS, flat, signal_of, tried

from plenofir.camera.calibration import (
    calibrate,
    calibration_of_grid,
    decode,
    focus_score,
    frames,
    hexagonal_to_rectangular,
    infinity_focus,
    inspect_white,
    largest_odd_size,
    lattice,
    measure_spots,
    pictures,
    pixels,
    resample,
    thesis_calibration,
    thesis_method,
)
from plenofir.camera.calibration import (
    spots as spot_sizes,
)
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.rays.measured import measure_pupil
from plenofir.camera.synthetic import regular_grid, white_image


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
    return [n for part in result for n in flat(part)]


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
