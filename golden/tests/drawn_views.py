# SPDX-License-Identifier: Apache-2.0
"""Views of planes with known disparities, drawn with exact parallax between pixels."""

import numpy as np


def texture(x: np.ndarray, y: np.ndarray, seed: int) -> np.ndarray:
    """Smooth colours from 0 to 1 at any place."""
    rng = np.random.default_rng(seed)
    levels = np.tile(rng.uniform(0.35, 0.65, 3), (*x.shape, 1))
    for _ in range(20):
        wave, turn, phase = rng.uniform(0.05, 0.9), *rng.uniform(0, 2 * np.pi, 2)
        angle = wave * (x * np.cos(turn) + y * np.sin(turn)) + phase
        levels += rng.uniform(-0.09, 0.09, 3) * np.sin(angle)[..., np.newaxis]
    return np.clip(levels, 0, 1)


def drawn(
    rows: int, columns: int, size: tuple[int, int] = (48, 64), step: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Views (rows, columns, t, s, 3) of 8 bit, and the disparity of the view in the middle.

    Behind at -1 `step`, a disc of 0 and one of +1 `step` in front.
    """
    height, width = size
    y, x = np.mgrid[:height, :width].astype(float)
    discs = ((0.0, 0.30, 0.45, 0.2, 2), (1.0, 0.70, 0.60, 0.25, 3))
    views = np.empty((rows, columns, height, width, 3), np.uint8)
    for v, u in np.ndindex(rows, columns):
        right, down = step * (u - columns // 2), step * (v - rows // 2)
        image = texture(x - right, y - down, 1)
        for disparity, cx, cy, radius, seed in discs:
            px, py = x + disparity * right, y + disparity * down
            distance = np.hypot(px - cx * width, py - cy * height)
            share = np.clip(radius * height - distance + 0.5, 0, 1)[..., np.newaxis]
            image = image * (1 - share) + texture(px, py, seed) * share
        views[v, u] = np.rint(255 * image)
    truth = np.full(size, -step)
    for disparity, cx, cy, radius, _ in discs:
        truth[np.hypot(x - cx * width, y - cy * height) < radius * height] = disparity * step
    return views, truth


def snr(found: np.ndarray, true: np.ndarray) -> float:
    """Peak signal to noise ratio of 8 bit in dB."""
    error = float(((found.astype(float) - true) ** 2).mean())
    return float(10 * np.log10(255**2 / max(error, 1e-9)))


def fourier(rows: int, columns: int, hexagonal: bool) -> np.ndarray:
    """Round pictures of points at several depths, dark between."""
    rng = np.random.default_rng(5)
    pitch, radius = 130, 56
    size = rows * pitch, columns * pitch
    y, x = np.mgrid[: size[0], : size[1]].astype(float)
    points = rng.uniform(-40, 40, (50, 2))
    depths = rng.uniform(-1, 1, 50)
    image = np.zeros(size)
    for v, u in np.ndindex(rows, columns):
        aside = 0.5 * pitch * (hexagonal and v % 2)
        cy, cx = (v + 0.5) * pitch - 0.5, (u + 0.5) * pitch + aside - 0.5
        if cx + radius > size[1]:
            continue
        seen = np.full(size, 0.08)
        for (py, px), depth in zip(points, depths, strict=True):
            down, right = (v - rows // 2), (u - columns // 2)
            away = (y - cy - py + depth * down) ** 2 + (x - cx - px + depth * right) ** 2
            seen += 0.8 * np.exp(-away / 12)
        image = np.where(np.hypot(y - cy, x - cx) < radius, seen, image)
    return np.rint(np.clip(image, 0, 1) * 65535).astype(np.uint16)
