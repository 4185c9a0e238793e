# SPDX-License-Identifier: Apache-2.0
"""Light fields whose depth is known: rendered scenes, and those of the HCI benchmark.

Depth is counted as the focus setting a, which is the disparity between neighbouring views in micro
lenses. The truth is what a pinhole in the middle of the main lens sees.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from skimage import data

from plenofir.camera.lightfield import compose
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.recognise import recognise
from plenofir.camera.recognise.benchmark import hci_scene
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image
from plenofir_studies.experiments import CAMERA
from plenofir_studies.synthetic.render import (
    TexturedPlane,
    field_of_view,
    pinhole_view,
    render,
    with_pitch,
)

Floats = npt.NDArray[np.float64]

M = 9
"""Micro image size of the rendered scenes, as in the HCI benchmark."""
LENSES = 81, 97
SEED = 6
RAMP_M = 5
RAMP = -0.6, 1.0
"""Focus settings at both ends of a ramp."""
RAMP_LENSES = 61, 81
HCI_BORDER = 15
"""Pixels at each border that the HCI benchmark does not count."""
TRUTH = "gt_disp_lowres.pfm"
# White of a rendered capture: as `render`'s level.
_LEVEL = 0.9


@dataclass(frozen=True)
class Scene:
    """What a camera sees: planes, and noise as a share of white."""

    model: RayModel
    planes: list[TexturedPlane]
    noise: float = 0.01


@dataclass(frozen=True)
class Truth:
    """A light field and its true depth."""

    name: str
    raw: Image  # aligned raw image
    m: int
    a: Floats  # focus setting of each micro lens; (t, s)
    picture: Floats | None  # all in focus, a value for each pixel, 0 to 1; None: not known


def _camera(focus: float = inf, m: int = M) -> RayModel:
    return with_pitch(RayModel.focused(load_camera(CAMERA), focus, m), float(m))


def plane(
    model: RayModel,
    texture: Image | Floats,
    a: float,
    width: float,
    middle: tuple[float, float] = (0.0, 0.0),
    slope: tuple[float, float] = (0.0, 0.0),
    coverage: Floats | None = None,
) -> TexturedPlane:
    """A plane; width and middle in micro lenses, slope: a for each micro lens down and right."""
    step = 1e-4
    mm, more = (float(model.distance(a + d).mm) for d in (0.0, step))
    lens = field_of_view(model, mm, 1)
    down, right = ((more - mm) / step * s / lens for s in slope)
    place = middle[0] * lens, middle[1] * lens
    return TexturedPlane(texture, mm, width * lens, place, (down, right), coverage)


def _picture(name: str) -> Image:
    """A public domain or CC0 picture of scikit-image."""
    return np.asarray(getattr(data, name)())


def _blobs(sigma: float, seed: int) -> Floats:
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(0, 1, (400, 400)), sigma)
    return np.asarray((noise - noise.min()) / np.ptp(noise))


def _strips() -> Scene:
    model = _camera()
    textures = [_picture(name) for name in ("gravel", "grass", "brick")]
    textures += [texture[::-1, ::-1] for texture in textures]
    planes = [plane(model, textures[0], 0.05, 220)]
    for k, a in enumerate((0.13, 0.86, 0.42, 1.21, 0.61, 0.27)):
        texture = np.tile(textures[(k + 1) % 6][:160, :160], (3, 1))
        planes.append(plane(model, texture, a, 14, (0, (k - 2.5) * 16)))
    return Scene(model, planes)


def _slopes() -> Scene:
    model = _camera()
    planes = [
        plane(model, _picture("brick"), 0.5, 220, (0, 0), (0.006, 0)),
        plane(model, _picture("coffee"), 0.7, 44, (-6, -22), (0, 0.01)),
        plane(model, _picture("astronaut"), 0.9, 36, (8, 24), (0.004, -0.012)),
    ]
    return Scene(model, planes)


def _pictures(noise: float = 0.01) -> Scene:
    model = _camera()
    planes = [
        plane(model, _picture("brick"), 1 / 11, 170),
        plane(model, _picture("coffee"), 4 / 11, 42, (4, -30)),
        plane(model, _picture("astronaut"), 7 / 11, 34),
        plane(model, _picture("chelsea"), 10 / 11, 40, (6, 32)),
    ]
    return Scene(model, planes, noise)


def _column() -> Scene:
    """Half a column, of even strips, before a wall."""
    model, bark, count = _camera(), _picture("gravel"), 16
    planes = [plane(model, _picture("grass"), 0.2, 220)]
    for k in range(count):
        angle = (np.arange(k, k + 2) / count - 0.5) * np.pi
        x, a = 30 * np.sin(angle), 0.3 + 0.8 * np.cos(angle)
        width = float(x[1] - x[0])
        part = bark[:, k * 512 // count : (k + 1) * 512 // count]
        slope = 0.0, float(a[1] - a[0]) / width
        planes.append(plane(model, part, a.mean(), 1.02 * width, (0, x.mean()), slope))
    return Scene(model, planes)


def _twigs() -> Scene:
    """Thin stripes in three layers."""
    model, random = _camera(1500), np.random.default_rng(3)
    planes = [plane(model, _picture("gravel"), -0.7, 260)]
    y, x = np.mgrid[-200:200, -200:200]
    for name, a in (("grass", -0.3), ("brick", 0.2), ("coffee", 0.6)):
        there = np.zeros((400, 400))
        for _ in range(5):
            angle, off, width = (random.uniform(*r) for r in ((0, np.pi), (-150, 150), (3, 7)))
            away = np.abs(y * np.cos(angle) + x * np.sin(angle) - off)
            there = np.maximum(there, np.clip(width - away + 0.5, 0, 1))
        planes.append(plane(model, _picture(name)[:400, :400], a, 100, coverage=there))
    return Scene(model, planes)


def _faint() -> Scene:
    """Blurred textures, and a plane without any."""
    model = _camera()
    y, x = np.mgrid[-200:200, -200:200]
    disc = np.clip(150 - np.hypot(y, x), 0, 1)
    planes = [
        plane(model, _blobs(25, 2) * 0.6 + 0.2, 0.15, 180),
        plane(model, _blobs(12, 1) * 0.5 + 0.3, 0.6, 50, (-4, -18), coverage=disc),
        plane(model, np.full((9, 9), 0.7), 0.9, 24, (4, 20)),
    ]
    return Scene(model, planes, 0.005)


def _deep() -> Scene:
    model = _camera(1000)
    planes = [
        plane(model, _picture("gravel"), -1.6, 300),
        plane(model, _picture("coffee"), -0.8, 44, (-10, -26)),
        plane(model, _picture("astronaut"), 0.5, 34, (4, 2), (0, 0.004)),
        plane(model, _picture("chelsea"), 1.7, 38, (16, 28)),
    ]
    return Scene(model, planes)


def ramp(texture: str, noise: float) -> Truth:
    """A plane of 8 bit, M = `RAMP_M`, whose a grows evenly from left to right."""
    (first, last), (_, columns) = RAMP, RAMP_LENSES
    model, slope = _camera(1000, RAMP_M), (last - first) / columns
    one = plane(model, _picture(texture), (first + last) / 2, 200, slope=(0, slope))
    raw = render(
        model,
        [one],
        RAMP_LENSES,
        form="square",
        radius=1.0,
        level=_LEVEL,
        noise=noise,
        bits=8,
        seed=SEED,
    ).raw
    _, mm = pinhole_view(model, [one], RAMP_LENSES)
    a, there = np.full(mm.shape, np.nan), np.isfinite(mm)
    a[there] = model.focus_setting(mm[there])
    return Truth(texture, np.ascontiguousarray(raw), RAMP_M, a, None)


SCENES: dict[str, Callable[[], Scene]] = {
    "strips": _strips,
    "slopes": _slopes,
    "pictures": _pictures,
    "column": _column,
    "twigs": _twigs,
    "faint": _faint,
    "noisy": lambda: _pictures(0.05),
    "deep": _deep,
}


def rendered(name: str, lenses: tuple[int, int] = LENSES) -> Truth:
    """Capture one of `SCENES`, 16 bit, and its truth."""
    scene = SCENES[name]()
    model, planes = scene.model, scene.planes
    raw = render(
        model,
        planes,
        lenses,
        form="square",
        radius=1.0,
        level=_LEVEL,
        noise=scene.noise,
        bits=16,
        seed=SEED,
    ).raw
    picture, _ = pinhole_view(model, planes, lenses, M)
    _, mm = pinhole_view(model, planes, lenses)
    a = np.asarray(model.focus_setting(mm))
    return Truth(name, np.ascontiguousarray(raw), M, a, _LEVEL * picture)


def hci_folders(folder: Path) -> list[Path]:
    """Scenes of the HCI benchmark in a folder or those in it, with true disparities."""
    folders = sorted(path.parent for path in folder.rglob(TRUTH))
    if not folders:
        raise InputError(
            f"has no {TRUTH}; scenes of the HCI benchmark have their truth in it", where=str(folder)
        )
    return folders


def hci_truth(folder: Path) -> Truth:
    """A scene of the HCI benchmark."""
    images, a = recognise(folder).all_views().pixels, hci_scene(folder).disparity
    if a is None or a.shape != images.shape[2:4]:
        raise InputError(f"{TRUTH} has another size than the views", where=str(folder))
    if min(a.shape) <= 2 * HCI_BORDER:
        size = f"views of {a.shape[1]} x {a.shape[0]} pixels"
        raise InputError(f"{size}; more than {2 * HCI_BORDER} pixels are needed", where=str(folder))
    return Truth(folder.name, compose(images), len(images), a.astype(np.float64), None)
