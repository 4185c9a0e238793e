# SPDX-License-Identifier: Apache-2.0
"""What the pictures of the ray model show, read from what is drawn."""

from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction
from itertools import combinations
from math import inf, nextafter

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from plenofir.camera.plots import SharpRange
from plenofir.camera.rays import (
    Camera,
    Cover,
    MainLens,
    MicroLensArray,
    RayModel,
    Sensor,
    Slice,
    load_camera,
)
from plenofir.camera.rays.plot import (
    plot_baselines,
    plot_bench,
    plot_cover,
    plot_triangulation,
    sharp_ranges,
)

F193 = load_camera("f193-mla2")
MODEL = RayModel.focused(F193, 3000.0, 13)
Floats = npt.NDArray[np.float64]


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def points(line: Line2D) -> Floats:
    return np.array(line.get_xydata())


def plain(f: float = 64.0, pupil: float = inf) -> RayModel:
    """A camera whose plane a lies at exactly 2 f + f^2 / (32 a) mm."""
    camera = Camera(
        name="plain",
        main_lens=MainLens(focal_length_mm=f, exit_pupil_mm=pupil),
        micro_lenses=MicroLensArray(focal_length_mm=2.0, pitch_mm=0.125),
        sensor=Sensor(pixel_pitch_mm=0.0078125),
    )
    return RayModel(camera, Decimal(0), 13)


def marks(figure: Figure) -> dict[str, float]:
    """Names on the optical bench and where they stand, each beside a line from top to bottom."""
    bench = figure.axes[0]
    lines = [points(line)[:, 0] for line in bench.lines]
    upright = {xs[0] for xs in lines if xs[0] == xs[-1]}
    found = {text.get_text(): text.get_position()[0] for text in bench.texts}
    assert set(found.values()) == upright
    return found


def test_the_optical_bench() -> None:
    settings = [Fraction(n) for n in (2, 1, -2, 3)]
    figure = plot_bench(MODEL, settings)
    front = MODEL.image_distance_mm + F193.main_lens.principal_plane_separation_mm
    places = {f"a = {a}": float(MODEL.distance(float(a)).mm) for a in settings if a != -2}
    assert marks(figure) == pytest.approx(
        places
        | {"micro lenses": 0.0, "H1": front, "H2": MODEL.image_distance_mm}
        | {"exit pupil": MODEL.exit_pupil_mm}
    )
    bench = figure.axes[0]
    rays = [line for line in bench.lines if line.get_linestyle() == "-" and line.get_label()]
    by_colour: dict[object, list[Floats]] = {}
    for ray in rays:
        by_colour.setdefault(ray.get_color(), []).append(points(ray))
    assert len(by_colour) == len(settings)
    farthest = max(places.values())
    for a, lines in zip(settings, by_colour.values(), strict=True):
        behind, before = ([line for line in lines if len(line) == n] for n in (3, 2))
        upright = [line for line in before if line[0, 0] == line[1, 0]]
        assert len(behind) == 2
        # The mark of a plane has the colour of its rays.
        assert [line[0, 0] for line in upright] == ([places[f"a = {a}"]] if a != -2 else [])
        for line in behind:
            # Height 0 at the exit pupil, but for the slope to a pixel at the border.
            c, s = np.sign(line[1, 1]) * 6 * np.sign(float(a)), line[1, 1]
            slope = -s / MODEL.exit_pupil_mm + c * 0.009 / 2.75
            assert abs(s) == pytest.approx(abs(float(a)) * 6 * 0.125)
            places_x = np.array([-2.75, 0.0, MODEL.image_distance_mm])
            assert line == pytest.approx(np.column_stack([places_x, s + slope * places_x]))
        for line in (line for line in before if line[0, 0] != line[1, 0]):
            assert line[:, 0] == pytest.approx([front, 1.15 * farthest])
            if a != -2:
                rise = (line[1, 1] - line[0, 1]) / (line[1, 0] - line[0, 0])
                at_plane = line[0, 1] + rise * (places[f"a = {a}"] - front)
                assert at_plane == pytest.approx(0, abs=1e-9)
    names = [label.get_text() for label in figure.axes[1].get_yticklabels()]
    assert names == ["a = 2", "a = 1", "", "a = 3"]


def assert_readable(figure: Figure, axes: Axes) -> None:
    """Texts lie in the picture, none on another."""
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts]
    frame = axes.get_window_extent()
    for box in boxes:
        # A pixel of rounding.
        assert frame.y0 - 1 <= box.y0
        assert box.y1 <= frame.y1 + 1
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


def test_names_on_the_bench_do_not_hide_each_other() -> None:
    # Principal planes and pupil in one place.
    figure = plot_bench(plain(pupil=64.0), [Fraction(1), Fraction(3)])
    assert_readable(figure, figure.axes[0])
    heights = {text.get_text(): text.get_position()[1] for text in figure.axes[0].texts}
    assert all((height > 0.5) == ("a =" not in name) for name, height in heights.items())


def reach(model: RayModel, *settings: float) -> float:
    """How far the rays are drawn."""
    bench = plot_bench(model, [Fraction(a) for a in settings]).axes[0]
    return float(points(bench.lines[1])[1, 0])


def test_how_far_the_bench_is_drawn() -> None:
    # Plane 1 lies at 20 image distances: too far. The next one does not.
    far = plain(576.0)
    near = nextafter(1.0, 2)
    assert set(marks(plot_bench(far, [Fraction(1)]))) == {"micro lenses", "H1", "H2"}
    assert f"a = {Fraction(near)}" in marks(plot_bench(far, [Fraction(near)]))
    assert reach(far, 1.0) == pytest.approx(1.15 * 1.5 * 576)
    assert reach(far, near) == pytest.approx(1.15 * 11520)
    assert reach(far, 0.5, 2.0) == pytest.approx(1.15 * 6336)


