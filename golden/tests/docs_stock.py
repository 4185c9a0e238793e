# SPDX-License-Identifier: Apache-2.0
"""The files that the commands of the documentation name, small ones."""

import shutil
import tarfile
from pathlib import Path

import cv2
import h5py
import numpy as np
from drawn_views import fourier
from focused_scenes import RAYTRIX_XML, scene
from lytro_writer import F01, ILLUM, changed, write_capture, write_whites
from scipy.io import savemat
from tifffile import imwrite

from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.rays.camera import CAMERAS
from plenofir.ground import project
from plenofir.ground.images import read_image, write_png
from plenofir_studies.synthetic import (
    TexturedPlane,
    field_of_view,
    regular_grid,
    render,
    white_image,
)

LENSES = 22, 27


def _capture(folder: Path, rng: np.random.Generator) -> None:
    """A raw capture with its white and dark images, as TIFF and as PNG, and spots of a star."""
    model = RayModel.focused(load_camera("f197-mla2"), float("inf"), 11)
    width = field_of_view(model, 1500.0, 1.3 * LENSES[1])
    plane = TexturedPlane(np.kron(rng.random((9, 11)), np.ones((8, 8))), 1500.0, width)
    taken = render(model, [plane], LENSES, dark_level=0.02, bits=8)
    dark = np.full(taken.raw.shape, 5, np.uint8)
    for name, image in (
        ("raw", taken.raw),
        ("capture", taken.raw),
        ("white", taken.white),
        ("dark", dark),
    ):
        imwrite(folder / f"{name}.tif", image)
        write_png(folder / f"{name}.png", image)
        # A DNG with filters in the order rggb: its version, pattern, black and white.
        tags = [(50706, 1, 4, (1, 4, 0, 0)), (33421, 3, 2, (2, 2)), (33422, 1, 4, (0, 1, 1, 2))]
        tags += [(50714, 4, 1, 5), (50717, 4, 1, 255)]
        how = {"photometric": 32803, "metadata": None, "extratags": [(*t, True) for t in tags]}
        imwrite(folder / f"{name}.dng", image.astype(np.uint16), **how)
    rows, columns = taken.raw.shape
    (folder / "scene.toml").write_text(SCENE.format(columns, rows))
    write_png(folder / "capture.png", taken.raw)
    imwrite(folder / "fourier.tif", fourier(3, 3, hexagonal=False))
    imwrite(folder / "white-reversed.tif", taken.white)
    star = np.full(taken.raw.shape, 3, np.uint8)
    for y, x in np.rint(taken.grid.centres(*np.indices(LENSES))).reshape(-1, 2).astype(int):
        star[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = 200
    imwrite(folder / "star.tif", star)
    grid = regular_grid((110, 120), 14.2, rotation_degrees=0.4)
    for name, radius in (("a", 0.16), ("b", 0.1), ("c", 0.16)):
        spots = white_image((110, 120), grid, form="spot", radius=radius)
        imwrite(folder / f"{name}.tif", spots)


def _focused(folder: Path) -> None:
    """A capture of a focused camera, its white image, and a maker's grid."""
    taken = scene((2.25, 2.6, 3.2), lenses=(20, 24)).capture
    write_png(folder / "texture.png", taken.raw)
    write_png(folder / "texture-white.png", taken.white)
    facts = {"x": 0, "y": 0, "diameter": 23, "rotation": 0, "distortion": 0}
    (folder / "raytrix.xml").write_text(RAYTRIX_XML.format(**facts))


def _film(file: Path, frames: list[np.ndarray]) -> None:
    """A film of RGB frames."""
    rows, columns = frames[0].shape[:2]
    film = cv2.VideoWriter(str(file), cv2.VideoWriter_fourcc(*"mp4v"), 25, (columns, rows))
    for frame in frames:
        film.write(np.ascontiguousarray(frame[..., ::-1]))
    film.release()


SCENE = """name = "own"
[camera]
micro_image_size = 11
[sensor]
columns = {}
rows = {}
pitch_px = 10.5
rotation_degrees = 0.5
distortion = true
devignette = true
[depth]
slices = ["4/11"]
"""


def _lytro(folder: Path) -> None:
    """Captures of both cameras, one with its white images."""
    for name, metadata, size in (("lfp", F01, (400, 300)), ("lfr", ILLUM, (320, 240))):
        small = changed(metadata, "image", "width", to=size[0])
        capture = write_capture(changed(small, "image", "height", to=size[1]))
        (folder / f"capture.{name}").write_bytes(capture.container())
    write_whites(folder / "whites", capture, {"MOD_0000": (943, 600), "MOD_0001": (100, 672)})
    with tarfile.open(folder / "caldata-B5143909630.tar", "w") as archive:
        archive.add(folder / "whites", "caldata")


def make_docs_stock(folder: Path) -> None:
    """Write one file for each name that the documentation uses."""
    rng = np.random.default_rng(24)
    _capture(folder, rng)
    _focused(folder)
    _lytro(folder)
    # Micro images of 5, 9 and 11 pixels alike.
    picture = np.kron(rng.integers(0, 256, (9, 9), np.uint8), np.ones((11, 11), np.uint8))
    write_png(folder / "aligned.png", picture)
    write_png(folder / "photo.png", picture[:30, :40])
    write_png(folder / "image.png", picture[:30, :40])
    (folder / "frames").mkdir()
    for n in range(2):
        write_png(folder / "frames" / f"frame_{n}.png", picture[n : n + 25, :30])
    (folder / "captures").mkdir()
    (folder / "captures" / "one.tif").write_bytes((folder / "raw.tif").read_bytes())
    for name in ("folder-of-views", "folder"):
        (folder / name).mkdir()
        for v, u in np.ndindex(11, 11):
            write_png(folder / name / f"view_{v:02}_{u:02}.png", picture[v::11, u::11])
    field = np.stack([np.stack([picture[v::9, u::9] for u in range(9)]) for v in range(9)])
    savemat(folder / "field.mat", {"LF": field})
    with h5py.File(folder / "field.h5", "w") as container:
        container["LF"] = field
    shutil.make_archive(str(folder / "views"), "zip", folder / "folder-of-views")
    flower = read_image(project.DATA / "flower_5x5.png")
    views = [np.hstack([flower[v::5, u::5] for u in range(5)]) for v in range(5)]
    write_png(folder / "mosaic.png", np.vstack(views))
    # A quilt begins with its bottom row.
    line = [np.roll(flower[2::5, 2::5], n, axis=1) for n in range(48)]
    _film(folder / "film.mp4", line)
    quilt = np.vstack([np.hstack(line[n : n + 8]) for n in range(40, -1, -8)])
    write_png(folder / "NAME_qs8x6a0.75.png", quilt)
    write_png(folder / "picture_eslf.png", np.tile(picture, (2, 2))[: 14 * 12, : 14 * 13])
    (folder / "my-camera.toml").write_text((CAMERAS / "f193-mla2.toml").read_text())
    (folder / "prescription.csv").write_text((project.DATA / "lenses" / "f100.csv").read_text())
    for name in ("golden", "scenes", "examples"):
        (folder / name).symlink_to(project.root() / name)
