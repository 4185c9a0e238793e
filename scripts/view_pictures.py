# SPDX-License-Identifier: Apache-2.0
"""Screenshots of the viewer and the time of its pictures, both from Chromium without a GPU.

Usage: python scripts/view_pictures.py [pictures] [times] [live]

Writes docs/images/view-*.jpg and the table of docs/viewer.md between its marks; live prints what
the page says of a stream. Times are of the
processor (all threads of the browser together), which other work on the machine changes little.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from PIL import Image as PillowImage
from playwright.sync_api import sync_playwright

from marks import between_marks
from plenofir import project
from plenofir.camera.rays import RayModel, load_camera
from plenofir.images import encode_png, read_image
from plenofir.refocus import refocus
from plenofir.view import Page, export, light_field_page, pictures_page

DOCS = project.root() / "docs"
SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
SOFTWARE += ["--enable-unsafe-swiftshader", "--disable-dev-shm-usage"]
FRAMES = 3
STREAM_FRAMES, STREAM_RATE = 100, 10
QUALITY = 80
LIMIT = 64_000_000


def opened(browser: Any, page: Page, size: tuple[int, int], **options: Any) -> Any:
    """A tab with the export of a page, when all of it is there."""
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, **options)
    tab = context.new_page()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "page.html"
        file.write_bytes(export(page, LIMIT))
        tab.goto(file.as_uri())
        tab.evaluate("plenofir.ready")
        tab.evaluate("plenofir.depth")
    return tab


def shot(tab: Any, name: str) -> None:
    """Write a screenshot as a small JPEG."""
    target = DOCS / "images" / f"view-{name}.jpg"
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        tab.screenshot(path=file.name)
        with PillowImage.open(file.name) as picture:
            picture.convert("RGB").save(target, quality=QUALITY, optimize=True)
    print(f"{target}: {target.stat().st_size / 1000:.0f} kB", flush=True)


def pictures(browser: Any) -> None:
    """The page with a camera, its depth map, a telephone, two pictures of a simulation."""
    raw = read_image(project.DATA / "planes_5x5.png")
    model = RayModel.focused(load_camera("f193-mla2"), 1500, 5)
    page = light_field_page(raw, 5, full_scale=255, title="planes_5x5.png", model=model)
    tab = opened(browser, page, (1000, 620))
    box = tab.locator("#picture").bounding_box()
    # The cat.
    place = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.mouse.click(*place)
    tab.wait_for_timeout(500)
    tab.mouse.move(box["x"] + 0.88 * box["width"], place[1])
    shot(tab, "refocused")
    tab.evaluate("plenofir.setMode('depth')")
    shot(tab, "depth")
    raw = read_image(project.DATA / "flower_5x5.png")
    page = light_field_page(raw, 5, full_scale=255, title="flower_5x5.png")
    tab = opened(browser, page, (360, 640), has_touch=True, is_mobile=True)
    tab.evaluate("plenofir.setMode('sharp')")
    shot(tab, "phone")
    with tempfile.TemporaryDirectory() as parent:
        folder = Path(parent) / "sim"
        folder.mkdir()
        for a in ("-3/5", "3/5"):
            name = f"refocused_{a.replace('/', '_')}.png"
            PillowImage.fromarray(refocus(raw, 5, a)).save(folder / name)
        tab = opened(browser, pictures_page(folder, "build/sim"), (1000, 480))
        tab.evaluate("plenofir.setMode('wipe')")
        shot(tab, "pictures")


def processor_time(process: psutil.Process) -> float:
    """Seconds of the processes that a process has started."""
    total = 0.0
    for child in process.children(recursive=True):
        times = child.cpu_times()
        total += times.user + times.system
    return total


def times(browser: Any) -> None:
    """Processor time of pictures, into the documentation."""
    flower = read_image(project.DATA / "flower_5x5.png")
    sensor = np.tile(flower[..., 1], (5, 5))[:3201, :3201]
    lines = [
        "| light field | a | views | pixels drawn | processor time, s | million reads a second |",
        "| --- " * 6 + "|",
    ]
    for raw, m, stride in ((flower, 5, 1), (sensor, 11, 4), (sensor, 11, 1)):
        page = light_field_page(raw, m, full_scale=255, title="times")
        tab = opened(browser, page, (1000, 560))
        for a, share in ((1 / m, 1.0), (0.5 / m, 1.0), (0.5 / m, 0.25)):
            tab.evaluate("a => plenofir.setFocus(a)", a)
            tab.evaluate("share => plenofir.setAperture(share)", share)
            rows, columns = (-(-n // stride) for n in raw.shape[:2])
            frames = 1 if rows * columns > 10**6 else FRAMES
            before = processor_time(psutil.Process())
            tab.evaluate(f"plenofir.frameTime({frames}, {stride})")
            took = (processor_time(psutil.Process()) - before) / frames
            size = f"{raw.shape[1]} x {raw.shape[0]}, M = {m}"
            on = "on the grid" if a == 1 / m else "off the grid"
            part = "all" if share == 1 else f"{share:.0%}"
            drawn = "all" if stride == 1 else f"every {stride}th each way"
            reads = rows * columns * m * m * share / took / 1e6
            lines.append(f"| {size} | {on} | {part} | {drawn} | {took:.2f} | {reads:.0f} |")
            print(lines[-1], flush=True)
        tab.context.close()
    target = DOCS / "viewer.md"
    target.write_text(between_marks(target.read_text(), "times", "\n".join(lines)))


def live(browser: Any) -> None:
    """A synthetic stream of the flower into a folder: what the page says of it, printed."""
    flower = encode_png(read_image(project.DATA / "flower_5x5.png"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def put(number: int) -> None:
            (folder / "new").write_bytes(flower)
            (folder / "new").rename(folder / f"{number:04}.png")

        put(0)
        command = ["view", "--source", name, "-M", "5", "--no-browser"]
        with subprocess.Popen(
            [sys.executable, "-m", "plenofir", *command], stdout=subprocess.PIPE, text=True
        ) as server:
            assert server.stdout is not None
            context = browser.new_context(viewport={"width": 1000, "height": 560})
            tab = context.new_page()
            tab.goto(server.stdout.readline().split()[0])
            tab.evaluate("plenofir.ready")
            begin = time.monotonic()
            for number in range(1, STREAM_FRAMES):
                time.sleep(max(begin + number / STREAM_RATE - time.monotonic(), 0))
                put(number)
            tab.wait_for_timeout(1000)
            text = tab.locator("#live").inner_text()
            print(f"{STREAM_FRAMES} frames, {STREAM_RATE} a second: {text}", flush=True)
            context.close()
            server.terminate()


def main() -> None:
    """Do what is asked for, or all."""
    wanted = sys.argv[1:] or ["pictures", "times", "live"]
    with sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE)
        for name in wanted:
            {"pictures": pictures, "times": times, "live": live}[name](browser)
        browser.close()


if __name__ == "__main__":
    main()
