# SPDX-License-Identifier: Apache-2.0
"""Command inspect: what a file is, and what a white image tells of a camera's adjustment."""

from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plenofir.commands import file_options, options
from plenofir.commands.capture import Dark
from plenofir.commands.console import print_json, progress_bar
from plenofir.commands.results import publish
from plenofir.ground.errors import InputError
from plenofir.ground.files import check_folder
from plenofir.ground.shell import command

if TYPE_CHECKING:
    from collections.abc import Callable

    from plenofir.camera.calibration.inspection import WhiteInspection
    from plenofir.camera.calibration.spots import Best, FocusScore, InfinityFocus
    from plenofir.camera.rays import MeasuredPupil, RayModel
    from plenofir.camera.recognise import Hints, LightFieldSource
    from plenofir.refocus.operator import Image

# Micro images of this diameter (in pitches) fill their cells; much smaller ones waste sensor area.
_SMALL = 0.85
# Hot pixels clip in any sensor; at this share the middles of micro images do.
_CLIPPED = 0.01
# The array is tilted if best positions of its sides differ by more than this many standard errors.
_TILT_ERRORS = 4.0

app = typer.Typer()

Lines = list[tuple[str, str]]


@app.command()
@file_options.takes_light_fields
def inspect(
    files: Annotated[
        list[str],
        typer.Argument(
            help="Any file, or a folder of views; or several pictures of collimated light through "
            "the micro lenses alone, each with a --position."
        ),
    ],
    hints: "Hints",
    dark: Dark = None,
    position: Annotated[
        list[float] | None,
        options.numbers(
            "--position", "Position of the micro lenses in mm, one for each picture in their order."
        ),
    ] = None,
    collimator: Annotated[
        Path | None,
        typer.Option(help="Picture of a collimator or a star through the whole camera."),
    ] = None,
    camera: options.CameraIfGiven = None,
    focus: options.Focus = inf,
    out: Annotated[str | None, typer.Option(help="Folder for pictures of the findings.")] = None,
    as_json: options.AsJson = False,
) -> None:
    """Tell what a file is, and check a camera's optics with its white image.

    A white image shows whether micro images touch, overlap or leave gaps; several pictures with
    positions, where the micro lenses are in focus. Any other option asks for a white image.
    """
    options.require("focus", "camera", camera is None and focus != inf)
    used = {"crop": hints.crop, "white_balance": hints.white_balance not in ("auto", "off")}
    options.refuse_used(used, "is for pictures that are made")
    if out is not None:
        check_folder(Path(out), out)
    if position:
        _alone(position, files, collimator, camera)
        content, lines, pictures = _spots(files, position, dark)
    else:
        if len(files) > 1:
            raise InputError("several pictures require --position, once for each of them")
        # Only a white image has use for these options, so the file is taken for one.
        calibrates = any(one is not None for one in (dark, collimator, camera, out))
        source = None if calibrates else _recognised(files[0], hints)
        if source is not None and source.white is None:
            content, lines, pictures = *_recognition(source), dict
        else:
            # Recognising a white image has inspected it already.
            inspection = source.white if source is not None else None
            content, lines, pictures = _white(files[0], dark, collimator, camera, focus, inspection)
            lines.append(("next", command("calibrate", Path(files[0]), "--out", "calib.json")))
    if out is not None:
        drawn = pictures()
        publish(drawn, Path(out))
        lines.append(("pictures", f"{out}/: {', '.join(drawn)}"))
    if as_json:
        print_json(content)
        return
    for heading, text in lines:
        typer.echo(f"{heading:<13} {text}")


def _recognised(file: str, hints: "Hints") -> "LightFieldSource":
    """Recognise a file behind a progress bar."""
    from plenofir.camera.recognise import recognise

    with progress_bar("inspecting"):
        return recognise(Path(file), hints)


def _recognition(source: "LightFieldSource") -> tuple[dict[str, Any], Lines]:
    """Kind of a file, for JSON and for people."""
    content = {
        "kind": source.kind,
        "evidence": [list(one[:3]) for one in source.findings],
        "micro_image_size": source.micro_image_size,
        "pitch_px": source.pitch_px,
        "next": list(source.advice),
    }
    lines = [("kind", source.kind), *((one.heading, one.text) for one in source.findings)]
    return content, lines + [("next", text) for text in source.advice]


