# SPDX-License-Identifier: Apache-2.0
"""Readers: what a file, folder or film holds, as arrays with named axes.

`READERS` has a row for each format: whether a path is one (by its first bytes or its ending), and
what reads it. The first row that takes a path reads it. A reader gives `Stored` pixels, whose kind
`plenofir.camera.recognise.kinds` finds out, or the whole answer where pixels need not be looked at.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plenofir.camera.calibration.record import load_calibration
from plenofir.camera.lytro.container import file_bytes, read_json
from plenofir.camera.lytro.frames import is_lytro
from plenofir.camera.lytro.metadata import FrameMetadata, frame_metadata
from plenofir.camera.recognise.archives import read_archive
from plenofir.camera.recognise.arrays import ARRAYS, read_array
from plenofir.camera.recognise.benchmark import hci_files, hci_findings, hci_views
from plenofir.camera.recognise.captures import lytro_source
from plenofir.camera.recognise.names import named_views, picture_files
from plenofir.camera.recognise.source import Finding, Hints, LightFieldSource
from plenofir.camera.recognise.storage import (
    LONGER,
    RUNNING,
    Stored,
    of_array,
    of_files,
    picture_findings,
)
from plenofir.ground.errors import InputError
from plenofir.ground.films import FILMS, first_frames
from plenofir.ground.images import SCREEN_GAMMA, Picture, read_picture, upright
from plenofir.ground.pages import Pages, has_pages
from plenofir.ground.shell import command

# Bytes of frames in memory; a light field's views are fewer, and others are looked at in part.
_LARGEST_FILM = 1 << 30
_UNREAD = (".exr", ".hdr", ".webp", ".heic", ".heif", ".avif", ".jxl", ".jp2", ".psd")


class Reader(NamedTuple):
    """A format."""

    name: str
    takes: Callable[[Path], bool]
    read: Callable[[Path, Hints], Stored | LightFieldSource | None]  # None: the next row reads it


def _ends_in(*suffixes: str) -> Callable[[Path], bool]:
    return lambda path: path.suffix.lower() in suffixes


def _lytro_folder(path: Path, hints: Hints) -> LightFieldSource | None:
    """A folder of files of a Lytro camera."""
    files = [file for file in sorted(path.iterdir())[:1000] if is_lytro(file)]
    if not files:
        return None
    advice = command("inspect", files[0]), command("decode", "CAPTURE.lfp", "--white", path)
    text = f"{len(files)} files of a Lytro camera: captures, or white images of one"
    findings = (Finding("evidence", text),)
    return LightFieldSource("folder of Lytro files", findings, advice)


def _hci(path: Path, hints: Hints) -> Stored | None:
    """A scene of the HCI benchmark."""
    if not hci_views(path):
        return None
    return of_files(path, "vuyx", hci_files(path), hci_findings(path))


def _folder(path: Path, hints: Hints) -> Stored | LightFieldSource:
    """A folder of pictures: views by their names, or a series."""
    files = picture_files(path)
    if not files:
        return _no_pictures(path)
    try:
        named = named_views(files, path)
    except InputError as error:
        finding = Finding("evidence", f"{error.problem} ({error.where})", "unknown")
        series: dict[tuple[int, ...], Path] = {(n,): file for n, file in enumerate(files)}
        return of_files(path, "nyx", series, (finding,))
    findings = tuple(Finding("files", note, "told", notable=True) for note in named.notes)
    if named.running:
        run: dict[tuple[int, ...], Path] = {(n,): file for (_, n), file in named.places.items()}
        return of_files(path, "nyx", run, findings, kind=RUNNING)
    return of_files(path, "vuyx", {place: file for place, file in named.places.items()}, findings)


def _no_pictures(path: Path) -> LightFieldSource:
    """A folder without pictures, as far as its names tell what it is."""
    names = [file.name for file in sorted(path.iterdir())[:1000]]
    text, advice = "no image files in the folder", "give a folder of views, or a picture"
    endings = {Path(name).suffix.lower() for name in names} - {""}
    unread = [f"*{ending}" for ending in _UNREAD if ending in endings]
    if {".zgroup", ".zarray", "zarr.json"} & set(names):
        text = "a Zarr array, which is not read"
        advice = "save it as .npy (numpy.save) or HDF5"
    elif unread:
        text = f"pictures that are not read: {', '.join(unread)}"
        advice = "convert them to PNG or TIFF"
    return LightFieldSource("can't tell", (Finding("evidence", text, "unknown"),), (advice,))


def _array(path: Path, hints: Hints) -> Stored:
    """Numbers of NumPy, HDF5 or MATLAB."""
    held = read_array(path)
    axes = {"views": "vuyx", "sequence": "nyx", "picture": "yx"}[held.kind]
    findings = tuple(Finding(*line, "told", line[0] == "values") for line in held.lines)
    return of_array(path, axes, held.picture, findings)


def _film(path: Path, hints: Hints) -> Stored:
    """Frames of a video, in time or view by view."""
    frames, are_all = first_frames(path, _LARGEST_FILM)
    findings = () if are_all else (Finding("frames", f"{len(frames)} looked at, of more"),)
    if len(frames) == 1:
        return of_array(path, "yx", Picture(frames[0], 255, SCREEN_GAMMA))
    if any(frame.shape != frames[0].shape for frame in frames):
        raise InputError("has frames of several sizes; convert it", where=str(path))
    picture = Picture(np.stack(frames), 255, SCREEN_GAMMA)
    return replace(
        of_array(path, "nyx", picture, findings),
        name_at=lambda place: f"{path}, frame {place[0] + 1}",
        kind="" if are_all else LONGER,
    )


def _pages(path: Path, hints: Hints) -> Stored | None:
    """Pages of a TIFF file, in time or view by view."""
    pages = Pages(path)
    if len(pages) < 2:
        return None
    findings: tuple[Finding, ...] = ()
    if pages.left_out:
        findings = (Finding("pages", pages.left_out_text, "told", notable=True),)
    return Stored(
        path,
        "nyx",
        (len(pages),),
        lambda place: upright(pages[place[0]]),
        lambda place: f"{path}, page {place[0] + 1}",
        findings,
    )


def _archive(path: Path, hints: Hints) -> Stored | LightFieldSource:
    """An archive of views, or of one file."""
    return read_archive(path, lambda inside: read(inside, hints))


def _metadata(path: Path, hints: Hints) -> LightFieldSource | None:
    """Metadata of a Lytro's frame in a file of their own."""
    metadata: FrameMetadata
    try:
        metadata = frame_metadata(read_json(file_bytes(path, "a file"), str(path)), str(path))
    except InputError:
        return None
    raw = path.with_suffix(".raw")
    text = f"metadata alone: pixels are in {raw.name}"
    findings = (*metadata.described(), ("evidence", text))
    advice = command("inspect", raw)
    return LightFieldSource(
        "Lytro file without a raw frame", tuple(Finding(*one) for one in findings), (advice,)
    )


