# SPDX-License-Identifier: Apache-2.0
"""Random calls of every command, drawn from its declared files, options, and environment."""

import io
import json
import os
import shutil
import signal
import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_origin
from unittest.mock import patch

import h5py
import numpy as np
from focused_scenes import RAYTRIX_XML
from hypothesis import strategies as st
from lytro_writer import F01, changed, pack, write_capture, write_whites
from PIL import Image as PillowImage
from scipy.io import savemat
from tifffile import imwrite

from plenofir.camera.calibration import calibrate
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.camera.lightfield.exports import encode_pfm
from plenofir.camera.rays.camera import CAMERAS
from plenofir.commands import console
from plenofir.commands.app import command_line, main
from plenofir.ground import project
from plenofir.ground.images import write_png

Words = tuple[str, ...]
M = 5


def every_command(command: Any, words: Words = ()) -> Iterator[tuple[Words, Any]]:
    """All commands with the words that call them."""
    yield words, command
    for name, sub in getattr(command, "commands", {}).items():
        yield from every_command(sub, (*words, name))


COMMANDS = dict(every_command(command_line()))

LONG = "x" * 300
# Bad values for names of files.
ODD_NAMES = (
    *("none.png", "folder", "empty.png", "text.png", "text.png/x.png", f"{LONG}.png", "", " "),
    *(
        "none/none/x.png",
        "/dev/null",
        "/dev/zero",
        "/proc/self/mem",
        "/proc/none/x.png",
        "ä\n\x1b[2J.png",
    ),
    *("\udcff.png", "deep.json", "deep.toml", ".", "*", "[", "~"),
)
IMAGES = ("grey.png", "rgb.png", "deep.png", "grey.tif", "rgb.jpg", "grey.pgm", "one.png")
IMAGES += ("row.png",)
# Usual values of each option.
NAMES: Mapping[str, tuple[str, ...]] = {
    "raster": (*IMAGES, "capture.png"),
    "raw": (*IMAGES, "white.png", "capture.png", "capture.lfp", "capture.raw"),
    "white": ("white.png", "capture.lfp", "whites"),
    "dark": ("dark.png",),
    "reversed_lens": ("white.png",),
    "files": ("white.png", *IMAGES, "capture.lfp", "views", "whites", "known.json", "field.mat"),
    "collimator": ("star.png",),
    "calib": ("known.json", "focused.json"),
    "lens_types": ("white.png", "capture.png", *IMAGES),
    "grid": ("maker.xml",),
    "virtual_depth": ("3", "2.5", "2:4:1", "1", "0", "-3", "1e9", "nan", "x", ""),
    "box": ("", "1", "3", "3,3", "3 1", "2", "5", "7", "-1", "x"),
    "capture": (*IMAGES, "white.png", "capture.lfp", "views", "field.mat"),
    "port": ("grey.png", "missing"),
    "frames": ("grey.png", "*.png"),
    "folder": ("views", "mosaic.png", "field.mat", "new.mat", "hci"),
    "scene": ("scene.toml", "rgb-480p", "lifcl40"),
    "camera": ("camera.toml", "f193-mla2", "odd_camera.toml", "lfm-levoy-25x"),
    "z": ("0", "-2:2", "-1:1:1/2"),
    "prescription": ("lens.csv", "f100"),
    "a": ("a.vcd", "b.vcd"),
    "b": ("a.vcd", "b.vcd"),
    "begin": ("", "1", "10ns"),
    "end": ("2", "30ns"),
    "clock": ("", "clk", "none", "top.clk"),
    "signals": ("*", "top.*", "x"),
    "sharpen": ("off", "auto", "1", "1/16", "0.125", "1/24", "-1/64", "1e99999999", "1/0", "nan"),
    "aperture": ("0.5", "0", "1", "0.3,-0.5,1", "2", "0.1,0", "nan", "x", ""),
    "tilt": ("0,0", "0.3,0", "-1 2", "1e9,0", "1", "nan,0", "x", ""),
    "exposure": ("off", "auto", "auto+1", "1.5", "-99", "1e999", "x", ""),
    "roi": ("0,0", "3,5", "-1,2", "9999,0", "²,0", "x", ""),
    "white_balance": ("auto", "off", "1.9,1.4", "0,1", "nan,1", "x", ""),
    "crop": ("0,0,20,20", "5,5,9,9", "-1,0,5,5", "0,0,0,0", "²,0,5,5", "x", ""),
    "region": ("0:3,1:9", ":,:", "5:2,0:1", "0:99999999999999999999,0:1"),
    "picture": ("picture.png",),
    "plot": ("plot.png", "plot.svg"),
    "export": ("page.html",),
    "csv_file": ("planes.csv",),
    "source": ("folder",),
    "ise": ("folder",),
    "device": ("LFE5U-45F", "LFE5U-85F", "XC6SLX45", "xc7a35t", "gw1nr-9", "x"),
    "tool": ("vivado", "quartus", "diamond", "ipxact", "x"),
    "scheduler": ("nowhere", "tcp://", "tcp://127.0.0.1:x"),
    "spots": ("folder",),
    "size": ("640x480", "64x40", "x", "99999x2"),
    "what": ("5.2", "table 5.9", "figure 5.9", "fig. 6.3", "5.99", "5.5 5.6", "٥.٥"),
}
ODD_WHOLE = ("-1", "0", "1", "2", "64", "10001", str(10**9), str(10**18), str(10**30), "x", "1.5")
ODD_WHOLE += ("9" * 400,)
ODD_REAL = (
    *("0", "-1", "1e-320", "1e-9", "1e9", "1e300", "nan", "inf", "-inf", "1e999", "x", ""),
    *("0.5", "1", "2.5", "100", "587.6", "5000"),
)
ODD_SETTINGS = (
    *("1e9", "1/0", "0:1", "0:1:1/5", "1:0", "0:1000", "1/5 1/5", "", ":", "0,2/5", "nan", "-"),
    *(str(10**9), str(10**30), "1/3", "100", "-2000", "0.2", "١"),
)


