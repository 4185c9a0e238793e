# SPDX-License-Identifier: Apache-2.0
"""Files of Lytro's cameras: container, pixels, grid, white images, and what is refused.

The files are written here (`lytro_writer`), with the metadata of real cameras and rendered pixels.
"""

import json
import sys
import tarfile
from contextlib import suppress
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
import pytest
from imageio.plugins import lytro as imageio_lytro
from in_process import plenofir
from lytro_writer import (
    F01,
    HEADER,
    ILLUM,
    PRIVATE,
    Written,
    changed,
    lfp_bytes,
    mosaic_of,
    name_of,
    pack,
    section,
    write_capture,
    write_whites,
)

from plenofir.camera.calibration import decode
from plenofir.camera.lightfield import views
from plenofir.camera.lytro import develop, frame_metadata, read_container, read_frame, read_lytro
from plenofir.camera.lytro.frames import nearest_white
from plenofir.camera.lytro.sensor import with_gamma
from plenofir.camera.patterns.match import match_capture
from plenofir.camera.recognise import recognise
from plenofir.camera.recognise.arrays import read_array
from plenofir.ground.errors import InputError
from plenofir.ground.images import read_image

# Both cameras only where all tests are run.
BOTH_IN_FULL = pytest.mark.parametrize(
    "written",
    [F01, pytest.param(ILLUM, marks=pytest.mark.slow)],
    ids=["F01", "ILLUM"],
    indirect=True,
)
SUFFIX = {"F01": ".lfp", "ILLUM": ".lfr"}


@pytest.fixture(scope="module", params=[F01, ILLUM], ids=["F01", "ILLUM"])
def written(request: pytest.FixtureRequest) -> Written:
    return write_capture(request.param, noise=0.003)


@pytest.fixture
def file(written: Written, tmp_path: Path) -> Path:
    path = tmp_path / f"capture{SUFFIX[written.known.model]}"
    path.write_bytes(written.container())
    return path


def test_container_and_pixels(written: Written, file: Path) -> None:
    frame = read_frame(file)
    assert (frame.mosaic() == written.raw).all()
    assert frame.metadata.serial == "A303134643"
    assert frame.metadata.model == written.known.model
    assert read_container(file).contents == "raw"


