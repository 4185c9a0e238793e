# SPDX-License-Identifier: Apache-2.0
"""Focused captures of the synthetic camera, against rays through thin lenses and the ray model."""

import numpy as np
import pytest

from plenofir.camera.calibration.grid import Layout
from plenofir.camera.calibration.types_of_lenses import usual_order
from plenofir.camera.rays import Camera, RayModel, blur_px, load_camera, setting_of_virtual_depth
from plenofir_studies.synthetic import TexturedPlane, render
from plenofir_studies.synthetic.pattern import regular_grid

R12 = load_camera("raytrix-r12")
MODEL = RayModel.focused(R12, 463.54174, 23)
KEPLERIAN = Camera.model_validate(
    {
        **R12.model_dump(),
        "name": "Keplerian",
        "micro_lenses": {
            "focal_length_mm": [0.27, 0.25, 0.23],
            "pitch_mm": R12.micro_lenses.pitch_mm,
            "sensor_distance_mm": R12.micro_lenses.spacing_mm,
        },
    }
)


@pytest.mark.parametrize("layout", ["hexagonal-rows", "hexagonal-columns"])
@pytest.mark.parametrize("offset", [0, 1])
def test_lenses_of_one_type_are_no_neighbours(layout: Layout, offset: int) -> None:
    grid = regular_grid((200, 200), 1.0, layout=layout).moved(offset, 0)
    t, s = np.mgrid[-4:5, -4:5]
    types = usual_order(grid, t, s, 3).ravel()
    centres = grid.centres(t, s).reshape(-1, 2)
    apart = np.sqrt(((centres[:, np.newaxis] - centres) ** 2).sum(axis=-1))
    same = types[:, np.newaxis] == types
    assert apart[same & (apart > 0)].min() == pytest.approx(np.sqrt(3))
    assert sorted(set(types.tolist())) == [0, 1, 2]


def edge_widths(model: RayModel, depth: float, layout: Layout) -> tuple[list[float], float]:
    """Of a step on a plane: its blur under each type in pixels, and how it moves between lenses."""
    a = float(setting_of_virtual_depth(model, depth))
    distance = float(model.distance(a).mm)
    step = np.zeros((501, 801))
    step[:, 401:] = 1
    capture = render(
        model,
        [TexturedPlane(step, distance, 16.0)],
        (1, 9),
        layout=layout,
        form="square",
        radius=9.0,
        level=1.0,
    )
    row = {}
    grid, types = capture.grid, len(model.camera.micro_lenses.focal_lengths_mm)
    widths: list[list[float]] = [[] for _ in range(types)]
    for s in range(-4, 5):
        y, x = grid.centres(0, s)
        part = round(y), slice(round(x) - 10, round(x) + 11)
        values = capture.raw[part] / capture.white[part]
        # Only lenses that see all of the edge.
        if min(values[0], values[-1]) > 1e-3 or max(values[0], values[-1]) < 1 - 1e-3:
            continue
        slope = np.abs(np.diff(values))
        places = np.arange(len(slope)) + 0.5 + round(x) - 10 - x
        middle = (slope * places).sum() / slope.sum()
        variance = (slope * (places - middle) ** 2).sum() / slope.sum()
        row[s] = middle
        # Of boxes as wide as the blur and a pixel; differences of samples add one more.
        number = int(usual_order(grid, np.array(0), np.array(s), types))
        widths[number].append(12 * variance - 2)
    moved = np.mean([row[s + 1] - row[s] for s in row if s + 1 in row])
    return [float(np.sqrt(max(0.0, np.mean(w)))) if w else np.nan for w in widths], float(moved)


@pytest.mark.parametrize(("camera", "depth"), [(R12, 5.0), (R12, 3.6), (KEPLERIAN, -5.0)])
def test_blur_and_displacement_are_those_of_the_ray_model(camera: Camera, depth: float) -> None:
    """An edge on a plane: as wide as each type blurs it, and moved by 1 / a to the next lens."""
    model = RayModel.focused(camera, 463.54174, 23)
    a = float(setting_of_virtual_depth(model, depth))
    layout: Layout = "hexagonal-rows" if camera is R12 else "rectangular"
    widths, moved = edge_widths(model, depth, layout)
    assert moved == pytest.approx(-1 / a, rel=0.02)
    for width, wanted in zip(widths, blur_px(model, a), strict=True):
        if not np.isnan(width):
            assert width == pytest.approx(float(wanted), abs=0.35)
    assert np.isfinite(widths).sum() >= 2