def make_stock(folder: Path) -> None:
    """Write one good file of each kind, and some of no kind."""
    rng = np.random.default_rng(18)
    grey = rng.integers(0, 256, (4 * M, 3 * M), np.uint8)
    rgb = rng.integers(0, 256, (3 * M, 4 * M, 3), np.uint8)
    write_png(folder / "grey.png", grey)
    write_png(folder / "rgb.png", rgb)
    write_png(folder / "deep.png", rng.integers(0, 65536, (23, 31), np.uint16))
    write_png(folder / "one.png", grey[:1, :1])
    write_png(folder / "row.png", grey[:M])
    write_png(folder / "dark.png", np.zeros((90, 90), np.uint8))
    imwrite(folder / "grey.tif", grey, compression="zlib")
    PillowImage.fromarray(rgb).save(folder / "rgb.jpg")
    (folder / "grey.pgm").write_bytes(b"P5 %d %d 255\n" % grey.shape[::-1] + grey.tobytes())
    y, x = np.mgrid[:90, :90]
    light = np.cos(np.pi * (y - 4.3) / 9) ** 2 * np.cos(np.pi * (x - 4.6) / 9) ** 2
    white = np.rint(20 + 220 * light).astype(np.uint8)
    write_png(folder / "white.png", white)
    calibration = calibrate(white)
    calibration.save(folder / "known.json")
    types = LensTypes(pattern=(0,), sharpest=(0.3,))
    calibration.model_copy(update={"lens_types": types}).save(folder / "focused.json")
    texture = np.clip(rng.normal(0.6, 0.3, (90, 90)), 0, 1)
    write_png(folder / "capture.png", np.rint(white * texture).astype(np.uint8))
    of_maker = {"x": 0.2, "y": -0.3, "diameter": 9, "rotation": 0.001, "distortion": 0}
    (folder / "maker.xml").write_text(RAYTRIX_XML.format(**of_maker))
    star = np.full((90, 90), 3, np.uint8)
    star[38:44, 40:44] = 200
    write_png(folder / "star.png", star)
    (folder / "views").mkdir()
    for v, u in np.ndindex(3, 3):
        write_png(folder / "views" / f"view_{v}_{u}.png", grey[v::3, u::3][:5, :5])
    write_png(folder / "mosaic.png", grey[:15])
    _make_light_fields(folder, grey)
    shutil.copy(project.root() / "scenes" / "rgb-480p.toml", folder / "scene.toml")
    shutil.copy(CAMERAS / "f193-mla2.toml", folder / "camera.toml")
    # Telecentric, afar and tiny, with micro images of 1601 pixels.
    odd = 'name = "odd"\n[main_lens]\nfocal_length_mm = 1e9\nexit_pupil_mm = inf\n'
    odd += "entrance_pupil_diameter_mm = 1e-9\n[micro_lenses]\nfocal_length_mm = 1e-6\n"
    odd += f"pitch_mm = 0.1\n[sensor]\npixel_pitch_mm = {0.1 / 1601}\ncolumns = {10**30}\n"
    (folder / "odd_camera.toml").write_text(odd)
    shutil.copy(project.DATA / "lenses" / "f100.csv", folder / "lens.csv")
    head = "$timescale 1ns $end\n$scope module top $end\n$var wire 1 ! clk $end\n"
    head += "$var wire 4 # x $end\n$upscope $end\n$enddefinitions $end\n"
    for name, value in (("a.vcd", "b0011"), ("b.vcd", "b0111")):
        steps = "".join(f"#{10 * n}\n{n % 2}!\n{value} #\n" for n in range(6))
        (folder / name).write_text(head + steps)
    (folder / "folder").mkdir()
    (folder / "empty.png").write_bytes(b"")
    (folder / "text.png").write_text("no picture")
    (folder / "deep.json").write_text("[" * 200_000)
    (folder / "deep.toml").write_text("a = " + "[" * 200_000)


