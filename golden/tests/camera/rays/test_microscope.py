# SPDX-License-Identifier: Apache-2.0
"""Microscopes: heights of their planes against views one by one, and against what is published."""

from math import asin, degrees
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.camera.rays import (
    Microscope,
    MicroscopeModel,
    load_instrument,
    microscope_names,
)
from plenofir.ground.errors import InputError

TEXT = """
name = "drawn"
[objective]
magnification = {magnification}
numerical_aperture = {aperture}
immersion_index = {index}
[micro_lenses]
pitch_mm = {pitch}
focal_length_mm = {focal}
[sensor]
pixel_pitch_mm = {pixel}
"""


def shipped(name: str) -> Microscope:
    found = load_instrument(name)
    assert isinstance(found, Microscope)
    return found


def at_index(microscope: Microscope, index: float) -> Microscope:
    """The microscope with its object in another medium."""
    objective = microscope.objective.model_copy(update={"immersion_index": index})
    return microscope.model_copy(update={"objective": objective})


def um_per_a(microscope: Microscope, m: int) -> float:
    """dz/da by the moves of many views, each traced by the sine condition."""
    objective, lenses = microscope.objective, microscope.micro_lenses
    u = np.linspace(-m / 2, m / 2, 401)
    right, down = np.meshgrid(u, u)
    slope = microscope.sensor.pixel_pitch_mm / lenses.focal_length_mm
    far = np.hypot(right, down)
    sine = far * slope * objective.real_magnification / objective.immersion_index
    inside = (far <= m / 2) & (far > 0)
    inside &= sine <= objective.numerical_aperture / objective.immersion_index
    tangent = np.tan(np.arcsin(sine[inside])) * right[inside] / far[inside]
    # Micro lenses by which a view moves for each um.
    moves = tangent * objective.real_magnification / (1000 * lenses.pitch_mm)
    return float((right[inside] ** 2).sum() / (moves * right[inside]).sum())


def test_heights_by_single_views(tmp_path: Path) -> None:
    seed = int(np.random.default_rng().integers(1 << 31))
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    models = [MicroscopeModel(shipped(name), 15) for name in microscope_names()]
    for number in range(6):
        index = rng.uniform(1, 1.52)
        file = tmp_path / f"{number}.toml"
        text = TEXT.format(
            magnification=rng.uniform(4, 63),
            aperture=index * rng.uniform(0.05, 0.95),
            index=index,
            pitch=rng.uniform(0.05, 0.2),
            focal=rng.uniform(1, 4),
            pixel=rng.uniform(0.003, 0.009),
        )
        file.write_text(text)
        found = load_instrument(file)
        assert isinstance(found, Microscope)
        # As many pixels as are lit.
        objective = found.objective
        lit = 2 * objective.numerical_aperture * found.micro_lenses.focal_length_mm
        lit /= objective.real_magnification * found.sensor.pixel_pitch_mm
        models.append(MicroscopeModel(found, max(2, round(lit))))
    for model in models:
        truth = um_per_a(model.microscope, model.micro_image_size)
        assert model.um_per_a == pytest.approx(truth, rel=3e-3), model
        assert model.focus_setting(model.height_um(0.3)) == pytest.approx(0.3)


def test_published_ranges_and_angles() -> None:
    """Figures of the microscopes' makers, with objects under glass (n = 1.5) as they had them."""
    levoy = shipped("lfm-levoy-25x")
    # "35 degrees of angular parallax on the specimen ... after accounting for refraction".
    seen = MicroscopeModel(at_index(levoy, 1.5), 15)
    assert 2 * degrees(asin(seen.outermost_sine)) == pytest.approx(35, abs=0.5)
    # "... 180 microns of this range (in theory ...)": a = -1 to 1.
    assert 2 * seen.um_per_a == pytest.approx(180, rel=0.04)
    # The volumes of Wagner et al. go from -156 to 156 um: a = -1 to 1 again.
    wagner = MicroscopeModel(shipped("lfm-wagner-22x"), 19)
    assert wagner.um_per_a == pytest.approx(156, rel=0.01)


def test_borders_are_those_of_the_ray_model() -> None:
    """Small angles: heights are the ray model's image distances over V^2 / n."""
    levoy = shipped("lfm-levoy-25x")
    small = levoy.objective.model_copy(update={"numerical_aperture": 0.001})
    model = MicroscopeModel(levoy.model_copy(update={"objective": small}), 15)
    slope, pitch = 0.0083333333 / 2.5, 125.0
    for a in (-0.4, 0.0, 0.7):
        ends = [(a * 14 + k) * pitch / ((14 - k) * slope) / 25**2 for k in (-1, 1)]
        assert model.depth_of_field_um(a) == pytest.approx(ends, rel=1e-6)
    assert model.pixel_um == pytest.approx(125 / 15 / 25)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("numerical_aperture = 0.45", "numerical_aperture = 1.0", "must be below immersion_index"),
        ("magnification = 25", "magnification = 0", "should be greater than 0"),
        ("magnification = 25", "magnification = nan", "magnification"),
        ("magnification = 25", "made_for_tube_lens_mm = 200\nmagnification = 25", "is missing"),
        ("focal_length_mm = 2.5", "focal_length_mm = 2.5\nf_number = 20", "not both"),
        ("focal_length_mm = 2.5", "f_number = '20'", "must be numbers"),
        ("focal_length_mm = 2.5", "", "micro_lenses.focal_length_mm is missing"),
        ("[sensor]", "[sensor]\nrelay = 1", "there is no field"),
    ],
)
def test_bad_descriptions(tmp_path: Path, old: str, new: str, said: str) -> None:
    from plenofir.camera.rays.camera import MICROSCOPES

    text = (MICROSCOPES / "lfm-levoy-25x.toml").read_text()
    assert old in text
    file = tmp_path / "m.toml"
    file.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=said):
        load_instrument(file)


def test_tube_lens_and_f_number(tmp_path: Path) -> None:
    from plenofir.camera.rays.camera import MICROSCOPES

    text = (MICROSCOPES / "lfm-levoy-25x.toml").read_text()
    text = text.replace("focal_length_mm = 2.5", "f_number = 20")
    tubes = "tube_lens_mm = 200\nmade_for_tube_lens_mm = 160\nmagnification = 20"
    file = tmp_path / "m.toml"
    file.write_text(text.replace("magnification = 25", tubes))
    other = MicroscopeModel(load_instrument(file), 15)  # type: ignore[arg-type]
    assert other.um_per_a == pytest.approx(MicroscopeModel(shipped("lfm-levoy-25x"), 15).um_per_a)


def test_commands_of_cameras_refuse_microscopes() -> None:
    for words in (
        ("baseline",),
        ("depth", "--disparity", "1"),
        ("slices", "--near", "1", "--far", "2"),
        ("distance", "-a", "1", "--focus", "100"),
        ("distance", "-a", "1", "-M", "1"),
    ):
        done = plenofir(*words, "--camera", "lfm-levoy-25x")
        assert done.returncode == 2, done
        assert len(done.stderr.splitlines()) == 1, done.stderr
    done = plenofir("distance", "-a", "-1:1:1", "--camera", "lfm-wagner-22x", "--json")
    assert '"z_um": 155.8' in done.stdout
    assert "lfm-wagner-22x" in plenofir("cameras").stdout
