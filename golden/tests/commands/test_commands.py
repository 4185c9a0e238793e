# SPDX-License-Identifier: Apache-2.0
"""The command line as a whole: help, one syntax, refusals named as the user typed them."""

import json
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from any_call import COMMANDS
from discs import disc_views

from plenofir.camera.lightfield.indexing import compose
from plenofir.commands import options
from plenofir.commands.app import main
from plenofir.commands.make_variables import arguments_of_make
from plenofir.commands.option_names import VARIABLES
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, encode_png, read_picture, write_png

Words = tuple[str, ...]

SCENE = str(project.root() / "scenes" / "rgb-480p.toml")


@pytest.fixture
def plenofir(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path):
    """Run the command in this process: exit code and both outputs."""
    monkeypatch.chdir(tmp_path)
    for name in (*VARIABLES, "MAKEFLAGS"):
        monkeypatch.delenv(name, raising=False)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["plenofir", *arguments])
        capfd.readouterr()
        with pytest.raises(SystemExit) as done:
            main()
        return (int(done.value.code or 0), *capfd.readouterr())

    return run


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_help(plenofir, words: tuple[str, ...]) -> None:
    code, text, errors = plenofir(*words, "--help")
    assert (code, errors) == (0, "")
    assert " ".join(("Usage: plenofir", *words)) in text
    for parameter in COMMANDS[words].params:
        assert parameter.help, parameter.name


@pytest.mark.parametrize(
    ("words", "numerics"),
    [
        (["--version"], []),
        (["--help"], []),
        (["inspect", "raster.png"], ["numpy", "scipy"]),
        (["design", "--camera", "f197-mla2"], ["numpy"]),
        (["develop", "raster.png", "-M", "3"], ["cv2", "numba", "numpy", "scipy"]),
    ],
)
def test_what_is_not_loaded(words: list[str], numerics: list[str], tmp_path: Path) -> None:
    """Commands start with what they need; pydantic is Typer's."""
    write_png(tmp_path / "raster.png", compose(disc_views(3, 24, 32)))
    code = (
        "import plenofir.commands.app as app, sys; "
        f"app.run({words}); print(*{{name.partition('.')[0] for name in sys.modules}})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    heavy = {"numpy", "scipy", "numba", "cv2", "matplotlib", "h5py", "distributed", "skimage"}
    heavy |= {"tornado", "pywellen", "mpmath"}
    assert sorted(heavy & set(done.stdout.splitlines()[-1].split())) == numerics


@pytest.mark.parametrize("words", [["report", "rays"], ["reproduce"]])
def test_the_studies_may_be_missing(words: list[str]) -> None:
    code = (
        "import importlib.metadata as m, sys; m.entry_points = lambda **_: (); "
        f"sys.argv = ['plenofir', *{words}]; from plenofir.__main__ import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "pip install ./studies" in done.stderr


def test_options_agree_with_what_they_choose() -> None:
    from plenofir.fpga.boards import BOARDS
    from plenofir.fpga.core.configuration import SLICE_ENGINES
    from plenofir.fpga.names import BoardName, HdmiBoardName, SliceEngineName
    from plenofir.fpga.screen.first_light import FLOWER_MICRO_IMAGE_SIZE
    from plenofir.refocus import interpolation_order
    from plenofir.refocus.sharpness import MAX_SHARPNESS_RADIUS

    assert get_args(SliceEngineName) == tuple(SLICE_ENGINES)
    assert get_args(BoardName) == tuple(BOARDS)
    assert set(get_args(HdmiBoardName)) == {b.name for b in BOARDS.values() if b.clock_ranges}
    orders = [interpolation_order(name) for name in get_args(options.InterpolationName)]
    assert orders == [0, 1, 0, 1, 2, 3]
    assert get_args(options.Radius)[1].max == MAX_SHARPNESS_RADIUS
    sim = {parameter.name: parameter for parameter in COMMANDS["sim",].params}
    assert sim["micro_image"].default == FLOWER_MICRO_IMAGE_SIZE
    taken = {p.name for words in (("sim",), ("bitstream", "build")) for p in COMMANDS[words].params}
    assert set(VARIABLES.values()) <= taken


def test_one_syntax_of_focus_settings() -> None:
    fifths = [Fraction(n, 5) for n in (-3, 0, 2, 5)]
    for texts in (["-3/5 0 2/5 1"], ["-3/5,0,2/5", "1"], ["-3/5", "0", " 2/5,\t1 "]):
        assert list(options.focus_settings(texts, 5)) == fifths
    assert list(options.focus_settings(["-1/5:2/5"], 5)) == [Fraction(n, 5) for n in range(-1, 3)]
    assert list(options.focus_settings(["0:1:2/5, 3"], 5)) == [0, Fraction(2, 5), Fraction(4, 5), 3]
    taking = [
        words for words, command in COMMANDS.items() for p in command.params if "-a" in p.opts
    ]
    assert set(taking) == {
        ("sim",),
        ("distance",),
        ("refocus",),
        ("stack",),
        ("batch",),
        ("bitstream", "build"),
        ("view",),
    }
    for words in taking:
        (parameter,) = (p for p in COMMANDS[words].params if "-a" in p.opts)
        assert parameter.opts == ["--a", "-a"]
        # The viewer has one slider, so one range.
        assert parameter.multiple == (words != ("view",)), words


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "give a focus setting"),
        ("1:0", "FIRST must not be above LAST"),
        ("0:1:0", "STEP must be positive"),
        ("0:1:1:1", "is not a range"),
        ("0:1000", "'0:1000' has 5001 settings, more than 1000"),
        ("0 0/5", "0 is given twice"),
        ("0.5", "0.5 lies between 2/5 and 3/5; use a multiple of 1/5"),
        ("0.26", "0.26 lies between 1/5 and 2/5"),
        ("1e0", "not a focus setting"),
        ("0:1:0.1", "0.1 lies between 0 and 1/5"),
    ],
)
def test_focus_settings_that_mean_nothing(text: str, message: str) -> None:
    with pytest.raises(InputError, match=f"^a: .*{message}"):
        options.focus_settings([text], 5)