def _alone(
    positions: list[float], files: list[str], collimator: Path | None, camera: str | None
) -> None:
    """Refuse what does not go with positions."""
    if len(positions) != len(files):
        raise InputError(f"{len(positions)} positions do not match {len(files)} pictures")
    for option, value in (("--collimator", collimator), ("--camera", camera)):
        if value is not None:
            raise InputError(f"{option} cannot be combined with --position")


def _white(
    file: str,
    dark: Path | None,
    collimator: Path | None,
    camera: str | None,
    focus: float,
    inspection: "WhiteInspection | None" = None,
) -> "tuple[dict[str, Any], Lines, Callable[[], dict[str, Image]]]":
    """Inspect a white image; `inspection` if it is known already."""
    from plenofir.camera.calibration.inspection import inspect_white
    from plenofir.camera.calibration.spots import infinity_focus
    from plenofir.camera.rays import RayModel, load_camera, measure_pupil
    from plenofir.ground.images import read_image, read_picture

    # M does not matter here.
    model = None if camera is None else RayModel.focused(load_camera(camera), focus, 2)
    dark_image = None if dark is None else read_image(dark, as_stored=True)
    star = None if collimator is None else read_image(collimator, as_stored=True)
    if inspection is None:
        image, full_scale, *_ = read_picture(Path(file), as_stored=True)
        with progress_bar("inspecting"):
            inspection = inspect_white(
                image, dark_image, full_scale=full_scale, where=file, dark_where=str(dark)
            )
    overlapping = inspection.fill.verdict == "overlapping"
    grid, evidence = inspection.calibration.grid, inspection.calibration.evidence
    pupil = None
    if model is not None and not overlapping:
        error = None if evidence is None else evidence.pitch_error_px
        pupil = measure_pupil(model, grid.lens_pitch, error or 0.0)
    infinity = None
    if star is not None:
        # Where micro images overlap, their size, which the star is compared with, is unknown.
        if overlapping:
            raise InputError("micro images overlap; close the main lens's aperture", where=file)
        infinity = infinity_focus(
            star,
            inspection.calibration,
            inspection.fill.diameter * grid.lens_pitch,
            dark_image,
            where=str(collimator),
            dark_where=str(dark),
        )
    content = _white_content(inspection, model, pupil, infinity)
    lines = _white_lines(inspection, model, pupil, infinity)
    return content, lines, partial(_white_pictures, inspection, model, pupil)


def _white_pictures(
    inspection: "WhiteInspection", model: "RayModel | None", pupil: "MeasuredPupil | None"
) -> "dict[str, Image]":
    from plenofir.camera.calibration.pictures import chief_ray_picture, micro_image_picture

    pictures = {"micro_image.png": micro_image_picture(inspection)}
    if model is not None and pupil is not None:
        lenses = inspection.calibration.lenses[1]
        pictures["chief_rays.png"] = chief_ray_picture(model, pupil, lenses)
    return pictures


def _white_content(
    inspection: "WhiteInspection",
    model: "RayModel | None",
    pupil: "MeasuredPupil | None",
    infinity: "InfinityFocus | None",
) -> dict[str, Any]:
    """Everything found, for JSON; what the grid of overlapping micro images says is left out."""
    from dataclasses import asdict

    calibration, fill = inspection.calibration, inspection.fill
    content: dict[str, Any] = {
        "kind": "white image",
        "micro_images": fill.verdict,
        "between": fill.between,
        "darkest": fill.darkest,
        "unevenness": inspection.unevenness,
        "darkest_lens": inspection.darkest_lens,
        "clipped_share": calibration.clipped_share,
        "advice": _advice(inspection),
    }
    if fill.verdict == "overlapping":
        return content
    content |= {
        "layout": calibration.grid.layout,
        "lenses": list(calibration.lenses),
        "missing": len(calibration.missing),
        "pitch_px": calibration.grid.lens_pitch,
        "rotation_degrees": calibration.grid.rotation_degrees,
        "diameter_pitches": fill.diameter,
        "fill_factor": fill.share,
    }
    if model is not None and pupil is not None:
        content["f_number"] = _f_number(inspection, model)
        content["exit_pupil"] = {
            name: options.finite(value) if isinstance(value, float) else value
            for name, value in asdict(pupil).items()
        }
    if infinity is not None:
        numbers = {name: options.finite(value) for name, value in asdict(infinity).items()}
        content["infinity"] = {**numbers, "in_focus": infinity.in_focus}
        if model is not None:
            content["infinity"]["extension_mm"] = _extension(model, infinity)
    return content