def _make_light_fields(folder: Path, grey: Any) -> None:
    """A Lytro capture, white images, MATLAB files and a scene of the HCI benchmark."""
    capture = write_capture(
        changed(changed(F01, "image", "width", to=160), "image", "height", to=120)
    )
    (folder / "capture.lfp").write_bytes(capture.container())
    (folder / "capture.raw").write_bytes(pack(capture.raw, 12))
    (folder / "capture.txt").write_text(json.dumps(capture.metadata))
    write_whites(folder / "whites", capture, {"MOD_0000": (943, 600), "MOD_0001": (100, 672)})
    field = np.stack([np.stack([grey[v : v + 8, u : u + 9] for u in range(3)]) for v in range(3)])
    savemat(folder / "field.mat", {"LF": field})
    with h5py.File(folder / "new.mat", "w") as file:
        file["LF"] = field.T
    (folder / "hci").mkdir()
    for n in range(9):
        write_png(folder / "hci" / f"input_Cam{n:03}.png", field[n // 3, n % 3])
    (folder / "hci" / "parameters.cfg").write_text("[extrinsics]\nbaseline_mm = 50.0\n")
    (folder / "hci" / "gt_disp_lowres.pfm").write_bytes(encode_pfm(np.ones((8, 9))))


@dataclass(frozen=True)
class Call:
    """A call: words, damage done before (file, kind, position, content), and environment."""

    words: Words
    damage: tuple[tuple[str, str, float, str], ...]
    environment: Mapping[str, str]


def mostly(draw: Any, usual: st.SearchStrategy[str], odd: st.SearchStrategy[str]) -> str:
    return str(draw(usual if draw(st.integers(0, 5)) else odd))


WHOLE = st.sampled_from(ODD_WHOLE)
REAL = st.sampled_from(ODD_REAL) | st.floats().map(str)
# Without a slash: results stay in the folder.
TEXT = st.text(st.characters(exclude_characters="\0/", exclude_categories=("Cs",)), max_size=8)
TEXT = TEXT.filter(lambda text: text != "..")
NAME = st.sampled_from(ODD_NAMES) | TEXT
SETTING = st.sampled_from(ODD_SETTINGS) | TEXT
USUAL_SETTING = st.integers(-6, 9).map(lambda shift: f"{shift}/{M}")


def value(draw: Any, command: Words, parameter: Any) -> str:
    """Draw a value for an option or an argument."""
    kind = parameter.type_descriptor.annotation
    if get_origin(kind) is list:
        (kind,) = get_args(kind)
    name = parameter.name
    if name == "a" and command != ("waves", "compare"):
        return mostly(draw, USUAL_SETTING, SETTING)
    if kind is int:
        return mostly(draw, st.just(str(M)) if name == "micro_image" else WHOLE, WHOLE)
    if kind is float:
        return str(draw(REAL))
    if get_args(kind):
        return mostly(draw, st.sampled_from(get_args(kind)), TEXT)
    if name == "out":
        usual = st.just(f"results/{parameter.default or 'out'}")
        taken = st.sampled_from(("grey.png", "known.json", "folder", "views", "results/x.tif"))
        return mostly(draw, usual, NAME | taken)
    return mostly(draw, st.sampled_from(NAMES[name]), NAME)


@st.composite
def calls(draw: Any, command: Words) -> Call:
    """Draw a call of a command, most of whose parts are valid."""
    words = list(command)
    for parameter in COMMANDS[command].params:
        # A page would be served until Ctrl-C.
        if parameter.name in ("version", "debug", "page"):
            continue
        given = draw(st.integers(0, 19)) > 0 if parameter.required else not draw(st.integers(0, 2))
        # Without, it would serve until Ctrl-C.
        given |= command == ("view",) and parameter.name in ("raster", "export")
        if not given:
            continue
        if parameter.param_type_name == "argument":
            words.append(value(draw, command, parameter))
        elif parameter.is_flag:
            words.append(draw(st.sampled_from((*parameter.opts, *parameter.secondary_opts))))
        else:
            for _ in range(draw(st.integers(1, 2)) if parameter.multiple else 1):
                words.append(f"{parameter.opts[0]}={value(draw, command, parameter)}")
    if not draw(st.integers(0, 14)):
        words.append(draw(TEXT))
    kinds = st.sampled_from(("cut", "flip", "number"))
    stock = ("grey.png", "deep.png", "white.png", "grey.tif", "rgb.jpg", "grey.pgm", "known.json")
    stock += ("capture.lfp", "capture.txt", "field.mat", "new.mat", "hci/parameters.cfg")
    stock += ("focused.json", "capture.png", "maker.xml")
    stock += ("scene.toml", "camera.toml", "lens.csv", "a.vcd", "views/view_1_1.png")
    damage = st.tuples(
        st.sampled_from(stock), kinds, st.floats(0, 1, exclude_max=True), WHOLE | REAL | TEXT
    )
    surroundings = {
        "COLUMNS": st.sampled_from(("1", "0", "x", "40")),
        "TERM": st.sampled_from(("dumb", "xterm")),
        "FORCE_COLOR": st.just("1"),
        "TMPDIR": st.sampled_from(("/none", "/proc", LONG)),
        "M": TEXT,
    }
    environment = st.fixed_dictionaries({}, optional=surroundings)
    return Call(
        tuple(words),
        tuple(draw(st.lists(damage, max_size=2)) if not draw(st.integers(0, 1)) else ()),
        draw(environment) if not draw(st.integers(0, 2)) else {},
    )


def spoil(path: Path, kind: str, place: float, text: str) -> None:
    """Damage a file: truncate it, flip bits of a byte, or replace a number by other text."""
    content = path.read_bytes()
    at = int(place * len(content))
    if kind == "cut":
        path.write_bytes(content[:at])
    elif kind == "flip":
        path.write_bytes(content[:at] + bytes([content[at] ^ 0x41]) + content[at + 1 :])
    else:
        # At the end, if truncation left none.
        digits = [n for n, byte in enumerate(content) if chr(byte).isdigit()] or [len(content)]
        at = digits[int(place * len(digits))]
        path.write_bytes(content[:at] + os.fsencode(text) + content[at + 1 :])


class StuckError(BaseException):
    """A call that does not end."""


def _stuck(*_: object) -> None:
    raise StuckError


def run(words: Words, environment: Mapping[str, str]) -> tuple[int, str, str]:
    """Call the command in this process: exit code and both outputs."""
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", newline="") for _ in range(2))
    old = signal.signal(signal.SIGALRM, _stuck)
    signal.alarm(120)
    try:
        with (
            patch.object(sys, "argv", ["plenofir", *words]),
            patch.dict(os.environ, {**environment, "PATH": ""}),
            patch.object(tempfile, "tempdir", None),
            # Lines of steps are told after some seconds, which a loaded machine needs.
            patch.object(console, "QUIET_SECONDS", 1e6),
            warnings.catch_warnings(),
            redirect_stdout(out),
            redirect_stderr(err),
        ):
            # Warnings would be additional lines.
            warnings.simplefilter("error", RuntimeWarning)
            main()
    except SystemExit as done:
        code = done.code
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, old)
    texts = []
    for stream in (out, err):
        stream.flush()
        texts.append(stream.buffer.getvalue().decode())  # type: ignore[attr-defined]
    assert isinstance(code, int)
    return code, texts[0], texts[1]


def is_warning(err: str) -> bool:
    """Whether standard error has only the warning that the camera has other micro images."""
    return err.startswith("warning: the micro images of ") and err.count("\n") == 1


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@contextmanager
def inside(stock: Path, call: Call) -> Iterator[dict[str, bytes]]:
    """A fresh copy of the stock as the working folder, damaged; yields what it holds."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        shutil.copytree(stock, name, dirs_exist_ok=True)
        os.chdir(name)
        try:
            for file, *how in call.damage:
                if Path(file).stat().st_size:
                    spoil(Path(file), *how)
            yield contents(Path(name))
        finally:
            os.chdir(before)


def strict_json(text: str) -> Any:
    def refuse(word: str) -> None:
        raise AssertionError(word)

    return json.loads(text, parse_constant=refuse)
