# SPDX-License-Identifier: Apache-2.0
"""Commands of the ray model: distance, baseline, depth, slices."""

from math import inf
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from plenofir.commands import options
from plenofir.commands.console import print_json, print_table
from plenofir.commands.rasters import focused, warn_of_camera
from plenofir.commands.results import check_plot_and_csv, write_csv, write_plot_and_csv

if TYPE_CHECKING:
    from fractions import Fraction
    from pathlib import Path
    from types import ModuleType

    from plenofir.camera.rays import Distances, Microscope, RayModel

MicroImage = Annotated[
    int | None,
    typer.Option(
        "--micro-image", "-M", min=2, help="M: micro image size in pixels; by default the camera's."
    ),
]
Gap = Annotated[
    int,
    typer.Option("--gap", help="G: number of views from the first virtual camera to the second."),
]
View = Annotated[
    int,
    typer.Option("--view", help="i: view of the first virtual camera, counted from the centre."),
]

SensorDistance = Annotated[
    float | None,
    typer.Option(
        "--sensor-distance",
        help="b_s from the micro lenses to the sensor in mm, in place of the camera's: other than "
        "f_s of a focused camera.",
        parser=options.length_mm,
        metavar="LENGTH",
    ),
]
Box = Annotated[
    int | None,
    typer.Option(
        "--box",
        min=1,
        help="B: samples of a slice that are averaged, up to M; M of a standard camera and |a M| "
        "of a focused one if not given.",
    ),
]

app = typer.Typer()


def _model(
    camera: str,
    focus: float,
    micro_image: int | None,
    sensor_distance: float | None,
    box: int | None = None,
) -> "RayModel":
    from plenofir.camera.rays import camera_of, load_camera

    known = load_camera(camera)
    if sensor_distance is not None:
        known = camera_of(known, {"sensor_distance": sensor_distance})
    return focused(known, focus, micro_image, box)


def _say_of_camera(model: "RayModel") -> None:
    """What speaks against the camera, and what was assumed of it: not where JSON goes."""
    warn_of_camera(model)
    if note := model.camera.thin_lens_note():
        typer.echo(f"note: {note}", err=True)


def _fraction(a: "Fraction") -> str:
    # Whole numbers as well, so that programs read one form.
    return f"{a.numerator}/{a.denominator}"


def _number_or_none(distances: "Distances") -> float | None:
    # JSON has no infinity.
    return options.finite(float(distances.mm))


def _note(text: str) -> None:
    """Print what a result should be taken with; nothing without it."""
    if text:
        typer.echo(f"note: {text}")


def _number(value: float) -> str:
    """Format with four decimals, or the leading digits where these are all that it has."""
    return f"{value:.4f}" if abs(value) < 1e9 else f"{value:.12g}"


def _cell(distances: "Distances") -> str:
    value = _number_or_none(distances)
    state = distances.state().value
    if value is None:
        return state
    return _number(value) if state == "real" else f"{_number(value)} ({state})"


def _title(model: "RayModel") -> str:
    extension = f"extension {model.extension_mm:.4f} mm"
    return (
        f"{model.camera.name}, M = {model.micro_image_size}, {extension}; mm from the micro lenses"
    )


def drawn() -> "ModuleType":
    """The plots, which take a second to load."""
    from plenofir.camera.rays import plot

    return plot


