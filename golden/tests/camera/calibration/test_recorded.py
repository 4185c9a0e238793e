# SPDX-License-Identifier: Apache-2.0
"""Whole calibrations of drawn white images give what they gave before.

The other tests tell what is right. These tell that a change alters results: if it is meant to, say
why, and record anew with ``python golden/tests/camera/calibration/test_recorded.py``.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from distorted_white import distorted_centres, distorted_white, ideal_white, spots

from plenofir.camera.calibration import calibrate
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import regular_grid, white_image

RECORD = Path(__file__).with_suffix(".json")
# Rounding differs between processors, and with the order of sums.
SHARE, LEAST = 1e-4, 1e-5


def white(
    shape: tuple[int, int], pitch: float, rotation: float = 0.0, layout: Any = "rectangular", **how
) -> np.ndarray:
    """A white image of a regular grid."""
    offset = (0.3, -0.2)
    grid = regular_grid(shape, pitch, rotation_degrees=rotation, layout=layout, offset=offset)
    return white_image(shape, grid, **how)


def patched(image: np.ndarray, share: float) -> np.ndarray:
    """A share of the squares of 9 pixels as good as dark."""
    dark = np.random.default_rng(4).random([n // 9 + 1 for n in image.shape]) < share
    lit = 1 - np.kron(dark, np.ones((9, 9)))[: image.shape[0], : image.shape[1]]
    return (image * lit).astype(image.dtype)


def scattered(share: float, side: int) -> np.ndarray:
    """Lenses that are off by a share of the pitch."""
    centres = distorted_centres((side, side), 9.3)
    centres = centres + np.random.default_rng(0).normal(0, 9.3 * share, centres.shape)
    light = np.clip(spots((side, side), centres, 2.8, 0.7), 0, 1)
    return np.rint(50000 * light).astype(np.uint16)


def coloured() -> dict[str, Any]:
    """In colours, with a dark frame."""
    image = white((80, 90), 9.3, 1.0)
    colours = np.stack([image // 2, image // 3, image // 4], axis=2) + 900
    dark = np.random.default_rng(1).integers(850, 950, colours.shape)
    return {"white": colours.astype(np.uint16), "dark": dark.astype(np.uint16)}


# What `calibrate` gets; an image alone is the white one.
CASES: dict[str, Callable[[], Any]] = {
    "hexagonal rows": lambda: white((90, 92), 9.1, -2.0, "hexagonal-rows", shading=0.8),
    "hexagonal columns": lambda: white((80, 92), 8.4, 3.0, "hexagonal-columns", noise=0.05),
    "pitch 4": lambda: white((84, 90), 4.0, 0.0, "hexagonal-rows", radius=0.4),
    "pitch 20": lambda: white((130, 150), 20.3, 1.0, "hexagonal-columns", shading=0.7),
    "spots": lambda: white((110, 120), 18.4, 0.3, form="spot", radius=0.1),
    "few": lambda: white((60, 60), 10.4, 2.0),
    "strip": lambda: white((32, 110), 9.3, 0.3),
    "order 2": lambda: {"white": white((84, 92), 8.3, 1.0), "order": 2},
    "as hexagonal": lambda: {"white": white((84, 92), 8.3, 1.0), "layout": "hexagonal-rows"},
    "eight bits": lambda: white((80, 90), 8.3, 1.0, bits=8, level=0.3, noise=0.1),
    "missing, grey ground": lambda: patched(white((90, 99), 9.0, 0.4, level=0.7), 0.2) + 4000,
    "fading": lambda: (white((70, 140), 7.3, 0.5) * np.linspace(0, 1, 140)).astype(np.uint16),
    "clipped": lambda: np.minimum(white((90, 100), 8.8, 1.0, shading=0.7) * 1.5, 65535).astype(
        np.uint16
    ),
    "dark frame and colours": coloured,
    "barrel": lambda: ideal_white((90, 150), 9.3, bend=-0.02, rotation_degrees=0.6).image,
    "tilt": lambda: ideal_white((90, 100), 8.3, tilt=(0.03, 0.01)).image,
    "distorted 9": lambda: distorted_white(9, 12000).image,
    "distorted 16": lambda: distorted_white(16, 12000).image,
    "scattered by 2 %": lambda: scattered(0.02, 58),
    "scattered by 13 %": lambda: scattered(0.13, 84),
    "overlaps": lambda: white((84, 92), 9.3, 0.7, radius=0.6, mixed=True),
    "pitch 2.6": lambda: white((80, 90), 2.6, 0.3),
}


def result(name: str) -> dict[str, Any]:
    """What reports tell of a calibration, and the centres in its corners, or its refusal."""
    given = CASES[name]()
    try:
        made = calibrate(**(given if isinstance(given, dict) else {"white": given}))
    except InputError as error:
        return {"refused": error.problem}
    grid, evidence = made.grid, made.evidence
    assert evidence is not None
    corners = np.ix_((0, -1), (0, -1))
    values = {
        "order": grid.order, "pitch": grid.pitch, "rotation": grid.rotation_degrees,
        "lenses": made.lenses, "used": made.used, "residual": made.residual_px,
        "missing": len(made.missing), "uneven": len(made.uneven), "clipped": made.clipped_share,
        "dark": made.dark_level, "light": made.lens_brightness[corners],
        "corners": made.model_centres[corners], **evidence.model_dump(),
    }  # fmt: skip
    flat = {key: [float(f"{x:.6g}") for x in np.ravel(value)] for key, value in values.items()}
    return {"layout": grid.layout, **flat}


@pytest.mark.parametrize("name", CASES)
def test_results_are_as_recorded(name: str) -> None:
    recorded = json.loads(RECORD.read_text())
    assert recorded.keys() == CASES.keys()
    made = result(name)
    assert made.keys() == recorded[name].keys()
    for key, value in recorded[name].items():
        same = value if isinstance(value, str) else pytest.approx(value, rel=SHARE, abs=LEAST)
        assert made[key] == same, key


if __name__ == "__main__":
    lines = [f"{json.dumps(name)}: {json.dumps(result(name))}" for name in CASES]
    RECORD.write_text("{\n" + ",\n".join(lines) + "\n}\n")
