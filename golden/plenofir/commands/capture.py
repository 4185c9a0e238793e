"""Commands from a camera's raw capture to an aligned raw image: calibrate, decode."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from plenofir.commands import options
from plenofir.commands.console import progress_bar
from plenofir.commands.results import check_file, publish

if TYPE_CHECKING:
    from plenofir.commands.results import Floats
    from plenofir.refocus.operator import Image

Dark = Annotated[Path | None, typer.Option("--dark", help="Dark frame of the same size.")]

app = typer.Typer()


def _optional(path: Path | None) -> "Image | None":
    from plenofir.images import read_image

    return read_image(path) if path else None


@app.command()
def calibrate(
    white: Annotated[str, typer.Argument(help="White image: an evenly lit, diffuse surface.")],
    out: Annotated[str, typer.Option(help="Calibration file to write.")] = "calib.json",
    dark: Dark = None,
    layout: Annotated[
        Literal["auto", "rectangular", "hexagonal-rows", "hexagonal-columns"],
        typer.Option(help="Layout of the micro lenses; auto finds out."),
    ] = "auto",
    order: Annotated[
        Literal["auto", "1", "2", "3"],
        typer.Option(help="Order of the grid (distortion); auto: as low as will do."),
    ] = "auto",
    picture: Annotated[
        str | None, typer.Option(help="Draw the centres found into the white image: a PNG file.")
    ] = None,
) -> None:
    """Find the micro image centres of a camera from its white image."""
    import numpy as np

    from plenofir.camera.calibration import calibrate as find
    from plenofir.images import read_image

    path = check_file(out, (".json",), white, dark)
    picture_path = check_file(picture, (".png",), white, dark) if picture else None
    image = read_image(Path(white))
    with progress_bar("calibrating"):
        found = find(
            image,
            _optional(dark),
            layout=None if layout == "auto" else layout,
            order=None if order == "auto" else int(order),
            where=white,
            dark_where=str(dark or ""),
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    found.save(path)
    if picture_path is not None:
        publish({picture_path.name: _marked(image, found.centres)}, picture_path.parent)
    rows, columns = found.lenses
    count = int((~np.isnan(found.centres[..., 0])).sum())
    grid = found.grid
    typer.echo(f"micro images  {count} ({columns} x {rows}, {len(found.missing)} missing)")
    typer.echo(f"layout        {grid.layout}, order {grid.order}")
    typer.echo(f"pitch         {grid.pitch[1]:.4f} x {grid.pitch[0]:.4f} pixels")
    typer.echo(f"rotation      {grid.rotation_degrees:.4f} degrees")
    typer.echo(f"scatter       {found.residual_px:.4f} pixels ({found.used} centroids used)")
    if found.evidence is not None:
        for line in found.evidence.lines():
            typer.echo(line)
    if found.clipped_share > 0.01:
        share = f"{100 * found.clipped_share:.0f} %"
        typer.echo(f"note          {share} of the pixels at full scale: vignetting is not known")
    typer.echo(f"file          {out}")


def _marked(image: "Image", centres: "Floats") -> "Image":
    """White image as 8 bit RGB with a red cross on each centre."""
    import numpy as np

    from plenofir.camera.calibration.frames import grey

    levels = grey(image)
    levels = np.clip(levels / max(float(np.percentile(levels, 99.9)), 1.0), 0, 1) * 255
    result = np.repeat(levels.astype(np.uint8)[:, :, np.newaxis], 3, axis=2)
    points = np.rint(centres[~np.isnan(centres[..., 0])]).astype(int)
    for y, x in ((-1, 0), (0, -1), (0, 0), (0, 1), (1, 0)):
        place = np.clip(points + (y, x), 0, np.array(levels.shape) - 1)  # noqa: RUF005
        result[place[:, 0], place[:, 1]] = (255, 0, 0)
    return result


@app.command()
def decode(
    raw: Annotated[str, typer.Argument(help="Raw capture: 8 or 16 bit, grey or RGB.")],
    calib: Annotated[str, typer.Option(help="Calibration file (plenofir calibrate).")],
    micro_image: options.MicroImage,
    out: options.OutPng = "aligned.png",
    dark: Dark = None,
    white: Annotated[
        Path | None, typer.Option(help="White image, to divide by it pixel by pixel.")
    ] = None,
    interpolation: Annotated[
        Literal["bilinear", "cubic"], typer.Option(help="How pixels are resampled.")
    ] = "bilinear",
    scale: Annotated[
        Literal["native", "fit"],
        typer.Option(help="native: crop micro images to M. fit: scale them to M."),
    ] = "native",
    devignette: Annotated[
        bool, typer.Option("--devignette/--no-devignette", help="Correct vignetting.")
    ] = True,
) -> None:
    """Resample a raw capture to aligned micro images of M x M pixels."""
    from plenofir.camera.calibration import decode as resample
    from plenofir.camera.calibration import load_calibration
    from plenofir.images import read_picture

    path = check_file(out, (".png",), raw, calib, dark, white)
    calibration = load_calibration(calib)
    capture = read_picture(Path(raw))
    with progress_bar("decoding") as show:
        raster = resample(
            capture.pixels,
            calibration,
            micro_image,
            dark=_optional(dark),
            white=_optional(white),
            interpolation=interpolation,
            scale=scale,
            devignette=devignette,
            full_scale=capture.full_scale,
            where=raw,
            progress=show,
        )
    publish({path.name: raster}, path.parent)
    rows, columns = (length // micro_image for length in raster.shape[:2])
    size = f"{micro_image} x {micro_image}"
    typer.echo(f"{out}: {columns} x {rows} micro images of {size} pixels")
