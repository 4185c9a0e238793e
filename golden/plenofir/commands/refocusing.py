# SPDX-License-Identifier: Apache-2.0
"""Commands that refocus: refocus, stack."""

import re
from fractions import Fraction
from math import ceil, inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plenofir.commands import file_options, options
from plenofir.commands.console import note, print_lines, progress_bar
from plenofir.commands.looks import aperture_of, look_for, setting_text, tilt_of
from plenofir.commands.rasters import model_of, read_field, warn_of_camera
from plenofir.commands.results import PICTURES, VOLUMES, check_file, is_volume, publish, save
from plenofir.ground.errors import InputError
from plenofir.ground.extras import missing
from plenofir.ground.files import Results, check_folder

if TYPE_CHECKING:
    from plenofir.camera.recognise import Hints
    from plenofir.refocus.sharpness import Slices

app = typer.Typer()


@app.command("refocus")
@file_options.takes_light_fields
def refocus_command(
    raster: options.LightField,
    hints: "Hints",
    a: options.FocusSetting,
    out: Annotated[str, typer.Option(help="PNG, TIFF or JPEG file to write.")] = "refocused.png",
    interpolation: options.InterpolationIfGiven = None,
    sharpen: options.SharpenIfGiven = None,
    upsample: options.Upsample = True,
    aperture: options.Aperture = None,
    tilt: options.Tilt = None,
    border: options.Border = "normalise",
    exposure: options.Exposure = "auto",
    gamma: options.Gamma = None,
    camera: options.CameraIfGiven = None,
    focus: options.Focus = inf,
    region: Annotated[
        str | None,
        typer.Option(
            help="Compute only this part of the result: TOP:BOTTOM,LEFT:RIGHT in its pixels."
        ),
    ] = None,
) -> None:
    """Refocus an aligned raw image to a picture to look at, at any real a.

    --interpolation, --sharpen and --no-upsample take the operator as the thesis and the VHDL have
    it instead, correctly rounded, at multiples of 1/M. The file says in XMP how it was made, with a
    camera also where it is focused.
    """
    from plenofir.camera.described import described
    from plenofir.camera.lightfield.any_field import is_rectangle
    from plenofir.camera.lightfield.shift_and_add import refocus_views
    from plenofir.refocus import best_picture, interpolation_order, refocus, sharpening_units
    from plenofir.refocus.sharpening import WEIGHT_UNITS

    path = check_file(out, PICTURES, raster)
    part = _region(region) if region else None
    options.require("focus", "camera", focus != inf and camera is None)
    operator = interpolation is not None or sharpen is not None or not upsample
    for name, given in (("aperture", aperture), ("tilt", tilt)):
        if given and operator:
            options.refuse_both(name, "--interpolation, --sharpen or --no-upsample")
    pupil, rise = aperture_of(aperture), tilt_of(tilt)
    raw, m, *_ = read_field(raster, hints, rectangles=True)
    rectangle = is_rectangle(raw.pixels)
    if rectangle:
        used = {
            "interpolation": interpolation,
            "sharpen": sharpen,
            "upsample": not upsample,
            "aperture": aperture,
            "tilt": tilt,
            "border": border != "normalise",
            "camera": camera,
            "region": region,
        }
        options.refuse_used(used, "is for a square of views")
    setting = options.one_focus_setting(a, m, rounded=operator)
    if operator:
        options.shifts_of((setting,), m)
    model = model_of(camera, focus, m)
    look = look_for(raw, m, exposure, gamma)
    order = interpolation_order(interpolation or ("linear" if upsample else "nearest"))
    weight = sharpen or "off"
    with progress_bar("refocusing"):
        if rectangle:
            image = refocus_views(look.source, float(setting))
        elif operator:
            image = refocus(
                look.source,
                m,
                setting,
                interpolation=order,
                sharpen=weight,
                upsample=upsample,
                border=border,
                region=part,
            )
        else:
            image = best_picture(
                look.source, m, setting, aperture=pupil, tilt=rise, border=border, region=part
            )
    if image.size == 0:
        raise InputError(f"{region} lies outside of the picture", where="region")
    publish({path.name: look(image)._replace(xmp=described(m, setting, model))}, path.parent)
    units = sharpening_units(weight, m, int(setting * m), order) if operator else 0
    sharpened = f", sharpened with b = {Fraction(units, WEIGHT_UNITS)}" if units else ""
    size = f"{image.shape[1]} x {image.shape[0]} pixels"
    typer.echo(f"{out}: a = {setting_text(setting, m)}, {size}{sharpened}")
    print_lines(look.words())
    warn_of_camera(model)