def _calibration(path: Path, hints: Hints) -> LightFieldSource:
    """A calibration."""
    calibration = load_calibration(path)
    grid, types = calibration.grid, calibration.lens_types
    text = f"{grid.layout}, pitch {grid.lens_pitch:.4f} pixels, as plenofir calibrate writes it"
    findings = [Finding("evidence", text, "told")]
    advice = command("decode", "RAW", "--calib", path, "--out", "aligned.png")
    if types is not None:
        findings.append(Finding("camera", "a focused (2.0) camera", "told"))
        findings += [Finding("lenses", one, "told") for one in types.described(grid.lens_pitch)]
        advice = command("develop", "RAW", "--calib", path)
    return LightFieldSource("calibration", tuple(findings), (advice,), pitch_px=grid.lens_pitch)


def _maker(path: Path, hints: Hints) -> LightFieldSource:
    """A calibration of a focused camera's maker."""
    # Loads numba.
    from plenofir.camera.focused import read_vendor_grid

    read_vendor_grid(path)
    text = "RayCalibData, Raytrix' calibration of a focused (2.0) camera"
    advice = command("calibrate", "RAW", "--grid", path, "--out", "calib.json")
    return LightFieldSource("calibration", (Finding("evidence", text, "told"),), (advice,))


def _picture(path: Path, hints: Hints) -> Stored:
    """One picture."""
    picture = read_picture(path, drop_alpha=True, as_stored=True)
    return of_array(path, "yx", picture, picture_findings(picture))


READERS: tuple[Reader, ...] = (
    Reader("folder of Lytro files", Path.is_dir, _lytro_folder),
    Reader("HCI benchmark", Path.is_dir, _hci),
    Reader("folder of pictures", Path.is_dir, _folder),
    Reader(
        "Lytro file", lambda path: is_lytro(path) or _ends_in(".lfp", ".lfr")(path), lytro_source
    ),
    Reader("array", _ends_in(*ARRAYS), _array),
    Reader("film", _ends_in(*FILMS), _film),
    Reader("zip archive", _ends_in(".zip"), _archive),
    Reader("pages of a TIFF", has_pages, _pages),
    Reader("metadata of a Lytro's frame", _ends_in(".json", ".txt"), _metadata),
    Reader("calibration", _ends_in(".json"), _calibration),
    Reader("calibration of a maker", _ends_in(".xml"), _maker),
    Reader("picture", lambda path: True, _picture),
)


def read(path: Path, hints: Hints) -> Stored | LightFieldSource:
    """Content of a path, by the first reader that takes it."""
    for reader in READERS:
        if reader.takes(path):
            held = reader.read(path, hints)
            if held is not None:
                return held
    raise AssertionError("the last reader takes anything")
