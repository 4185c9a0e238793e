# SPDX-License-Identifier: Apache-2.0
"""What the record draws: white images with damage and light, and how they are run."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from distorted_white import distorted_centres, ideal_white, spots
from recorded import Case

from plenofir.camera.calibration import (
    calibrate,
    frames,
    inspect_white,
)
from plenofir.camera.calibration.grid import Grid
from plenofir.camera.synthetic import regular_grid, white_image
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


def flat(value: Any) -> Iterator[Any]:
    if isinstance(value, list | tuple):
        for part in value:
            yield from flat(part)
    elif isinstance(value, np.ndarray):
        yield from value.ravel().tolist()
    else:
        yield value


def signal_of(white: np.ndarray, dark: np.ndarray | None = None) -> float:
    return float(frames.white_signal(white, dark, where="white", dark_where="dark").sum())


def drawn_small(layouts: Any = ("rectangular", "hexagonal-rows")) -> list[np.ndarray]:
    return [
        white_image(
            (60, 64), regular_grid((60, 64), 4.0, layout=layout, offset=(0.3, -0.2)), radius=0.4
        )
        for layout in layouts
    ]


def bent_grid(order: int) -> Grid:
    """A grid of an order, almost even."""
    terms = [(0.01, -0.01)] * ((order + 1) * (order + 2) // 2)
    terms[:3] = [(20.0, 20.0), (9.0, 0.1), (-0.1, 9.0)]
    return Grid(
        layout="rectangular", order=order, middle=(0.0, 0.0), scale=1.0, coefficients=tuple(terms)
    )