@app.command()
def distance(
    camera: options.Camera,
    a: options.FocusSettings,
    focus: options.Focus = inf,
    micro_image: MicroImage = None,
    as_json: options.AsJson = False,
    plot: options.PlotFile = None,
    csv_file: options.CsvFile = None,
    sensor_distance: SensorDistance = None,
    box: Box = None,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose",
            help="Print by how much an error of each of the camera's numbers changes the result.",
        ),
    ] = False,
) -> None:
    """Distance and depth of field of refocused planes; of a microscope their heights in um."""
    from plenofir.camera.rays import (
        Microscope,
        State,
        condition_numbers,
        diffraction_note,
        load_instrument,
        rayleigh_limit,
    )

    instrument = load_instrument(camera)
    if isinstance(instrument, Microscope):
        # A microscope is focused by its stage: heights do not depend on a focus distance.
        of_cameras = {
            "focus": focus != inf,
            "plot": plot,
            "verbose": verbose,
            "sensor_distance": sensor_distance,
            "box": box,
        }
        options.refuse_used(of_cameras, "is for cameras with a main lens")
        _heights(instrument, a, micro_image, as_json, csv_file)
        return
    model = _model(camera, focus, micro_image, sensor_distance, box)
    settings = options.focus_settings(a, model.micro_image_size, rounded=False)
    rows = [
        (setting, model.near_border(value), model.distance(value), model.far_border(value))
        for setting, value in ((s, float(s)) for s in settings)
    ]
    planes: list[dict[str, object]] = [
        {
            "a": _fraction(setting),
            "state": centre.state().value,
            "distance_mm": _number_or_none(centre),
            "near_mm": _number_or_none(near),
            "far_mm": _number_or_none(far),
            "near_state": near.state().value,
            "far_state": far.state().value,
            "alpha": options.finite(float(model.alpha(float(setting)))),
            **_focused_figures(model, setting),
        }
        for setting, near, centre, far in rows
    ]
    # What cannot be written ends the command before anything is printed.
    check_plot_and_csv(plot, csv_file, camera)
    write_plot_and_csv(plot, lambda: drawn().plot_bench(model, settings), csv_file, planes)
    _say_of_camera(model)
    if as_json:
        # In JSON without --verbose too: programs take what they need.
        for plane, setting in zip(planes, settings, strict=True):
            plane["condition"] = {
                name: options.finite(number)
                for name, number in condition_numbers(model, setting).items()
            }
        limit = rayleigh_limit(model.camera)
        content = {
            "camera": model.camera.name,
            "rayleigh_limit_mm": options.finite(limit),
            "diffraction_limited": model.camera.sensor.pixel_pitch_mm < limit,
            "planes": planes,
        }
        print_json(content)
        return
    heads = ["a", "near", "distance", "far"]
    cells = [[str(s), _cell(near), _cell(centre), _cell(far)] for s, near, centre, far in rows]
    if not model.camera.micro_lenses.standard:
        heads += ["v", "B", "lens type", "blur / px"]
        for line, plane in zip(cells, planes, strict=True):
            values = [plane[name] for name in ("virtual_depth", "box", "lens_type", "blur_px")]
            line += ["none" if v is None else f"{v:.4g}" for v in values]
    print_table(heads, cells, title=_title(model), width=0 if len(heads) == 4 else 110)
    if verbose:
        numbers = {str(s): condition_numbers(model, s) for s in settings}
        heads = ["a", *next(iter(numbers.values()))]
        print_table(
            heads,
            [[a, *(f"{n:.3g}" for n in row.values())] for a, row in numbers.items()],
            title="times that a relative error of each input counts in the distance",
            width=100,
        )
    blurred = [str(s) for s, near, _, _ in rows if near.state() is State.BLURRED]
    if blurred:
        _note(
            f"no lens type is sharp, to a pixel or the box, at a = {', '.join(blurred)}: no depth "
            f"of field there; a larger {options.typed('box')} averages the blur"
        )
    _note(diffraction_note(model.camera))


def _focused_figures(model: "RayModel", setting: "Fraction") -> dict[str, object]:
    """What a plane of a focused camera has beside those of others; nothing of a standard one."""
    from plenofir.camera.rays import resolution_ratio, sharpest_type, virtual_depth

    if model.camera.micro_lenses.standard:
        return {}
    a = float(setting)
    best = sharpest_type(model, a)
    sharp = bool(best.sharp)
    return {
        "virtual_depth": options.finite(float(virtual_depth(model, a))),
        "box": float(model.box_at(a)),
        "lens_type": int(best.lens_type) + 1 if sharp else None,
        "blur_px": options.finite(float(best.blur_px)),
        "resolution_ratio": float(resolution_ratio(model, a)),
    }


