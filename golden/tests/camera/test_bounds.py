# SPDX-License-Identifier: Apache-2.0
"""What limits the picture in focus everywhere of coarse inputs: the input's own error.

`pytest -s` prints PSNR in dB against the views before they were made coarse.
"""

import io
from collections.abc import Callable

import numpy as np
import pytest
from drawn_views import drawn
from PIL import Image as Pillow

from plenofir.camera.lightfield import all_in_focus
from plenofir.camera.lightfield.indexing import compose

VIEWS = drawn(5, 5, (96, 128))[0]


def jpeg(image: Pillow.Image, quality: int, subsampling: int = 2) -> Pillow.Image:
    file = io.BytesIO()
    image.save(file, "JPEG", quality=quality, subsampling=subsampling)
    return Pillow.open(file)


def psnr(found: np.ndarray, true: np.ndarray) -> float:
    error = np.mean((found.astype(float) - true) ** 2)
    return float(10 * np.log10(255**2 / max(error, 1e-9)))


@pytest.mark.parametrize(
    ("name", "coarse"),
    [
        ("JPEG, quality 75", lambda image: jpeg(image, 75)),
        ("JPEG, quality 90", lambda image: jpeg(image, 90)),
        ("JPEG, quality 92, colours at full size", lambda image: jpeg(image, 92, 0)),
        ("palette of 256 colours", lambda image: image.quantize(256)),
        ("palette of 32 colours", lambda image: image.quantize(32)),
    ],
)
def test_no_farther_from_the_truth_than_the_input(
    name: str, coarse: Callable[[Pillow.Image], Pillow.Image]
) -> None:
    views = np.empty_like(VIEWS)
    for place in np.ndindex(5, 5):
        views[place] = np.asarray(coarse(Pillow.fromarray(VIEWS[place])).convert("RGB"))
    sharp = all_in_focus(compose(views), 5).reshape(96, 5, 128, 5, 3).mean((1, 3))
    given, result = (psnr(image, VIEWS[2, 2]) for image in (views[2, 2], sharp))
    print(f"{name}: view {given:.1f} dB, in focus everywhere {result:.1f} dB")
    assert result > given
