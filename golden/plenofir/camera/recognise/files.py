# SPDX-License-Identifier: Apache-2.0
"""Recognise a file or folder by its content, not by its name."""

from pathlib import Path

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.record import load_calibration
from plenofir.camera.lightfield.folders import ViewOrder, image_paths, read_views
from plenofir.camera.lightfield.sources import hci_scene, hci_views, read_mat, read_source
from plenofir.camera.lytro.capture import checked_grid, match_text
from plenofir.camera.lytro.container import file_bytes, is_container, read_container, read_json
from plenofir.camera.lytro.frames import is_lytro, read_frame
from plenofir.camera.lytro.metadata import FrameMetadata, frame_metadata
from plenofir.camera.lytro.sensor import balanced, grey_mosaic
from plenofir.camera.recognise.picture import Recognition, recognise_picture
from plenofir.ground.errors import InputError
from plenofir.ground.films import VIDEOS
from plenofir.ground.images import read_picture
from plenofir.refocus.operator import Image

_FEWEST_VIEWS, _SMALLEST_VIEW, _WINDOW, _FAR = 3, 24, 15, 2
# The direction is clear if the displacement in it is this many times that in the other.
_CLEAR = 1.3
# Pictures of these kinds are frames of a camera, not views.
_OF_FRAMES = ("aligned raster", "raw capture", "white image")


def recognise(path: Path) -> Recognition:
    """Recognise a file or a folder."""
    name = str(path)
    try:
        if path.is_dir():
            return _folder(path, name)
        if is_lytro(path) or path.suffix.lower() in (".lfp", ".lfr"):
            return _lytro(path, name)
    except OSError as error:
        raise InputError(error.strerror or "cannot be read", where=name) from None
    if path.suffix.lower() == ".mat":
        shape = read_mat(path).shape
        text = f"{shape[1]} x {shape[0]} views of {shape[3]} x {shape[2]} pixels"
        advice = f"plenofir compose {name} --out aligned.png"
        evidence = (("evidence", text),)
        return Recognition("light field in a MATLAB file", evidence, (advice,), shape[0])
    if path.suffix.lower() in VIDEOS:
        source = read_source(path)
        advice = f"plenofir develop {name}"
        return Recognition("video of views", source.lines, (advice,), source.images.shape[0])
    if path.suffix.lower() in (".json", ".txt"):
        metadata = _metadata(path)
        if metadata is not None:
            raw = path.with_suffix(".raw").name
            lines = (*metadata.described(), ("evidence", f"metadata alone: pixels are in {raw}"))
            advice = f"plenofir inspect {raw}, with {path.name} beside it"
            return Recognition("Lytro file without a raw frame", lines, (advice,))
    if path.suffix.lower() == ".json":
        grid = load_calibration(path).grid
        text = f"{grid.layout}, pitch {grid.lens_pitch:.4f} pixels, as plenofir calibrate writes it"
        advice = f"plenofir decode RAW --calib {name} --out aligned.png"
        return Recognition(
            "calibration", (("evidence", text),), (advice,), pitch_px=grid.lens_pitch
        )
    is_jpeg = path.suffix.lower() in (".jpg", ".jpeg")
    picture = read_picture(path, drop_alpha=True)
    return recognise_picture(picture, name, is_jpeg=is_jpeg)


def _lytro(path: Path, name: str) -> Recognition:
    """A file of a Lytro camera."""
    if is_container(path):
        container = read_container(path)
        if container.frame is None:
            text, advice = {
                "stack": (
                    "refocused pictures without the raw frame: nothing to refocus",
                    "export or copy the raw .lfp or .lfr from the camera or the library",
                ),
                "depth": (
                    "a depth map without the raw frame: nothing to refocus",
                    "export or copy the raw .lfp or .lfr from the camera or the library",
                ),
                "storage": (
                    "files that a camera stores: white images and calibration",
                    f"plenofir decode CAPTURE.lfp --white {name}",
                ),
            }.get(
                container.contents,
                ("no raw frame, no pictures", "none: it is not a capture"),
            )
            text = f"{len(container.sections)} sections; {text}"
            evidence = (("evidence", text),)
            return Recognition("Lytro file without a raw frame", evidence, (advice,))
    frame = read_frame(path)
    metadata = frame.metadata
    match = checked_grid(grey_mosaic(balanced(frame.mosaic(), metadata)), metadata, name)
    lines = (*metadata.described(), ("grid", match_text(match)))
    advice = f"plenofir decode {name} --out aligned.png"
    return Recognition("Lytro capture", lines, (advice,), pitch_px=metadata.pitch_px)


