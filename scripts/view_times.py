# SPDX-License-Identifier: Apache-2.0
"""Measure the viewer in Chromium without a GPU.

Usage: python scripts/view_times.py [times] [live]

`times` writes the table of docs/viewer.md between its marks: processor time of all threads of the
browser, which other work on the machine changes little. `live` writes a stream into a folder that
the viewer watches, and prints the page's statistics.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from marks import between_marks
from page_pictures import browser, opened
from picture_files import FLOWER
from plenofir.ground import project
from plenofir.ground.images import encode_png, read_image
from plenofir.view import light_field_page

FRAMES = 3
STREAM_FRAMES, STREAM_RATE = 100, 10


def processor_time() -> float:
    """Seconds of the processes that this one has started."""
    children = psutil.Process().children(recursive=True)
    spent = [child.cpu_times() for child in children]
    return float(sum(each.user + each.system for each in spent))


def times(chromium: Any) -> None:
    """Processor time of pictures, into the documentation."""
    flower = read_image(FLOWER)
    sensor = np.tile(flower[..., 1], (5, 5))[:3201, :3201]
    lines = [
        "| light field | a | views | pixels drawn | processor time, s | million reads a second |",
        "| --- " * 6 + "|",
    ]
    for raw, m, stride in ((flower, 5, 1), (sensor, 11, 4), (sensor, 11, 1)):
        page = light_field_page(raw, m, full_scale=255, title="times")
        tab = opened(chromium, page, (1000, 560))
        rows, columns = (-(-n // stride) for n in raw.shape[:2])
        frames = 1 if rows * columns > 10**6 else FRAMES
        for a, share in ((1 / m, 1.0), (0.5 / m, 1.0), (0.5 / m, 0.25)):
            tab.evaluate("a => plenofir.setFocus(a)", a)
            tab.evaluate("share => plenofir.setAperture(share)", share)
            before = processor_time()
            tab.evaluate(f"plenofir.frameTime({frames}, {stride})")
            took = (processor_time() - before) / frames
            size = f"{raw.shape[1]} x {raw.shape[0]}, M = {m}"
            on = "on the grid" if a == 1 / m else "off the grid"
            part = "all" if share == 1 else f"{share:.0%}"
            drawn = "all" if stride == 1 else f"every {stride}th each way"
            reads = rows * columns * m * m * share / took / 1e6
            lines.append(f"| {size} | {on} | {part} | {drawn} | {took:.2f} | {reads:.0f} |")
            print(lines[-1], flush=True)
        tab.context.close()
    target = project.root() / "docs" / "viewer.md"
    target.write_text(between_marks(target.read_text(), "times", "\n".join(lines)))


def live(chromium: Any) -> None:
    """A synthetic stream of the flower: what the page says of it, printed."""
    flower = encode_png(read_image(FLOWER))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def put(number: int) -> None:
            (folder / "new").write_bytes(flower)
            (folder / "new").rename(folder / f"{number:04}.png")

        put(0)
        command = [sys.executable, "-m", "plenofir", "view", "--source", name]
        command += ["-M", "5", "--no-browser"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            tab = chromium.new_context(viewport={"width": 1000, "height": 560}).new_page()
            tab.goto(server.stdout.readline().split()[0])
            tab.evaluate("plenofir.ready")
            begin = time.monotonic()
            for number in range(1, STREAM_FRAMES):
                time.sleep(max(begin + number / STREAM_RATE - time.monotonic(), 0))
                put(number)
            tab.wait_for_timeout(1000)
            text = tab.locator("#live").inner_text()
            print(f"{STREAM_FRAMES} frames, {STREAM_RATE} a second: {text}", flush=True)
            tab.context.close()
            server.terminate()


def main() -> int:
    """Do what is asked for, or both."""
    with browser() as chromium:
        for name in sys.argv[1:] or ["times", "live"]:
            {"times": times, "live": live}[name](chromium)
    return 0


if __name__ == "__main__":
    sys.exit(main())
