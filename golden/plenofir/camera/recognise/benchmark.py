# SPDX-License-Identifier: Apache-2.0
"""Scenes of the HCI 4D Light Field Benchmark: ``input_Cam000.png`` and so on, with true depth."""

import configparser
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isqrt
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plenofir.camera.recognise.source import Finding
from plenofir.ground.errors import InputError
from plenofir.ground.extras import missing
from plenofir.ground.files import input_file

Floats32 = npt.NDArray[np.float32]

_HCI_VIEW = re.compile(r"input_Cam(\d{3})\.png")


@dataclass(frozen=True, eq=False)
class HciScene:
    """Data of a scene of the HCI benchmark besides its views."""

    parameters: Mapping[str, str]  # numbers and texts of ``parameters.cfg``
    # Ground truth of the central view in pixels per view, positive for what is nearer than the
    # plane of disparity 0 (as `plenofir.camera.lightfield.Disparity` counts).
    disparity: Floats32 | None


def hci_views(folder: Path) -> list[Path]:
    """Views of the HCI benchmark, by their names."""
    return sorted(path for path in folder.iterdir() if _HCI_VIEW.fullmatch(path.name))


def hci_files(folder: Path) -> dict[tuple[int, ...], Path]:
    """Views of a scene by row and column; other pictures of the folder are left alone."""
    paths = hci_views(folder)
    m = isqrt(len(paths))
    numbers = [int(path.name[9:12]) for path in paths]
    if m * m != len(paths) or numbers != list(range(m * m)):
        raise InputError(
            f"has {len(paths)} views input_CamNNN.png; there must be a square number, "
            "from 000 on without gaps; of a cross of views, the middle row in a folder of its own, "
            "named view_000.png and so on, is a line of views",
            where=str(folder),
        )
    return {divmod(n, m): path for n, path in enumerate(paths)}


def hci_findings(folder: Path) -> tuple[Finding, ...]:
    """Camera and ground truth of a scene, for people."""
    m = isqrt(len(hci_views(folder)))
    scene = hci_scene(folder)
    truth = "with" if scene.disparity is not None else "without"
    lines = [
        Finding("views", f"{m} x {m} of the HCI benchmark, {truth} true disparity", "told"),
    ]
    words = [
        f"{label} {scene.parameters[name]} {unit}"
        for name, label, unit in (
            ("baseline_mm", "baseline", "mm"),
            ("focal_length_mm", "focal length", "mm"),
            ("focus_distance_m", "focus at", "m"),
        )
        if name in scene.parameters
    ]
    if words:
        lines.append(Finding("camera", ", ".join(words), "told"))
    if scene.disparity is not None:
        low, high = np.nanmin(scene.disparity), np.nanmax(scene.disparity)
        lines.append(Finding("true disparity", f"{low:.3f} to {high:.3f} pixels per view", "told"))
    return tuple(lines)


def hci_scene(folder: Path) -> HciScene:
    """Read the data of a scene of the HCI benchmark besides its views."""
    parameters: dict[str, str] = {}
    config = folder / "parameters.cfg"
    if config.is_file():
        parser = configparser.ConfigParser(interpolation=None)
        try:
            parser.read_string(input_file(config).read_text("utf-8"))
        except (OSError, UnicodeDecodeError, configparser.Error) as error:
            reason = " ".join(str(error).split())[:120]
            raise InputError(
                f"cannot be read ({reason}); it must have sections of numbers", where=str(config)
            ) from None
        for section in parser.sections():
            parameters.update(parser[section])
    disparity = folder / "gt_disp_lowres.pfm"
    return HciScene(parameters, read_pfm(disparity) if disparity.is_file() else None)


def read_pfm(path: Path) -> Floats32:
    """Map of numbers in a .pfm file without colours, top line first, shape (rows, columns)."""
    from netpbmfile import NetpbmFile

    where = str(path)
    try:
        data = input_file(path).read_bytes()
        with NetpbmFile(io.BytesIO(data)) as file:
            image = np.asarray(file.asarray())
    except ModuleNotFoundError as error:
        raise InputError(missing(error.name or "").problem, where=where) from None
    except Exception as error:  # As for pictures.
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(
            f"is damaged ({reason}); it must be a whole .pfm file with one channel", where=where
        ) from None
    if image.ndim != 2 or image.dtype.kind != "f":
        raise InputError(
            f"has shape {image.shape}; it must be a .pfm file with one channel", where=where
        )
    # Lines of a PFM come from the bottom up, and netpbmfile leaves them so.
    return np.asarray(image[::-1], np.float32)