def _heights(
    microscope: "Microscope",
    a: list[str],
    micro_image: int | None,
    as_json: bool,
    csv_file: "Path | None",
) -> None:
    """Heights of a microscope's planes over the plane in focus."""
    from plenofir.camera.rays import MicroscopeModel

    # The model needs two pixels a lens at least.
    model = MicroscopeModel(microscope, micro_image or max(2, microscope.micro_image_size))
    settings = options.focus_settings(a, model.micro_image_size, rounded=False)
    rows: list[dict[str, object]] = []
    cells = []
    for setting in settings:
        far, near = model.depth_of_field_um(float(setting))
        um = [options.finite(float(n)) for n in (far, model.height_um(float(setting)), near)]
        names = ("far_um", "z_um", "near_um")
        rows.append({"a": _fraction(setting), **dict(zip(names, um, strict=True))})
        cells.append([str(setting), *("none" if n is None else f"{n:.3f}" for n in um)])
    check_plot_and_csv(None, csv_file)
    write_csv(csv_file, rows)
    if words := model.micro_image_note():
        typer.echo(f"warning: {words}", err=True)
    if as_json:
        sizes = {"um_per_a": model.um_per_a, "pixel_um": model.pixel_um}
        print_json({"camera": microscope.name, **sizes, "planes": rows})
        return
    print_table(
        ["a", "far", "z", "near"],
        cells,
        title=f"{microscope.name}, M = {model.micro_image_size}; um over the plane in focus",
    )
    typer.echo(f"z / a: {model.um_per_a:.4f} um; a pixel of a picture: {model.pixel_um:.4f} um")


def _baseline_row(model: "RayModel", gap: int, view: int) -> dict[str, float | None]:
    return {
        "gap": gap,
        "baseline_mm": float(model.baseline(gap)),
        "exit_pupil_baseline_mm": options.finite(float(model.exit_pupil_baseline(gap))),
        # The sum with zero has no negative zero, which would be printed as -0.
        "tilt_deg": float(model.tilt(gap, view)) + 0.0,
        "entrance_pupil_mm": model.entrance_pupil_mm,
    }


@app.command()
def baseline(
    camera: options.Camera,
    focus: options.Focus = inf,
    micro_image: MicroImage = None,
    gap: Gap = 1,
    view: View = 0,
    as_json: options.AsJson = False,
    plot: options.PlotFile = None,
    csv_file: options.CsvFile = None,
    sensor_distance: SensorDistance = None,
) -> None:
    """Baseline and tilt of two virtual cameras, and where they stand.

    Plot and CSV have all gaps up to M - 1, and the given one.
    """
    model = _model(camera, focus, micro_image, sensor_distance)
    content = _baseline_row(model, gap, view)
    # The given gap is marked among all others in the plot, also one beyond M.
    gaps = sorted({gap, *range(1, model.micro_image_size)})
    check_plot_and_csv(plot, csv_file, camera)
    write_plot_and_csv(
        plot,
        lambda: drawn().plot_baselines(model, gaps, gap, view),
        csv_file,
        [_baseline_row(model, other, view) for other in gaps],
    )
    note = model.vignetting_note(view, view + gap)
    _say_of_camera(model)
    if as_json:
        print_json({**content, "outermost_view": model.outermost_view, "vignetted": bool(note)})
        return
    names = ["gap", "baseline / mm", "at the exit pupil", "tilt / degrees", "entrance pupil / mm"]
    values = [content[k] for k in list(content)[1:]]
    cells = [str(gap), *("infinite" if v is None else _number(v) for v in values)]
    print_table(names, [cells], title=_title(model))
    _note(note)


