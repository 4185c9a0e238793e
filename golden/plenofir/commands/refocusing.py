# SPDX-License-Identifier: Apache-2.0
"""Commands that refocus: refocus, stack."""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from fractions import Fraction
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plenofir.commands import file_options, options
from plenofir.commands.console import note, print_lines, progress_bar
from plenofir.commands.focused import AtDepth, refocus_to, sweep
from plenofir.commands.focused_volumes import write_planes
from plenofir.commands.groups import CameraData, LookIfGiven, LookOptions, Operator, Pupil
from plenofir.commands.looks import look_for, setting_text
from plenofir.commands.rasters import model_of, read_field, warn_of_camera
from plenofir.commands.results import PICTURES, VOLUMES, check_file, is_volume, publish, save
from plenofir.ground.errors import InputError
from plenofir.ground.extras import missing
from plenofir.ground.files import Results, check_folder

if TYPE_CHECKING:
    from plenofir.camera.recognise import Hints
    from plenofir.commands.looks import Look as FieldLook
    from plenofir.refocus.operator import Image
    from plenofir.refocus.sharpness import Slices

app = typer.Typer()

_FOCUSED = "is for a capture with the calibration of a focused camera, --calib"


@app.command("refocus")
@file_options.takes_light_fields
def refocus_command(
    raster: options.LightField,
    hints: "Hints",
    *,
    a: options.FocusSetting = None,
    of: AtDepth,
    out: Annotated[str, typer.Option(help="PNG, TIFF or JPEG file to write.")] = "refocused.png",
    operator: Operator,
    pupil: Pupil,
    border: options.Border = "normalise",
    exposed: LookOptions,
    camera: CameraData,
    region: Annotated[
        str | None,
        typer.Option(
            help="Compute only this part of the result: TOP:BOTTOM,LEFT:RIGHT in its pixels."
        ),
    ] = None,
) -> None:
    """Refocus an aligned raw image to a picture to look at, at any real a.

    --interpolation, --sharpen and --no-upsample take the operator as the thesis has it instead,
    correctly rounded, at multiples of 1/M. The file says in XMP how it was made, with a camera also
    where it is focused. With --calib it takes a raw capture; that of a focused camera is refocused
    to a virtual depth, -v.
    """
    from plenofir.camera.description import description_of
    from plenofir.camera.lightfield.any_field import is_rectangle
    from plenofir.camera.lightfield.shift_and_add import refocus_views
    from plenofir.refocus import best_picture, interpolation_order, refocus, sharpening_units
    from plenofir.refocus.sharpening import WEIGHT_UNITS

    path = check_file(out, PICTURES, raster, of.calib)
    # What is wrong with options is told before a large file is read.
    part = _region(region) if region else None
    camera.check()
    field = of.opened(raster, hints, camera, exposed.exposure, exposed.gamma)
    if field is not None:
        standard: dict[str, object] = {"a": a, "box": pupil.box, "micro_image": hints.micro_image}
        standard |= {"interpolation": operator.interpolation, "sharpen": operator.sharpen}
        standard |= {"upsample": not operator.upsample, "aperture": pupil.aperture}
        standard |= {"tilt": pupil.tilt, "border": border != "normalise", "region": region}
        refocus_to(field, of.virtual_depth, path, standard)
        return
    options.refuse_used({"virtual_depth": of.virtual_depth}, _FOCUSED)
    if a is None:
        raise InputError("give a focus setting, such as -3/5", where="a")
    hints = hints._replace(calib=of.calib)
    exact = operator.is_set
    if exact:
        pupil.refuse_beside("--interpolation, --sharpen or --no-upsample")
    how = pupil.how()
    raw, m, *_ = read_field(raster, hints, rectangles=True)
    rectangle = is_rectangle(raw.pixels)
    if rectangle:
        used = {
            "interpolation": operator.interpolation,
            "sharpen": operator.sharpen,
            "box": pupil.box,
            "upsample": not operator.upsample,
            "aperture": pupil.aperture,
            "tilt": pupil.tilt,
            "border": border != "normalise",
            "camera": camera.camera,
            "region": region,
        }
        options.refuse_used(used, "is for a square of views")
    # The operator has multiples of 1/M alone; pictures to look at take any a between two of them.
    setting = options.one_focus_setting(a, m, rounded=exact)
    if exact:
        options.shifts_of((setting,), m)
    model = model_of(camera.camera, camera.focus, m)
    look = look_for(raw, m, exposed.exposure, exposed.gamma)
    order = interpolation_order(
        operator.interpolation or ("linear" if operator.upsample else "nearest")
    )
    weight = operator.sharpen or "off"
    with progress_bar("refocusing"):
        if rectangle:
            image = refocus_views(look.source, float(setting))
        elif exact:
            image = refocus(
                look.source,
                m,
                setting,
                interpolation=order,
                sharpen=weight,
                upsample=operator.upsample,
                border=border,
                box=pupil.box,
                region=part,
            )
        else:
            image = best_picture(look.source, m, setting, border=border, region=part, **how)
    if image.size == 0:
        raise InputError(f"{region} lies outside of the picture", where="region")
    publish({path.name: look(image)._replace(xmp=description_of(m, setting, model))}, path.parent)
    # With "auto" the weight depends on the slice, so it is told.
    units = sharpening_units(weight, m, int(setting * m), order, box=pupil.box) if exact else 0
    sharpened = f", sharpened with b = {Fraction(units, WEIGHT_UNITS)}" if units else ""
    size = f"{image.shape[1]} x {image.shape[0]} pixels"
    typer.echo(f"{out}: a = {setting_text(setting, m)}, {size}{sharpened}")
    of_best = () if exact or rectangle else (setting,)
    print_lines(look.words(), *pupil.words(m, of_best))
    warn_of_camera(model)