def _metadata(path: Path) -> FrameMetadata | None:
    """Metadata of a Lytro's frame in a file of their own, None if it holds something else."""
    try:
        content = read_json(file_bytes(path, "a file"), str(path))
        return frame_metadata(content, str(path))
    except InputError:
        return None


def _folder(path: Path, name: str) -> Recognition:
    """A folder of views or of captures."""
    lytro = sum(is_lytro(file) for file in sorted(path.iterdir())[:1000])
    if lytro:
        text = f"{lytro} files of a Lytro camera"
        advice = (
            f"plenofir inspect {name}/FILE",
            f"plenofir decode CAPTURE.lfp --white {name}, if they are white images",
        )
        return Recognition("folder of Lytro files", (("evidence", text),), advice)
    command = f"plenofir compose {name} --out aligned.png"
    hci = hci_views(path)
    if hci:
        scene = hci_scene(path)
        truth = "with" if scene.disparity is not None else "without"
        text = f"{len(hci)} views as the HCI benchmark names them, {truth} true disparity"
        return Recognition("folder of views", (("evidence", text),), (command,))
    pictures = image_paths(path)
    if not pictures:
        return Recognition("can't tell", (("evidence", "no pictures in the folder"),))
    first = recognise(pictures[0])
    if first.kind in _OF_FRAMES:
        text = f"{len(pictures)} pictures; the first of them, {pictures[0].name}: {first.kind}"
        pattern = f"'{path / ('*' + pictures[0].suffix)}'"
        go_on = f"plenofir batch {pattern} -M {first.micro_image_size} -a 0"
        if first.micro_image_size is None:
            go_on = f"plenofir inspect {pictures[0]}; its captures have to be decoded one by one"
        return Recognition(
            "folder of pictures",
            (("evidence", text), *first.evidence[1:]),
            (go_on,),
            first.micro_image_size,
            first.pitch_px,
        )
    try:
        images = read_views(path)
    except InputError as error:
        text = f"pictures, but no light field: {error.problem} ({error.where})"
        return Recognition("can't tell", (("evidence", text),))
    m, _, rows, columns = images.shape[:4]
    text = f"{m} x {m} pictures of {columns} x {rows} pixels, numbered by row and column"
    order = first_counts(images)
    if order == "columns":
        text += "; what is seen moves sideways with the first number: it counts columns"
        command = f"plenofir compose {name} --order columns --out aligned.png"
    elif order is None:
        text += "; which number counts columns cannot be told: what is seen does not move clearly"
    return Recognition("folder of views", (("evidence", text),), (command,), m)


def first_counts(images: Image) -> ViewOrder | None:
    """Whether the first number of views counts rows or columns, by how the content moves.

    `images` are the views as if it counted rows, shape (v, u, t, s[, 3]). Content moves vertically
    between views above each other, horizontally between views side by side; None if that is
    unclear.
    """
    m = len(images)
    if m < _FEWEST_VIEWS or min(images.shape[2:4]) < _SMALLEST_VIEW:
        return None
    middle, far = m // 2, max(1, min(_FAR, m // 2))
    down, right = np.gradient(ndimage.gaussian_filter(grey(images[middle, middle]), 1.0))
    sums = [[down * down, down * right], [down * right, right * right]]
    matrix = np.array([[ndimage.uniform_filter(part, _WINDOW) for part in line] for line in sums])
    matrix += 1e-3 * float(np.trace(matrix.mean(axis=(2, 3)))) * np.eye(2)[:, :, None, None]
    upright = sideways = 0.0
    for first in (True, False):
        steps = (far, 0) if first else (0, far)
        one = grey(images[middle + steps[0], middle + steps[1]])
        other = grey(images[middle - steps[0], middle - steps[1]])
        change = ndimage.gaussian_filter(one - other, 1.0)
        known = np.array([ndimage.uniform_filter(g * change, _WINDOW) for g in (down, right)])
        moves = np.linalg.solve(
            np.moveaxis(matrix, (0, 1), (2, 3)), np.moveaxis(known, 0, 2)[..., None]
        )
        up, side = np.abs(moves[..., 0]).reshape(-1, 2).mean(axis=0)
        upright += up if first else side
        sideways += side if first else up
    if max(upright, sideways) < _CLEAR * min(upright, sideways):
        return None
    return "rows" if upright > sideways else "columns"
