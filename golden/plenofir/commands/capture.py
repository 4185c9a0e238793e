# SPDX-License-Identifier: Apache-2.0
"""Commands from a camera's raw capture to an aligned raw image: calibrate, decode."""

from dataclasses import dataclass
from math import inf, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from plenofir.commands import file_options, options
from plenofir.commands.console import note, progress_bar
from plenofir.commands.focused import FocusedOptions, decoded_focused, type_lines
from plenofir.commands.groups import CameraData, grouped
from plenofir.commands.results import check_file, publish
from plenofir.ground.errors import InputError
from plenofir.ground.files import Results

if TYPE_CHECKING:
    from plenofir.camera.calibration import Calibration
    from plenofir.camera.rays import MeasuredPupil, RayModel
    from plenofir.commands.results import Floats
    from plenofir.refocus.operator import Image

Dark = Annotated[Path | None, typer.Option("--dark", help="Dark frame of the same size.")]

app = typer.Typer()


def _optional(path: Path | None) -> "Image | None":
    from plenofir.ground.images import read_image

    return read_image(path, as_stored=True) if path else None


@dataclass(frozen=True)
class _Reversed:
    """A white image with the main lens reversed."""

    reversed_lens: Annotated[
        Path | None,
        typer.Option(
            help="White image taken with the main lens reversed; it tells the entrance pupil."
        ),
    ] = None
    reversed_focus: Annotated[
        float,
        options.distance(
            "--reversed-focus", "Focus distance of the camera in that picture in mm, or inf."
        ),
    ] = inf


@app.command()
@grouped
def calibrate(
    white: Annotated[str, typer.Argument(help="White image: an evenly lit, diffuse surface.")],
    *,
    out: Annotated[str, typer.Option(help="Calibration file to write.")] = "calib.json",
    dark: Dark = None,
    bayer: file_options.BayerIfGiven = None,
    layout: Annotated[
        Literal["auto", "rectangular", "hexagonal-rows", "hexagonal-columns"],
        typer.Option(help="Layout of the micro lenses; auto finds it in the white image."),
    ] = "auto",
    order: Annotated[
        Literal["auto", "1", "2", "3"],
        typer.Option(
            help="Order of the polynomial for lens distortion; auto takes the lowest that fits."
        ),
    ] = "auto",
    picture: Annotated[
        str | None,
        typer.Option(help="PNG file to write: the white image with the centres drawn in."),
    ] = None,
    camera: CameraData,
    turned: _Reversed,
    of_types: FocusedOptions,
) -> None:
    """Find the micro image centres of a camera in its white image.

    With --camera it also measures the exit pupil and compares it with the camera's. A focused
    camera's types of micro lenses are told apart with --lens-types, or read with --grid.
    """
    import numpy as np

    from plenofir.camera.calibration.inspection import nowhere_dark
    from plenofir.camera.captures.prepare import calibrated as find
    from plenofir.ground.images import read_picture

    camera.check()
    reversed_lens, name = turned.reversed_lens, camera.camera
    options.require("reversed_lens", "camera", name is None and reversed_lens is not None)
    alone = reversed_lens is None and turned.reversed_focus != inf
    options.require("reversed_focus", "reversed_lens", alone)
    of_types.check(pupil=reversed_lens is not None)
    # No result may replace what the calibration is made from.
    inputs = white, dark, reversed_lens, of_types.lens_types, of_types.grid
    path = check_file(out, (".json",), *inputs)
    picture_path = check_file(picture, (".png",), *inputs) if picture else None
    pupils = None
    if name is not None and not of_types.is_set:
        pupils = _Pupils(name, camera.focus, reversed_lens, turned.reversed_focus)
    picture_of_white = read_picture(Path(white), as_stored=True)
    for text in picture_of_white.notes:
        note(f"{white}: {text}")

    def of_white() -> "Calibration":
        return find(
            picture_of_white,
            _optional(dark),
            bayer=bayer,
            layout=None if layout == "auto" else layout,
            order=None if order == "auto" else int(order),
            where=white,
            dark_where=str(dark or ""),
        )

    with progress_bar("calibrating"):
        calibration = (
            of_types.calibration(picture_of_white, white, bayer, camera, of_white)
            if of_types.is_set
            else of_white()
        )
        measured = [] if pupils is None else pupils.lines(calibration)
    with Results(path.parent) as results:
        results.write(path.name, calibration.text())
        # Both files or none: if the picture cannot be written, the block ends here.
        if picture_path is not None:
            publish(
                {picture_path.name: _marked(picture_of_white.pixels, calibration.centres)},
                picture_path.parent,
            )
    rows, columns = calibration.lenses
    count = int((~np.isnan(calibration.centres[..., 0])).sum())
    grid = calibration.grid
    typer.echo(f"micro images  {count} ({columns} x {rows}, {len(calibration.missing)} missing)")
    typer.echo(f"layout        {grid.layout}, order {grid.order}")
    pitch = f"{grid.pitch[1]:.4f} x {grid.pitch[0]:.4f} pixels"
    if calibration.evidence is not None and calibration.evidence.pitch_error_px is not None:
        pitch += f" (standard error {calibration.evidence.pitch_error_px:.5f})"
    typer.echo(f"pitch         {pitch}")
    for line in measured:
        typer.echo(line)
    typer.echo(f"rotation      {grid.rotation_degrees:.4f} degrees")
    typer.echo(
        f"scatter       {calibration.residual_px:.4f} pixels ({calibration.used} centroids used)"
    )
    if calibration.evidence is not None:
        for line in calibration.evidence.lines():
            typer.echo(line)
    if calibration.clipped_share > 0.01:
        share = f"{100 * calibration.clipped_share:.0f} %"
        typer.echo(f"note          {share} of the pixels at full scale: vignetting is not known")
    darkest = min(map(min, calibration.profile))
    if nowhere_dark(grid.layout, grid.lens_pitch, darkest):
        typer.echo(
            f"note          nowhere darker than {100 * darkest:.0f} % of the middle: where micro "
            "images overlap, centres may be half a pitch off (plenofir inspect)"
        )
    for line in type_lines(calibration):
        typer.echo(line)
    typer.echo(f"file          {out}")


