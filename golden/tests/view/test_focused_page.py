# SPDX-License-Identifier: Apache-2.0
"""The page of a focused camera's capture in a real browser: its pictures are those of `refocus`."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from focused_scenes import FOCUS, Scene, scene
from in_browser import pixels, served
from in_process import plenofir
from PIL import Image as PillowImage
from scipy import ndimage

from plenofir.camera.calibration import Calibration, calibrate
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.commands import view as commands_view
from plenofir.ground.images import eight_bits, read_image, write_png
from plenofir.view import Page

CAMERA = ("--camera", "raytrix-r12", "--focus", str(FOCUS))


@pytest.fixture(scope="module")
def captured() -> tuple[Scene, Calibration]:
    """A capture of 167 x 137 pixels with its calibration."""
    truth = scene((2.3, 2.9), pitch=15.0, lenses=(9, 11), rotation_degrees=0.3)
    types = LensTypes(pattern=(0, 1, 2), sharpest=(0.45, 0.38, 0.31))
    return truth, calibrate(truth.capture.white).model_copy(update={"lens_types": types})


@pytest.fixture
def page_of(
    captured: tuple[Scene, Calibration], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Any:
    """The page that the command would serve of the capture, in the test's folder."""
    truth, calibration = captured
    calibration.save(tmp_path / "calib.json")

    def view(*words: str, grey: bool = False, orientation: int = 1) -> Page:
        pages: list[Page] = []
        raw = truth.capture.raw
        if grey:
            raw = (raw.mean(axis=2) / 257).astype(np.uint8)
        if orientation != 1:
            exif = PillowImage.Exif()
            exif[0x0112], raw = orientation, (raw / 257).astype(np.uint8)
            PillowImage.fromarray(raw).save(tmp_path / "raw.png", exif=exif)
        else:
            write_png(tmp_path / "raw.png", raw)
        monkeypatch.setattr(commands_view, "serve_page", lambda page, *_: pages.append(page))
        done = plenofir("view", "raw.png", "--calib", "calib.json", *words, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return pages[0]

    return view


def refocused(folder: Path, v: float, *words: str) -> np.ndarray:
    """What the command makes, 8 bits."""
    done = plenofir("refocus", "raw.png", "--calib", "calib.json", "-v", str(v), *words, cwd=folder)
    assert done.returncode == 0, done.stderr
    image = eight_bits(read_image(folder / "refocused.png"))
    return image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)


def check(found: np.ndarray, want: np.ndarray, name: object) -> None:
    """As near as smooth pictures of standard cameras: one grey level."""
    assert found.shape == want.shape
    assert np.abs(found.astype(int) - want).max() <= 1, name


def test_planes_are_those_of_refocus(open_page: Any, page_of: Any, tmp_path: Path) -> None:
    with served(page_of()) as address:
        tab = open_page(address)
        for v in (2.3, 5.5, -3.0):
            tab.evaluate("v => plenofir.setDepth(v)", v)
            check(pixels(tab), refocused(tmp_path, v), v)
        # Places between micro images: of two beside them that are equally near either will do.
        tab.evaluate("plenofir.setDepth(1)")
        found, want = pixels(tab).astype(int), refocused(tmp_path, 1.0).astype(int)
        assert (np.abs(found - want) <= 1).mean() > 0.9
        assert (found >= ndimage.minimum_filter(want, (5, 5, 1)) - 1).all()
        assert (found <= ndimage.maximum_filter(want, (5, 5, 1)) + 1).all()
        tab.evaluate("plenofir.setDepth(2.3)")
        tab.evaluate("plenofir.setExposure(0, 'stored')")
        refocused(tmp_path, 2.3, "--exposure", "off")
        # Linear values, on a screen with a gamma of 2.2.
        stored = (read_image(tmp_path / "refocused.png") / 65535) ** (1 / 2.2)
        check(pixels(tab), np.rint(255 * stored), "as stored")


def test_planes_of_a_camera_lie_as_the_picture_is_looked_at(
    open_page: Any, page_of: Any, tmp_path: Path
) -> None:
    """V is counted between its micro lenses then; the capture was turned to the left."""
    with served(page_of(*CAMERA, orientation=8)) as address:
        tab = open_page(address)
        for v in (2.6, 7.0):
            tab.evaluate("v => plenofir.setDepth(v)", v)
            check(pixels(tab), refocused(tmp_path, v, *CAMERA), v)


def test_slider_typed_depth_and_address(open_page: Any, page_of: Any, tmp_path: Path) -> None:
    with served(page_of(grey=True)) as address:
        tab = open_page(address)
        slider, typed = tab.locator("#depth"), tab.locator("#typed")
        # From before the nearest plane of a type to behind the farthest.
        assert float(slider.get_attribute("min")) < 1 / 0.45
        assert 1 / 0.31 < float(slider.get_attribute("max")) < 10
        assert tab.evaluate("plenofir.depth") == pytest.approx(1 / 0.38)
        slider.fill("2.3")
        tab.wait_for_function("document.getElementById('depth-text').innerText.includes('v = 2.3')")
        typed.fill("2.75")
        typed.press("Enter")
        tab.wait_for_function("document.getElementById('command').textContent === '-v 2.75'")
        check(pixels(tab), refocused(tmp_path, 2.75), "typed")
        for text in ("0.5", "-0.9", "21", "", "much", "1e9"):
            typed.fill(text)
            typed.press("Enter")
            assert "v is a number from 1 to 20" in tab.locator("#message").inner_text(), text
            assert tab.evaluate("plenofir.depth") == 2.75
        tab.locator("#picture").press("ArrowRight")
        assert tab.evaluate("plenofir.depth") > 2.75
        tab.evaluate("plenofir.setDepth(3.1)")
        again = open_page(tab.url)
        assert again.evaluate("plenofir.depth") == 3.1
        assert (pixels(again) == pixels(tab)).all()


@pytest.mark.slow
def test_depth_and_all_in_focus(open_page: Any, page_of: Any, tmp_path: Path) -> None:
    with served(page_of(*CAMERA, orientation=8)) as address:
        tab = open_page(address)
        words = "raw.png", "--calib", "calib.json", *CAMERA
        done = plenofir("stack", *words, "-v", "2", "--all-in-focus", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        tab.evaluate("plenofir.setMode('sharp')")
        assert (pixels(tab) == read_image(tmp_path / "stack" / "all_in_focus.png")).all()
        done = plenofir("depth-map", *words, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        tab.evaluate("plenofir.setMode('depth')")
        assert (pixels(tab) == read_image(tmp_path / "depth" / "depth.png")).all()