def _f_number(inspection: "WhiteInspection", model: "RayModel") -> float:
    """Working f-number of the main lens on the side of the sensor."""
    diameter = inspection.fill.diameter * inspection.calibration.grid.lens_pitch
    array = model.camera.micro_lenses
    return array.spacing_mm / (diameter * model.camera.sensor.pixel_pitch_mm)


def _extension(model: "RayModel", infinity: "InfinityFocus") -> float | None:
    """Extension of the main lens in mm, by where it has infinity."""
    from plenofir.camera.rays import extension_of_infinity

    return options.finite(extension_of_infinity(model.camera, infinity.a))


def _advice(inspection: "WhiteInspection") -> list[str]:
    """Advice on the aperture and the exposure."""
    fill, advice = inspection.fill, []
    if fill.verdict == "overlapping":
        advice.append(
            "close the aperture until dark gaps appear: pixels where micro images overlap get "
            "light of two lenses. If they do not overlap, the level without light is high: give a "
            "dark frame"
        )
    elif fill.verdict == "touching":
        advice.append("close the aperture a little: micro images touch, and their rims mix")
    elif fill.diameter < _SMALL:
        advice.append(
            f"open the aperture by up to {fill.stops_to_touch:.1f} stops: the sensor is lit to "
            f"{100 * fill.share:.0f} % only"
        )
    if inspection.calibration.clipped_share > _CLIPPED:
        advice.append(
            f"expose less: {100 * inspection.calibration.clipped_share:.0f} % of the pixels are at "
            "full scale"
        )
    return advice or ["none: the aperture suits the micro lenses"]


def _white_lines(
    inspection: "WhiteInspection",
    model: "RayModel | None",
    pupil: "MeasuredPupil | None",
    infinity: "InfinityFocus | None",
) -> Lines:
    """Findings in words."""
    from plenofir.commands.capture import pupil_text

    calibration, fill = inspection.calibration, inspection.fill
    rows, columns = calibration.lenses
    lines = [("kind", "white image"), ("micro images", fill.verdict)]
    if fill.verdict != "overlapping":
        grid = calibration.grid
        lines += [
            (
                "grid",
                f"{columns} x {rows} lenses ({len(calibration.missing)} missing), {grid.layout}, "
                f"pitch {grid.lens_pitch:.4f} pixels, rotation {grid.rotation_degrees:.4f} degrees",
            ),
            (
                "diameter",
                f"{fill.diameter:.3f} pitches ({fill.diameter * grid.lens_pitch:.1f} pixels) at "
                f"half brightness, fill factor {fill.share:.3f}",
            ),
        ]
    lines += [
        (
            "brightness",
            f"{100 * fill.between:.0f} % half way to the neighbours, {100 * fill.darkest:.0f} % at "
            f"the darkest place, corners of the picture {100 * inspection.darkest_lens:.0f} %",
        )
    ]
    if model is not None and pupil is not None:
        array = model.camera.micro_lenses
        lines += [
            (
                "f-number",
                f"{_f_number(inspection, model):.1f} of the main lens, "
                f"{array.spacing_mm / array.pitch_mm:.1f} of the micro lenses",
            ),
            ("exit pupil", pupil_text(pupil)),
        ]
    if infinity is not None:
        state = "in focus" if infinity.in_focus else "not in focus"
        lines.append(
            (
                "infinity",
                f"{state}: sharp at a = {infinity.a:.4f} (standard error {infinity.error:.4f}; "
                f"seen from {infinity.resolution:.4f} on), light in {infinity.lenses:.1f} lenses",
            )
        )
        extension = None if model is None else _extension(model, infinity)
        if model is not None and extension is not None:
            lines.append(
                (
                    "main lens",
                    f"{extension:.4f} mm from its infinity focus (b_U - f_U; by --focus: "
                    f"{model.extension_mm:.4f})",
                )
            )
    return lines + [("advice", text) for text in _advice(inspection)]


