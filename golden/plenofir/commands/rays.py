"""Commands of the ray model: distance, baseline, depth, slices, cameras, lens."""

import json
from fractions import Fraction
from math import inf, isnan
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from plenofir.camera.optics.paraxial import paraxial_properties
from plenofir.camera.optics.prescription import load_prescription
from plenofir.camera.rays import (
    Distances,
    RayModel,
    camera_names,
    covering_slices,
    load_camera,
)
from plenofir.errors import InputError
from plenofir.refocus.shifts import parse_focus

CameraOption = Annotated[
    str, typer.Option("--camera", help="Shipped camera (plenofir cameras) or TOML file.")
]
FocusOption = Annotated[
    str, typer.Option("--focus", help="Focus distance from the micro lenses in mm, or inf.")
]
MicroImageOption = Annotated[
    str, typer.Option("--micro-image", "-M", help="M: micro image size in pixels.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]
PlotOption = Annotated[str, typer.Option("--plot", help="Draw the optical bench into this PNG.")]


def number(text: str, where: str, *, allow_infinity: bool = False) -> float:
    """Read a number from the command line.

    Parameters
    ----------
    text
        What the user gave.
    where
        Option that it belongs to.
    allow_infinity
        Whether inf is allowed.

    Returns
    -------
    float
        The number.

    Raises
    ------
    InputError
        If it is none, nan, or an infinity that is not allowed.
    """
    expected = "a number, or inf" if allow_infinity else "a number"
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{text!r}", where=where, expected=expected) from None
    if isnan(value) or value == -inf or (value == inf and not allow_infinity):
        raise InputError(f"{text!r}", where=where, expected=expected)
    return value


def integer(text: str, where: str) -> int:
    """Read an integer from the command line.

    Parameters
    ----------
    text
        What the user gave.
    where
        Option that it belongs to.

    Returns
    -------
    int
        The integer.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        return int(text)
    except ValueError:
        raise InputError(f"{text!r} is no integer", where=where, expected="an integer") from None


def _model(camera: str, focus: str, micro_image: str) -> RayModel:
    distance = number(focus, "--focus", allow_infinity=True)
    return RayModel.focused(load_camera(camera), distance, integer(micro_image, "--micro-image"))


def _fraction(a: Fraction) -> str:
    return f"{a.numerator}/{a.denominator}"


def _number_or_none(distances: Distances) -> float | None:
    value = float(distances.mm)
    return None if isnan(value) else value


def _cell(distances: Distances) -> str:
    value = _number_or_none(distances)
    state = distances.state().value
    if value is None:
        return state
    return f"{value:.4f}" if state == "real" else f"{value:.4f} ({state})"


def _print_table(title: str, columns: list[str], rows: list[list[str]]) -> None:
    typer.echo(title)
    table = Table()
    for column in columns:
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(*row)
    Console().print(table)


def _print_json(content: Any) -> None:
    typer.echo(json.dumps(content, indent=2, allow_nan=False))


def _title(model: RayModel) -> str:
    extension = f"extension {model.extension_mm:.4f} mm"
    return (
        f"{model.camera.name}, M = {model.micro_image_size}, {extension}; mm from the micro lenses"
    )


def distance(
    camera: CameraOption,
    a: Annotated[list[str], typer.Option("--a", "-a", help="Focus setting, may be repeated.")],
    focus: FocusOption = "inf",
    micro_image: MicroImageOption = "13",
    as_json: JsonOption = False,
    plot: PlotOption = "",
) -> None:
    """Distance and depth of field of refocused planes."""
    model = _model(camera, focus, micro_image)
    settings = [parse_focus(text, where="--a") for text in a]
    rows = [
        (setting, model.near_border(value), model.distance(value), model.far_border(value))
        for setting, value in ((s, float(s)) for s in settings)
    ]
    if plot:
        # Matplotlib takes its time to load.
        from plenofir.camera.rays.plot import plot_bench

        plot_bench(model, settings, Path(plot))
    if as_json:
        planes = [
            {
                "a": _fraction(setting),
                "state": centre.state().value,
                "distance_mm": _number_or_none(centre),
                "near_mm": _number_or_none(near),
                "far_mm": _number_or_none(far),
                "near_state": near.state().value,
                "far_state": far.state().value,
            }
            for setting, near, centre, far in rows
        ]
        _print_json({"camera": model.camera.name, "planes": planes})
        return
    _print_table(
        _title(model),
        ["a", "near", "distance", "far"],
        [[str(s), _cell(near), _cell(centre), _cell(far)] for s, near, centre, far in rows],
    )


def baseline(
    camera: CameraOption,
    focus: FocusOption = "inf",
    micro_image: MicroImageOption = "13",
    gap: Annotated[str, typer.Option("--gap", help="G: views between the two cameras.")] = "1",
    view: Annotated[
        str, typer.Option("--view", help="i: the first of them, from the centre.")
    ] = "0",
    as_json: JsonOption = False,
) -> None:
    """Baseline and tilt of the virtual cameras, and where they stand."""
    model = _model(camera, focus, micro_image)
    views = integer(gap, "--gap")
    content = {
        "gap": views,
        "baseline_mm": float(model.baseline(views)),
        "tilt_deg": float(model.tilt(views, integer(view, "--view"))) + 0.0,
        "entrance_pupil_mm": model.entrance_pupil_mm,
    }
    if as_json:
        _print_json(content)
        return
    names = ["gap", "baseline / mm", "tilt / degrees", "entrance pupil / mm"]
    cells = [str(views), *(f"{content[k]:.4f}" for k in list(content)[1:])]
    _print_table(_title(model), names, [cells])


def depth(
    camera: CameraOption,
    disparity: Annotated[
        list[str], typer.Option("--disparity", help="Disparity in pixels, may be repeated.")
    ],
    focus: FocusOption = "inf",
    micro_image: MicroImageOption = "13",
    gap: Annotated[str, typer.Option("--gap", help="G: views between the two cameras.")] = "1",
    view: Annotated[
        str, typer.Option("--view", help="i: the first of them, from the centre.")
    ] = "0",
    per_view: Annotated[
        bool, typer.Option("--per-view", help="Disparity is divided by the gap.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Distance of an object from the disparity between two views."""
    model = _model(camera, focus, micro_image)
    unit = "pixels per view" if per_view else "pixels"
    views = integer(gap, "--gap")
    first = integer(view, "--view")
    objects = []
    for text in disparity:
        value = number(text, "--disparity")
        found = model.depth(value, views, view=first, unit=unit)  # type: ignore[arg-type]
        z = _number_or_none(found)
        objects.append(
            {
                "disparity": value,
                "state": found.state().value,
                "depth_mm": z,
                "distance_mm": None if z is None else z + model.entrance_pupil_mm,
            }
        )
    if as_json:
        _print_json({"camera": model.camera.name, "gap": views, "unit": unit, "objects": objects})
        return
    cells = [
        [f"{o['disparity']:g}", *(str(o["state"]) if o[k] is None else f"{o[k]:.4f}" for k in keys)]
        for keys in (("depth_mm", "distance_mm"),)
        for o in objects
    ]
    names = [f"disparity / {unit}", "from entrance pupil", "from micro lenses"]
    _print_table(_title(model), names, cells)


def slices(
    camera: CameraOption,
    near: Annotated[str, typer.Option("--near", help="Nearest distance in mm.")],
    far: Annotated[str, typer.Option("--far", help="Farthest distance in mm, or inf.")],
    focus: FocusOption = "inf",
    micro_image: MicroImageOption = "13",
    whole: Annotated[bool, typer.Option("--whole", help="Only whole numbers a.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Fewest slices whose depths of field cover a range, and the gaps that remain."""
    model = _model(camera, focus, micro_image)
    cover = covering_slices(
        model,
        number(near, "--near"),
        number(far, "--far", allow_infinity=True),
        step=Fraction(1) if whole else None,
    )
    if as_json:
        parts = [
            {
                "a": _fraction(part.a),
                "near_mm": part.near_mm,
                "far_mm": None if part.far_mm == inf else part.far_mm,
            }
            for part in cover.slices
        ]
        gaps = [
            {"near_mm": gap[0], "far_mm": None if gap[1] == inf else gap[1]} for gap in cover.gaps
        ]
        _print_json({"camera": model.camera.name, "slices": parts, "gaps": gaps})
        return
    rows = [[str(part.a), f"{part.near_mm:.1f}", f"{part.far_mm:.1f}"] for part in cover.slices]
    _print_table(_title(model), ["a", "near", "far"], rows)
    for gap in cover.gaps:
        typer.echo(f"not covered: {gap[0]:.1f} to {gap[1]:.1f} mm")
    if not cover.gaps:
        typer.echo("no gaps")


def cameras(as_json: JsonOption = False) -> None:
    """List the shipped cameras."""
    known = [load_camera(name) for name in camera_names()]
    if as_json:
        _print_json([camera.model_dump() for camera in known])
        return
    rows = [
        [
            camera.name,
            str(camera.main_lens.focal_length_mm),
            str(camera.micro_lenses.focal_length_mm),
            str(camera.micro_lenses.pitch_mm),
            str(camera.sensor.pixel_pitch_mm),
        ]
        for camera in known
    ]
    _print_table("shipped cameras, mm", ["name", "f_U", "f_s", "p_M", "p_p"], rows)


def lens(
    prescription: Annotated[
        str, typer.Argument(help="CSV file of a lens prescription, or a shipped lens.")
    ],
    wavelength: Annotated[str, typer.Option("--wavelength", help="Wavelength in nm.")] = "550",
    as_json: JsonOption = False,
) -> None:
    """Cardinal points and pupils of a main lens from its prescription."""
    main_lens = load_prescription(prescription)
    content = paraxial_properties(main_lens, number(wavelength, "--wavelength"))
    if as_json:
        _print_json({"lens": main_lens.name, "wavelength_nm": float(wavelength), **content})
        return
    rows = [[name, "none" if v is None else f"{v:.4f}"] for name, v in content.items()]
    _print_table(f"{main_lens.name}, {wavelength} nm", ["property", "mm"], rows)


def register(app: typer.Typer) -> None:
    """Add the commands.

    Parameters
    ----------
    app
        The command line.
    """
    for command in (distance, baseline, depth, slices, cameras, lens):
        app.command()(command)
