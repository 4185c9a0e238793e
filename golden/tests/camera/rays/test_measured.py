# SPDX-License-Identifier: Apache-2.0
"""Pupils measured on synthetic white images whose pupils are known."""

import re
from math import inf, isnan
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.camera.calibration import Calibration, calibrate
from plenofir.camera.rays import (
    Camera,
    MeasuredPupil,
    RayModel,
    load_camera,
    measure_pupil,
    measured_focal_length,
)
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import write_png
from plenofir_studies.synthetic import micro_image_pitch, regular_grid, render, white_image

F193 = load_camera("f193-mla2")


def measured(model: RayModel, found: Calibration) -> MeasuredPupil:
    assert found.evidence is not None
    assert found.evidence.pitch_error_px is not None
    return measure_pupil(model, found.grid.lens_pitch, found.evidence.pitch_error_px)


def white_of(model: RayModel, **how: object) -> np.ndarray:
    return render(model, [], (18, 22), radius=0.45, noise=0.01, **how).white  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("camera", "focus", "how"),
    [
        ("f197-mla2", inf, {"rotation_degrees": 0.3, "shading": 0.3}),
        ("f193-mla1", 1500.0, {"layout": "hexagonal-rows", "offset": (0.3, -0.4)}),
    ],
)
def test_exit_pupil_of_synthetic_cameras(camera: str, focus: float, how: dict) -> None:
    model = RayModel.focused(load_camera(camera), focus, 13)
    found = measured(model, calibrate(white_of(model, **how)))
    print(camera, focus, how, found)
    assert found.agrees
    assert abs(found.distance_mm - model.exit_pupil_mm) < 4 * found.error_mm
    assert found.error_mm < 0.005 * found.distance_mm


@pytest.mark.slow
def test_standard_errors_are_honest() -> None:
    model = RayModel.focused(load_camera("f197-mla2"), inf, 11)
    pitch = micro_image_pitch(model)
    off = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        shape = 180, 210
        grid = regular_grid(
            shape, pitch, rotation_degrees=rng.uniform(-2, 2), offset=tuple(rng.uniform(0, 9, 2))
        )
        found = measured(model, calibrate(white_image(shape, grid, noise=0.05, seed=seed)))
        off.append((found.distance_mm - model.exit_pupil_mm) / found.error_mm)
    print("deviations in standard errors, seeds 0 to 19:", np.round(off, 2))
    print("root mean square:", np.sqrt(np.mean(np.square(off))))
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.5


def test_another_exit_pupil_is_noticed() -> None:
    lens = F193.main_lens.model_copy(update={"exit_pupil_mm": 95.0})
    camera = F193.model_copy(update={"main_lens": lens})
    told, true = (RayModel.focused(c, inf, 13) for c in (F193, camera))
    found = measure_pupil(told, micro_image_pitch(true), 1e-5)
    assert not found.agrees
    assert found.distance_mm == pytest.approx(95.0)
    assert found.deviation_percent == pytest.approx(100 * (95.0 / 111.0324 - 1))
    # With such micro lenses the camera's data would be right.
    array = F193.micro_lenses.model_copy(update={"pitch_mm": found.micro_lens_pitch_mm})
    other = RayModel.focused(F193.model_copy(update={"micro_lenses": array}), inf, 13)
    assert measure_pupil(other, micro_image_pitch(true), 1e-5).agrees


def test_entrance_pupil_with_the_lens_reversed() -> None:
    model = RayModel.focused(F193, 3000.0, 13)
    reversed_model = RayModel.focused(F193.reversed(), 5000.0, 13)
    # Seen from the object-side focal point: Newton's equation against Eqs. 3.52 and 3.53.
    front = model.image_distance_mm + F193.main_lens.principal_plane_separation_mm
    from_plane = model.entrance_pupil_mm - front
    assert F193.reversed().main_lens.exit_pupil_mm == pytest.approx(
        F193.main_lens.focal_length_mm - from_plane
    )
    pupils = [measure_pupil(m, micro_image_pitch(m), 1e-5) for m in (model, reversed_model)]
    length, error = measured_focal_length(model, pupils[0], reversed_model, pupils[1])
    assert length == pytest.approx(F193.main_lens.focal_length_mm)
    assert 0 < error < 0.5
    assert F193.reversed().reversed().main_lens.exit_pupil_mm == pytest.approx(111.0324)


def test_listing_of_the_page(tmp_path: Path) -> None:
    """What docs/ray-model.md shows of two white images: the same words, and numbers to 0.02 %."""
    page = (project.root() / "docs/ray-model.md").read_text()
    (how,) = re.findall(r"render\(model, \[\], (.*)\)\.white", page)
    (shown,) = re.findall(r"(?:^    (?:pitch|pupils|  |focal length) .*\n)+", page, flags=re.M)
    camera = load_camera("f197-mla2")
    for name, one in (("white", camera), ("reversed", camera.reversed())):
        names = {"render": render, "model": RayModel.focused(one, np.inf, 11)}
        white = eval(f"render(model, [], {how})", names).white
        write_png(tmp_path / f"{name}.png", white)
    printed = plenofir(
        *("calibrate", str(tmp_path / "white.png"), "--camera", "f197-mla2"),
        *("--reversed-lens", str(tmp_path / "reversed.png"), "--out", str(tmp_path / "c.json")),
    ).stdout
    number = re.compile(r"(?:(standard error) )?(\d+\.\d+)")
    for line in shown.splitlines():
        words = number.sub("#", line.strip())
        (same,) = (
            other for other in printed.splitlines() if number.sub("#", other).strip() == words
        )
        pairs = zip(number.findall(line), number.findall(same), strict=True)
        for (error, wanted), (_, found) in pairs:
            margin = {"rel": 0.2, "abs": 1e-5} if error else {"rel": 2e-4}
            assert float(found) == pytest.approx(float(wanted), **margin), line
    assert len(shown.splitlines()) == 4


def test_pupils_at_infinity_and_behind_the_sensor() -> None:
    model = RayModel.focused(F193, inf, 13)
    equal = F193.micro_lenses.pitch_mm / F193.sensor.pixel_pitch_mm
    far, behind = (measure_pupil(model, equal * k, 1e-4) for k in (1.0, 0.99))
    assert far.distance_mm == inf
    assert behind.distance_mm < 0
    assert not far.agrees
    assert not behind.agrees
    assert all(isnan(n) for n in measured_focal_length(model, behind, model, far))
    assert all(isnan(n) for n in measured_focal_length(model, far, model, far))


def test_white_image_of_another_camera() -> None:
    model = RayModel.focused(F193, inf, 13)
    for pitch in (11.0, 34.0, float("nan")):
        with pytest.raises(InputError, match="f193-mla2"):
            measure_pupil(model, pitch, 0.001)


def test_cameras_that_cannot_be_reversed() -> None:
    for change in ({"exit_pupil_mm": inf}, {"exit_pupil_mm": 1e-20, "focal_length_mm": 1e20}):
        lens = F193.main_lens.model_copy(update=change)
        camera: Camera = F193.model_copy(update={"main_lens": lens})
        with pytest.raises(InputError, match="exit_pupil_mm"):
            camera.reversed()
