# SPDX-License-Identifier: Apache-2.0
"""Images come back as they were written, with the white that the file tells; damaged do not."""

import io
import random
import struct
import subprocess
import sys
import warnings
import zlib
from math import inf
from pathlib import Path
from xml.etree import ElementTree

import imagecodecs
import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from PIL import Image as PillowImage

from plenofir.camera.description import description_of
from plenofir.camera.rays import RayModel, load_camera
from plenofir.ground.errors import InputError
from plenofir.ground.images import (
    Picture,
    bare,
    eight_bits,
    encode_picture,
    encode_png,
    read_image,
    read_picture,
    write_png,
)
from plenofir.ground.pages import Pages

RNG = np.random.default_rng(5)


def picture(dtype: type = np.uint16, channels: int = 3, bits: int = 16) -> np.ndarray:
    """Something like a photograph: a ramp with noise."""
    ramp = np.linspace(0, 0.9, 40 * 30 * channels).reshape(40, 30, channels)
    values = (ramp + 0.1 * RNG.random(ramp.shape)) * ((1 << bits) - 1)
    return np.squeeze(values.astype(dtype))


@given(
    arrays(np.uint16, array_shapes(min_dims=2, max_dims=2, max_side=9))
    | arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3)))
    | arrays(np.uint16, st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3)))
)
def test_png_keeps_every_bit(tmp_path_factory: pytest.TempPathFactory, image: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("png") / "image.png"
    write_png(path, image[::1, ::-1])
    got = read_image(path)
    assert got.dtype == image.dtype
    assert np.array_equal(got, image[:, ::-1])


def netpbm(image: np.ndarray, largest: int) -> bytes:
    kind = b"P6" if image.ndim == 3 else b"P5"
    size = b"%d %d" % (image.shape[1], image.shape[0])
    data = image.astype(">u2" if largest > 255 else "u1").tobytes()
    return b"\n".join([kind, size, b"%d" % largest, data])


def tiff(image: np.ndarray, **options: object) -> bytes:
    file = io.BytesIO()
    tifffile.imwrite(file, image, **options)  # type: ignore[arg-type]
    return file.getvalue()


def pillow(image: np.ndarray, kind: str) -> bytes:
    file = io.BytesIO()
    PillowImage.fromarray(image).save(file, kind)
    return file.getvalue()


def with_chunk(png: bytes, kind: bytes, body: bytes) -> bytes:
    """A PNG with one more chunk after its header."""
    chunk = struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    return png[:33] + chunk + png[33:]


DEEP = picture()
TWELVE = picture(bits=12)
EIGHT = picture(np.uint8, bits=8)
GREY = picture(np.uint8, 1, bits=8)

CASES = {
    "png16": (encode_png(DEEP), DEEP, 16),
    "png, 12 significant bits": (with_chunk(encode_png(TWELVE), b"sBIT", b"\x0c" * 3), TWELVE, 16),
    "tiff": (tiff(DEEP), DEEP, 16),
    "tiff big endian": (tiff(DEEP, byteorder=">"), DEEP, 16),
    "tiff big": (tiff(GREY, bigtiff=True), GREY, 8),
    "tiff lzw": (tiff(DEEP, compression="lzw", predictor=True), DEEP, 16),
    "tiff deflate": (tiff(EIGHT, compression="zlib"), EIGHT, 8),
    "tiff planes": (tiff(np.moveaxis(DEEP, 2, 0), photometric="rgb"), DEEP, 16),
    "tiff tiles": (tiff(GREY, tile=(16, 16), compression="lzw"), GREY, 8),
    "tiff white is zero": (tiff(GREY, photometric="miniswhite"), 255 - GREY, 8),
    "tiff 12 bit": (
        tiff(TWELVE[..., 0], bitspersample=12, photometric="minisblack"),
        TWELVE[..., 0],
        12,
    ),
    "ppm 10 bit": (netpbm(picture(bits=10), 1023), None, 10),
    "ppm": (netpbm(DEEP, 65535), DEEP, 16),
    "pgm": (netpbm(GREY, 255), GREY, 8),
    "bmp": (pillow(EIGHT, "BMP"), EIGHT, 8),
    "jpeg": (pillow(GREY, "JPEG"), None, 8),
}


@pytest.mark.parametrize("case", CASES)
def test_formats(tmp_path: Path, case: str) -> None:
    data, want, bits = CASES[case]
    path = tmp_path / "image"
    path.write_bytes(data)
    got = read_picture(path)
    assert got.full_scale == (1 << bits) - 1
    assert got.pixels.dtype == (np.uint8 if bits == 8 else np.uint16)
    assert got.pixels.flags.c_contiguous
    if want is not None:
        assert np.array_equal(got.pixels, want)


def test_white_that_is_no_power_of_two(tmp_path: Path) -> None:
    path = tmp_path / "image"
    path.write_bytes(netpbm(TWELVE[:, :, 0] // 8, 1000))
    assert read_picture(path).full_scale == 1000
    refuses(path, netpbm(TWELVE[:, :, 0], 1000), "the largest value is 1000")


PROFILE = imagecodecs.cms_profile("adobergb")


@pytest.mark.parametrize("suffix", [".png", ".tif", ".jpg"])
@pytest.mark.parametrize("profile", [None, PROFILE], ids=["no profile", "profile"])
@pytest.mark.parametrize(
    ("full_scale", "gamma"), [(65535, None), (4095, 1.0), (1000, 1 / 0.45455), (65535, 1.0)]
)
def test_what_numbers_mean_travels(
    tmp_path: Path, suffix: str, profile: bytes | None, full_scale: int, gamma: float | None
) -> None:
    pixels = np.minimum(DEEP, full_scale)
    path = tmp_path / f"image{suffix}"
    path.write_bytes(encode_picture(suffix, Picture(pixels, full_scale, gamma, profile)))
    found = read_picture(path)
    assert found.profile == profile
    if suffix == ".jpg":
        assert (found.full_scale, found.gamma) == (255, 2.2)
        assert np.abs(found.pixels - 255.0 * pixels / full_scale).mean() < 6
        return
    assert np.array_equal(found.pixels, pixels)
    assert found.full_scale == full_scale
    assert found.gamma == (None if gamma is None else pytest.approx(gamma, abs=1e-4))


def test_values_above_white_are_kept(tmp_path: Path) -> None:
    for suffix in (".png", ".tif"):
        path = tmp_path / f"image{suffix}"
        path.write_bytes(encode_picture(suffix, Picture(DEEP, 4095)))
        assert np.array_equal(read_image(path), DEEP)
        assert read_picture(path).full_scale == 4095


def test_wrong_white_is_refused(tmp_path: Path) -> None:
    for text, match in ((b"70000", "counts 70000 as white"), (b"5", "3 bit"), (b"x", "damaged")):
        data = with_chunk(encode_png(DEEP), b"tEXt", b"White level\0" + text)
        refuses(tmp_path / "image", data, match)


def test_pictures_for_screens_are_known(tmp_path: Path) -> None:
    path = tmp_path / "image"
    path.write_bytes(with_chunk(encode_png(DEEP), b"sRGB", b"\0"))
    assert read_picture(path).gamma == 2.2


def test_eight_bits_are_rounded_once() -> None:
    values = np.arange(65536, dtype=np.uint16)
    for full_scale in (65535, 4095, 1000):
        want = np.minimum(np.floor(values * 255.0 / full_scale + 0.5), 255)
        assert np.array_equal(eight_bits(values, full_scale), want)
    assert eight_bits(EIGHT) is EIGHT
    assert np.array_equal(eight_bits(EIGHT, 200), np.minimum((EIGHT * 255.0 + 100) // 200, 255))


def refuses(path: Path, data: bytes, match: str) -> None:
    path.write_bytes(data)
    with pytest.raises(InputError, match=match) as refused:
        read_image(path)
    assert "\n" not in str(refused.value)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize("case", CASES)
def test_cut_files_are_refused(tmp_path: Path, case: str) -> None:
    data = CASES[case][0]
    seed = random.SystemRandom().randrange(1 << 31)
    print(f"seed {seed}")
    draw = random.Random(seed)
    # The last bytes of a TIFF may be its padding.
    for length in (0, 1, len(data) // 2, *(draw.randrange(len(data) - 16) for _ in range(20))):
        refuses(tmp_path / "image", data[:length], "damaged|empty|no image")


@pytest.mark.parametrize("case", ["png16", "png, 12 significant bits", "tiff deflate"])
def test_every_flipped_bit_is_found(tmp_path: Path, case: str) -> None:
    """Of formats with checksums: in the pixels, and in a PNG anywhere."""
    data, want, _ = CASES[case]
    first = 8 if case.startswith("png") else 400
    seed = random.SystemRandom().randrange(1 << 31)
    print(f"seed {seed}")
    draw = random.Random(seed)
    for _ in range(100):
        damaged = bytearray(data)
        damaged[draw.randrange(first, len(data) - 16)] ^= 1 << draw.randrange(8)
        path = tmp_path / "image"
        path.write_bytes(bytes(damaged))
        try:
            assert np.array_equal(read_image(path), want)
        except InputError as error:
            assert "damaged" in str(error)  # noqa: PT017


def test_lzw_strips_of_a_wrong_length_are_refused(tmp_path: Path) -> None:
    """LZW has no checksum; a strip that decodes to another length is found."""
    data = tiff(DEEP, compression="lzw")
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        page = file.pages[0]
        place = page.dataoffsets[0]
    short = imagecodecs.lzw_encode(DEEP.tobytes()[:-600])
    refuses(tmp_path / "image.tif", data[:place] + short + data[place + len(short) :], "strip 0")


@pytest.mark.parametrize(
    ("stored", "values", "white"),
    [
        (np.linspace(0, 1, 400, dtype=np.float32), np.rint(np.linspace(0, 65535, 400)), 65535),
        (np.arange(400, dtype=np.uint32), np.arange(400), 65535),
        (np.arange(400, dtype=np.int16), np.arange(400), 32767),
    ],
)
def test_numbers_of_other_types(
    stored: np.ndarray, values: np.ndarray, white: int, tmp_path: Path
) -> None:
    (tmp_path / "image.tif").write_bytes(tiff(stored.reshape(20, 20)))
    picture = read_picture(tmp_path / "image.tif")
    assert (np.abs(picture.pixels.ravel() - values) <= 1).all()
    assert picture.full_scale == white


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (tiff(np.zeros((3, 20, 20), np.uint8), photometric="minisblack"), "3 pages"),
        (tiff(np.full((20, 20), 3.5, np.float32)), "3.5; floats must go from 0 to 1"),
        (tiff(np.zeros((20, 20, 4), np.uint8)), "alpha channel that is not opaque"),
        (encode_png(np.zeros((5, 5, 4), np.uint8)), "alpha channel that is not opaque"),
        (pillow(np.zeros((9, 9, 4), np.uint8), "TIFF"), "alpha channel that is not opaque"),
        (b"P4\n8 1\n\0", "no image of a known kind"),
        (netpbm(GREY >> 4, 15), "4 bit"),
        (b"GIF89a", "no image of a known kind"),
        (b"", "an empty file"),
    ],
)
def test_refused_by_name(tmp_path: Path, data: bytes, match: str) -> None:
    refuses(tmp_path / "image", data, match)


@pytest.mark.parametrize("case", ["bmp", "jpeg"])
@pytest.mark.parametrize("limit", [400, 900])
def test_pictures_of_any_size(tmp_path: Path, monkeypatch, case: str, limit: int) -> None:
    """Pillow warns of pictures above a limit of its own, and refuses those above twice that."""
    monkeypatch.setattr(PillowImage, "MAX_IMAGE_PIXELS", limit)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        test_formats(tmp_path, case)


def test_what_decoders_say_is_not_printed(tmp_path: Path) -> None:
    """A whole PNG with an odd time stamp: libpng warns of it."""
    path = tmp_path / "image.png"
    path.write_bytes(with_chunk(encode_png(GREY), b"tIME", bytes(7)))
    read = f"from plenofir.ground.images import *; read_image(Path({str(path)!r}))"
    done = subprocess.run([sys.executable, "-c", read], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_what_is_no_file(tmp_path: Path) -> None:
    for path, match in (
        (tmp_path / "none.png", "no such file"),
        (tmp_path, "is a folder"),
        (tmp_path / ("x" * 300), "File name too long"),
        (Path("nul\0"), "null"),
    ):
        with pytest.raises(InputError, match=match):
            read_image(path)


def test_a_text_names_a_file_as_a_path_does(tmp_path: Path) -> None:
    name = str(tmp_path / "grey.png")
    write_png(name, GREY)
    assert (read_image(name) == GREY).all()
    with pytest.raises(InputError, match="no such file"):
        read_picture(f"{name}x")


@pytest.mark.parametrize(
    ("kind", "channels", "match"),
    [
        ("cielab", 3, "colours of the kind CIELAB"),
        ("ycbcr", 3, "colours of the kind YCBCR"),
        ("separated", 4, "colours of the kind SEPARATED"),
        ("palette", 1, "takes its colours from a palette"),
    ],
)
def test_colours_that_are_no_rgb(tmp_path: Path, kind: str, channels: int, match: str) -> None:
    """Of one picture, and of pages: their samples are no levels of red, green and blue."""
    samples = np.repeat(GREY[..., np.newaxis], channels, axis=2).squeeze()
    colours = np.zeros((3, 256), np.uint16) if kind == "palette" else None
    tifffile.imwrite(tmp_path / "one.tif", samples, photometric=kind, colormap=colours)
    with pytest.raises(InputError, match=match):
        read_picture(tmp_path / "one.tif", drop_alpha=True)
    stack = np.stack(3 * [samples])
    tifffile.imwrite(tmp_path / "pages.tif", stack, photometric=kind, colormap=colours)
    with pytest.raises(InputError, match=match):
        Pages(tmp_path / "pages.tif")[1]


def test_pages_whose_white_is_zero(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "pages.tif", np.stack(3 * [255 - GREY]), photometric="miniswhite")
    assert np.array_equal(Pages(tmp_path / "pages.tif")[2].pixels, GREY)


def test_metadata_that_are_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder
) -> None:
    """Their picture is read as it is stored; faults of anything else are not taken for damage."""
    exif = PillowImage.Exif()
    exif[0x0112], exif[0x010F] = 3, "a maker of cameras"
    whole = exif.tobytes().removeprefix(b"Exif\0\0")
    rng, path = random.Random(5), tmp_path / "one.png"
    turned = []
    for cut in range(120):
        damaged = bytearray(whole)
        for _ in range(cut > 0):
            damaged[rng.randrange(len(damaged))] = rng.choice((0, 1, 2, 7, 255))
        path.write_bytes(with_chunk(encode_png(GREY), b"eXIf", bytes(damaged[: 180 - cut])))
        read = read_picture(path, as_stored=True)
        assert np.array_equal(read.pixels, GREY)
        turned.append(read.orientation == 3)
    assert turned[0]
    assert 0 < sum(turned) < len(turned)
    assert not recwarn.list

    def fail(*_: object) -> None:
        raise RuntimeError("a fault of Pillow's")

    monkeypatch.setattr(PillowImage.Exif, "load", fail)
    with pytest.raises(InputError, match="a fault of Pillow's"):
        read_picture(path)


def xmp_of(path: Path) -> dict[str, str]:
    """What a file's XMP says, by the names of the properties."""
    with PillowImage.open(path) as file:
        file.load()
        tree = ElementTree.fromstring(file.info["xmp"])
    found = next(e for e in tree.iter() if e.tag.endswith("}Description")).attrib
    return {name.rpartition("}")[2]: value for name, value in found.items()}


@pytest.mark.parametrize("name", ["one.png", "one.tif", "one.jpg"])
def test_xmp(tmp_path, name):
    """Other programs read what a picture says of how it was made."""
    model = RayModel.focused(load_camera("f193-mla2"), inf, 5)
    plain = bare(np.full((40, 30), 9, np.uint8))._replace(xmp=description_of(5, None, model))
    path = tmp_path / name
    path.write_bytes(encode_picture(path.suffix, plain))
    facts = xmp_of(path)
    assert (facts["M"], facts["CreatorTool"]) == ("5", "plenofir")
    # At a = 0 it is infinite, as EXIF writes that.
    assert facts["SubjectDistance"] == "4294967295/1"
    assert facts["Model"] == "f193-mla2"
    assert np.abs(read_image(path).astype(int) - 9).max() <= 1