def test_pupils_on_and_off_the_bench() -> None:
    end = 1.15 * (1.5 * 64)
    for pupil, shown in (
        (0.5, 1),
        (-0.5, 0),
        (inf, 0),
        (nextafter(end, 0), 1),
        (end, 0),
        (500.0, 0),
    ):
        found = marks(plot_bench(plain(pupil=pupil), [Fraction(0)]))
        assert ("exit pupil" in found) == shown, pupil
        assert found["micro lenses"] == 0.0


def test_sharp_ranges_are_depths_of_field() -> None:
    model = RayModel.focused(F193, 3000.0, 13)
    settings = [Fraction(n, 13) for n in (13, 0, -5, -26, 52)]
    found = sharp_ranges(model, settings)
    near, plane, far = (
        [float(way(float(a)).mm) for a in settings]
        for way in (model.near_border, model.distance, model.far_border)
    )
    assert found == [
        SharpRange("a = 1", near[0], far[0], plane[0]),
        SharpRange("a = 0", near[1], far[1], plane[1]),
        SharpRange("a = -5/13", near[2], inf, plane[2]),
        "a = -2: beyond infinity",
        SharpRange("a = 4", near[4], far[4], plane[4]),
    ]
    # Beyond infinity itself, sharp up to it; and partly in the lens.
    endless = RayModel.focused(F193, inf, 13)
    beyond, inside = sharp_ranges(endless, [Fraction(-1, 13), Fraction(30)])
    assert beyond == SharpRange("a = -1/13", float(endless.near_border(-1 / 13).mm), inf, None)
    assert inside == "a = 30: inside lens"


def spans(axes: Axes) -> list[tuple[float, float]]:
    boxes = [patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches]
    return [(box.x0, box.x1) for box in boxes]


def test_gaps_between_slices_are_marked() -> None:
    slices = tuple(
        Slice(a, float(MODEL.near_border(float(a)).mm), float(MODEL.far_border(float(a)).mm))
        for a in (Fraction(1), Fraction(2))
    )
    gaps = ((slices[1].far_mm, slices[0].near_mm), (200.0, slices[1].near_mm))
    axes = plot_cover(MODEL, Cover(slices, gaps)).axes[0]
    low, _ = axes.get_xlim()
    assert spans(axes) == [pytest.approx(gaps[0]), pytest.approx((low, gaps[1][1]))]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a = 1", "a = 2"]
    assert axes.get_legend() is not None
    beyond = plot_cover(MODEL, Cover(slices, ((slices[0].far_mm, inf),))).axes[0]
    assert spans(beyond) == [pytest.approx((slices[0].far_mm, beyond.get_xlim()[1]))]
    assert plot_cover(MODEL, Cover(slices, ())).axes[0].get_legend() is None


def test_baselines_and_the_edge_of_the_pupil() -> None:
    lens = F193.main_lens.model_copy(update={"entrance_pupil_diameter_mm": 7.0})
    model = RayModel.focused(F193.model_copy(update={"main_lens": lens}), 3000.0, 13)
    (bound,) = {model.outermost_view}
    assert bound is not None
    gaps, view = list(range(1, 13)), -2
    figure = plot_baselines(model, gaps, 6, view)
    base, tilt = figure.axes
    for axes, values, text in (
        (base, model.baseline(gaps), f"G = 6: {float(model.baseline(6)):.4f}"),
        (tilt, model.tilt(gaps, view), f"G = 6: {float(model.tilt(6, view)):.4f}"),
    ):
        curve, mark = map(points, axes.lines[:2])
        assert curve == pytest.approx(np.column_stack([gaps, values]))
        assert mark == pytest.approx(curve[5:6])
        legend = axes.get_legend()
        assert legend is not None
        assert text in [entry.get_text() for entry in legend.get_texts()]
    # View -2 + G may be as far out as the outermost.
    assert [points(line)[0, 0] for line in base.lines[2:]] == [bound + 2]
    for last, drawn in ((bound + 2, 0), (bound + 3, 1)):
        base = plot_baselines(model, list(range(1, last + 1)), 1, view).axes[0]
        assert len(base.lines) == 2 + drawn
    assert len(plot_baselines(MODEL, gaps, 6, 0).axes[0].lines) == 2


@pytest.mark.parametrize(
    ("given", "ends"),
    [
        ([0.5, 2.0], (-0.4, 2.6)),
        ([0.0], (-0.2, 0.3)),
        ([-1.0, 0.5], (-1.2, 0.8)),
        ([-4.0, -3.0], (-4.8, -1.8)),
    ],
)
def test_distances_over_disparities(given: list[float], ends: tuple[float, float]) -> None:
    axes = plot_triangulation(MODEL, given, 4, 1, "pixels per view").axes[0]
    curve, marked = map(points, axes.lines)
    assert (curve[0, 0], curve[-1, 0]) == pytest.approx(ends)
    assert (np.diff(curve[:, 0]) > 0).all()
    assert marked[:, 0].tolist() == given
    for x, y in (*marked, *curve[::50]):
        wanted = model_distance(x)
        assert y == pytest.approx(wanted, nan_ok=True)
    assert axes.get_xlabel() == "disparity / pixels per view, views 1 and 5"


def model_distance(disparity: float) -> float:
    """From the micro lenses: where the virtual cameras stand, and on."""
    found = MODEL.depth(disparity * 4, 4, view=1)
    return float(found.mm) + MODEL.entrance_pupil_mm