def _region(text: str) -> tuple[slice, slice]:
    """Region of interest from TOP:BOTTOM,LEFT:RIGHT."""
    found = re.fullmatch(r"\s*(\d*):(\d*)\s*,\s*(\d*):(\d*)\s*", text)
    if found is None:
        raise InputError(
            f"{text} is not a region; write TOP:BOTTOM,LEFT:RIGHT in pixels", where="region"
        )
    top, bottom, left, right = (int(n) if n else None for n in found.groups())
    return slice(top, bottom), slice(left, right)


def _volume(
    raster: str,
    hints: "Hints",
    planes: tuple[list[str] | None, list[str] | None],
    out: str,
    camera: str | None,
    focus: float,
    **how: Any,
) -> str:
    """Write the stack of a light field as one file; what was written, for people."""
    from plenofir.camera.lightfield.any_field import is_rectangle, pictures_of
    from plenofir.commands.volumes import deepened, slices_of_volume
    from plenofir.ground.volumes import write_volume

    path = check_file(out, VOLUMES, raster)
    field, m, *_ = read_field(raster, hints, rectangles=True)
    pixels = deepened(field.pixels)
    if is_rectangle(pixels):
        used: dict[str, object] = {"camera": camera, "aperture": how["aperture"]}
        used["tilt"] = any(how["tilt"])
        options.refuse_used(used, "is for a square of views")
    chosen = slices_of_volume(*planes, camera, focus, m)
    with progress_bar("refocusing") as show:
        slices = pictures_of(pixels, m, chosen.settings, show, **how)
        total = len(chosen.settings)
        shape = write_volume(path, [slices], 1, total, voxel=chosen.voxel, about=chosen.about())
    return f"{out}: {chosen.words(1, shape[3:], pixels.dtype)}"


