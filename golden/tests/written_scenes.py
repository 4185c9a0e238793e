# SPDX-License-Identifier: Apache-2.0
"""A small scene and its changes, for the tests of plans."""

from pathlib import Path

from plenofir.plan import LoadedScene, load_scene

BASE = """
name = "test"
[camera]
model = "f193-mla2"
focus_mm = 5000.0
micro_image_size = 5
[frame]
columns = 640
rows = 480
colour = "rgb"
[depth]
near_mm = 800.0
far_mm = inf
[build]
"""


def write(folder: Path, text: str, *changes: tuple[str, str]) -> Path:
    """Write a scene with texts of it replaced."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def scene(folder: Path, *changes: tuple[str, str], build: str = "") -> LoadedScene:
    """Load the scene with texts of it replaced."""
    return load_scene(write(folder, BASE + build, *changes))