@app.command()
def depth(
    camera: options.Camera,
    disparity: Annotated[
        list[float], options.numbers("--disparity", "Disparity in pixels. May be repeated.")
    ],
    focus: options.Focus = inf,
    micro_image: MicroImage = None,
    gap: Gap = 1,
    view: View = 0,
    per_view: Annotated[
        bool,
        typer.Option(
            "--per-view", help="The disparity is in pixels per view, that is, divided by the gap."
        ),
    ] = False,
    as_json: options.AsJson = False,
    plot: options.PlotFile = None,
    csv_file: options.CsvFile = None,
    sensor_distance: SensorDistance = None,
) -> None:
    """Distance of an object from the disparity between two views."""
    model = _model(camera, focus, micro_image, sensor_distance)
    unit: Literal["pixels", "pixels per view"] = "pixels per view" if per_view else "pixels"
    objects = []
    for value in disparity:
        point = model.depth(value, gap, view=view, unit=unit)
        z = _number_or_none(point)
        objects.append(
            {
                "disparity": value,
                "state": point.state().value,
                "depth_mm": z,
                "distance_mm": None if z is None else z + model.entrance_pupil_mm,
            }
        )
    note = model.vignetting_note(view, view + gap)
    check_plot_and_csv(plot, csv_file, camera)
    write_plot_and_csv(
        plot,
        lambda: drawn().plot_triangulation(model, disparity, gap, view, unit),
        csv_file,
        objects,
    )
    _say_of_camera(model)
    if as_json:
        content = {"camera": model.camera.name, "gap": gap, "unit": unit, "vignetted": bool(note)}
        print_json({**content, "objects": objects})
        return
    cells = [
        [
            f"{o['disparity']:g}",
            *(_number(z) if isinstance(z, float) else str(o["state"]) for z in map(o.get, keys)),
        ]
        for keys in (("depth_mm", "distance_mm"),)
        for o in objects
    ]
    names = [f"disparity / {unit}", "from entrance pupil", "from micro lenses"]
    print_table(names, cells, title=_title(model))
    _note(note)


@app.command()
def slices(
    camera: options.Camera,
    near: Annotated[float, options.distance("--near", "Nearest distance in mm.")],
    far: Annotated[float, options.distance("--far", "Farthest distance in mm, or inf.")],
    focus: options.Focus = inf,
    micro_image: MicroImage = None,
    whole: Annotated[bool, typer.Option("--whole", help="Use integer a only.")] = False,
    as_json: options.AsJson = False,
    plot: options.PlotFile = None,
    csv_file: options.CsvFile = None,
    sensor_distance: SensorDistance = None,
    box: Box = None,
) -> None:
    """Fewest slices whose depths of field cover a range, and the gaps that remain."""
    from fractions import Fraction

    from plenofir.camera.rays import covering_slices

    model = _model(camera, focus, micro_image, sensor_distance, box)
    cover = covering_slices(model, near, far, step=Fraction(1) if whole else None)
    parts = [
        {
            "a": _fraction(part.a),
            "near_mm": part.near_mm,
            "far_mm": None if part.far_mm == inf else part.far_mm,
        }
        for part in cover.slices
    ]
    check_plot_and_csv(plot, csv_file, camera)
    write_plot_and_csv(plot, lambda: drawn().plot_cover(model, cover), csv_file, parts)
    _say_of_camera(model)
    if as_json:
        gaps = [
            {"near_mm": gap[0], "far_mm": None if gap[1] == inf else gap[1]} for gap in cover.gaps
        ]
        print_json({"camera": model.camera.name, "slices": parts, "gaps": gaps})
        return
    rows = [[str(part.a), f"{part.near_mm:.1f}", f"{part.far_mm:.1f}"] for part in cover.slices]
    print_table(["a", "near", "far"], rows, title=_title(model))
    for gap in cover.gaps:
        typer.echo(f"not covered: {gap[0]:.1f} to {gap[1]:.1f} mm")
    if not cover.gaps:
        typer.echo("no gaps")