class _Pupils:
    """What a camera's data say about its pupils, and what white images say."""

    def __init__(
        self, camera: str, focus: float, reversed_lens: Path | None, reversed_focus: float
    ) -> None:
        from plenofir.camera.rays import RayModel, load_camera

        described = load_camera(camera)
        # M does not matter here.
        self.model = RayModel.focused(described, focus, 2)
        self.reversed = None
        if reversed_lens is not None:
            self.reversed = (
                reversed_lens,
                RayModel.focused(described.reversed(), reversed_focus, 2),
            )

    def lines(self, calibration: "Calibration") -> list[str]:
        """Lines to print about them."""
        from plenofir.camera.captures.prepare import calibrated
        from plenofir.camera.rays import measured_focal_length
        from plenofir.ground.images import read_picture

        pupil = self._measured(self.model, calibration)
        lines = [f"pupils        exit {pupil_text(pupil)}"]
        if self.reversed is not None:
            white, model = self.reversed
            reversed_calibration = calibrated(read_picture(white, as_stored=True), where=str(white))
            other = self._measured(model, reversed_calibration)
            lines.append(f"              entrance {pupil_text(other)}")
            length, error = measured_focal_length(self.model, pupil, model, other)
            nominal = self.model.camera.main_lens.focal_length_mm
            text = f"{length:.4f} mm (standard error {error:.4f}; camera: {nominal:.4f})"
            lines.append(f"focal length  {'none that fits both pupils' if isnan(length) else text}")
        return lines

    @staticmethod
    def _measured(model: "RayModel", calibration: "Calibration") -> "MeasuredPupil":
        from plenofir.camera.rays import measure_pupil

        error = calibration.evidence.pitch_error_px if calibration.evidence is not None else None
        return measure_pupil(model, calibration.grid.lens_pitch, error or 0.0)


def pupil_text(pupil: "MeasuredPupil") -> str:
    """Distance of a pupil, beside the camera's data."""
    verdict = "agrees"
    if not pupil.agrees:
        verdict = (
            f"disagrees by {pupil.deviation_percent:.1f} %; micro lenses "
            f"{pupil.micro_lens_pitch_mm:.6f} mm apart would agree"
        )
    return (
        f"{pupil.distance_mm:.4f} mm from the micro lenses (standard error {pupil.error_mm:.4f}; "
        f"camera: {pupil.predicted_mm:.4f}: {verdict})"
    )


def _marked(image: "Image", centres: "Floats") -> "Image":
    """White image as 8 bit RGB with a red cross on each centre."""
    import numpy as np

    from plenofir.camera.calibration.frames import grey

    levels = grey(image)
    # The percentile leaves out hot pixels, which would darken the picture.
    levels = np.clip(levels / max(float(np.percentile(levels, 99.9)), 1.0), 0, 1) * 255
    result = np.repeat(levels.astype(np.uint8)[:, :, np.newaxis], 3, axis=2)
    points = np.rint(centres[~np.isnan(centres[..., 0])]).astype(int)
    for y, x in ((-1, 0), (0, -1), (0, 0), (0, 1), (1, 0)):
        place = np.clip(points + (y, x), 0, np.array(levels.shape) - 1)  # noqa: RUF005
        result[place[:, 0], place[:, 1]] = (255, 0, 0)
    return result


