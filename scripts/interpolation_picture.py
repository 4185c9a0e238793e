# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/interpolation.jpg: M = 3 nearest neighbour against M = 5 linear.

The three planes go through the VHDL core twice, focused in front of them and behind them. The
light field with M = 3 is made of the 3 x 3 central pixels of the 5 x 5 micro images.

Usage: python scripts/interpolation_picture.py
"""

import tempfile
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont
from rich.progress import track

from plenofir import project
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.simulate.file_bench import run_bench
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.images import read_image
from plenofir_studies.resolution import central_directions

SIZE = 480
MARGIN = 8
CAPTION = 30


def refocused(raw: npt.NDArray[np.integer], m: int, order: int) -> list[npt.NDArray[np.integer]]:
    """Sweep a light field through the core: a = -1 and a = 1."""
    core = CoreConfiguration(
        micro_image_size=m, shifts=(-m, m), max_columns=raw.shape[1], channels=3, order=order
    )
    frames = np.stack([raw, raw])
    with tempfile.TemporaryDirectory() as folder:
        result = run_bench(find_simulator("ghdl"), core, frames, Path(folder), sweep_frames=1)
    want = [core.arithmetic.refocus(raw, m, shift=shift, order=order) for shift in core.shifts]
    assert np.array_equal(result.frames, np.stack(want))
    return list(result.frames)


def main() -> None:
    """Simulate and draw."""
    raw = read_image(project.DATA / "planes_5x5.png")
    side = min(raw.shape[:2]) // 2 // 5 * 5
    raw = raw[:side, :side]
    cases = (
        ("M = 3, nearest neighbour", central_directions(raw, 5, 3), 3, 0),
        ("M = 5, nearest neighbour", raw, 5, 0),
        ("M = 5, linear", raw, 5, 1),
    )
    width = len(cases) * (SIZE + MARGIN) - MARGIN
    picture = Image.new("RGB", (width, 2 * (SIZE + CAPTION)), "white")
    draw = ImageDraw.Draw(picture)
    font = ImageFont.load_default(18)
    for column, (name, light_field, m, order) in enumerate(track(cases, "simulations")):
        for row, (a, image) in enumerate(
            zip((-1, 1), refocused(light_field, m, order), strict=True)
        ):
            x, y = column * (SIZE + MARGIN), row * (SIZE + CAPTION)
            scaled = Image.fromarray(image).resize((SIZE, SIZE), Image.Resampling.NEAREST)
            picture.paste(scaled, (x, y))
            draw.text((x + 4, y + SIZE + 4), f"{name}, a = {a}", "black", font)
    iio.imwrite(
        project.root() / "docs" / "images" / "interpolation.jpg", np.asarray(picture), quality=88
    )


if __name__ == "__main__":
    main()
