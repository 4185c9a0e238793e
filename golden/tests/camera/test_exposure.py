# SPDX-License-Identifier: Apache-2.0
"""Pictures to be looked at: levels, gamma, files."""

from pathlib import Path

import imagecodecs
import numpy as np
import pytest
from in_process import plenofir
from scipy import ndimage

from plenofir.camera.exposure import exposure, finer, one_exposure, to_srgb
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, bare, read_picture, write_png
from plenofir.refocus import best_picture

pytestmark = pytest.mark.quick


def dark_field(m: int = 5) -> Picture:
    """A light field that uses 300 of 65536 levels."""
    lenses = np.linspace(100, 400, 400).reshape(20, 20).astype(np.uint16)
    return bare(lenses.repeat(m, 0).repeat(m, 1))


def test_auto_takes_black_and_white_from_the_picture() -> None:
    field = dark_field()
    look = exposure(field, 5)
    shown = look.apply(field.pixels)
    assert shown.dtype == field.pixels.dtype
    assert (shown.min(), shown.max()) == (0, 65535)
    # In proportion: the middle stays in the middle.
    assert abs(int(np.median(shown)) - 32768) < 700
    darker = exposure(field, 5, "auto-2.2")
    assert darker == look._replace(ev=-2.2)
    below = field.pixels < look.white
    assert np.abs(darker.apply(field.pixels) - shown / 2)[below].max() <= 1


def test_what_is_bright_stays_unless_it_is_linear() -> None:
    ramp = np.linspace(20, 200, 400).reshape(20, 20).astype(np.uint8)
    assert exposure(bare(ramp), 1) == (0, 255, 1, 0, 1)
    assert exposure(bare(ramp), 1).as_stored(bare(ramp))
    linear = Picture(ramp, 255, 1.0)
    black, white, gamma, *_ = exposure(linear, 1)
    assert (round(black), round(white), gamma) == (20, 200, 2.2)
    assert exposure(linear._replace(gamma=2.2), 1) == (0, 255, 1, 0, 1)


def test_white_is_what_the_file_says() -> None:
    ramp = np.linspace(100, 4000, 400).reshape(20, 20).astype(np.uint16)
    look = exposure(Picture(ramp, 4095), 1)
    assert look == (0, 4095, 1, 0, 1)
    assert not look.as_stored(Picture(ramp, 4095))
    shown = look.shown(Picture(ramp, 4095, 1.0), ramp)
    assert (shown.full_scale, shown.gamma) == (65535, 1)
    assert np.array_equal(shown.pixels, np.floor(ramp * (65535 / 4095) + 0.5))


def test_ev_is_light_on_the_screen_and_gamma_brightens() -> None:
    values = bare(np.arange(0, 256, 5, dtype=np.uint8).reshape(4, 13))
    stored = values.pixels
    twice = exposure(values, 2, "1").apply(stored)
    light = np.minimum((stored / 255) ** 2.2 * 2, 1)
    assert np.abs(twice - 255 * light ** (1 / 2.2)).max() <= 0.5
    assert np.array_equal(exposure(values, 2, "off").apply(stored), stored)
    brighter = exposure(values, 2, "off", 2.2).apply(stored)
    assert np.array_equal(brighter, np.rint(255 * (stored / 255) ** (1 / 2.2)))


def landscape(sky: int = 0) -> Picture:
    """A dark scene, 100 x 60 pixels for a screen, with lines of white sky."""
    rng = np.random.default_rng(5)
    ground = ndimage.gaussian_filter(rng.normal(size=(100, 60)), 1)
    values = np.clip(33 + 8 * ground / ground.std(), 0, 255).astype(np.uint8)
    values[:sky] = 255
    return Picture(values, 255, 2.2)


@pytest.mark.parametrize("sky", [1, 5, 20, 40])
def test_a_strip_of_sky_does_not_darken_a_picture(sky: int) -> None:
    picture = landscape(sky)
    look = exposure(picture, 1)
    shown = look.apply(picture.pixels)
    assert 60 <= np.median(shown[40:]) <= 100
    # White stays white, and what is brighter stays so.
    assert (shown[:sky] == 255).all()
    assert (np.diff(look.apply(np.arange(256, dtype=np.uint8)).astype(int)) >= 0).all()
    assert "dark parts" in look.words()


def test_an_even_background_stays_dark() -> None:
    # As of a fluorescence microscope: light in a tenth of the picture.
    values = np.full((60, 60), 1000, np.uint16)
    values[20:38, 20:38] = np.random.default_rng(1).integers(8000, 60000, (18, 18))
    look = exposure(Picture(values, 65535, 1.0), 1)
    assert look.shoulder == 1
    assert look.apply(values)[0, 0] == 0