@pytest.mark.parametrize(
    ("text", "m", "found", "note"),
    [
        # What the viewer shows.
        ("0.616 -0.6", 13, "8/13 -8/13", "0.616 as 8/13, -0.6 as -8/13"),
        ("-0.62 .08 1.", 13, "-8/13 1/13 1", "-0.62 as -8/13, .08 as 1/13"),
        ("-0.2 1.40", 5, "-1/5 7/5", None),
        ("0.3:0.33", 3, "1/3", "0.3 as 1/3, 0.33 as 1/3"),
    ],
)
def test_decimals_are_taken_where_a_multiple_is_near(capsys, text, m, found, note) -> None:
    got = options.focus_settings([text], m)
    assert list(got) == [Fraction(word) for word in found.split()]
    said = capsys.readouterr().err
    assert said == ("" if note is None else f"note: a = {note}, in steps of 1/{m}\n")
    assert list(options.focus_settings(["0.616"], m, rounded=False)) == [Fraction(77, 125)]


def test_the_same_settings_by_every_command(plenofir, tmp_path: Path) -> None:
    raw = np.random.default_rng(1).integers(0, 256, (20, 25), np.uint8)
    write_png(tmp_path / "raw.png", raw)
    for settings in (("-a", "-1/5:1/5:1/5 1"), ("-a", "-1/5,0", "-a", "1/5 1")):
        code, text, errors = plenofir("distance", "--camera", "f193-mla2", *settings, "--json")
        assert code == 0, errors
        planes = [plane["a"] for plane in json.loads(text)["planes"]]
        assert planes == ["-1/5", "0/1", "1/5", "1/1"]
        code, _, errors = plenofir("stack", "raw.png", "-M", "5", *settings, "--out", "slices")
        assert code == 0, errors
        assert len(list((tmp_path / "slices").iterdir())) == 4
        code, _, errors = plenofir("refocus", "raw.png", "-M", "5", *settings)
        assert (code, errors) == (2, "plenofir: --a: takes one focus setting, not 4\n")


