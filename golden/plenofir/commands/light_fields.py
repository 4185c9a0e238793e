# SPDX-License-Identifier: Apache-2.0
"""Commands on light fields: views, mosaic, quilt, compose, refocus, stack, depth-map."""

import re
from fractions import Fraction
from math import ceil, inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from plenofir.commands import file_options, options
from plenofir.commands.console import print_lines, progress_bar
from plenofir.commands.rasters import (
    doubt_of_depth,
    model_of,
    read_field,
    recognised,
    warn_of_camera,
)
from plenofir.commands.results import PICTURES, check_file, publish, save
from plenofir.ground.errors import InputError
from plenofir.ground.files import Results, check_folder

if TYPE_CHECKING:
    from collections.abc import Callable

    from plenofir.camera.recognise import Hints
    from plenofir.commands.results import Floats
    from plenofir.ground.images import Image, Picture

app = typer.Typer()


@app.command()
@file_options.takes_light_fields
def views(
    raster: options.LightField,
    hints: "Hints",
    out: Annotated[
        str, typer.Option(help="Folder for the views, view_VV_UU.png (row, column).")
    ] = "views",
) -> None:
    """Write the sub-aperture images of an aligned raw image."""
    from plenofir.camera.lightfield import named_views
    from plenofir.camera.lightfield.any_field import all_views

    check_folder(Path(out), out)
    picture, m, *_ = read_field(raster, hints, rectangles=True)
    images = all_views(picture.pixels, m)
    files = {name: picture.like(view) for name, view in named_views(images).items()}
    publish(files, Path(out))
    rows, columns = images.shape[2:4]
    typer.echo(f"{out}: {len(files)} views of {columns} x {rows} pixels")


@app.command()
@file_options.takes_light_fields
def mosaic(
    raster: options.LightField,
    hints: "Hints",
    out: options.OutPng = "mosaic.png",
) -> None:
    """Write all views of an aligned raw image side by side, in one picture."""
    from plenofir.camera.lightfield.any_field import all_views
    from plenofir.camera.lightfield.exports import mosaic as side_by_side

    path = check_file(out, (".png",), raster)
    picture, m, *_ = read_field(raster, hints, rectangles=True)
    images = all_views(picture.pixels, m)
    publish({path.name: picture.like(side_by_side(images))}, path.parent)
    v, u, rows, columns = images.shape[:4]
    typer.echo(f"{out}: {u} x {v} views of {columns} x {rows} pixels")