def _region(text: str) -> tuple[slice, slice]:
    """Region of interest from TOP:BOTTOM,LEFT:RIGHT."""
    match = re.fullmatch(r"\s*(\d*):(\d*)\s*,\s*(\d*):(\d*)\s*", text)
    if match is None:
        raise InputError(
            f"{text} is not a region; write TOP:BOTTOM,LEFT:RIGHT in pixels", where="region"
        )
    top, bottom, left, right = (int(n) if n else None for n in match.groups())
    return slice(top, bottom), slice(left, right)


def _volume_file(
    out: str, z: list[str] | None, of_folders: Mapping[str, object], *inputs: str | None
) -> Path | None:
    """The file of a volume, if one is asked for."""
    if is_volume(out):
        options.refuse_used(of_folders, "is for a folder of slices")
        return check_file(out, VOLUMES, *inputs)
    if z:
        raise InputError("is for volumes; give --out NAME.ome.tif, too", where=options.typed("z"))
    return None


def _volume(
    raster: str,
    hints: "Hints",
    planes: tuple[list[str] | None, list[str] | None],
    path: Path,
    camera: CameraData,
    **how: Any,
) -> str:
    """Write the stack of a light field as one file; what was written, for people."""
    from plenofir.camera.lightfield.any_field import is_rectangle, pictures_of
    from plenofir.commands.volumes import deepened, slices_of_volume
    from plenofir.ground.volumes import write_volume

    field, m, *_ = read_field(raster, hints, rectangles=True)
    pixels = deepened(field.pixels)
    if is_rectangle(pixels):
        used: dict[str, object] = {"camera": camera.camera, "aperture": how["aperture"]}
        used["box"] = how["box"]
        used["tilt"] = any(how["tilt"])
        options.refuse_used(used, "is for a square of views")
    chosen = slices_of_volume(*planes, camera.camera, camera.focus, m)
    with progress_bar("refocusing") as show:
        slices = pictures_of(pixels, m, chosen.settings, show, **how)
        total = len(chosen.settings)
        shape = write_volume(path, [slices], 1, total, voxel=chosen.voxel, about=chosen.about())
    return f"{path}: {chosen.words(1, shape[3:], pixels.dtype)}"


@dataclass(frozen=True)
class _Extra:
    """Results beside the slices."""

    everywhere: Annotated[
        bool,
        typer.Option(
            "--all-in-focus", help="Write a picture that is sharp everywhere too, all_in_focus.png."
        ),
    ] = False
    index: Annotated[
        bool,
        typer.Option(
            "--depth-index",
            help="Write, as the VHDL computes them: the slice in which each micro image is "
            "sharpest (depth_index.png), the picture made of these slices (all_in_focus.png) and, "
            "of three slices or more, depth between slices (depth.png, depth.npy, confidence.png).",
        ),
    ] = False
    radius: options.Radius = 1

    def refuse_beside(self, pupil: Pupil) -> None:
        """Refuse an aperture or a tilt beside the VHDL's slices."""
        if self.index:
            pupil.refuse_beside("--depth-index")

    def check(self) -> None:
        """Refuse options that cannot be combined."""
        if self.index and self.everywhere:
            raise InputError("--depth-index writes all_in_focus.png too; leave out --all-in-focus")
        options.require("radius", "depth_index", self.radius != 1 and not self.index)