@pytest.mark.parametrize("how", [("--exposure", "off"), ("--gamma", "1", "--exposure", "0")])
def test_sharpening_ends_at_the_white_of_the_file(
    plenofir, tmp_path: Path, how: tuple[str, ...]
) -> None:
    """12 bits in words of 16: edges overshoot white, but not in the file."""
    lenses = np.kron(np.indices((8, 9)).sum(axis=0) // 2 % 2, np.full((5, 5), 4095))
    (tmp_path / "raw.png").write_bytes(encode_png(Picture(lenses.astype(np.uint16), 4095)))
    words = ("refocus", "raw.png", "-M", "5", "-a", "0", *how)
    code, _, errors = plenofir(*words)
    assert code == 0, errors
    found = read_picture(tmp_path / "refocused.png")
    assert found.pixels.max() == found.full_scale


# What cannot be combined: make's variables, and which is named with which.
COMBINATIONS = [
    ({"A": "0", "SWEEP": "0 1"}, "SWEEP", "A"),
    ({"A": "0", "STACK": "0 1"}, "STACK", "A"),
    ({"SWEEP": "0 1", "STACK": "0 1"}, "STACK", "SWEEP"),
    ({"STACK": "0 1", "ENGINE": "fir"}, "ENGINE", "STACK"),
    ({"STACK": "0 1", "IOTA": "2"}, "IOTA", "STACK"),
    ({"STACK": "0 1", "ANY_ROWS": "1"}, "ANY_ROWS", "STACK"),
    ({"STACK": "0 1", "INTERPOLATION": "linear"}, "INTERPOLATION", "STACK"),
    ({"STACK": "0 1", "ARITH": "stored"}, "ARITH", "STACK"),
    ({"STACK": "0 1", "FRACTION": "3"}, "FRACTION", "ARITH=exact"),
    ({"STACK": "0 1", "CHAIN": "hdmi"}, "CHAIN", "STACK"),
    ({"STACK": "0 1", "SCENE": SCENE}, "SCENE", "STACK"),
    ({"RADIUS": "2"}, "RADIUS", "ENGINE=fir"),
    ({"RADIUS": "2", "ENGINE": "moving_sum"}, "RADIUS", "ENGINE=moving_sum"),
    ({"ENGINE": "fir", "ANY_ROWS": "1"}, "ANY_ROWS", "ENGINE=fir"),
    ({"ANY_ROWS": "1"}, "ANY_ROWS", "ENGINE=fir"),
    ({"ENGINE": "fir", "PIXELS": "4"}, "PIXELS", "ENGINE=fir"),
    ({"PIXELS": "4", "ARITH": "stored"}, "PIXELS", "ARITH=stored"),
    ({"PIXELS": "4", "IOTA": "2"}, "IOTA", "ENGINE=moving_sum"),
    ({"PIXELS": "4", "CHAIN": "hdmi"}, "PIXELS", "CHAIN=hdmi"),
    ({"ENGINE": "moving_sum", "IOTA": "2"}, "IOTA", "ENGINE=moving_sum"),
    ({"FRACTION": "3"}, "FRACTION", "ARITH=exact"),
    ({"GUARD": "1"}, "GUARD", "ARITH=exact"),
    ({"WAVES": "1", "SIM": "verilator"}, "WAVES", "SIM=verilator"),
    ({"CHAIN": "hdmi", "SIM": "verilator"}, "CHAIN", "SIM=verilator"),
    ({"CHAIN": "hdmi", "IOTA": "2"}, "IOTA", "CHAIN=hdmi"),
    ({"CHAIN": "hdmi", "ENGINE": "moving_sum", "ANY_ROWS": "1"}, "ANY_ROWS", "CHAIN=hdmi"),
    *(
        ({"SCENE": SCENE, name: value}, name, "SCENE")
        for name, value in {
            "M": "5",
            "ENGINE": "fir",
            "ANY_ROWS": "1",
            "PIXELS": "2",
            "IOTA": "1",
            "INTERPOLATION": "nearest",
            "ARITH": "exact",
            "FRACTION": "3",
            "GUARD": "1",
            "RADIUS": "2",
        }.items()
    ),
    ({"SCENE": SCENE, "A": "0"}, "SCENE", "A"),
]


def refusal_of(errors: str, name: str) -> str:
    (line,) = errors.splitlines()
    assert line.startswith(f"plenofir: {name} cannot be combined with "), line
    return line


@pytest.mark.parametrize(("variables", "where", "other"), COMBINATIONS, ids=str)
def test_bad_combinations_of_make(
    plenofir, monkeypatch, tmp_path: Path, variables: dict[str, str], where: str, other: str
) -> None:
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    code, _, errors = plenofir("--make", "sim")
    assert code == 2
    assert f"cannot be combined with {other};" in refusal_of(errors, where)
    assert "--" not in errors
    assert not any(tmp_path.iterdir())


def by_hand(variables: dict[str, str]) -> list[str]:
    """Options that a user types instead of make's variables."""
    flags = {name: "--" + of.replace("_", "-") for name, of in VARIABLES.items()}
    arguments = ["--engine=stack"] if "STACK" in variables else []
    for name, value in variables.items():
        switch = name == "ANY_ROWS"
        arguments.append(flags[name] if switch else f"{flags[name]}={value}")
    return arguments


@pytest.mark.parametrize(
    ("variables", "where", "other"),
    # By hand there is one option for focus settings, and the stack is an engine.
    [
        case
        for case in COMBINATIONS
        if not {case[1], case[2]} & {"A", "SWEEP"} and case[1] != "ENGINE"
    ],
    ids=str,
)
def test_bad_combinations_by_hand(
    plenofir, tmp_path: Path, variables: dict[str, str], where: str, other: str
) -> None:
    code, _, errors = plenofir("sim", *by_hand(variables))
    assert code == 2
    if {where, other} == {"SCENE", "STACK"}:
        where, other = "A", "SCENE"
    other = "ENGINE=stack" if other == "STACK" else other
    name, _, value = other.partition("=")
    named = "--" + VARIABLES[name].replace("_", "-") + (f" {value}" if value else "")
    flag = "--" + VARIABLES[where].replace("_", "-")
    assert f"cannot be combined with {named};" in refusal_of(errors, flag)
    assert "=" not in errors.replace(SCENE, "")
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"M": "five"}, "M: 'five' must be a valid integer"),
        ({"M": "0"}, "M: '0' must be greater than or equal to 1"),
        ({"IOTA": "0"}, "IOTA: '0' must be "),
        ({"IOTA": "65"}, "IOTA: 65 rows at once exceed the core's limit of 64"),
        ({"ENGINE": "belt"}, "ENGINE: 'belt' must be one of 'fir', 'moving_sum'"),
        ({"SIM": "isim"}, "SIM: 'isim' must be one of 'ghdl', 'nvc', 'verilator'"),
        ({"CHAIN": "sdi"}, "CHAIN: 'sdi' must be one of 'core', 'hdmi'"),
        ({"WAVES": "yes"}, "WAVES: 'yes' must be one of '0', '1', 'all'"),
        ({"ANY_ROWS": "2"}, "ANY_ROWS: '2' must be 0 or 1"),
        ({"A": "1/2"}, "A: 1/2 is not on the grid of M = 5; use "),
        ({"SWEEP": "0 1/2"}, "SWEEP: 1/2 is not on the grid of M = 5; use "),
        ({"STACK": "0 0"}, "STACK: 0 is given twice"),
        ({"STACK": "0", "RADIUS": "9"}, "RADIUS: '9' must be less than or equal to 8"),
        ({"A": "100"}, "A: a filter of 2001 taps"),
        ({"ARITH": "float"}, "ARITH: 'float' must be one of 'exact', 'stored'"),
        ({"ARITH": "stored", "FRACTION": "13"}, "FRACTION: '13' must be "),
        ({"ARITH": "stored", "FRACTION": "1", "GUARD": "2"}, "GUARD: guard_bits must not exceed"),
        ({"RAW": "none.png"}, "none.png: no such file; use "),
        ({"OUT": "/proc/none"}, "OUT: "),
    ],
    ids=str,
)
def test_bad_values_of_make(plenofir, monkeypatch, variables, message) -> None:
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    code, _, errors = plenofir("--make", "sim")
    assert code == 2
    assert errors.startswith(f"plenofir: {message}")
    assert errors.count("\n") == 1