@app.command()
@file_options.takes_light_fields
def stack(
    raster: options.LightField,
    hints: "Hints",
    a: options.SettingsIfGiven = None,
    z: options.Heights = None,
    out: Annotated[
        str,
        typer.Option(
            help="Folder for the slices, or a volume: NAME.ome.tif (OME-TIFF) or NAME.tif (a "
            "hyperstack of ImageJ)."
        ),
    ] = "stack",
    everywhere: Annotated[
        bool,
        typer.Option(
            "--all-in-focus", help="Write a picture that is sharp everywhere too, all_in_focus.png."
        ),
    ] = False,
    index: Annotated[
        bool,
        typer.Option(
            "--depth-index",
            help="Write, as the VHDL computes them: the slice in which each micro image is "
            "sharpest (depth_index.png), the picture made of these slices (all_in_focus.png) and, "
            "of three slices or more, depth between slices (depth.png, depth.npy, confidence.png).",
        ),
    ] = False,
    radius: options.Radius = 1,
    aperture: options.Aperture = None,
    tilt: options.Tilt = None,
    border: options.BorderIfGiven = None,
    exposure: options.ExposureIfGiven = None,
    gamma: options.Gamma = None,
    camera: options.CameraIfGiven = None,
    focus: options.Focus = inf,
) -> None:
    """Refocus an aligned raw image to a stack of planes, and plot how sharp each is.

    Without focus settings it goes from 0 to 1 in steps of 1/M. Slices are made as refocus makes
    them, with one exposure for all, and the border is normalised; with --depth-index they are the
    VHDL's. A volume keeps the light field's values, in 16 bits, and with a microscope as --camera
    has sizes in um.
    """
    import numpy as np

    from plenofir.camera.depth_picture import depth_picture
    from plenofir.camera.described import described
    from plenofir.camera.lightfield.any_field import (
        is_rectangle,
        pictures_of,
        search_depth,
        sharp_everywhere,
        slices_of,
    )
    from plenofir.camera.lightfield.stack import sharpness_curve
    from plenofir.refocus import setting_names
    from plenofir.refocus.sharpness import (
        MAX_STACK,
        SURE,
        TEXTURE,
        confidence_level,
        depth_index,
        depth_index_picture,
        has_order,
    )

    how: dict[str, Any] = {"aperture": aperture_of(aperture), "tilt": tilt_of(tilt)}
    used: dict[str, object]
    if is_volume(out):
        used = {
            "all_in_focus": everywhere,
            "depth_index": index,
            "radius": radius != 1,
            "exposure": exposure is not None,
            "gamma": gamma is not None,
        }
        options.refuse_used(used, "is for a folder of slices")
        how["border"] = border or "normalise"
        typer.echo(_volume(raster, hints, (a, z), out, camera, focus, **how))
        return
    if z:
        raise InputError("is for volumes; give --out NAME.ome.tif, too", where=options.typed("z"))
    if index and everywhere:
        raise InputError("--depth-index writes all_in_focus.png too; leave out --all-in-focus")
    options.require("radius", "depth_index", radius != 1 and not index)
    options.require("focus", "camera", focus != inf and camera is None)
    for name, given in (("aperture", aperture), ("tilt", tilt)):
        if given and index:
            options.refuse_both(name, "--depth-index")
    check_folder(Path(out), out)
    raw, m, *_ = read_field(raster, hints, rectangles=True)
    if is_rectangle(raw.pixels):
        used = {"depth_index": index, "border": border, "aperture": aperture, "tilt": tilt}
        options.refuse_used(used, "is for a square of views")
    settings = options.focus_settings(a or ["0:1"], m, rounded=index)
    shifts = options.shifts_of(settings, m) if index else ()
    if index and len(settings) > MAX_STACK:
        raise InputError(
            f"--depth-index takes at most {MAX_STACK} slices, not {len(settings)}", where="a"
        )
    model = model_of(camera, focus, m)
    # Pixels of a picture, and for each micro lens.
    shape, lens = raw.pixels.shape[:2], m
    if is_rectangle(raw.pixels):
        shape, lens = raw.pixels.shape[2:4], 1
    # Near the borders views are missing.
    margin = ceil(max(abs(setting) for setting in settings) * (m - 1) / 2) * lens
    look = look_for(raw, m, exposure or "auto", gamma)
    lines = [f"{out}: {len(settings)} slices", look.words()]
    with progress_bar("refocusing") as show, Results(Path(out)) as results:
        # Slices are made again where they are needed again: that takes less than keeping them.
        edge = border or ("zero" if index else "normalise")
        pixels = raw.pixels
        slices: Slices
        shown: Slices
        if index:
            slices = slices_of(pixels, m, settings, show, border=edge)
            shown = slices_of(look.source, m, settings, show, border=edge)
        else:
            slices = shown = pictures_of(look.source, m, settings, show, border=edge, **how)
        names = iter(zip(setting_names(settings, m), settings, strict=True))
        for image in shown:
            name, setting = next(names)
            about = described(m, setting, model)
            save(results, f"refocused_{name}.png", look(image)._replace(xmp=about))
            # Before the next one is made.
            del image
        if min(shape) >= 2 * margin + 8 * lens:
            inside = slice(margin, shape[0] - margin), slice(margin, shape[1] - margin)
            curve = sharpness_curve(slices, inside, lens)
            try:
                from plenofir.camera.plots import sharpness_picture
            except ModuleNotFoundError as error:
                note(f"no sharpness.png: {missing(error.name or '').problem}")
            else:
                plot = sharpness_picture([float(setting) for setting in settings], {"": curve})
                save(results, "sharpness.png", plot)
            lines.insert(0, f"sharpest: a = {settings[int(np.argmax(curve))]}")
        if everywhere:
            found = search_depth(pixels, m, progress=show).disparity
            nearest = found.limited(float(min(settings)), float(max(settings)))
            sharp = sharp_everywhere(look.source, m, nearest, show)
            save(results, "all_in_focus.png", look(sharp))
        if index:
            channels, bits = (1, 3)[pixels.ndim > 2], 8 * pixels.dtype.itemsize
            level = confidence_level(TEXTURE, m, radius, channels, bits)
            between = shifts if len(shifts) > 2 and has_order(shifts) else ()
            sharpest = depth_index(slices, m, radius, confidence=level, shifts=between)
            if sharpest.confidence is not None:
                depth = sharpest.focus(shifts, m)
                sure = np.where(sharpest.confidence < SURE, np.nan, depth)
                save(results, "depth.npy", depth)
                save(results, "depth.png", depth_picture(sure))
                save(results, "confidence.png", sharpest.confidence)
            save(results, "all_in_focus.png", look.of_field(sharpest.image))
            of_pixels = sharpest.index.repeat(m, 0).repeat(m, 1)[: shape[0], : shape[1]]
            save(results, "depth_index.png", depth_index_picture(of_pixels, len(slices)))
    print_lines(*lines)
    warn_of_camera(model)