@app.command()
@file_options.takes_light_fields
def stack(
    raster: options.LightField,
    hints: "Hints",
    *,
    a: options.SettingsIfGiven = None,
    z: options.Heights = None,
    of: AtDepth,
    out: Annotated[
        str,
        typer.Option(
            help="Folder for the slices, or a volume: NAME.ome.tif (OME-TIFF) or NAME.tif (a "
            "hyperstack of ImageJ)."
        ),
    ] = "stack",
    extra: _Extra,
    pupil: Pupil,
    border: options.BorderIfGiven = None,
    exposed: LookIfGiven,
    camera: CameraData,
) -> None:
    """Refocus an aligned raw image to a stack of planes, and plot how sharp each is.

    Without focus settings it goes from 0 to 1 in steps of 1/M. Slices are made as refocus makes
    them, with one exposure for all, and the border is normalised; with --depth-index they are the
    VHDL's, and --box is for what all_in_focus.png has in focus. A volume keeps the light field's
    values, in 16 bits, and with a microscope as --camera has sizes in um. A focused camera's
    capture, with --calib, is swept over virtual depths, -v; with its --camera a volume's planes can
    be given by --z, distances from the micro lenses in mm.
    """
    from plenofir.camera.description import description_of
    from plenofir.camera.lightfield.any_field import (
        is_rectangle,
        pictures_of,
        search_depth,
        sharp_everywhere,
        slices_of,
    )
    from plenofir.refocus import setting_names
    from plenofir.refocus.sharpness import MAX_STACK

    how = pupil.how()
    of_folders = {
        "all_in_focus": extra.everywhere,
        "depth_index": extra.index,
        "radius": extra.radius != 1,
        "exposure": exposed.exposure is not None,
        "gamma": exposed.gamma is not None,
    }
    volume = _volume_file(out, z, of_folders, raster, of.calib)
    field = of.opened(raster, hints, camera, exposed.exposure or "auto", exposed.gamma)
    if field is not None:
        standard: dict[str, object] = {
            "a": a,
            "border": border,
            "depth_index": extra.index,
            "aperture": pupil.aperture,
            "tilt": pupil.tilt,
            "box": pupil.box,
        }
        if volume is None:
            sweep(field, of.virtual_depth, Path(out), standard, everywhere=extra.everywhere)
        else:
            write_planes(field, (of.virtual_depth, z), volume, standard)
        return
    options.refuse_used({"virtual_depth": of.virtual_depth}, _FOCUSED)
    hints = hints._replace(calib=of.calib)
    if volume is not None:
        typer.echo(
            _volume(raster, hints, (a, z), volume, camera, border=border or "normalise", **how)
        )
        return
    extra.check()
    camera.check()
    extra.refuse_beside(pupil)
    check_folder(Path(out), out)
    raw, m, *_ = read_field(raster, hints, rectangles=True)
    if is_rectangle(raw.pixels):
        beside = {"border": border, **asdict(pupil)}
        options.refuse_used({"depth_index": extra.index, **beside}, "is for a square of views")
    settings = options.focus_settings(a or ["0:1"], m, rounded=extra.index)
    shifts = options.shifts_of(settings, m) if extra.index else ()
    if extra.index and len(settings) > MAX_STACK:
        raise InputError(
            f"--depth-index takes at most {MAX_STACK} slices, not {len(settings)}", where="a"
        )
    model = model_of(camera.camera, camera.focus, m)
    look = look_for(raw, m, exposed.exposure or "auto", exposed.gamma)
    lines = [f"{out}: {len(settings)} slices", look.words(), *pupil.words(m, settings)]
    with progress_bar("refocusing") as show, Results(Path(out)) as results:
        # Slices are made again where they are needed again: that takes less than keeping them.
        edge = border or ("zero" if extra.index else "normalise")
        slices: Slices
        pictures: Slices
        if extra.index:
            slices = slices_of(raw.pixels, m, settings, show, border=edge)
            pictures = slices_of(look.source, m, settings, show, border=edge)
        else:
            slices = pictures = pictures_of(look.source, m, settings, show, border=edge, **how)
        names = iter(zip(setting_names(settings, m), settings, strict=True))
        for image in pictures:
            name, setting = next(names)
            about = description_of(m, setting, model)
            save(results, f"refocused_{name}.png", look(image)._replace(xmp=about))
            # Before the next one is made.
            del image
        if sharpest := _save_curve(results, slices, settings, raw.pixels, m):
            lines.insert(0, sharpest)
        if extra.everywhere:
            disparity = search_depth(raw.pixels, m, progress=show).disparity
            nearest = disparity.limited(float(min(settings)), float(max(settings)))
            everywhere = sharp_everywhere(look.source, m, nearest, show, box=pupil.box)
            save(results, "all_in_focus.png", look(everywhere))
        if extra.index:
            sharp = slices_of(raw.pixels, m, settings, show, border=edge, box=pupil.box)
            _save_index(
                results,
                (slices, sharp if pupil.box else None),
                shifts,
                raw.pixels,
                m,
                extra.radius,
                look,
            )
    print_lines(*lines)
    warn_of_camera(model)


