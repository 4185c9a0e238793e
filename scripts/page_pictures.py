# SPDX-License-Identifier: Apache-2.0
"""Pictures of the pages in a browser, for scripts/pictures.py: Chromium without a GPU."""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from picture_files import FLOWER, PLANES, save
from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.rays import RayModel, load_camera
from plenofir.ground.images import read_image, write_png
from plenofir.refocus import refocus
from plenofir.view import Page, export, light_field_page, pictures_page
from plenofir_studies.calibration_report import MICROSCOPE


@contextmanager
def browser() -> Iterator[Any]:
    """Chromium that draws with the processor."""
    software = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
    software += ["--enable-unsafe-swiftshader", "--disable-dev-shm-usage"]
    with sync_playwright() as tools:
        chromium = tools.chromium.launch(executable_path=shutil.which("chromium"), args=software)
        yield chromium
        chromium.close()


def opened(chromium: Any, page: Page, size: tuple[int, int], **options: Any) -> Any:
    """A tab with the export of a page, completely loaded."""
    viewport = {"width": size[0], "height": size[1]}
    tab = chromium.new_context(viewport=viewport, **options).new_page()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "page.html"
        file.write_bytes(export(page, 64_000_000))
        tab.goto(file.as_uri())
        tab.evaluate("plenofir.ready")
        tab.evaluate("plenofir.depth")
    return tab


def shot(tab: Any, name: str) -> None:
    """Write a screenshot."""
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        tab.screenshot(path=file.name)
        save(name, read_image(Path(file.name))[:, :, :3])


def viewer() -> None:
    """The viewer with a camera, its depth map, on a telephone, with two pictures."""
    planes, flower = read_image(PLANES), read_image(FLOWER)
    model = RayModel.focused(load_camera("f193-mla2"), 1500, 5)
    with browser() as chromium, tempfile.TemporaryDirectory() as parent:
        page = light_field_page(planes, 5, full_scale=255, title=PLANES.name, model=model)
        tab = opened(chromium, page, (1000, 620))
        tab.mouse.click(*tab.evaluate("plenofir.placeOf(0.5, 0.5)"))
        tab.wait_for_timeout(500)
        tab.mouse.move(*tab.evaluate("plenofir.placeOf(0.88, 0.5)"))
        shot(tab, "view-refocused.jpg")
        tab.evaluate("plenofir.setMode('depth')")
        shot(tab, "view-depth.jpg")
        white, dark, raw = (read_image(MICROSCOPE / f"{n}.png") for n in ("white", "dark", "raw"))
        aligned = decode(raw, calibrate(white, dark), 13, dark=dark)
        page = light_field_page(aligned, 13, full_scale=65535, title="vesicle", gamma=1.0)
        tab = opened(chromium, page, (1000, 700))
        tab.evaluate("plenofir.setZoom(1.6, 0.55, 0.45)")
        shot(tab, "view-microscope.jpg")
        page = light_field_page(flower, 5, full_scale=255, title=FLOWER.name)
        tab = opened(chromium, page, (360, 640), has_touch=True, is_mobile=True)
        tab.evaluate("plenofir.setMode('sharp')")
        shot(tab, "view-phone.jpg")
        folder = Path(parent) / "sim"
        folder.mkdir()
        for a in ("-3/5", "3/5"):
            write_png(folder / f"refocused_{a.replace('/', '_')}.png", refocus(flower, 5, a))
        tab = opened(chromium, pictures_page(folder, "build/sim"), (1000, 480))
        tab.evaluate("plenofir.setMode('wipe')")
        shot(tab, "view-pictures.jpg")


def developed() -> None:
    """The page that `plenofir develop` makes of the microscope's capture."""
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        # In their folder, so that the page shows no path of this machine.
        command = [sys.executable, "-m", "plenofir", "develop", "raw.png", "--white", "white.png"]
        command += ["--dark", "dark.png", "-M", "13", "--out", folder]
        subprocess.run(command, check=True, cwd=MICROSCOPE)
        tab = chromium.new_context(viewport={"width": 1000, "height": 1100}).new_page()
        tab.goto((Path(folder) / "index.html").as_uri())
        shot(tab, "developed.jpg")


def designed() -> None:
    """The page of `plenofir design --page`."""
    command = [sys.executable, "-m", "plenofir", "design", "--camera", "f193-mla2"]
    command += ["--focus", "1500", "--near", "500", "--far", "5000", "--page", "--no-browser"]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server,
        browser() as chromium,
    ):
        assert server.stdout is not None
        address = server.stdout.readline().split()[0]
        tab = chromium.new_context(viewport={"width": 1200, "height": 860}).new_page()
        tab.goto(address)
        tab.evaluate("plenofir.ready")
        shot(tab, "design.jpg")
        server.terminate()