def test_frames_of_a_run_keep_their_changes_of_light() -> None:
    first = dark_field()
    frames = [first._replace(pixels=first.pixels // share) for share in (1, 2, 4)]
    look = one_exposure((frame, 5) for frame in frames)
    means = [look.apply(frame.pixels).mean() for frame in frames]
    assert means[0] > 1.9 * means[1] > 3.2 * means[2]
    assert (look.black, look.white) == (
        exposure(frames[2], 5).black,
        exposure(frames[0], 5).white,
    )
    with pytest.raises(InputError, match="no picture"):
        one_exposure([])


def test_eight_bits_of_a_microscope_come_out_in_many_levels(tmp_path: Path) -> None:
    # 225 views of 12 grey levels, linear light.
    rng = np.random.default_rng(2)
    lenses = ndimage.gaussian_filter(rng.normal(size=(30, 30)), 2)
    field = (12 + 4 * lenses / abs(lenses).max()).repeat(15, 0).repeat(15, 1)
    raw = Picture(np.rint(field + rng.normal(0, 1, field.shape)).astype(np.uint8), 255, 1.0)
    write_png(tmp_path / "raw.png", raw)
    for out, command in (("r.png", ("refocus", "-a", "0")), ("s", ("stack", "-a", "0"))):
        done = plenofir(
            command[0],
            str(tmp_path / "raw.png"),
            "-M",
            "15",
            *command[1:],
            "--out",
            out,
            cwd=tmp_path,
        )
        assert done.returncode == 0, done.stderr
    for file in ("r.png", "s/refocused_a0.png"):
        pixels = read_picture(tmp_path / file).pixels
        assert pixels.dtype == np.uint8
        assert len(np.unique(pixels)) >= 150


def test_even_picture_stays_as_it_is() -> None:
    raster = np.full((20, 20), 7, np.uint8)
    assert (exposure(bare(raster), 4).apply(raster) == 7).all()


@pytest.mark.parametrize("setting", ["bright", "nan", "25", "-1e9", "", "auto+", "auto 1"])
def test_other_exposures_are_refused(setting: str) -> None:
    with pytest.raises(InputError, match="is not an exposure; use auto, off, or a number of EV"):
        exposure(bare(np.zeros((8, 8), np.uint8)), 2, setting)


def test_colours_of_another_profile_become_srgb() -> None:
    rng = np.random.default_rng(1)
    pixels = rng.integers(0, 65536, (9, 8, 3), dtype=np.uint16)
    same = to_srgb(Picture(pixels, 65535, None, imagecodecs.cms_profile("srgb")), "a")
    assert np.array_equal(same.pixels, pixels)
    assert (same.profile, same.gamma) == (None, 2.2)
    green = np.zeros((2, 2, 3), np.uint16)
    green[..., 1] = 30000
    found = to_srgb(Picture(green, 65535, None, imagecodecs.cms_profile("adobergb")), "a").pixels
    # Green of Adobe RGB is more than sRGB has.
    assert found[0, 0, 0] == 0
    assert found[0, 0, 1] > 30000
    with pytest.raises(InputError, match=r"a.png: its colour profile cannot be used"):
        to_srgb(Picture(pixels, 65535, None, b"no profile"), "a.png")


def test_commands_expose_what_is_looked_at_and_keep_values_when_told(tmp_path: Path) -> None:
    ramp = np.linspace(100, 900, 900).reshape(30, 30).astype(np.uint16)
    raw = Picture(ramp, 4095, 1.0)
    write_png(tmp_path / "raw.png", raw)
    how = ("refocus", str(tmp_path / "raw.png"), "-M", "3", "-a", "1/3", "--out")
    want = best_picture(ramp, 3, "1/3")
    look = exposure(raw, 3)
    # Pictures to look at are made of values that use all 16 bits.
    fine, unit = finer(raw)
    assert unit == 16
    shown = look.apply(best_picture(fine, 3, "1/3"), unit=unit)
    for name, options, pixels, told in (
        ("data.png", ("--exposure", "off"), want, (4095, 1.0)),
        ("data.tif", ("--exposure", "off"), want, (4095, 1.0)),
        ("seen.png", (), shown, (65535, 2.2)),
        ("seen.tif", (), shown, (65535, 2.2)),
    ):
        done = plenofir(*how, str(tmp_path / name), *options)
        assert (done.returncode, done.stderr) == (0, "")
        assert ("exposed: black 1" in done.stdout) == (name.startswith("seen"))
        found = read_picture(tmp_path / name)
        assert np.array_equal(found.pixels, pixels), name
        assert (found.full_scale, found.gamma) == (told[0], pytest.approx(told[1], 1e-4))
    assert plenofir("views", str(tmp_path / "raw.png"), "-M", "3", "--out", str(tmp_path / "views"))
    assert read_picture(tmp_path / "views" / "view_01_02.png")[1:3] == (4095, 1)
    again = str(tmp_path / "again.png")
    assert plenofir("compose", str(tmp_path / "views"), "--out", again).returncode == 0
    assert read_picture(Path(again))[1:3] == (4095, 1)
    assert np.array_equal(read_picture(Path(again)).pixels, ramp)
