# SPDX-License-Identifier: Apache-2.0
"""Volumes as other programs read them, and what they hold."""

import tracemalloc
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from in_process import plenofir
from PIL import Image as Pillow
from tifffile import TiffFile, TiffWriter, imread, imwrite, xml2dict

from plenofir.camera.rays import Microscope, MicroscopeModel, load_instrument
from plenofir.commands import volumes
from plenofir.ground import volumes as written
from plenofir.ground.images import Picture, encode_png
from plenofir.refocus import best_picture

M, LENSES = 5, 16

STEEP = """
name = "steep"
[objective]
magnification = 40
numerical_aperture = 1.2
immersion_index = 1.33
[micro_lenses]
pitch_mm = 0.1
f_number = 15.5
[sensor]
pixel_pitch_mm = 0.0103
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Frames of 8 and 16 bits, grey and RGB, a film of them, and a microscope."""
    place = tmp_path_factory.mktemp("volumes")
    rng = np.random.default_rng(5)
    size = LENSES * M
    lenses = rng.integers(0, 200, (4, LENSES, LENSES)).repeat(M, 1).repeat(M, 2)
    grey = (lenses + rng.integers(0, 50, (4, size, size))).astype(np.uint8)
    imwrite(place / "film.tif", grey.astype(np.uint16) * 257, photometric="minisblack")
    for number, frame in enumerate(grey):
        Pillow.fromarray(frame).save(place / f"grey_{number}.png")
    colours = np.stack([grey[0], grey[0] // 2, grey[0] // 3], axis=-1)
    Pillow.fromarray(colours).save(place / "rgb.png")
    (place / "steep.toml").write_text(STEEP)
    return place


def run(folder: Path, *words: str) -> str:
    done = plenofir(*words, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def sizes(folder: Path, camera: str = "steep.toml") -> MicroscopeModel:
    found = load_instrument(folder / camera)
    assert isinstance(found, Microscope)
    return MicroscopeModel(found, M)


def test_ome_tiff_as_napari_reads_it(folder: Path) -> None:
    run(folder, *f"batch film.tif -M {M} -a -1/5:1/5 --camera steep.toml --out x.ome.tif".split())
    model = sizes(folder)
    with TiffFile(folder / "x.ome.tif") as file:
        assert file.is_ome
        series = file.series[0]
        found = series.asarray()
        pixels = xml2dict(file.ome_metadata or "")["OME"]["Image"]["Pixels"]
        # Readers of TIFF alone.
        across = 1e4 * file.pages[0].tags["XResolution"].value[1]  # type: ignore[union-attr]
        across /= file.pages[0].tags["XResolution"].value[0]  # type: ignore[union-attr]
    assert (series.axes, found.shape) == ("TZYX", (4, 3, LENSES * M, LENSES * M))
    counts = [pixels[f"Size{axis}"] for axis in "TZCYX"]
    assert counts == [4, 3, 1, LENSES * M, LENSES * M]
    assert [pixels[f"PhysicalSize{axis}Unit"] for axis in "XYZ"] == ["µm"] * 3
    assert pixels["PhysicalSizeX"] == pixels["PhysicalSizeY"] == pytest.approx(model.pixel_um)
    assert across == pytest.approx(model.pixel_um, rel=1e-6)
    assert pixels["PhysicalSizeZ"] == pytest.approx(model.um_per_a / 5)
    frames = imread(folder / "film.tif")
    for t in range(4):
        for z, a in enumerate((-1, 0, 1)):
            np.testing.assert_array_equal(found[t, z], best_picture(frames[t], M, f"{a}/5"))


def test_hyperstack_of_imagej(folder: Path) -> None:
    words = f"-M {M} --z -2:2:2 --camera steep.toml --out x.tif"
    run(folder, "batch", "grey_*.png", *words.split())
    with TiffFile(folder / "x.tif") as file:
        assert file.is_imagej
        about, found = file.imagej_metadata, file.asarray()
        tags = file.pages[0].tags  # type: ignore[union-attr]
        resolution, unit = tags["XResolution"].value, tags["ResolutionUnit"].value
    assert about is not None
    assert [about[key] for key in ("frames", "slices", "images")] == [4, 3, 12]
    assert about["hyperstack"]
    assert (about["unit"], about["spacing"], about["zorigin"]) == ("um", 2.0, 1.0)
    # Pixels for each of the unit.
    assert resolution[1] / resolution[0] == pytest.approx(sizes(folder).pixel_um, rel=1e-6)
    assert unit == 1
    # Frames of 8 bits have finer values in the volume, white at 65535.
    frame = np.asarray(Pillow.open(folder / "grey_2.png")).astype(np.uint16) * 257
    np.testing.assert_array_equal(found[2, 1], best_picture(frame, M, 0))


def test_white_below_the_largest_number(tmp_path: Path) -> None:
    """Pixels of 8 bits that are brighter than what the file calls white do not begin anew at 0."""
    raster = np.full((40, 40), 90, np.uint8)
    raster[10:20, 10:20] = 250
    picture = Picture(raster, 150)
    (tmp_path / "white150.png").write_bytes(encode_png(picture))
    run(tmp_path, *f"batch white150.png -M {M} -a 0 --out x.tif".split())
    want = best_picture(raster.astype(np.uint16) * 257, M, 0)
    np.testing.assert_array_equal(imread(tmp_path / "x.tif").squeeze(), want)


def test_pages_of_other_sizes_are_told(folder: Path) -> None:
    with TiffWriter(folder / "thumbnail.tif") as file:
        file.write(imread(folder / "film.tif")[:2], photometric="minisblack")
        file.write(np.zeros((8, 8), np.uint16), photometric="minisblack")
    done = plenofir(*f"batch thumbnail.tif -M {M} -a 0 --out y.tif".split(), cwd=folder)
    assert (done.returncode, imread(folder / "y.tif").shape[0]) == (0, 2)
    assert "1 pages of other sizes are left out" in done.stderr


@pytest.mark.parametrize("name", ["c.ome.tif", "c.tif"])
def test_colours_are_channels(folder: Path, name: str) -> None:
    said = run(folder, *f"stack rgb.png -M {M} -a -1/5:1/5 --out {name}".split())
    assert "without --camera MICROSCOPE no micrometres" in said
    with TiffFile(folder / name) as file:
        found, axes = file.asarray(), file.series[0].axes
        if file.is_ome:
            pixels = xml2dict(file.ome_metadata or "")["OME"]["Image"]["Pixels"]
            assert not [key for key in pixels if key.startswith("Physical")]
            assert [one["Name"] for one in pixels["Channel"]] == ["red", "green", "blue"]
        else:
            assert file.imagej_metadata is not None
            assert file.imagej_metadata["mode"] == "composite"
    assert axes == "ZCYX"
    picture = np.asarray(Pillow.open(folder / "rgb.png")).astype(np.uint16) * 257
    np.testing.assert_array_equal(np.moveaxis(found[2], 0, -1), best_picture(picture, M, "1/5"))


def test_a_plane_is_sharp_at_its_height(folder: Path) -> None:
    """Views of a plane drawn by the sine condition, at an aperture where sines do not do."""
    m, lenses = 9, 30
    text = STEEP.replace("f_number = 15.5", "f_number = 16.6667").replace("0.0103", "0.0111111")
    (folder / "wide.toml").write_text(text)
    microscope = load_instrument(folder / "wide.toml")
    assert isinstance(microscope, Microscope)
    assert MicroscopeModel(microscope, m).steepness > 1.4
    height, rng = 7.0, np.random.default_rng(8)
    waves, phases = rng.normal(0, 1.2, (2, 30)), rng.uniform(0, 7, 30)
    u = np.arange(m) - (m - 1) / 2
    down, right = np.meshgrid(u, u, indexing="ij")
    far = np.hypot(down, right)
    sine = far * 0.0111111 / 1.66667 * 40 / 1.33
    lit = sine <= 1.2 / 1.33
    moves = 40 * height * np.tan(np.arcsin(np.where(lit, sine, 0))) / 100 / np.maximum(far, 1e-9)
    t, s = np.mgrid[:lenses, :lenses]
    y = t[:, None, :, None] + (moves * down)[None, :, None, :]
    x = s[:, None, :, None] + (moves * right)[None, :, None, :]
    light = sum(np.sin(a * y + b * x + p) for a, b, p in zip(*waves, phases, strict=True))
    raw = np.where(lit[None, :, None, :], 128 + 8 * np.asarray(light), 0)
    raw = np.clip(np.rint(raw), 0, 255).astype(np.uint8).reshape(lenses * m, lenses * m)
    Pillow.fromarray(raw).save(folder / "plane.png")
    words = f"stack plane.png -M {m} --z 4:10:1/2 --camera wide.toml --out p.ome.tif"
    run(folder, *words.split())
    middle = imread(folder / "p.ome.tif")[:, 60:-60, 60:-60].astype(float)
    sharpest = 4 + np.argmax(middle.var(axis=(1, 2))) / 2
    assert abs(sharpest - height) <= 0.5


def test_memory_does_not_grow_with_frames(folder: Path) -> None:
    """The peak may grow by a twentieth of the pixels of the frames that are added."""

    def peak(frames: int) -> int:
        film = np.full((frames, 20 * M, 20 * M), 9, np.uint16)
        imwrite(folder / "long.tif", film, photometric="minisblack")
        del film
        slices = volumes.Slices((Fraction(0),), None)
        tracemalloc.start()
        source = volumes.Film([folder / "long.tif"], volumes_hints())
        volumes.volume_of_film(
            source, lambda _: slices, folder / "long.ome.tif", lambda *_: None, threads=1
        )
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    peak(5)
    short, long = peak(10), peak(600)
    frame = 2 * (20 * M) ** 2
    assert long - short < 590 * frame / 20


def volumes_hints() -> Any:
    from plenofir.camera.recognise.source import Hints

    return Hints(micro_image=M)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("stack grey_0.png -M 5 --z 1:2 --out x.ome.tif", "requires a microscope"),
        ("stack grey_0.png -M 5 --z 1:2 --out folder", "is for volumes"),
        ("stack grey_0.png -M 5 --z 1 -a 1 --camera steep.toml --out x.tif", "combined with -a"),
        ("stack grey_0.png -M 5 --z x --camera steep.toml --out x.tif", "--z: 'x'"),
        ("stack grey_0.png -M 5 --z 3:1 --camera steep.toml --out x.tif", "--z: '3:1' is empty"),
        ("stack grey_0.png -M 5 -a 0,1,3 --camera steep.toml --out x.tif", "equal steps"),
        ("stack grey_0.png -M 5 -a 1,0 --camera steep.toml --out x.tif", "equal steps"),
        ("stack grey_0.png -M 5 --camera f193-mla2 --out x.tif", "is no microscope"),
        ("stack grey_0.png -M 5 --camera steep.toml --focus 9 --out x.tif", "by its stage"),
        ("stack grey_0.png -M 5 --exposure auto --out x.tif", "for a folder"),
        ("stack grey_0.png -M 5 --depth-index --out x.tif", "for a folder"),
        ("stack grey_0.png -M 5 --out grey_0.png/x.tif", "not a folder"),
        ("stack film.tif -M 5 --out film.tif", "made from"),
        ("batch grey_0.png -M 5 --workers 2 --out x.tif", "for a folder"),
        ("batch grey_0.png rgb.png -M 5 --out x.tif", "rgb.png: has another size or type"),
        ("batch grey_0.png --out x.tif", "give -M"),
        ("batch damaged.tif -M 5 --out x.ome.tif", "damaged.tif"),
    ],
)
def test_what_cannot_be_a_volume(folder: Path, words: str, said: str) -> None:
    content = (folder / "film.tif").read_bytes()
    # The last frame is not all there.
    (folder / "damaged.tif").write_bytes(content[: 2 * (LENSES * M) ** 2 * 3 + 2000])
    before = sorted(folder.rglob("*"))
    done = plenofir(*words.split(), cwd=folder)
    assert done.returncode == 2, done
    errors = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    assert len(errors) == 1, done.stderr
    assert said in errors[0]
    assert sorted(folder.rglob("*")) == before


def test_failures_in_the_middle_leave_nothing(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = sorted(folder.rglob("*"))
    monkeypatch.setattr(written, "_CLASSIC_BYTES", 100_000)
    done = plenofir(*f"batch film.tif -M {M} --out big.tif".split(), cwd=folder)
    assert done.returncode == 2
    assert "write big.ome.tif" in done.stderr

    def damaged(self: Any, first: int) -> Any:
        yield from original(self, first)
        raise self._damaged(ValueError("cut"))

    from plenofir.ground.pages import Pages

    original = Pages._from
    monkeypatch.setattr(Pages, "_from", damaged)
    done = plenofir(*f"batch film.tif -M {M} -a 0 --out cut.ome.tif".split(), cwd=folder)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "film.tif: is damaged (cut)" in done.stderr
    assert sorted(folder.rglob("*")) == before


def ring(slice_: Any, centre: tuple[float, float]) -> float:
    """Radius in pixels of the brightest ring about a centre."""
    y, x = np.indices(slice_.shape)
    far = np.hypot(y - centre[0], x - centre[1]).astype(int) // 2
    light = [np.median(slice_[far == k]) for k in range(20, 90)]
    smooth = np.convolve(light, np.ones(5) / 5, "same")[2:-2]
    return float(2 * (22 + np.argmax(smooth)) + 1)


def test_a_vesicle_is_round(tmp_path: Path) -> None:
    """A captured giant vesicle, a sphere: as high in z as it is wide in x and y.

    Two frames with one calibration have the values that decode and refocus give.
    """
    from plenofir.ground import project

    data = project.DATA / "microscope"
    run(tmp_path, "calibrate", str(data / "white.png"), "--out", "calib.json")
    Pillow.open(data / "raw.png").save(tmp_path / "raw_2.png")
    words = "--calib calib.json -M 15 --z -8:8:2 --camera lfm-vesicle-60x --out v.ome.tif"
    said = run(tmp_path, "batch", str(data / "raw.png"), "raw_2.png", *words.split())
    assert "2 frames of 9 slices of 420 x 420 pixels" in said
    with TiffFile(tmp_path / "v.ome.tif") as file:
        found = file.asarray()
        pixels = xml2dict(file.ome_metadata or "")["OME"]["Image"]["Pixels"]
    np.testing.assert_array_equal(found[0], found[1])
    words = "--calib calib.json -M 15 --out aligned.png"
    run(tmp_path, "decode", str(data / "raw.png"), *words.split())
    decoded = np.asarray(Pillow.open(tmp_path / "aligned.png")).astype(np.uint16)
    np.testing.assert_array_equal(found[0, 4], best_picture(decoded, 15, 0))

    radii = [pixels["PhysicalSizeX"] * ring(one, (214.9, 203.9)) for one in found[0]]
    heights = pixels["PhysicalSizeZ"] * (np.arange(9) - 4)
    # r^2 = R^2 - q^2 (z - z_0)^2, and q is 1 for a sphere: 1.12 found, 0.75 without g.
    square, _, offset = np.polyfit(heights, np.square(radii), 2)
    print(f"q = {np.sqrt(-square):.3f}, R = {np.sqrt(offset):.2f} um")
    assert np.sqrt(-square) == pytest.approx(1, abs=0.15)