def _spots(
    files: list[str], positions: list[float], dark: Path | None
) -> "tuple[dict[str, Any], Lines, Callable[[], dict[str, Image]]]":
    """Find where micro lenses are in focus."""
    from plenofir.camera.calibration import calibrate
    from plenofir.camera.calibration.frames import white_signal
    from plenofir.camera.calibration.spots import focus_score, measure_spots
    from plenofir.ground.images import read_image, read_picture

    dark_image = None if dark is None else read_image(dark, as_stored=True)
    spots = []
    with progress_bar("inspecting") as show:
        for number, (file, place) in enumerate(zip(files, positions, strict=True)):
            show(number, len(files))
            image, full_scale, *_ = read_picture(Path(file), as_stored=True)
            signal = white_signal(
                image, dark_image, where=file, dark_where=str(dark), full_scale=full_scale
            )
            # The array may move between pictures, so each has a grid of its own.
            calibration = calibrate(
                image, dark_image, where=file, dark_where=str(dark), full_scale=full_scale
            )
            spots.append(measure_spots(signal, calibration, place, where=file))
    score = focus_score(spots)
    content = {
        "kind": "spots",
        "spots": [
            {"position": one.position, "radius_px": one.radius_px, "radius_pitches": one.radius}
            for one in score.spots
        ],
        "best": _best_content(score.best),
        "sides": {side: _best_content(best) for side, best in score.sides.items()},
        "advice": _focus_advice(score),
    }
    lines = [
        (
            f"{one.position:g}",
            f"spots of {one.radius_px:.3f} pixels radius ({one.radius:.4f} pitches)",
        )
        for one in score.spots
    ]
    lines.append(("best", _best_text(score.best)))
    lines += [(f"  {side}", _best_text(best)) for side, best in score.sides.items()]
    lines += [("advice", text) for text in _focus_advice(score)]
    return content, lines, partial(_focus_pictures, score)


def _focus_pictures(score: "FocusScore") -> "dict[str, Image]":
    from plenofir.camera.calibration.pictures import focus_picture

    return {"focus.png": focus_picture(score)}


def _best_content(best: "Best | None") -> dict[str, Any] | None:
    if best is None:
        return None
    error = None if best.error is None else options.finite(best.error)
    return {"position": best.position, "error": error, "bracketed": best.bracketed}


def _best_text(best: "Best | None") -> str:
    if best is None:
        return "none: spots do not grow on both sides"
    error = "" if best.error is None else f" (standard error {best.error:.4g})"
    return f"{best.position:.6g}{error}{'' if best.bracketed else ', outside the positions'}"


def _focus_advice(score: "FocusScore") -> list[str]:
    """Advice on the position of the micro lenses."""
    from plenofir.camera.calibration.spots import LARGEST_SPOT

    smallest = min(score.spots, key=lambda one: one.radius)
    advice = []
    # A minimum at the end of a series is only its smallest picture: the best may lie beyond.
    if score.best is None or not score.best.bracketed:
        advice.append(f"take more pictures around {smallest.position:g}, on both sides of the best")
    else:
        advice.append(f"put the micro lenses at {score.best.position:.6g}")
    if any(one.radius > LARGEST_SPOT for one in score.spots):
        advice.append("leave out positions whose spots fill the pitch: their sizes say little")
    sides = [best for best in score.sides.values() if best is not None]
    places = [best.position for best in sides]
    apart = max(places, default=0.0) - min(places, default=0.0)
    errors = [best.error for best in sides if best.error is not None]
    if errors and apart > _TILT_ERRORS * max(errors):
        advice.append(f"align the array with the sensor: its sides are best {apart:.3g} apart")
    return advice
