# SPDX-License-Identifier: Apache-2.0
"""Cross-check of lenses and real rays with optiland, an independent optical design package.

It is large and not a dependency: ``pip install -e .[optiland]`` brings it, and without it these
are skipped.
"""

import numpy as np
import pytest

from plenofir.camera.optics.paraxial import cardinal_points, exit_pupil
from plenofir.camera.optics.prescription import LensSystem, load_prescription
from plenofir_studies.tracing import trace_to_object

pytest.importorskip("optiland")

LENSES = ["f100", "brendel", "tronnier", "merte"]
WAVELENGTH_NM = 550.0


def optiland_lens(system: LensSystem):
    from optiland.materials import IdealMaterial
    from optiland.optic import Optic

    lens = Optic()
    lens.surfaces.add(index=0, thickness=np.inf)
    gaps = [*system.gaps, system.image_distance_mm]
    for number, (curvature, gap) in enumerate(zip(system.curvatures, gaps, strict=True)):
        lens.surfaces.add(
            index=number + 1,
            radius=1 / curvature if curvature else np.inf,
            thickness=gap,
            material=IdealMaterial(float(system.indices[number + 1])),
            is_stop=number == system.stop,
        )
    lens.surfaces.add(index=len(gaps) + 1)
    lens.set_aperture("EPD", 10.0)
    lens.fields.set_type("angle")
    lens.fields.add(y=0)
    lens.wavelengths.add(value=WAVELENGTH_NM / 1000, is_primary=True)
    return lens


@pytest.mark.parametrize("name", LENSES)
def test_paraxial_data(name: str) -> None:
    system = load_prescription(name).at(WAVELENGTH_NM)
    lens = optiland_lens(system)
    points = cardinal_points(system)
    assert float(lens.paraxial.f2()) == pytest.approx(points.focal_length_mm, rel=1e-9)
    # optiland counts the exit pupil from the image plane.
    pupil = exit_pupil(system).position_mm - system.image_distance_mm
    assert float(lens.paraxial.XPL()) == pytest.approx(pupil, rel=1e-9)


@pytest.mark.parametrize("name", LENSES)
def test_real_rays(name: str) -> None:
    from optiland.rays import RealRays

    system = load_prescription(name).at(WAVELENGTH_NM)
    backwards = optiland_lens(system)
    backwards.updater.flip()
    heights = np.array([-2.0, 0.0, 1.0, 2.5])
    slopes = np.array([0.05, -0.04, 0.02, -0.03])
    distance = cardinal_points(system).back_focal_distance_mm
    found = trace_to_object(system, heights, slopes, distance).rays

    cosine = 1 / np.sqrt(1 + slopes**2)
    rays = RealRays(
        np.zeros(4),
        heights,
        np.full(4, -distance),
        np.zeros(4),
        slopes * cosine,
        cosine,
        np.ones(4),
        np.full(4, WAVELENGTH_NM / 1000),
    )
    backwards.surfaces.trace(rays, skip=1)
    y, z = backwards.surfaces.y[-2], backwards.surfaces.z[-2]
    slope = backwards.surfaces.M[-2] / backwards.surfaces.N[-2]
    assert found.slopes[:, 1] == pytest.approx(np.asarray(slope).ravel(), abs=1e-10)
    assert found.at(np.asarray(z).ravel())[:, 1] == pytest.approx(np.asarray(y).ravel(), abs=1e-9)