def test_make_forwards_what_is_set_and_nothing_else() -> None:
    sim = {p.name: p for p in COMMANDS["sim",].params}
    assert arguments_of_make("sim", sim, {"M": "", "SIM": " "}) == ([], {})
    arguments, names = arguments_of_make(
        "sim", sim, {"M": "3", "SWEEP": "0 1", "WAVES": "0", "ANY_ROWS": "1", "ISE": "/opt"}
    )
    assert arguments == ["--micro-image=3", "--a=0 1", "--any-rows", "--waves=0"]
    assert names["a"] == "SWEEP"
    assert arguments_of_make("sim", sim, {"STACK": "0 1"})[0] == ["--engine=stack", "--a=0 1"]
    synth = {p.name: p for p in COMMANDS["synth",].params}
    assert arguments_of_make("synth", synth, {"SCENE": "x.toml", "M": "3"})[0] == ["x.toml"]
    # Variables on make's command line are for the command; those in the environment may be for
    # others.
    for name in ("ISE", "SWEPT"):
        flags = {"MAKEFLAGS": rf" -- A=1\ {name}=2 {name}=/opt", name: "/opt"}
        with pytest.raises(InputError, match=f"make sim has no variable {name}; it takes RAW"):
            arguments_of_make("sim", sim, flags)