@dataclass(frozen=True)
class _Sensor:
    """Options of a capture's sensor."""

    bayer: file_options.BayerIfGiven = None
    white_balance: file_options.WhiteBalance = "auto"
    roi: file_options.Roi = None
    colour: Annotated[
        Literal["camera", "balanced", "srgb"],
        typer.Option(
            help="Lytro files: the camera's own colours, with white balance, or converted to sRGB."
        ),
    ] = "balanced"
    demosaic: Annotated[
        Literal["edge-aware", "bilinear"],
        typer.Option(help="Lytro files: how the colours of the mosaic are interpolated."),
    ] = "edge-aware"

    def check(self, *, lytro: bool) -> None:
        """Refuse options for other files."""
        for option, is_given, for_lytro in (
            ("colour", self.colour != "balanced", True),
            ("demosaic", self.demosaic != "edge-aware", True),
            ("bayer", self.bayer is not None, False),
            ("white_balance", self.white_balance != "auto", False),
            ("roi", self.roi is not None, False),
        ):
            if is_given and lytro != for_lytro:
                whose = "files of Lytro cameras" if for_lytro else "captures of other cameras"
                raise InputError(f"{options.typed(option)} is for {whose} only")


@dataclass(frozen=True)
class _Resampling:
    """How pixels are resampled."""

    interpolation: Annotated[
        Literal["nearest", "bilinear", "cubic"], typer.Option(help="How pixels are resampled.")
    ] = "bilinear"
    scale: Annotated[
        Literal["native", "fit"],
        typer.Option(help="native crops micro images to M pixels, fit scales them to M."),
    ] = "native"
    devignette: Annotated[
        bool, typer.Option("--devignette/--no-devignette", help="Correct vignetting.")
    ] = True

    def refuse(self) -> None:
        """Refuse what captures of focused cameras do not take."""
        if self != _Resampling():
            raise InputError(
                "--interpolation, --scale and --no-devignette are not for captures of focused "
                "cameras; leave them out"
            )


