# SPDX-License-Identifier: Apache-2.0
"""Raw captures: from a sensor's pixels and a calibration to an aligned raw image."""

from pathlib import Path
from typing import NamedTuple

from plenofir.camera.calibration import Calibration, calibrate, decode, load_calibration
from plenofir.camera.calibration.resample import largest_odd_size
from plenofir.camera.lytro.capture import checked_grid, match_text, read_lytro
from plenofir.camera.lytro.container import is_container, read_container
from plenofir.camera.lytro.frames import read_frame
from plenofir.camera.lytro.sensor import FULL_SCALE, balanced, grey_mosaic
from plenofir.camera.recognise.source import Field, Finding, Hints, LightFieldSource, Progress
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture, read_image, read_picture
from plenofir.ground.shell import command

_NO_FRAME = {
    "stack": (
        "refocused pictures without the raw frame: nothing to refocus",
        "export or copy the raw .lfp or .lfr from the camera or the library",
    ),
    "depth": (
        "a depth map without the raw frame: nothing to refocus",
        "export or copy the raw .lfp or .lfr from the camera or the library",
    ),
}


class Capture(NamedTuple):
    """Pixels of a sensor with the grid of the micro lenses, ready to be decoded."""

    picture: Picture
    calibration: Calibration
    dark: Image | None = None
    divisor: Image | None = None  # white image to divide by
    findings: tuple[Finding, ...] = ()
    made: str | None = None  # text of the calibration, if a white image gave it

    def decoded(self, micro_image: int | None, where: str, progress: Progress) -> Field:
        """The aligned raw image; M is the largest odd size that fits if none is given."""
        m = micro_image or largest_odd_size(self.calibration)
        raster = decode(
            self.picture.pixels,
            self.calibration,
            m,
            dark=self.dark,
            white=self.divisor,
            full_scale=self.picture.full_scale,
            where=where,
            progress=progress,
        )
        # A camera's pixels count light, unless the file says otherwise.
        picture = self.picture.like(raster)._replace(gamma=self.picture.gamma or 1.0)
        return Field(picture, m, self.findings, self.made)


def calibration_of(white: Path, dark: Path | None) -> Calibration:
    """Calibration of a white image, and the dark frame if there is one."""
    picture = read_picture(white)
    return calibrate(
        picture.pixels,
        read_image(dark) if dark else None,
        full_scale=picture.full_scale,
        where=str(white),
        dark_where=str(dark),
    )


def read_capture(picture: Picture, where: str, hints: Hints) -> Capture:
    """A capture with the calibration, or the white image, that the hints name."""
    if hints.calib is not None:
        calibration, made = load_calibration(hints.calib), None
    else:
        assert hints.white is not None
        calibration = calibration_of(hints.white, hints.dark)
        made = calibration.text()
    dark = read_image(hints.dark) if hints.dark else None
    pitch = " x ".join(f"{p:.3f}" for p in calibration.grid.pitch[::-1])
    text = f"{calibration.grid.layout}, {pitch} pixels a lens"
    return Capture(picture, calibration, dark, None, (Finding("calibrated", text, "told"),), made)


def read_lytro_capture(path: Path, hints: Hints) -> Capture:
    """A capture of a Lytro, with its own grid or that of the hints."""
    taken = read_lytro(path, white=None if hints.calib else hints.white, colour="best")
    calibration = load_calibration(hints.calib) if hints.calib else taken.calibration
    return Capture(
        Picture(taken.image, FULL_SCALE, 1.0),
        calibration,
        divisor=taken.white,
        findings=tuple(Finding(*line) for line in taken.lines),
    )


def capture_source(picture: Picture, where: str, hints: Hints) -> LightFieldSource:
    """A picture that the hints say is a capture, as they name its calibration."""

    def raster(progress: Progress) -> Field:
        return read_capture(picture, where, hints).decoded(hints.micro_image, where, progress)

    finding = Finding("evidence", f"taken as a capture of {hints.calib or hints.white}", "told")
    return LightFieldSource("raw capture", (finding,), raster=raster)


def lytro_source(path: Path, hints: Hints) -> LightFieldSource:
    """A file of a Lytro camera."""
    name = str(path)
    if hints.dark is not None:
        raise InputError(f"is not used for {name}", where="dark")
    if is_container(path):
        container = read_container(path)
        if container.frame is None:
            no_capture = ("no raw frame, no pictures", "none: it is not a capture")
            text, advice = no_capture
            if container.contents == "storage":
                text = "files that a camera stores: white images and calibration"
                advice = command("decode", "CAPTURE.lfp", "--white", path)
            else:
                text, advice = _NO_FRAME.get(container.contents, no_capture)
            evidence = Finding("evidence", f"{len(container.sections)} sections; {text}", "told")
            return LightFieldSource("Lytro file without a raw frame", (evidence,), (advice,))
    frame = read_frame(path)
    metadata = frame.metadata
    match = checked_grid(grey_mosaic(balanced(frame.mosaic(), metadata)), metadata, name)
    lines = (*metadata.described(), ("grid", match_text(match)))
    return LightFieldSource(
        "Lytro capture",
        tuple(Finding(*line) for line in lines),
        (command("decode", path, "--out", "aligned.png"),),
        pitch_px=metadata.pitch_px,
        raster=lambda progress: read_lytro_capture(path, hints).decoded(
            hints.micro_image, name, progress
        ),
    )
