"""Commands from a raw capture to pictures: calibrate, decode, views, refocus, stack, depth-map."""

import io
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from fractions import Fraction
from math import ceil, floor
from pathlib import Path
from typing import Annotated, cast

import numpy as np
import numpy.typing as npt
import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from plenofir.commands.rays import CameraOption, FocusOption, integer, number
from plenofir.errors import InputError
from plenofir.files import Results, check_folder
from plenofir.images import encode_png, read_image
from plenofir.refocus import (
    check_raw,
    focus_to_shift,
    interpolation_order,
    parse_focus,
    refocus,
)
from plenofir.refocus.operator import Image

RasterArgument = Annotated[
    str, typer.Argument(help="Aligned raw image: micro images of exactly M x M pixels.")
]
MicroImageOption = Annotated[
    str, typer.Option("--micro-image", "-M", help="M: micro image size in pixels.")
]
DarkOption = Annotated[str, typer.Option("--dark", help="Dark frame of the same size.")]

Floats = npt.NDArray[np.float64]

_LARGEST_STACK = 1000


@contextmanager
def progress_bar(description: str) -> Iterator[Callable[[int, int], None]]:
    """Progress bar on standard error while something runs.

    Parameters
    ----------
    description
        What runs.

    Yields
    ------
    Callable
        To be called with what is done and to do.
    """
    from rich.console import Console

    columns = (TextColumn("{task.description:<14}"), BarColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    hidden = not console.is_terminal
    with Progress(*columns, transient=True, console=console, disable=hidden) as bars:
        task = bars.add_task(description, total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)


def _check_file(out: str, suffixes: tuple[str, ...]) -> Path:
    """Refuse a result file that cannot be written, before any work is done."""
    path = Path(out)
    if path.suffix.lower() not in suffixes:
        raise InputError("no such kind of file", where=out, expected=" or ".join(suffixes))
    if path.is_dir():
        raise InputError("is a folder", where=out, expected="a file")
    check_folder(path.parent, out)
    return path


def _publish(files: Mapping[str, Image | Floats], folder: Path) -> None:
    """Write PNG and NumPy files, all or none of them."""
    with Results(folder) as results:
        for name, values in files.items():
            if name.endswith(".npy"):
                content = io.BytesIO()
                np.save(content, values)
                results.write(name, content.getbuffer())
            else:
                results.write(name, encode_png(cast("Image", values)))


def _optional(path: str) -> Image | None:
    return read_image(Path(path)) if path else None


def _raster(path: str, micro_image: str) -> tuple[Image, int]:
    m = integer(micro_image, "--micro-image")
    raw = read_image(Path(path))
    check_raw(raw, m, where=path)
    return raw, m


def calibrate(
    white: Annotated[str, typer.Argument(help="White image: an evenly lit, diffuse surface.")],
    out: Annotated[str, typer.Option(help="Calibration file to write.")] = "calib.json",
    dark: DarkOption = "",
    layout: Annotated[
        str,
        typer.Option(help="rectangular, hexagonal-rows, hexagonal-columns; auto finds out."),
    ] = "auto",
    order: Annotated[
        str,
        typer.Option(help="Order of the grid: 1 to 3 (distortion); auto: as low as will do."),
    ] = "auto",
    picture: Annotated[
        str, typer.Option(help="Draw the centres found into the white image: a PNG file.")
    ] = "",
) -> None:
    """Find the micro image centres of a camera from its white image."""
    from plenofir.camera.calibration import Layout
    from plenofir.camera.calibration import calibrate as find
    from plenofir.camera.calibration.grid import MAX_ORDER

    path = _check_file(out, (".json",))
    picture_path = _check_file(picture, (".png",)) if picture else None
    layouts = ("rectangular", "hexagonal-rows", "hexagonal-columns")
    if layout not in ("auto", *layouts):
        raise InputError(f"{layout!r}", where="--layout", expected=f"auto, {', '.join(layouts)}")
    degree = None if order == "auto" else integer(order, "--order")
    if degree is not None and not 1 <= degree <= MAX_ORDER:
        raise InputError(order, where="--order", expected=f"auto, or 1 to {MAX_ORDER}")
    image = read_image(Path(white))
    with progress_bar("calibrating"):
        found = find(
            image,
            _optional(dark),
            layout=None if layout == "auto" else cast("Layout", layout),
            order=degree,
            where=white,
            dark_where=dark,
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    found.save(path)
    if picture_path is not None:
        _publish({picture_path.name: _marked(image, found.centres)}, picture_path.parent)
    rows, columns = found.lenses
    count = int((~np.isnan(found.centres[..., 0])).sum())
    grid = found.grid
    typer.echo(f"micro images  {count} ({columns} x {rows}, {len(found.missing)} missing)")
    typer.echo(f"layout        {grid.layout}, order {grid.order}")
    typer.echo(f"pitch         {grid.pitch[1]:.4f} x {grid.pitch[0]:.4f} pixels")
    typer.echo(f"rotation      {grid.rotation_degrees:.4f} degrees")
    typer.echo(f"scatter       {found.residual_px:.4f} pixels ({found.used} centroids used)")
    if found.clipped_share > 0.01:
        share = f"{100 * found.clipped_share:.0f} %"
        typer.echo(f"note          {share} of the pixels at full scale: vignetting is not known")
    typer.echo(f"file          {out}")


def _marked(image: Image, centres: Floats) -> Image:
    """White image as 8 bit RGB with a red cross on each centre."""
    from plenofir.camera.calibration.frames import grey

    levels = grey(image)
    levels = np.clip(levels / max(float(np.percentile(levels, 99.9)), 1.0), 0, 1) * 255
    result = np.repeat(levels.astype(np.uint8)[:, :, np.newaxis], 3, axis=2)
    points = np.rint(centres[~np.isnan(centres[..., 0])]).astype(int)
    for y, x in ((-1, 0), (0, -1), (0, 0), (0, 1), (1, 0)):
        place = np.clip(points + (y, x), 0, np.array(levels.shape) - 1)  # noqa: RUF005
        result[place[:, 0], place[:, 1]] = (255, 0, 0)
    return result


def decode(
    raw: Annotated[str, typer.Argument(help="Raw capture: 8 or 16 bit, grey or RGB.")],
    calib: Annotated[str, typer.Option(help="Calibration file (plenofir calibrate).")],
    micro_image: MicroImageOption,
    out: Annotated[str, typer.Option(help="PNG file to write.")] = "aligned.png",
    dark: DarkOption = "",
    white: Annotated[str, typer.Option(help="White image, to divide by it pixel by pixel.")] = "",
    interpolation: Annotated[str, typer.Option(help="bilinear or cubic.")] = "bilinear",
    scale: Annotated[
        str, typer.Option(help="native: crop micro images to M. fit: scale them to M.")
    ] = "native",
    devignette: Annotated[
        bool, typer.Option("--devignette/--no-devignette", help="Correct vignetting.")
    ] = True,
) -> None:
    """Resample a raw capture to aligned micro images of M x M pixels."""
    from plenofir.camera.calibration import decode as resample
    from plenofir.camera.calibration import load_calibration
    from plenofir.camera.calibration.resample import Interpolation, Scale

    path = _check_file(out, (".png",))
    m = integer(micro_image, "--micro-image")
    calibration = load_calibration(calib)
    capture = read_image(Path(raw))
    with progress_bar("decoding") as show:
        raster = resample(
            capture,
            calibration,
            m,
            dark=_optional(dark),
            white=_optional(white),
            interpolation=cast("Interpolation", interpolation),
            scale=cast("Scale", scale),
            devignette=devignette,
            where=raw,
            progress=show,
        )
    _publish({path.name: raster}, path.parent)
    rows, columns = raster.shape[0] // m, raster.shape[1] // m
    typer.echo(f"{out}: {columns} x {rows} micro images of {m} x {m} pixels")


def views(
    raster: RasterArgument,
    micro_image: MicroImageOption,
    out: Annotated[str, typer.Option(help="Folder for view_VV_UU.png.")] = "views",
) -> None:
    """Write the sub-aperture images of an aligned raw image."""
    from plenofir.camera.lightfield.folders import named_views

    raw, m = _raster(raster, micro_image)
    check_folder(Path(out), out)
    files = named_views(raw, m)
    _publish(files, Path(out))
    rows, columns = raw.shape[0] // m, raw.shape[1] // m
    typer.echo(f"{out}: {len(files)} views of {columns} x {rows} pixels")


def compose(
    folder: Annotated[str, typer.Argument(help="Folder of M x M views.")],
    out: Annotated[str, typer.Option(help="PNG file to write.")] = "aligned.png",
    order: Annotated[
        str, typer.Option(help="rows: the first number in the names counts downwards; columns.")
    ] = "rows",
) -> None:
    """Compose an aligned raw image from a folder of views."""
    from plenofir.camera.lightfield.folders import ViewOrder, read_views
    from plenofir.camera.lightfield.indexing import compose as interleave

    path = _check_file(out, (".png",))
    with progress_bar("reading") as show:
        images = read_views(Path(folder), order=cast("ViewOrder", order), progress=show)
    _publish({path.name: interleave(images)}, path.parent)
    m, _, rows, columns = images.shape[:4]
    typer.echo(f"{out}: M = {m}, {columns} x {rows} micro images")


def refocus_command(
    raster: RasterArgument,
    micro_image: MicroImageOption,
    a: Annotated[str, typer.Option("--a", "-a", help="Focus setting: a fraction.")],
    out: Annotated[str, typer.Option(help="PNG file to write.")] = "refocused.png",
    interpolation: Annotated[
        str, typer.Option(help="nearest, linear, or the order of a B-spline, 0 to 3.")
    ] = "nearest",
    upsample: Annotated[
        bool,
        typer.Option(
            "--upsample/--no-upsample", help="The raw image's size, or a pixel for each micro lens."
        ),
    ] = True,
    region: Annotated[
        str, typer.Option(help="Part of the result: TOP:BOTTOM,LEFT:RIGHT in its pixels.")
    ] = "",
) -> None:
    """Refocus an aligned raw image, correctly rounded."""
    path = _check_file(out, (".png",))
    raw, m = _raster(raster, micro_image)
    focus_to_shift(a, m, where="--a")
    order = interpolation_order(interpolation, where="--interpolation")
    part = _region(region) if region else None
    with progress_bar("refocusing"):
        image = refocus(raw, m, a, interpolation=order, upsample=upsample, region=part)
    if image.size == 0:
        raise InputError(region, where="--region", expected="a part of the picture")
    _publish({path.name: image}, path.parent)
    typer.echo(f"{out}: a = {a}, {image.shape[1]} x {image.shape[0]} pixels")


def _region(text: str) -> tuple[slice, slice]:
    """Region of interest from TOP:BOTTOM,LEFT:RIGHT."""
    found = re.fullmatch(r"\s*(\d*):(\d*)\s*,\s*(\d*):(\d*)\s*", text)
    if found is None:
        raise InputError(text, where="--region", expected="TOP:BOTTOM,LEFT:RIGHT in pixels")
    top, bottom, left, right = (int(n) if n else None for n in found.groups())
    return slice(top, bottom), slice(left, right)


def slice_settings(first: str, last: str, step: str, m: int) -> list[Fraction]:
    """Focus settings from the first to the last.

    Parameters
    ----------
    first, last, step
        Fractions as text; an empty step is 1/M.
    m
        M in pixels.

    Returns
    -------
    list of Fraction
        Multiples of 1/M.

    Raises
    ------
    InputError
        If one of them is no focus setting of that M, or there is nothing between them.
    """
    low, high = parse_focus(first, where="--from"), parse_focus(last, where="--to")
    width = parse_focus(step, where="--step") if step else Fraction(1, m)
    if width <= 0 or (width * m).denominator != 1:
        raise InputError(step, where="--step", expected=f"a positive multiple of 1/{m}")
    if low > high:
        raise InputError(f"{first} to {last}", where="--from", expected="less than --to")
    start, stop = ceil(low * m), floor(high * m)
    shifts = range(start, stop + 1, int(width * m))
    if not 1 <= len(shifts) <= _LARGEST_STACK:
        raise InputError(
            f"{len(shifts)} slices", where="--from", expected=f"1 to {_LARGEST_STACK} slices"
        )
    return [Fraction(k, m) for k in shifts]


def stack(
    raster: RasterArgument,
    micro_image: MicroImageOption,
    first: Annotated[str, typer.Option("--from", help="First focus setting.")] = "0",
    last: Annotated[str, typer.Option("--to", help="Last focus setting.")] = "1",
    step: Annotated[str, typer.Option("--step", help="Step, 1/M if not given.")] = "",
    out: Annotated[str, typer.Option(help="Folder for the slices.")] = "stack",
    everywhere: Annotated[
        bool,
        typer.Option("--all-in-focus", help="Write all_in_focus.png too, sharp everywhere."),
    ] = False,
    index: Annotated[
        bool,
        typer.Option(
            "--depth-index",
            help="Write depth_index.png, the slice in which each micro image is sharpest, and "
            "all_in_focus.png made of them, as the VHDL does.",
        ),
    ] = False,
    window: Annotated[
        str, typer.Option(help="--depth-index: micro images around each that are looked at.")
    ] = "1",
) -> None:
    """Refocus an aligned raw image to a stack of planes, and plot how sharp each is."""
    from plenofir.camera.lightfield.pictures import sharpness_picture
    from plenofir.camera.lightfield.stack import all_in_focus, focal_stack, sharpness_curve
    from plenofir.fpga.simulate.job import picture_names
    from plenofir.refocus.sharpness import (
        MAX_SHARPNESS_RADIUS,
        MAX_STACK,
        depth_index,
        depth_index_picture,
    )

    if everywhere and index:
        raise InputError(
            "--depth-index with --all-in-focus", where="--depth-index", expected="one of them"
        )
    radius = integer(window, "--window")
    if not 0 <= radius <= MAX_SHARPNESS_RADIUS:
        raise InputError(window, where="--window", expected=f"0 to {MAX_SHARPNESS_RADIUS}")
    raw, m = _raster(raster, micro_image)
    settings = slice_settings(first, last, step, m)
    if index and len(settings) > MAX_STACK:
        raise InputError(
            f"{len(settings)} slices",
            where="--from",
            expected=f"at most {MAX_STACK} with --depth-index",
        )
    check_folder(Path(out), out)
    with progress_bar("refocusing") as show:
        slices = focal_stack(raw, m, settings, show)
    # Two or more: even the only slice has its a in its name.
    names = [picture_names(int(a * m), m, 2)[0] for a in settings]
    files = dict(zip(names, slices, strict=True))
    # Near the borders views are missing.
    margin = ceil(max(abs(a) for a in settings) * (m - 1) / 2) * m
    if min(raw.shape[:2]) >= 2 * margin + 8 * m:
        inside = slice(margin, raw.shape[0] - margin), slice(margin, raw.shape[1] - margin)
        curve = sharpness_curve(slices, inside, m)
        files["sharpness.png"] = sharpness_picture([float(a) for a in settings], {"": curve})
        best = settings[int(np.argmax(curve))]
        typer.echo(f"sharpest: a = {best}")
    if everywhere:
        files["all_in_focus.png"] = all_in_focus(slices, m).image
    if index:
        found = depth_index(slices, m, radius)
        files["all_in_focus.png"] = found.image
        of_pixels = found.index.repeat(m, 0).repeat(m, 1)[: raw.shape[0], : raw.shape[1]]
        files["depth_index.png"] = depth_index_picture(of_pixels, len(slices))
    _publish(files, Path(out))
    typer.echo(f"{out}: {len(slices)} slices")


def depth_map(
    raster: RasterArgument,
    micro_image: MicroImageOption,
    camera: CameraOption,
    focus: FocusOption = "inf",
    near: Annotated[
        str, typer.Option("--near", help="Largest disparity searched, pixels per view.")
    ] = "2",
    far: Annotated[
        str, typer.Option("--far", help="Smallest disparity searched, pixels per view.")
    ] = "-0.5",
    window: Annotated[str, typer.Option("--window", help="Side of the window, odd.")] = "7",
    confidence: Annotated[
        str, typer.Option("--confidence", help="Least confidence of a distance, 0 to 1.")
    ] = "0.3",
    out: Annotated[str, typer.Option(help="Folder for the maps.")] = "depth",
) -> None:
    """Distances in mm from an aligned raw image and the camera's lens data."""
    from plenofir.camera.lightfield.disparity import depth_map as measure
    from plenofir.camera.lightfield.pictures import depth_picture
    from plenofir.camera.rays import RayModel, load_camera

    raw, m = _raster(raster, micro_image)
    distance = number(focus, "--focus", allow_infinity=True)
    model = RayModel.focused(load_camera(camera), distance, m)
    check_folder(Path(out), out)
    with progress_bar("matching") as show:
        found = measure(
            raw,
            model,
            search=(number(far, "--far"), number(near, "--near")),
            window=integer(window, "--window"),
            least_confidence=number(confidence, "--confidence"),
            progress=show,
        )
    known = found.distance_mm[~np.isnan(found.distance_mm)]
    tenths = np.nan_to_num(np.rint(10 * found.distance_mm), nan=0.0)
    files: dict[str, Image | Floats] = {
        "depth.png": depth_picture(found.distance_mm),
        "distance_tenth_mm.png": np.clip(tenths, 0, 65535).astype(np.uint16),
        "distance_mm.npy": found.distance_mm,
        "disparity.npy": found.disparity.pixels_per_view,
    }
    _publish(files, Path(out))
    share = 100 * known.size / found.distance_mm.size
    spread = (
        f", {np.percentile(known, 5):.0f} to {np.percentile(known, 95):.0f} mm"
        if known.size
        else ""
    )
    typer.echo(
        f"{out}: distances for {share:.0f} % of {raw.shape[1] // m} x {raw.shape[0] // m}"
        f" pixels{spread}"
    )


def report_calibration(
    out: Annotated[str, typer.Option(help="Folder for the report.")] = "build/report-calibration",
    spots: Annotated[
        str,
        typer.Option(help="Folder of other spot images NAME.png with centres NAME.txt (y x)."),
    ] = "",
) -> None:
    """Accuracy and time of the calibration, and section 5.3's experiments: Markdown, figures."""
    from plenofir.studies.calibration_report import write_report

    with progress_bar("report") as show:
        path = write_report(Path(out), Path(spots) if spots else None, show)
    typer.echo(f"report: {path}")


def register(app: typer.Typer, report: typer.Typer) -> None:
    """Add the commands.

    Parameters
    ----------
    app
        The command line.
    report
        Its command ``report``.
    """
    for command in (calibrate, decode, views, compose, stack):
        app.command()(command)
    app.command("refocus")(refocus_command)
    app.command("depth-map")(depth_map)
    report.command("calibration")(report_calibration)
