# SPDX-License-Identifier: Apache-2.0
"""The viewer's exports: their size, and how views are packed."""

import io
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir
from PIL import Image as PillowImage

from plenofir import InputError
from plenofir.ground.images import write_png
from plenofir.view import export, light_field_page, pictures_page
from plenofir.view.mosaic import packed_views
from plenofir.view.views_and_depth import LightField

RNG = np.random.default_rng(3)


def test_large_grey_views_without_loss_are_png_which_is_quicker_for_them() -> None:
    views = RNG.integers(0, 200, (2, 2, 800, 800), dtype=np.uint8)
    kinds = {}
    for name, some in {"grey": views, "small": views[:, :, :90], "RGB": views[..., None]}.items():
        mosaic = packed_views(some.repeat(3, -1) if name == "RGB" else some, 1 << 24)
        kinds[name] = mosaic.part.kind
        picture = np.asarray(PillowImage.open(io.BytesIO(mosaic.part.content)))
        whole = np.moveaxis(some, (0, 1), (0, 2)).reshape(2 * some.shape[2], -1)
        assert ((picture if picture.ndim == 2 else picture[..., 0]) == whole).all()
    assert kinds == {"grey": "image/png", "small": "image/webp", "RGB": "image/webp"}


def test_an_export_keeps_to_its_size(tmp_path: Path) -> None:
    raw = np.random.default_rng(8).integers(0, 256, (150, 150, 3), dtype=np.uint8)
    page = light_field_page(raw, 3, full_scale=255, title="noise")
    for limit in (300_000, 200_000, 150_000):
        content = export(page, limit)
        assert len(content) <= limit
        assert b"Scaled down" in content if limit == 150_000 else b"Views" in content
    with pytest.raises(InputError, match="does not fit"):
        export(page, 130_000)
    assert packed_views(LightField(raw, 3).views(), 1000) is None
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "page.html"
    done = plenofir("view", str(tmp_path / "raw.png"), "-M", "3", "--export", str(out))
    assert done.stdout == f"{out}: {out.stat().st_size / 1e6:.1f} MB\n"
    assert done.returncode == 0


def test_16_bit_stay_in_an_export_or_become_steps_of_brightness() -> None:
    rng = np.random.default_rng(9)
    views = rng.integers(100, 4000, (3, 3, 20, 30), dtype=np.uint16)
    whole = packed_views(views, 1_000_000)
    assert whole is not None
    assert whole.codes is None
    assert "16 bit" in whole.words
    found = np.asarray(PillowImage.open(io.BytesIO(whole.part.content)).convert("L"), np.uint16)
    high, low = found[:60], found[60:]
    mosaic = np.moveaxis(views, (0, 1), (0, 2)).reshape(60, 90)
    assert np.array_equal(256 * high + low, mosaic)
    steps = packed_views(views, len(whole.part.content) - 1)
    assert steps is not None
    assert steps.codes is not None
    coded = np.asarray(PillowImage.open(io.BytesIO(steps.part.content)).convert("L"))
    values = np.array(steps.codes)[coded]
    # Steps are finer where it is dark.
    assert np.abs(values - mosaic).max() <= 18
    assert np.abs(values - mosaic)[mosaic < 300].max() <= 4


def test_an_export_of_pictures_fits_or_tells_the_limit_that_does(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        write_png(tmp_path / name, RNG.integers(0, 256, (150, 150, 3), dtype=np.uint8))
    page = pictures_page(tmp_path)
    whole = len(export(page, 1_000_000))
    # All of the limit is used.
    assert len(export(page, whole + 5000)) == whole
    # Close to it, and far from it.
    for limit in (whole - 5000, 100_000):
        with pytest.raises(InputError, match=r"limit: 0.1 MB of pictures .* give 2 or more"):
            export(page, limit)