@app.command()
@grouped
def decode(
    raw: Annotated[
        str,
        typer.Argument(help="Raw capture: a picture of 8 or 16 bit, or a Lytro .lfp, .lfr, .raw."),
    ],
    *,
    calib: Annotated[
        str | None,
        typer.Option(help="Calibration file (plenofir calibrate); not needed for a Lytro's file."),
    ] = None,
    micro_image: options.MicroImageIfGiven = None,
    out: Annotated[
        str,
        typer.Option(help="PNG or TIFF file to write."),
    ] = "aligned.png",
    dark: Dark = None,
    white: Annotated[
        Path | None,
        typer.Option(
            help="White image; the capture is divided by it pixel by pixel. For a Lytro a .lfp, "
            ".lfr, .raw, or a folder or .tar of them, of which the one nearest in zoom and focus "
            "is taken; it gives the grid too."
        ),
    ] = None,
    how: _Resampling,
    sensor: _Sensor,
    gamma: Annotated[
        float,
        typer.Option(
            help="Gamma of the result: 1 keeps linear light, 2.2 is for looking at.",
            min=0.2,
            max=5.0,
        ),
    ] = 1.0,
) -> None:
    """Resample a raw capture to aligned micro images of M x M pixels.

    By default M is the largest odd number of pixels that fits into a micro image. Of a focused
    camera it is the pitch, and rows and columns of micro images run along the grid's own axes.
    """
    from plenofir.camera.calibration import load_calibration
    from plenofir.camera.captures.prepare import CaptureHints, prepared
    from plenofir.camera.lytro import is_lytro, read_lytro
    from plenofir.camera.lytro.sensor import with_gamma
    from plenofir.camera.recognise.captures import of_lytro
    from plenofir.ground.images import read_picture

    lytro = is_lytro(Path(raw)) or Path(raw).suffix.lower() in (".lfp", ".lfr")
    sensor.check(lytro=lytro)
    if lytro and dark is not None:
        raise InputError(
            f"{options.typed('dark')} is not needed: a Lytro's file tells its black level"
        )
    inputs = (raw, calib, dark, None if white is not None and white.is_dir() else white)
    path = check_file(out, (".png", ".tif", ".tiff"), *inputs)
    with progress_bar("decoding") as show:
        if lytro:
            capture_read = read_lytro(
                Path(raw),
                white=None if calib else white,
                colour=sensor.colour,
                demosaic=sensor.demosaic,
            )
            ready = of_lytro(capture_read, raw, calib, white)
        else:
            if calib is None:
                raise InputError(
                    f"{options.typed('calib')} is missing; plenofir calibrate makes one"
                )
            ready = prepared(
                read_picture(Path(raw), as_stored=True),
                load_calibration(calib),
                CaptureHints(sensor.bayer, sensor.white_balance, sensor.roi),
                white=read_picture(white, as_stored=True) if white else None,
                dark=read_picture(dark, as_stored=True) if dark else None,
                where=raw,
            )
        beside: dict[str, Image] = {}
        if ready.calibration.lens_types is not None:
            how.refuse()
            raster, lenses, m = decoded_focused(ready, micro_image, raw)
            beside[f"{path.stem}_lenses.png"] = lenses
        else:
            raster, m = ready.decoded(
                micro_image,
                raw,
                interpolation=how.interpolation,
                scale=how.scale,
                devignette=how.devignette,
                progress=show,
            )
    for text in ready.notes:
        typer.echo(f"note: {raw}: {text}", err=True)
    # Resampling averages light, so that gamma is applied after it.
    encoded = raster.gamma or 1.0
    decoded = raster._replace(
        pixels=with_gamma(raster.pixels, gamma, raster.full_scale), gamma=encoded * gamma
    )
    publish({path.name: decoded, **beside}, path.parent)
    for heading, text in ready.lines:
        typer.echo(f"{heading:<13} {text}")
    rows, columns = (length // m for length in raster.pixels.shape[:2])
    typer.echo(f"{out}: {columns} x {rows} micro images of {m} x {m} pixels")
    for name in beside:
        typer.echo(f"{name}: type of the micro lens of each pixel, from 1; 0 without light")
    if decoded.gamma == 1:
        typer.echo(
            f"note: in linear light, white is {raster.full_scale}; plenofir's commands read that "
            "in the file, others may show it dark (for them: --gamma 2.2)"
        )


@app.command(rich_help_panel="VHDL and FPGA")
def resampler(
    calib: Annotated[str, typer.Argument(help="Calibration file (plenofir calibrate).")],
    micro_image: options.MicroImage,
    channels: Annotated[
        Literal["1", "3"],
        typer.Option(help="Channels of a pixel: 1 (grey) or 3 (RGB, after the colour mosaic)."),
    ] = "1",
    bits: Annotated[int, typer.Option(help="Bits of a channel.", min=1, max=16)] = 8,
    devignette: Annotated[
        bool, typer.Option("--devignette/--no-devignette", help="Correct vignetting.")
    ] = True,
    out: Annotated[
        str | None,
        typer.Option(
            help="VHDL file to write: the calibration as constants, and an entity that loads them."
        ),
    ] = None,
) -> None:
    """Configure the VHDL resampler for a calibration: generics, memory, accuracy, constants."""
    from plenofir.camera.calibration import load_calibration
    from plenofir.plan.sensor.calibration_loader import LOADER, loader_text
    from plenofir.plan.sensor.chip import resampling

    path = None if out is None else check_file(out, (".vhd",), calib)
    chip = resampling(
        load_calibration(calib),
        micro_image,
        channels=int(channels),
        pixel_bits=bits,
        devignette=devignette,
        where=calib,
    )
    core, needs, accuracy = chip.core, chip.needs, chip.accuracy
    rows, columns = chip.registers.raster_shape
    full = "more than any" if needs.full_rate is None else str(needs.full_rate)
    typer.echo(f"raster     {columns} x {rows}, M = {micro_image}, {chip.registers.layout}")
    typer.echo(
        f"ring       {core.lines} lines of {core.max_columns} pixels, "
        f"{core.lines * core.max_columns * core.channels * core.pixel_bits} bits; "
        f"{needs.least} needed, {full} for a source without gaps"
    )
    typer.echo(f"table      {core.lenses if core.moves or core.gains else 0} lenses")
    typer.echo(
        f"positions  off by {accuracy.rounding_px:.4f} pixels (registers), "
        f"{accuracy.turn_px:.3f} at the corners of micro images (the sensor's axes)"
    )
    typer.echo(f"distortion {accuracy.distortion_px:.3f} pixels, taken up by the table")
    generics = ", ".join(f"{k} => {str(v).lower()}" for k, v in core.generics().items())
    typer.echo(f"generics   {generics}")
    if path is not None:
        with Results(path.parent) as results:
            results.write(path.name, loader_text(chip.core, chip.loads(), Path(calib).name))
        typer.echo(f"file       {out}: entity {LOADER}, {len(chip.loads())} words")
