# SPDX-License-Identifier: Apache-2.0
"""Prescriptions: the shipped files, what is read from a file, and errors that name the place."""

import math

import numpy as np
import pytest

from plenofir.camera.optics import (
    AIR,
    D_LINE_NM,
    Cauchy,
    Constant,
    Prescription,
    Sellmeier,
    cardinal_points,
    load_prescription,
    read_prescription,
    shipped_lenses,
)
from plenofir.ground.errors import InputError

HEADER = "radius;thickness;material;index;v-no;sa\n"
SINGLET = HEADER + "50;5;BK7;1.517;64.2;10\n-50;2;air;;;10\n;45;air;;;4\n"


def write(tmp_path, text, name="lens.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_shipped_lenses_include_the_thesis_lens_and_credits():
    assert {"f100", "brendel", "tronnier"} <= set(shipped_lenses())
    assert len(shipped_lenses()) >= 6


@pytest.mark.parametrize("name", shipped_lenses())
def test_shipped_lens_focuses_where_its_file_says(name):
    # The files were made for the d line; f100's image plane is the best focus of real rays.
    system = load_prescription(name).at(D_LINE_NM)
    points = cardinal_points(system)
    assert points.focal_length_mm == pytest.approx(100, abs=1)
    assert points.back_focal_distance_mm == pytest.approx(system.image_distance_mm, abs=0.2)
    assert system.stop is not None


def test_surfaces_of_f100():
    lens = load_prescription("f100")
    assert len(lens.surfaces) == 11
    assert [k for k, s in enumerate(lens.surfaces) if s.stop] == [5]
    assert 1 / lens.surfaces[0].curvature_per_mm == pytest.approx(54.1532461657, rel=1e-15)
    assert lens.surfaces[3].curvature_per_mm == 0
    assert [s.glass.name for s in lens.surfaces[:4]] == ["N-SK2", "air", "N-SK16", "F5"]
    assert all(isinstance(s.glass.dispersion, Sellmeier | Constant) for s in lens.surfaces)


def test_reading_a_file(tmp_path):
    lens = read_prescription(write(tmp_path, SINGLET))
    assert lens.name == "lens"
    assert [s.curvature_per_mm for s in lens.surfaces] == [1 / 50, -1 / 50, 0]
    assert [s.thickness_mm for s in lens.surfaces] == [5, 2, 45]
    assert [s.semi_aperture_mm for s in lens.surfaces] == [10, 10, 4]
    assert [s.stop for s in lens.surfaces] == [False, False, True]
    assert [s.glass.name for s in lens.surfaces] == ["BK7", "air", "air"]
    system = lens.at(D_LINE_NM)
    assert list(system.gaps) == [5, 2]
    assert system.image_distance_mm == 45
    assert system.stop == 2
    assert system.indices == pytest.approx([1, 1.5168, 1, 1], abs=1e-6)


def test_commas_comments_and_marked_stop(tmp_path):
    text = (
        "\ufeff# a singlet\nsurface,radius,thickness,material,semi_aperture\n"
        "1,50,5,BK7,10\n\n2,-50,2,air,10\n3,0,45,air_stop,4\n"
    )
    path = tmp_path / "other.csv"
    path.write_text(text, encoding="utf-8")
    want = read_prescription(write(tmp_path, SINGLET)).surfaces
    assert read_prescription(path).surfaces == want


def test_which_source_of_glass_holds(tmp_path):
    def dispersion(material):
        text = HEADER + f"50;5;{material};10\n-50;45;air;;;10\n"
        return read_prescription(write(tmp_path, text)).surfaces[0].glass.dispersion

    assert isinstance(dispersion("BK7;1.517;64.2"), Sellmeier)
    assert isinstance(dispersion("BK7;;"), Sellmeier)
    # An index that contradicts the table's: the row's own numbers hold.
    made = dispersion("BK7;1.617;50")
    assert isinstance(made, Cauchy)
    assert float(made.index(D_LINE_NM)) == pytest.approx(1.617, rel=1e-14)
    assert isinstance(dispersion("unheard-of;1.7;30"), Cauchy)
    assert dispersion("unheard-of;1.7;") == Constant(value=1.7)


@pytest.mark.parametrize(
    ("text", "place", "what"),
    [
        ("", "lens.csv", "no header"),
        (HEADER, "lens.csv", "no surfaces"),
        ("radius;thickness;sa\n1;2;3\n", "line 1", "no column for material"),
        ("radius;thickness;material;sa;colour\n", "line 1", "there is no column 'colour'"),
        ("radius;thickness;material;sa;sa\n", "line 1", "twice"),
        (SINGLET.replace("50;5;BK7", "5x;5;BK7"), "line 2, radius", "'5x' is not a number"),
        (SINGLET.replace("50;5;BK7", "inf;5;BK7"), "line 2, radius", "'inf' is not allowed"),
        (SINGLET.replace("50;5;BK7", "1e-320;5;BK7"), "line 2, radius", "too small"),
        (SINGLET.replace("-50;2", "-50;-2"), "line 3, thickness", "at least 0"),
        (SINGLET.replace("-50;2", "-50;"), "line 3, thickness", "not a number"),
        (SINGLET.replace(";4\n", ";0\n"), "line 4, semi aperture", "above 0"),
        (SINGLET.replace("1.517", "0.9"), "line 2, index", "above 1"),
        (SINGLET.replace("BK7;1.517;64.2", "QQ7;1.517;-1"), "line 2, Abbe number", "above 0"),
        (
            SINGLET.replace("BK7;1.517;64.2", "QQ7;;"),
            "line 2, material",
            "glass 'QQ7' is not known",
        ),
        (SINGLET.replace("BK7", ""), "line 2, material", "name air or a glass"),
        (SINGLET.replace(";45;air", ";45;BK7"), "line 4, material", "it must be air"),
        (
            SINGLET.replace("-50;2;air", "-50;2;air_stop"),
            "line 3, material",
            "a stop cannot refract",
        ),
        (SINGLET + ";3;air;;;4\n", "line 5, material", "second aperture stop"),
        (SINGLET.replace(";;10\n", ";10\n"), "line 3", "5 fields"),
    ],
)
def test_wrong_files(tmp_path, text, place, what):
    with pytest.raises(InputError) as caught:
        read_prescription(write(tmp_path, text))
    message = str(caught.value)
    assert "lens.csv" in message
    assert place in message
    assert what in message
    assert "\n" not in message


def test_unreadable_files(tmp_path):
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00\x81")
    for path in (binary, tmp_path / "absent.csv", tmp_path):
        with pytest.raises(InputError, match=path.name):
            read_prescription(path)
    with pytest.raises(InputError, match="f100"):
        load_prescription("no-such-lens")


def test_models_refuse_what_the_files_may_not_hold():
    f100 = load_prescription("f100")
    with pytest.raises(ValueError, match="one stop"):
        Prescription(name="x", surfaces=(f100.surfaces[5], f100.surfaces[5]))
    with pytest.raises(ValueError, match="must be air"):
        Prescription(name="x", surfaces=f100.surfaces[:1])


def test_reversing_twice_and_sections():
    system = load_prescription("f100").at(550)
    back = system.reversed()
    assert back.stop == 5
    assert np.array_equal(back.curvatures, -system.curvatures[::-1])
    twice = back.reversed()
    for name in ("curvatures", "gaps", "indices", "semi_apertures"):
        assert np.array_equal(getattr(twice, name), getattr(system, name))
    part = system.section(4, 6)
    assert part.stop == 1
    assert list(part.gaps) == list(system.gaps[4:6])
    assert list(part.indices) == list(system.indices[4:8])
    assert system.section(0, 3).stop is None
    with pytest.raises(ValueError, match="section"):
        system.section(3, 11)


def test_scaling():
    system = load_prescription("f100").at(550)
    scaled = load_prescription("f100").scaled(0.1).at(550)
    assert cardinal_points(scaled).focal_length_mm == pytest.approx(
        0.1 * cardinal_points(system).focal_length_mm, rel=1e-12
    )
    assert scaled.semi_apertures == pytest.approx(0.1 * system.semi_apertures)
    for factor in (0.0, -1.0, math.inf):
        with pytest.raises(InputError, match="positive"):
            load_prescription("f100").scaled(factor)


def test_air_has_index_one():
    assert float(AIR.index(400)) == 1
    assert AIR.abbe_number == math.inf