@app.command()
@file_options.takes_light_fields
def quilt(
    raster: options.LightField,
    hints: "Hints",
    columns: Annotated[int | None, typer.Option(help="Columns of views.", min=1, max=100)] = None,
    rows: Annotated[int | None, typer.Option(help="Rows of views.", min=1, max=100)] = None,
    out: Annotated[
        str,
        typer.Option(help="Name without ending; _qsCOLUMNSxROWSaASPECT.png is added."),
    ] = "quilt",
    exposure: options.Exposure = "auto",
    gamma: options.Gamma = None,
) -> None:
    """Write the central row of views as a quilt for a Looking Glass.

    Without columns and rows it takes all views of the row. More than there are are interpolated,
    with the depth of the central view.
    """
    from plenofir.camera.lightfield.any_field import all_views, search_depth
    from plenofir.camera.lightfield.exports import quilt as arrange
    from plenofir.camera.lightfield.exports import quilt_name, quilt_tiles

    picture, m, *_ = read_field(raster, hints, rectangles=True)
    images = all_views(picture.pixels, m)
    line = images[len(images) // 2]
    if columns is None and rows is None:
        columns, rows = quilt_tiles(len(line))
    else:
        columns, rows = columns or max(1, len(line) // (rows or 1)), rows or 1
    view = line.shape[1:3]
    name = f"{quilt_name(out, view, columns, rows)}.png"
    path = check_file(name, (".png",), raster)
    disparity = None
    between = columns * rows > len(line) > 1
    if between:
        with progress_bar("matching") as show:
            found = search_depth(picture.pixels, m, progress=show)
        disparity = found.disparity.pixels_per_view
    image = arrange(line, columns, rows, disparity)
    look, exposed = _look(picture, m, exposure, gamma)
    publish({path.name: look(image)}, path.parent)
    typer.echo(f"{name}: {columns} x {rows} views of {view[1]} x {view[0]} pixels")
    if between:
        typer.echo(f"interpolated between {len(line)} views, with the depth of the central one")
    print_lines(exposed)


@app.command()
@file_options.takes_light_fields
def compose(
    folder: Annotated[
        str,
        typer.Argument(
            help="Folder of M x M views, a mosaic of all views, an ESLF picture, or a .mat file."
        ),
    ],
    hints: "Hints",
    out: options.OutPng = "aligned.png",
    keep: Annotated[
        int | None,
        typer.Option("--views", help="Keep this many central views along each side.", min=1),
    ] = None,
) -> None:
    """Compose an aligned raw image from views.

    The views come as a folder (the HCI benchmark's too), a mosaic, an ESLF picture or a .mat file.
    """
    from plenofir.camera.lightfield.indexing import central
    from plenofir.camera.lightfield.indexing import compose as interleave

    source = Path(folder)
    path = check_file(out, (".png",), *(source.iterdir() if source.is_dir() else (source,)))
    with progress_bar("reading") as show:
        seen = recognised(source, hints)
        picture = seen.all_views(show)
    images = picture.pixels if keep is None else central(picture.pixels, keep)
    if images.shape[0] != images.shape[1]:
        seen.field()
    publish({path.name: picture.like(interleave(images))}, path.parent)
    for finding in seen.findings:
        typer.echo(f"{finding.heading:<15} {finding.text}")
    m, _, rows, columns = images.shape[:4]
    typer.echo(f"{out}: M = {m}, {columns} x {rows} micro images")


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
    """Refocus an aligned raw image, correctly rounded.

    It is interpolated linearly and sharpened by 3/16, unless told otherwise: --interpolation
    nearest is the operator as the thesis and the VHDL have it, as --no-upsample is. The file says
    in XMP how it was made, with a camera also where it is focused.
    """
    from plenofir.camera.described import described
    from plenofir.camera.lightfield.stack import PICTURE
    from plenofir.refocus import interpolation_order, refocus, sharpening_units
    from plenofir.refocus.sharpening import WEIGHT_UNITS

    path = check_file(out, PICTURES, raster)
    part = _region(region) if region else None
    options.require("focus", "camera", focus != inf and camera is None)
    raw, m, *_ = read_field(raster, hints)
    setting = options.one_focus_setting(a, m)
    options.shifts_of((setting,), m)
    model = model_of(camera, focus, m)
    look, exposed = _look(raw, m, exposure, gamma)
    if sharpen is None:
        sharpen = str(PICTURE["sharpen"]) if upsample and interpolation is None else "off"
    order = interpolation_order(interpolation or (PICTURE["interpolation"] if upsample else 0))
    with progress_bar("refocusing"):
        image = refocus(
            raw.pixels,
            m,
            setting,
            interpolation=order,
            sharpen=sharpen,
            upsample=upsample,
            border=border,
            region=part,
        )
    if image.size == 0:
        raise InputError(f"{region} lies outside of the picture", where="region")
    publish({path.name: look(image)._replace(xmp=described(m, setting, model))}, path.parent)
    units = sharpening_units(sharpen, m, int(setting * m), order)
    sharpened = f", sharpened with b = {Fraction(units, WEIGHT_UNITS)}" if units else ""
    size = f"{image.shape[1]} x {image.shape[0]} pixels"
    typer.echo(f"{out}: a = {setting}, {size}{sharpened}")
    print_lines(exposed)
    warn_of_camera(model)


def _look(
    raw: "Picture", m: int, setting: str, gamma: float | None
) -> "tuple[Callable[[Image], Picture], str]":
    """What makes a picture of the light field one to look at, and a line that says how."""
    if setting == "off" and gamma is None:
        return raw.like, ""
    from plenofir.camera.exposure import exposure

    look = exposure(raw, m, setting, gamma)
    changed = "" if look.as_stored(raw) else f"exposed: {look.words()} (--exposure off: as it is)"
    return lambda image: look.shown(raw.like(image)), changed


def _region(text: str) -> tuple[slice, slice]:
    """Region of interest from TOP:BOTTOM,LEFT:RIGHT."""
    found = re.fullmatch(r"\s*(\d*):(\d*)\s*,\s*(\d*):(\d*)\s*", text)
    if found is None:
        raise InputError(
            f"{text} is not a region; write TOP:BOTTOM,LEFT:RIGHT in pixels", where="region"
        )
    top, bottom, left, right = (int(n) if n else None for n in found.groups())
    return slice(top, bottom), slice(left, right)


@app.command()
@file_options.takes_light_fields
def stack(
    raster: options.LightField,
    hints: "Hints",
    a: options.SettingsIfGiven = None,
    out: Annotated[str, typer.Option(help="Folder for the slices.")] = "stack",
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
    border: options.BorderIfGiven = None,
    exposure: options.Exposure = "auto",
    gamma: options.Gamma = None,
    camera: options.CameraIfGiven = None,
    focus: options.Focus = inf,
) -> None:
    """Refocus an aligned raw image to a stack of planes, and plot how sharp each is.

    Without focus settings it goes from 0 to 1 in steps of 1/M. Slices are linear and sharpened as
    refocus makes them, and the border is normalised; with --depth-index both are the VHDL's.
    """
    import numpy as np

    from plenofir.camera.described import described
    from plenofir.camera.lightfield.any_field import (
        is_rectangle,
        search_depth,
        sharp_everywhere,
        slices_of,
    )
    from plenofir.camera.lightfield.stack import PICTURE, sharpness_curve
    from plenofir.camera.plots import depth_picture, sharpness_picture
    from plenofir.refocus import slice_names
    from plenofir.refocus.sharpness import (
        MAX_STACK,
        SURE,
        TEXTURE,
        confidence_level,
        depth_index,
        depth_index_picture,
        has_order,
    )

    if index and everywhere:
        raise InputError("--depth-index writes all_in_focus.png too; leave out --all-in-focus")
    options.require("radius", "depth_index", radius != 1 and not index)
    options.require("focus", "camera", focus != inf and camera is None)
    check_folder(Path(out), out)
    raw, m, *_ = read_field(raster, hints, rectangles=True)
    if is_rectangle(raw.pixels) and (index or border):
        option = "depth_index" if index else "border"
        raise InputError("is for a square of views; leave it out", where=options.typed(option))
    settings = options.focus_settings(a or ["0:1"], m)
    shifts = options.shifts_of(settings, m)
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
    look, exposed = _look(raw, m, exposure, gamma)
    lines = [f"{out}: {len(settings)} slices", exposed]
    with progress_bar("refocusing") as show, Results(Path(out)) as results:
        # Slices are made again where they are needed again: that takes less than keeping them.
        edge = border or ("zero" if index else "normalise")
        pixels, how = raw.pixels, {} if index else PICTURE
        slices = slices_of(pixels, m, settings, show, border=edge)
        shown = slices_of(pixels, m, settings, show, border=edge, **how)
        names = iter(zip(slice_names(shifts, m), settings, strict=True))
        for image in shown:
            name, setting = next(names)
            about = described(m, setting, model)
            save(results, f"refocused_{name}.png", look(image)._replace(xmp=about))
            # Before the next one is made.
            del image
        if min(shape) >= 2 * margin + 8 * lens:
            inside = slice(margin, shape[0] - margin), slice(margin, shape[1] - margin)
            curve = sharpness_curve(slices, inside, lens)
            plot = sharpness_picture([float(setting) for setting in settings], {"": curve})
            save(results, "sharpness.png", plot)
            lines.insert(0, f"sharpest: a = {settings[int(np.argmax(curve))]}")
        if everywhere:
            found = search_depth(pixels, m, progress=show).disparity.pixels_per_view
            nearest = np.clip(found, float(min(settings)), float(max(settings)))
            save(results, "all_in_focus.png", look(sharp_everywhere(pixels, m, nearest, show)))
        if index:
            channels, bits = (1, 3)[pixels.ndim > 2], 8 * pixels.dtype.itemsize
            level = confidence_level(TEXTURE, m, radius, channels, bits)
            between = shifts if len(shifts) > 2 and has_order(shifts) else ()
            sharpest = depth_index(slices, m, radius, confidence=level, shifts=between)
            if sharpest.confidence is not None:
                depth = sharpest.focus(shifts, m)
                sure = np.where(sharpest.confidence < SURE, np.nan, depth)
                save(results, "depth.npy", depth)
                save(results, "depth.png", depth_picture(sure, in_mm=False))
                save(results, "confidence.png", sharpest.confidence)
            save(results, "all_in_focus.png", look(sharpest.image))
            of_pixels = sharpest.index.repeat(m, 0).repeat(m, 1)[: shape[0], : shape[1]]
            save(results, "depth_index.png", depth_index_picture(of_pixels, len(slices)))
    print_lines(*lines)
    warn_of_camera(model)


@app.command("depth-map")
@file_options.takes_light_fields
def depth_map(
    raster: options.LightField,
    hints: "Hints",
    camera: options.CameraIfGiven = None,
    focus: options.Focus = inf,
    near: Annotated[
        float | None,
        options.number(
            "--near",
            "Largest disparity searched, pixels per view; without it 2, or more if needed.",
        ),
    ] = None,
    far: Annotated[
        float | None,
        options.number(
            "--far",
            "Smallest disparity searched, pixels per view; without it -1, or less if needed.",
        ),
    ] = None,
    window: Annotated[
        int,
        typer.Option(
            "--window", help="Side of the matching window in pixels, an odd number.", min=1
        ),
    ] = 7,
    method: Annotated[
        Literal["guided", "windows", "structure-tensor"],
        typer.Option(
            help="How disparities are found: differences between views, averaged up to the edges "
            "of objects (guided) or over whole windows; or slopes in epipolar plane images "
            "(structure-tensor)."
        ),
    ] = "guided",
    confidence: Annotated[
        float,
        typer.Option(
            "--confidence",
            help="Depth with less confidence than this counts as unknown.",
            min=0,
            max=1,
        ),
    ] = 0.3,
    out: Annotated[str, typer.Option(help="Folder for the maps.")] = "depth",
    pfm: Annotated[bool, typer.Option("--pfm", help="Write distance_mm.pfm too.")] = False,
    tiff: Annotated[
        bool, typer.Option("--tiff", help="Write distance_mm.tif too, 32 bit floats.")
    ] = False,
    ply: Annotated[
        bool, typer.Option("--ply", help="Write points.ply too, a coloured point cloud in mm.")
    ] = False,
) -> None:
    """Find the depth in an aligned raw image: in mm if --camera is given, else as a.

    Without --near and --far the search range grows until it covers the picture.
    """
    import numpy as np

    from plenofir.camera.exposure import exposure
    from plenofir.camera.lightfield import exports
    from plenofir.camera.lightfield.any_field import central_view, is_rectangle, search_depth
    from plenofir.camera.lightfield.disparity import MANY, sure_distances
    from plenofir.camera.plots import depth_picture

    for option, given in (("pfm", pfm), ("tiff", tiff), ("ply", ply)):
        options.require(option, "camera", given and camera is None)
    options.require("focus", "camera", focus != inf and camera is None)
    check_folder(Path(out), out)
    field = read_field(raster, hints, rectangles=True)
    picture, m, *_ = field
    raw = picture.pixels
    if is_rectangle(raw) and camera is not None:
        raise InputError(
            "is for a plenoptic camera's square of views; leave it out", where="camera"
        )
    model = model_of(camera, focus, m)
    with progress_bar("matching") as show:
        found = search_depth(
            raw,
            m,
            smallest=far,
            largest=near,
            window=window,
            method=method,
            least_confidence=confidence,
            progress=show,
        )
    disparity = found.disparity
    files: dict[str, Image | Floats] = {
        "disparity.npy": disparity.pixels_per_view,
        "confidence.png": np.rint(255 * disparity.confidence).astype(np.uint8),
    }
    if model is None:
        sure = disparity.confidence >= confidence
        depth = np.where(sure, disparity.pixels_per_view, np.nan)
    else:
        files["distance_mm.npy"] = depth = sure_distances(disparity, model, confidence)
        tenths = np.clip(np.nan_to_num(np.rint(10 * depth), nan=0.0), 0, 65535)
        files["distance_tenth_mm.png"] = tenths.astype(np.uint16)
    files["depth.png"] = depth_picture(depth, in_mm=model is not None)
    with Results(Path(out)) as results:
        for name, values in files.items():
            save(results, name, values)
        if pfm:
            results.write("distance_mm.pfm", exports.encode_pfm(depth))
        if tiff:
            results.write("distance_mm.tif", exports.encode_float_tiff(depth))
        if ply and model is not None:
            colours = exposure(picture, m).apply(central_view(raw, m))
            results.write("points.ply", exports.encode_ply(exports.points(depth, model), colours))
    known, spread = depth[~np.isnan(depth)], ""
    if known.size:
        first, last = np.percentile(known, [5, 95])
        in_mm = f"{first:.0f} to {last:.0f} mm"
        spread = f", a = {first:.2f} to {last:.2f}" if model is None else f", {in_mm}"
    typer.echo(
        f"{out}: {'disparities' if model is None else 'distances'} of {known.size} of {depth.size}"
        f" pixels ({100 * known.size / depth.size:.1f} %){spread}"
    )
    print_lines(doubt_of_depth(known.size / depth.size, field))
    for share, end, option in zip(found.at_ends, found.search, ("far", "near"), strict=True):
        if share > MANY:
            typer.echo(
                f"note: {100 * share:.0f} % of the matched pixels lie at the {option} end of the "
                f"search, {end:g} pixels per view; widen it with {options.typed(option)}"
            )
    warn_of_camera(model)
