# SPDX-License-Identifier: Apache-2.0
"""Commands on light fields: views, mosaic, quilt, compose, depth-map."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from plenofir.commands import file_options, options
from plenofir.commands.console import print_lines, progress_bar
from plenofir.commands.focused import OfCapture, depth_maps
from plenofir.commands.groups import CameraData
from plenofir.commands.looks import look_for
from plenofir.commands.rasters import (
    MAPS,
    doubt_of_depth,
    model_of,
    read_field,
    recognised,
    unit_of,
    warn_of_camera,
)
from plenofir.commands.results import check_file, publish, save
from plenofir.ground.errors import InputError
from plenofir.ground.files import Results, check_folder

if TYPE_CHECKING:
    from plenofir.camera.recognise import Hints
    from plenofir.commands.results import Floats
    from plenofir.ground.images import Image

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

    # Large captures take seconds to read; a folder that cannot be written is told before.
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
    # A Looking Glass shows parallax along rows alone.
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
            searched = search_depth(picture.pixels, m, progress=show)
        disparity = searched.disparity.pixels_per_view
    image = arrange(line, columns, rows, disparity)
    look = look_for(picture, m, exposure, gamma)
    publish({path.name: look.of_field(image)}, path.parent)
    typer.echo(f"{name}: {columns} x {rows} views of {view[1]} x {view[0]} pixels")
    if between:
        typer.echo(f"interpolated between {len(line)} views, with the depth of the central one")
    print_lines(look.words())


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
    from plenofir.camera.recognise.request import as_asked

    source = Path(folder)
    # No view may be replaced by the raster that is made of it.
    path = check_file(out, (".png",), *(source.iterdir() if source.is_dir() else (source,)))
    with progress_bar("reading") as show:
        light_field = recognised(source, hints)
        picture = light_field.all_views(show)
    images = picture.pixels if keep is None else central(picture.pixels, keep)
    # Refused in the words that other commands have for a rectangle of views.
    if images.shape[0] != images.shape[1]:
        light_field.field()
    m = images.shape[0]
    raster = as_asked(picture.like(interleave(images)), m, hints, folder)
    publish({path.name: raster}, path.parent)
    for finding in light_field.findings:
        typer.echo(f"{finding.heading:<15} {finding.text}")
    rows, columns = (length // m for length in raster.pixels.shape[:2])
    typer.echo(f"{out}: M = {m}, {columns} x {rows} micro images")


@dataclass(frozen=True)
class _Exports:
    """Maps in formats of other programs."""

    pfm: Annotated[
        bool,
        typer.Option(
            "--pfm",
            help="Write disparity.pfm too, with --camera distance_mm.pfm or height_um.pfm; unknown "
            "is inf.",
        ),
    ] = False
    tiff: Annotated[
        bool,
        typer.Option("--tiff", help="Write the same as .tif too, 32 bit floats; unknown is nan."),
    ] = False
    ply: Annotated[
        bool,
        typer.Option(
            "--ply", help="Write points.ply too, a coloured point cloud in mm, of the views' size."
        ),
    ] = False

    def check(self, hints: "Hints", unit: str) -> None:
        """Refuse points of a microscope, or of a part."""
        if self.ply and unit == "um":
            raise InputError("is in mm, of cameras; leave it out for a microscope", where="ply")
        if self.ply and hints.crop:
            options.refuse_both("ply", "--crop", "the axis is that of the whole light field")


@app.command("depth-map")
@file_options.takes_light_fields
def depth_map(
    raster: options.LightField,
    hints: "Hints",
    *,
    camera: CameraData,
    of: OfCapture,
    near: Annotated[
        float | None,
        options.number(
            "--near",
            "Largest disparity searched, pixels per view; without it 2, or more if needed. Of a "
            "focused camera one end of the virtual depth searched, without it 1.6.",
        ),
    ] = None,
    far: Annotated[
        float | None,
        options.number(
            "--far",
            "Smallest disparity searched, pixels per view; without it -1, or less if needed. Of a "
            "focused camera the other end, without it 12.",
        ),
    ] = None,
    confidence: Annotated[
        float,
        typer.Option(
            "--confidence",
            help="Depth that is less likely than this to be right counts as unknown.",
            min=0,
            max=1,
        ),
    ] = 0.5,
    out: Annotated[str, typer.Option(help="Folder for the maps.")] = "depth",
    resolution: Annotated[
        Literal["views", "sensor"],
        typer.Option(
            help="Maps with a value for each micro lens, as the views have, or for each pixel of "
            "the raw image."
        ),
    ] = "views",
    more: _Exports,
) -> None:
    """Find the depth in an aligned raw image: in mm if --camera is given, else as a.

    With a microscope as --camera it is the height over the plane in focus, in um.

    Without --near and --far the search range grows until it covers the picture. With --calib it
    takes a raw capture; that of a focused camera has virtual depth, and mm with its --camera.
    """
    import numpy as np

    from plenofir.camera.depth_picture import depth_picture
    from plenofir.camera.exposure import exposure
    from plenofir.camera.lightfield import exports
    from plenofir.camera.lightfield.any_field import central_view, is_rectangle, search_depth
    from plenofir.camera.lightfield.disparity import MANY, sure_distances
    from plenofir.camera.lightfield.enlarged import at_sensor
    from plenofir.camera.rays import RayModel

    options.require("ply", "camera", more.ply and camera.camera is None)
    camera.check()
    check_folder(Path(out), out)
    capture = of.opened(raster, hints, camera, "off", None)
    if capture is not None:
        standard = {"pfm": more.pfm, "tiff": more.tiff, "ply": more.ply, "-M": hints.micro_image}
        depth_maps(
            capture,
            (near, far),
            confidence,
            Path(out),
            {**standard, "resolution": resolution != "views"},
        )
        return
    hints = hints._replace(calib=of.calib)
    field = read_field(raster, hints, rectangles=True)
    picture, m, *_ = field
    raw = picture.pixels
    if is_rectangle(raw) and camera.camera is not None:
        raise InputError(
            "is for a plenoptic camera's square of views; leave it out", where="camera"
        )
    if is_rectangle(raw) and resolution == "sensor":
        raise InputError("sensor is for a square of views; take views", where="resolution")
    model = model_of(camera.camera, camera.focus, m)
    unit = unit_of(model)
    name = MAPS[unit]
    more.check(hints, unit)
    with progress_bar("matching") as show:
        searched = search_depth(
            raw,
            m,
            smallest=far,
            largest=near,
            progress=show,
        )
    disparity, view = searched.disparity, central_view(raw, m)
    if resolution == "sensor":
        rows, columns = raw.shape[:2]
        disparity = at_sensor(disparity, view, m, (rows, columns))
    files: dict[str, Image | Floats] = {
        "disparity.npy": disparity.pixels_per_view,
        "confidence.png": np.rint(255 * disparity.confidence).astype(np.uint8),
    }
    if model is None:
        sure = disparity.confidence >= confidence
        depth = np.where(sure, disparity.pixels_per_view, np.nan)
    else:
        files[f"{name}.npy"] = depth = sure_distances(disparity, model, confidence)
        if unit == "mm":
            # A PNG that viewers open has 16 bits: tenths of a mm reach to 6.5 m.
            tenths = np.clip(np.nan_to_num(np.rint(10 * depth), nan=0.0), 0, 65535)
            files["distance_tenth_mm.png"] = tenths.astype(np.uint16)
    files["depth.png"] = depth_picture(depth, unit)
    with Results(Path(out)) as results:
        for file, values in files.items():
            save(results, file, values)
        if more.pfm:
            results.write(f"{name}.pfm", exports.encode_pfm(depth))
        if more.tiff:
            results.write(f"{name}.tif", exports.encode_float_tiff(depth))
        if more.ply and isinstance(model, RayModel):
            # One point for each micro lens, at any resolution of the maps: more would repeat it.
            places = exports.points(sure_distances(searched.disparity, model, confidence), model)
            colours = exposure(picture, m).apply(view)
            results.write("points.ply", exports.encode_ply(places, colours))
    typer.echo(f"{out}: {_extent(depth[~np.isnan(depth)], depth.size, unit)}")
    print_lines(doubt_of_depth(1 - float(np.isnan(depth).mean()), field))
    for share, end, option in zip(searched.at_ends, searched.search, ("far", "near"), strict=True):
        if share > MANY:
            typer.echo(
                f"note: {100 * share:.0f} % of the matched pixels lie at the {option} end of the "
                f"search, {end:g} pixels per view; widen it with {options.typed(option)}"
            )
    warn_of_camera(model)


def _extent(depths: "Floats", places: int, unit: str) -> str:
    """How much of a map is known, and from where to where, for people."""
    import numpy as np

    spread = ""
    if depths.size:
        first, last = np.percentile(depths, [5, 95])
        spread = {
            "a": f", a = {first:.2f} to {last:.2f}",
            "mm": f", {first:.0f} to {last:.0f} mm",
            "um": f", z = {first:.1f} to {last:.1f} um over the plane in focus",
        }[unit]
    maps = {"a": "disparities", "mm": "distances", "um": "heights"}[unit]
    part = f"{100 * depths.size / places:.1f} %"
    return f"{maps} of {depths.size} of {places} pixels ({part}){spread}"
