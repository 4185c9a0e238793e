"""What a file or a folder is, told by its content, not by its name."""

from pathlib import Path

from plenofir.camera.calibration.record import load_calibration
from plenofir.camera.lightfield.folders import image_paths, read_views
from plenofir.camera.lightfield.sources import hci_scene, hci_views, read_mat
from plenofir.camera.lytro.capture import checked_grid, match_text
from plenofir.camera.lytro.container import is_container, read_container
from plenofir.camera.lytro.frames import is_lytro, read_frame
from plenofir.camera.lytro.sensor import balanced, grey_mosaic
from plenofir.camera.recognise.picture import Recognition, recognise_picture
from plenofir.errors import InputError
from plenofir.images import read_picture


def recognise(path: Path) -> Recognition:
    """Recognise a file or a folder.

    Parameters
    ----------
    path
        What a user has.

    Returns
    -------
    Recognition
        Kind, evidence, and the command to go on with.

    Raises
    ------
    InputError
        If it cannot be read, or is damaged.
    """
    name = str(path)
    try:
        if path.is_dir():
            return _folder(path, name)
        if is_lytro(path) or path.suffix.lower() in (".lfp", ".lfr"):
            return _lytro(path, name)
    except OSError as error:
        raise InputError(
            error.strerror or "cannot be read", where=name, expected="a file or a folder"
        ) from None
    if path.suffix.lower() == ".mat":
        shape = read_mat(path).shape
        text = f"{shape[1]} x {shape[0]} views of {shape[3]} x {shape[2]} pixels"
        advice = f"plenofir compose {name} --out aligned.png"
        evidence = (("evidence", text),)
        return Recognition("light field in a MATLAB file", evidence, (advice,), shape[0])
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
                    "refocused pictures (JPEG) without the raw frame: nothing to refocus",
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
    if not image_paths(path):
        return Recognition("can't tell", (("evidence", "no pictures in the folder"),))
    try:
        images = read_views(path)
    except InputError as error:
        text = f"pictures, but no light field: {error.what} ({error.where})"
        return Recognition("can't tell", (("evidence", text),))
    m, _, rows, columns = images.shape[:4]
    text = f"{m} x {m} pictures of {columns} x {rows} pixels, numbered by row and column"
    return Recognition("folder of views", (("evidence", text),), (command,), m)
