# SPDX-License-Identifier: Apache-2.0
"""Raw captures: from a sensor's pixels and a calibration to an aligned raw image."""

from dataclasses import replace
from pathlib import Path

from plenofir.camera.calibration import Calibration, load_calibration
from plenofir.camera.captures.colours import order_of_mosaic
from plenofir.camera.captures.prepare import CaptureHints, Prepared, calibrated, prepared
from plenofir.camera.lytro.capture import LytroCapture, checked_grid, match_text, read_lytro
from plenofir.camera.lytro.container import is_container, read_container
from plenofir.camera.lytro.frames import read_frame
from plenofir.camera.lytro.sensor import FULL_SCALE, balanced, grey_mosaic
from plenofir.camera.recognise.source import Field, Finding, Hints, LightFieldSource, Progress
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, read_image, read_picture
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


def calibration_of(white: Path, dark: Path | None, bayer: str | None = None) -> Calibration:
    """Calibration of a white image, and the dark frame if there is one."""
    return calibrated(
        read_picture(white, as_stored=True),
        read_image(dark, as_stored=True) if dark else None,
        bayer=bayer,
        where=str(white),
        dark_where=str(dark),
    )


def read_capture(picture: Picture, where: str, hints: Hints, progress: Progress) -> Field:
    """The aligned raw image of a capture with the calibration, or the white image, of the hints."""
    facts = CaptureHints(hints.bayer, hints.white_balance, hints.roi)
    # What is missing is told before the calibration, which takes long.
    order_of_mosaic(picture, facts.bayer, where)
    if hints.calib is not None:
        calibration, new = load_calibration(hints.calib), None
    else:
        assert hints.white is not None
        calibration = (
            calibration_of(hints.white, hints.dark, hints.bayer)
            if hints.white_calib is None
            else load_calibration(hints.white_calib)
        )
        new = calibration.text()
    dark = read_picture(hints.dark, as_stored=True) if hints.dark else None
    ready = prepared(picture, calibration, facts, dark=dark, where=where)
    pitch = " x ".join(f"{p:.3f}" for p in ready.calibration.grid.pitch[::-1])
    text = f"{calibration.grid.layout}, {pitch} pixels a lens"
    field = _field(ready, hints, where, progress)
    lines = (Finding("calibrated", text, "told"), *field.lines)
    return field._replace(lines=lines, calibration=new)


def of_lytro(
    reading: LytroCapture, where: str, calib: str | None = None, white: Path | None = None
) -> Prepared:
    """A capture of a Lytro, with its own grid, or with a calibration and a white image for it."""
    picture = Picture(reading.image, FULL_SCALE, 1.0, orientation=reading.metadata.orientation)
    if calib is None:
        return Prepared(picture, reading.calibration, None, reading.white, None, (), reading.lines)
    ready = prepared(
        picture,
        load_calibration(calib),
        CaptureHints(white_balance="off"),
        white=read_picture(white, as_stored=True) if white else None,
        where=where,
    )
    return replace(ready, lines=(*reading.lines[:-1], *ready.lines))


def _field(ready: Prepared, hints: Hints, where: str, progress: Progress) -> Field:
    """The aligned raw image of a capture, and what was done to it."""
    raster, m = ready.decoded(hints.micro_image, where, progress=progress)
    findings = (
        *(Finding(*line) for line in ready.lines),
        *(Finding("calibration", note, notable=True) for note in ready.notes),
    )
    return Field(raster, m, findings)


def _lytro_field(path: Path, hints: Hints, progress: Progress) -> Field:
    """The aligned raw image of a Lytro's capture."""
    reading = read_lytro(path, white=None if hints.calib else hints.white, colour="best")
    return _field(of_lytro(reading, str(path), hints.calib), hints, str(path), progress)


def capture_source(picture: Picture, where: str, hints: Hints) -> LightFieldSource:
    """A picture that the hints say is a capture, as they name its calibration."""

    def raster(progress: Progress) -> Field:
        return read_capture(picture, where, hints, progress)

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
        raster=lambda progress: _lytro_field(path, hints, progress),
    )