def test_imageio_reads_the_same(
    written: Written, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shape = written.raw.shape
    monkeypatch.setattr(imageio_lytro, "LYTRO_ILLUM_IMAGE_SIZE", shape)
    monkeypatch.setattr(imageio_lytro, "LYTRO_F01_IMAGE_SIZE", shape)
    kind = "lytro-lfp" if file.suffix == ".lfp" else "lytro-lfr"
    options = {} if file.suffix == ".lfp" else {"include_thumbnail": False}
    theirs = imageio.imread(file, format=kind, **options)
    full = (1 << written.known.packing.bitsPerPixel) - 1
    assert (np.rint(np.asarray(theirs) * full) == read_frame(file).mosaic()).all()
    assert theirs.meta["metadata"] == written.metadata
    assert theirs.meta["privateMetadata"] == PRIVATE


def test_raw_files_with_metadata_beside(written: Written, tmp_path: Path) -> None:
    packed = pack(written.raw, written.known.packing.bitsPerPixel)
    (tmp_path / "a.raw").write_bytes(packed)
    with pytest.raises(InputError, match=r"put one of a.txt, a.TXT, a.json, a.JSON"):
        read_frame(tmp_path / "a.raw")
    (tmp_path / "a.json").write_text(json.dumps(written.metadata))
    assert (read_frame(tmp_path / "a.raw").mosaic() == written.raw).all()


def test_colours(written: Written, file: Path) -> None:
    """Even colours come back, with white balance and with the matrix; clipped white stays white."""
    frame = read_frame(file)
    colour = np.broadcast_to(np.array([0.31, 0.22, 0.4]), written.colour.shape)
    mosaic = mosaic_of(colour, written.known)
    inner = np.s_[8:-8, 8:-8]
    for demosaic in ("bilinear", "edge-aware"):
        found = develop(mosaic, frame.metadata, demosaic=demosaic)[inner] / 65535
        assert np.abs(found - colour[inner]).max() < 2 / (1 << frame.metadata.packing.bitsPerPixel)
    matrix = np.array(frame.metadata.matrix).reshape(3, 3)
    found = develop(mosaic, frame.metadata, colour="srgb")[inner] / 65535
    assert np.abs(found - np.clip(colour[inner] @ matrix.T, 0, 1)).max() < 0.01
    clipped = np.full_like(mosaic, (1 << frame.metadata.packing.bitsPerPixel) - 1)
    assert (develop(clipped, frame.metadata) == 65535).all()
    levels = np.array([[0, 16384, 65535]], np.uint16)
    assert with_gamma(levels, 2, 65535).tolist() == [[0, 32768, 65535]]


def test_grid_of_the_metadata_and_of_the_pixels(written: Written, file: Path) -> None:
    """The metadata's grid is the true one; a wrong one is corrected by the pixels."""
    t, s = np.mgrid[-10:10, -10:10]
    true = written.grid.centres(t, s)
    found = read_lytro(file)
    # calibration_of_grid counts lenses from the top left.
    _, _, off = found.calibration.grid.nearest(true.reshape(-1, 2))
    assert np.hypot(*off.T).max() < 0.2
    coefficients = np.array(written.grid.coefficients)
    coefficients[0] += (1.7, -2.3)
    coefficients[1:] *= 1.0008
    wrong = written.grid.model_copy(update={"coefficients": tuple(map(tuple, coefficients))})
    grey = written.colour[..., 1].astype(np.float32)
    match = match_capture(grey, wrong)
    assert match.fits
    _, _, off = match.grid.nearest(true.reshape(-1, 2))
    assert np.hypot(*off.T).max() < 0.3
    assert match.moved_px > 2.5


def test_decoded_without_a_white_image(written: Written, file: Path) -> None:
    """Views are those of a decoding with the true grid."""
    found = read_lytro(file)
    m = 7
    ours = views(decode(found.image, found.calibration, m), m)
    truth = (written.colour * 65535).astype(np.uint16)
    calibration = found.calibration.model_copy(update={"grid": _same_first(found, written)})
    best = views(decode(truth, calibration, m), m)
    centre = np.s_[2:5, 2:5, 2:-2, 2:-2, 1]
    difference = np.abs(ours[centre].astype(int) - best[centre].astype(int)) / 65535
    assert np.median(difference) < 0.03
    for heading, word in (("camera", written.known.model), ("grid", "of the metadata, moved by")):
        assert any(name == heading and word in text for name, text in found.lines)


def _same_first(found, written: Written):
    """True grid, counted from the lens that the found one counts from."""
    first = found.calibration.grid.centres(0, 0)
    t, s, _ = written.grid.nearest(first[np.newaxis])
    return written.grid.moved(int(t[0]), int(s[0]))


@BOTH_IN_FULL
def test_nearest_white_image(written: Written, file: Path, tmp_path: Path) -> None:
    known = written.known.lens
    zoom, focus = int(known.zoomStep), int(known.focusStep)
    steps = {
        "MOD_0000": (zoom + 300, focus),
        "MOD_0001": (zoom - 9, focus + 20),
        "MOD_0002": (zoom - 9, focus - 400),
    }
    write_whites(tmp_path / "whites", written, steps)
    (tmp_path / "whites" / "notes.txt").write_text("no metadata")
    found = read_lytro(file, white=tmp_path / "whites")
    text = dict(found.lines)["white image"]
    assert "MOD_0001.RAW" in text
    assert "9 and 20 from the capture's), the nearest of 3" in text
    t, s = np.mgrid[3:20, 3:20]
    _, _, off = written.grid.nearest(found.calibration.grid.centres(t, s).reshape(-1, 2))
    assert np.hypot(*off.T).max() < 0.1
    assert found.white is not None
    raster = decode(found.image, found.calibration, 7, white=found.white)
    assert raster.shape[2] == 3
    with tarfile.open(tmp_path / "caldata.tar", "w") as archive:
        archive.add(tmp_path / "whites", "caldata")
    chosen = nearest_white(tmp_path / "caldata.tar", written.known)
    assert chosen.frame.where.endswith("caldata.tar/caldata/MOD_0001.RAW")
    assert (chosen.frame.mosaic() == written.white).all()
    single = nearest_white(tmp_path / "whites" / "MOD_0002.RAW", written.known)
    assert single.count == 1


def test_white_images_that_a_camera_stored(written: Written, tmp_path: Path) -> None:
    write_whites(tmp_path / "whites", written, {"MOD_0000": (1, 2)})
    parts = {
        name: (tmp_path / "whites" / name).read_bytes() for name in ("MOD_0000.RAW", "MOD_0000.TXT")
    }
    table = {
        "files": [
            {"name": f"C:\\T1CALIB\\{name}", "dataRef": name_of(data)}
            for name, data in parts.items()
        ]
    }
    data = HEADER + section(b"M", json.dumps(table).encode())
    data += b"".join(section(b"C", part) for part in parts.values())
    (tmp_path / "data.C.0").write_bytes(data)
    chosen = nearest_white(tmp_path / "data.C.0", written.known)
    assert chosen.frame.where.endswith("C:/T1CALIB/MOD_0000.RAW")
    assert (chosen.frame.mosaic() == written.white).all()
    assert recognise(tmp_path / "data.C.0").kind == "Lytro file without a raw frame"


def test_no_white_image_fits(written: Written, tmp_path: Path) -> None:
    other = changed(written.metadata, "image", "width", to=written.known.width - 4)
    (tmp_path / "whites").mkdir()
    (tmp_path / "whites" / "w.RAW").write_bytes(b"")
    (tmp_path / "whites" / "w.TXT").write_text(json.dumps(other))
    with pytest.raises(InputError) as error:
        nearest_white(tmp_path / "whites", written.known)
    assert "no white image among 2 files (1 of another size)" in str(error.value)
    assert f"zoom step {written.known.lens.zoomStep:g}" in str(error.value)
    mine = json.dumps({"camera": {"serialNumber": "B999"}, **written.metadata})
    known = frame_metadata(written.metadata, "", PRIVATE)
    (tmp_path / "whites" / "w.TXT").write_text(
        json.dumps({**json.loads(mine), "camera": {"model": "F01", "serialNumber": "B999"}})
    )
    with pytest.raises(InputError, match="those of B999 are another camera's"):
        nearest_white(tmp_path / "whites", known)


@BOTH_IN_FULL
def test_pixels_that_contradict_the_metadata(written: Written, tmp_path: Path) -> None:
    pitch = written.metadata["devices"]["mla"]["lensPitch"]
    wrong = changed(written.metadata, "devices", "mla", "lensPitch", to=pitch * 1.2)
    path = tmp_path / "wrong.lfp"
    path.write_bytes(lfp_bytes(wrong, pack(written.raw, written.known.packing.bitsPerPixel)))
    with pytest.raises(InputError) as error:
        read_lytro(path)
    assert f"the pixels have micro images {written.known.pitch_px:.0f}"[:-2] in str(error.value)
    assert "the metadata say" in str(error.value)


@BOTH_IN_FULL
def test_pixels_without_micro_images(written: Written, tmp_path: Path) -> None:
    """An even picture has no micro images: the metadata's grid stays, with a note."""
    path = tmp_path / "even.lfp"
    even = np.full_like(written.raw, 500)
    path.write_bytes(written.container(even))
    found = read_lytro(path)
    assert dict(found.lines)["grid"].startswith("of the metadata, unchecked")


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("image", "width"), 40_000, "width = 40000"),
        (("image", "width"), 30_000, "259200 bytes of pixels"),
        (("image", "width"), "x", "width"),
        (("image", "rawDetails", "pixelPacking", "bitsPerPixel"), 14, "bitsPerPixel = 14"),
        (("image", "rawDetails", "pixelPacking", "endianness"), "little", "12 bit big endian"),
        (("image", "rawDetails", "mosaic", "tile"), "x,y", "mosaic.tile"),
        (("image", "rawDetails", "pixelFormat", "black", "r"), 5000, "black 5000"),
        (("devices", "mla", "tiling"), "round", "tiling 'round'"),
        (("devices", "mla", "lensPitch"), 1e-7, "micro lenses 0.0714 pixels apart"),
        (("devices", "mla", "lensPitch"), None, "mla.lensPitch = None"),
        (("devices", "mla", "rotation"), 3.0, "rotation = 3.0"),
        (("devices", "mla", "sensorOffset"), {"x": 1.0, "y": 0}, "outside of the picture"),
        (("devices", "mla"), None, "metadata: mla is missing"),
        (("devices", "sensor", "pixelPitch"), float("nan"), "pixel_pitch = nan"),
        (("camera",), {}, "model is missing"),
    ],
)
def test_metadata_that_are_refused(
    tmp_path: Path, path: tuple[str, ...], value: object, message: str
) -> None:
    metadata = changed(F01, *path, to=value)
    file = tmp_path / "bad.lfp"
    file.write_bytes(lfp_bytes(metadata, bytes(259_200)))
    with pytest.raises(InputError) as error:
        read_frame(file)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    assert str(file) in str(error.value)