def test_bitstream_by_make(plenofir, monkeypatch, tmp_path: Path) -> None:
    for variables, message in (
        ({"M": "3"}, "M requires A"),
        ({"SCENE": SCENE, "ENGINE": "fir"}, "ENGINE cannot be combined with SCENE"),
        ({"STACK": "0 1"}, "make bitstream has no variable STACK"),
        ({"ENGINE": "stack"}, "ENGINE: 'stack' must be one of 'fir', 'moving_sum'"),
        ({"MAX_COLUMNS": "0"}, "MAX_COLUMNS: '0'"),
        ({"ENGINE": "moving_sum", "ISE": str(tmp_path)}, f"ISE={tmp_path}: holds no settings64"),
    ):
        with monkeypatch.context() as patch:
            for name, value in variables.items():
                patch.setenv(name, value)
            patch.setenv("MAKEFLAGS", " -- " + " ".join(f"{name}=x" for name in variables))
            code, _, errors = plenofir("--make", "bitstream", "build")
        assert code == 2
        assert errors.startswith(f"plenofir: {message}"), errors


def test_makefile(tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    done = subprocess.run(
        ["make", "-s", "-o", "venv", "-o", "simulator", "sim", "A=1", "SWEEP=0 1"],
        cwd=project.root(),
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("plenofir: SWEEP cannot be combined with A; use one of")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("simulate",), "No such command 'simulate'"),
        (("sim", "--iota", "3"), "No such option: --iota"),
        (("sim", "-M"), "Option '-M' requires an argument"),
        (("sim", "image.png"), "Got unexpected extra argument(s) (image.png)"),
        (("distance",), "--camera is missing"),
        (("waves", "compare", "a.vcd"), "b is missing"),
        (("distance", "--camera", "f193-mla2", "-a", "0", "--focus", "nan"), "--focus: nan"),
        (("stack", "raw.png", "-M", "5", "--radius", "2"), "--radius requires --depth-index"),
        (("synth", "--out", "x"), "--out requires --scene"),
        (("calibrate", "white.png", "--order", "4"), "--order: '4'"),
    ],
)
def test_usage_errors_are_one_line(plenofir, arguments: tuple[str, ...], message: str) -> None:
    code, _, errors = plenofir(*arguments)
    assert code == 2
    assert errors.startswith(f"plenofir: {message}")
    assert errors.count("\n") == 1