def _save_curve(
    results: Results, slices: "Slices", settings: tuple[Fraction, ...], pixels: "Image", m: int
) -> str:
    """Plot how sharp slices are; which is the sharpest, for people. Nothing of small pictures."""
    import numpy as np

    from plenofir.camera.lightfield.any_field import is_rectangle
    from plenofir.camera.lightfield.stack import sharpness_curve

    # Pixels of a picture, and for each micro lens.
    shape, lens = pixels.shape[:2], m
    if is_rectangle(pixels):
        shape, lens = pixels.shape[2:4], 1
    # Near the borders views are missing.
    margin = ceil(max(abs(setting) for setting in settings) * (m - 1) / 2) * lens
    if min(shape) < 2 * margin + 8 * lens:
        return ""
    inside = slice(margin, shape[0] - margin), slice(margin, shape[1] - margin)
    curve = sharpness_curve(slices, inside, lens)
    try:
        from plenofir.camera.plots import sharpness_picture
    except ModuleNotFoundError as error:
        note(f"no sharpness.png: {missing(error.name or '').problem}")
    else:
        plot = sharpness_picture([float(setting) for setting in settings], {"": curve})
        save(results, "sharpness.png", plot)
    return f"sharpest: a = {settings[int(np.argmax(curve))]}"


def _save_index(
    results: Results,
    stacks: "tuple[Slices, Slices | None]",
    shifts: tuple[int, ...],
    pixels: "Image",
    m: int,
    radius: int,
    look: "FieldLook",
) -> None:
    """Write the sharpest slice of each micro image, as the VHDL finds it, and depth between.

    `stacks`: the slices, and those with smaller boxes for what is in focus.
    """
    import numpy as np

    from plenofir.camera.depth_picture import depth_picture
    from plenofir.refocus.sharpness import (
        SURE,
        TEXTURE,
        confidence_level,
        depth_index,
        depth_index_picture,
        has_order,
    )

    channels, bits = (1, 3)[pixels.ndim > 2], 8 * pixels.dtype.itemsize
    level = confidence_level(TEXTURE, m, radius, channels, bits)
    between = shifts if len(shifts) > 2 and has_order(shifts) else ()
    slices, sharp = stacks
    sharpest = depth_index(slices, m, radius, confidence=level, shifts=between, sharp=sharp)
    if sharpest.confidence is not None:
        depth = sharpest.focus(shifts, m)
        sure = np.where(sharpest.confidence < SURE, np.nan, depth)
        save(results, "depth.npy", depth)
        save(results, "depth.png", depth_picture(sure))
        save(results, "confidence.png", sharpest.confidence)
    save(results, "all_in_focus.png", look.of_field(sharpest.image))
    rows, columns = pixels.shape[:2]
    of_pixels = sharpest.index.repeat(m, 0).repeat(m, 1)[:rows, :columns]
    save(results, "depth_index.png", depth_index_picture(of_pixels, len(slices)))