@BOTH_IN_FULL
def test_damaged_containers(written: Written, tmp_path: Path) -> None:
    """Cut off anywhere or with a changed byte: refused, or the same frame as before."""
    whole = written.container()
    path = tmp_path / "damaged.lfp"
    rng = np.random.default_rng(19)
    for at in (*range(0, 200, 13), *rng.integers(200, len(whole), 12)):
        path.write_bytes(whole[:at])
        with pytest.raises(InputError) as error:
            read_frame(path)
        assert "\n" not in str(error.value)
    for at in (*range(0, 140, 7), *rng.integers(140, len(whole), 12)):
        changed_byte = bytes([whole[at] ^ 0x41])
        path.write_bytes(whole[:at] + changed_byte + whole[at + 1 :])
        with suppress(InputError):
            assert (read_frame(path).mosaic() == written.raw).all()
    for content, message in (
        (b"", "not a Lytro file"),
        (HEADER, "no table of contents"),
        (HEADER + section(b"M", b"[]"), "JSON object"),
        (HEADER + section(b"M", b"{" * 5000), "JSON object"),
        (HEADER + section(b"M", b"{}"), "no raw frame"),
        (HEADER + section(b"M", b'{"files": []}'), "files stored by a camera"),
        (HEADER + section(b"M", b"{}") + section(b"C", b"\xff\xd8\xff"), "refocused pictures"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=message):
            read_frame(path)


def test_recognised(written: Written, file: Path) -> None:
    found = recognise(file)
    assert found.kind == "Lytro capture"
    assert found.pitch_px == pytest.approx(written.grid.lens_pitch, rel=1e-3)
    assert recognise(file.parent).kind == "folder of Lytro files"
    alone = file.parent / "alone.json"
    alone.write_text(json.dumps(written.metadata))
    evidence = dict(recognise(alone).lines)
    assert evidence["evidence"] == "metadata alone: pixels are in alone.raw"
    assert f"pitch {written.known.pitch_px:.4f} pixels" in evidence["micro lenses"]


@pytest.mark.parametrize(
    ("kind", "text"),
    [("refocusStack", "refocused pictures"), ("depthMap", "a depth map"), ("", "no")],
)
def test_what_lytro_desktop_made(tmp_path: Path, kind: str, text: str) -> None:
    # As real files have it: the pictures of a stack may be one H.264 stream.
    made = [{"type": f"com.lytro.acceleration.{kind}"}]
    table = {"picture": {"frameArray": [{"frame": {}}], "accelerationArray": made}}
    path = tmp_path / "made.lfp"
    path.write_bytes(
        HEADER + section(b"M", json.dumps(table).encode()) + section(b"C", b"\0\0\0\1\t")
    )
    found = recognise(path)
    assert found.kind == "Lytro file without a raw frame"
    assert f"1 sections; {text}" in dict(found.lines)["evidence"]


@BOTH_IN_FULL
def test_decode_command(written: Written, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(file.parent)
    done = plenofir("decode", file.name)
    m = {"F01": 9, "ILLUM": 13}[written.known.model]
    assert f"micro images of {m} x {m} pixels" in done.stdout
    assert "in linear light" in done.stdout
    linear = read_image(Path("aligned.png"))
    plenofir("decode", file.name, "--gamma", "2", "--out", "bright.png")
    assert (read_image(Path("bright.png")) == with_gamma(linear, 2, 65535)).all()
    out = "--out", "new.png"
    for words, message in (
        (("none.lfp",), "none.lfp: no such file"),
        (
            (file.name, "--dark", "aligned.png"),
            "--dark is not needed: a Lytro's file tells its black level",
        ),
        (("aligned.png", "--colour", "srgb"), "--colour is for files of Lytro"),
        (("aligned.png",), "--calib is missing"),
        ((file.name, "--white", "none"), "none: no such file"),
        ((file.name, "--gamma", "0"), "--gamma: "),
    ):
        done = plenofir("decode", *words, *out)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert message in done.stderr
    assert not Path("new.png").exists()


def test_missing_packages(
    written: Written, file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(
        InputError, match=r"OpenCV is not installed; pip install opencv-python-headless"
    ):
        read_lytro(file)
    monkeypatch.setitem(sys.modules, "h5py", None)
    (tmp_path / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(600, b"\0"))
    with pytest.raises(InputError, match=r"h5py is not installed.*pip install h5py"):
        read_array(tmp_path / "new.mat")
