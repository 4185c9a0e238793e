# SPDX-License-Identifier: Apache-2.0
"""Static checks of the VHDL: the standard, synthesis, dependencies of folders."""

import re
import shutil
import subprocess
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.hdl_text import declarations, used_units
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground import project
from plenofir.refocus import StoredProductArithmetic
from plenofir_tb.tools import or_skip


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Library with all synthesisable sources, analysed as strict VHDL-93."""
    with or_skip():
        find_simulator("ghdl")
    folder = tmp_path_factory.mktemp("library")
    done = analyse_as_the_page_says(folder)
    assert done.returncode == 0, done.stderr
    return folder / "hdl"


def analyse_as_the_page_says(folder: Path) -> subprocess.CompletedProcess[str]:
    """Copy the sources into a folder and follow docs/core.md to the letter."""
    shutil.copytree(project.root() / "hdl", folder / "hdl")
    page = (project.root() / "docs" / "core.md").read_text()
    blocks = re.findall(r"```sh\n(.*?)```", page, re.S)
    (commands,) = (block for block in blocks if "sources.txt" in block)
    return subprocess.run(
        ["sh", "-e", "-c", commands], cwd=folder, capture_output=True, text=True, check=False
    )


def unexplained_ports(text: str) -> list[str]:
    """Names of the ports that no comment explains; ``clk`` and ``reset`` explain themselves."""
    return [
        port.name
        for port in declarations(text, "port")
        if not port.comment and port.name not in ("clk", "reset")
    ]


def test_the_list_is_all_but_the_boards(library: Path) -> None:
    units = (library / "work-obj93.cf").read_text()
    for path in hdl.hdl_sources():
        assert f" {path.stem} at " in units, path
    own = set(hdl.all_sources()) - set(hdl.hdl_sources())
    assert own
    # Only these need their vendors' libraries.
    for path in hdl.all_sources():
        assert bool(re.search(r"library (unisim|ecp5u|gw2a|lifcl);", path.read_text())) <= (
            path in own
        )


@pytest.mark.parametrize(
    "core",
    [
        CoreConfiguration(micro_image_size=1, shifts=(0,), max_columns=640),
        CoreConfiguration(micro_image_size=2, shifts=(-2,), max_columns=100, pixel_bits=16),
        CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=1280, channels=3),
        CoreConfiguration(
            micro_image_size=5,
            shifts=(-3,),
            max_columns=640,
            channels=3,
            arithmetic=StoredProductArithmetic(),
        ),
        CoreConfiguration(micro_image_size=11, shifts=(1,), max_columns=1280, align="causal"),
        CoreConfiguration(
            micro_image_size=3,
            shifts=(-2, 0, 3),
            max_columns=640,
            order=1,
            engine=FirEngine(parallel_rows=3),
        ),
        CoreConfiguration(
            micro_image_size=5,
            shifts=(-5, 0, 5),
            max_columns=100,
            engine=FirEngine(hold=True, broadcast_taps=8, parallel_rows=2),
            arithmetic=StoredProductArithmetic(),
        ),
        CoreConfiguration(
            micro_image_size=4, shifts=(1, 2, 4), max_columns=100, sharpening=(4, 3, 0)
        ),
    ],
    ids=lambda core: (
        f"M{core.micro_image_size}_shift{core.shifts[0]}_{core.arithmetic.kind}"
        f"_rows{core.parallel_rows}"
    ),
)
def test_core_synthesises(library: Path, core: CoreConfiguration) -> None:
    # GHDL's synthesis refuses latches, several drivers of a signal, delays and dynamic loops.
    generics = [f"-g{k}={str(v).lower()}" for k, v in core.generics().items()]
    done = subprocess.run(
        ["ghdl", "--synth", "--std=93", *generics, "--out=none", "raster_refocuser"],
        cwd=library,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "latch" not in done.stderr


@pytest.mark.parametrize(
    ("top", "core"),
    [
        (
            "focal_stack",
            CoreConfiguration(
                micro_image_size=3,
                shifts=(-2, 0, 3),
                max_columns=640,
                channels=3,
                engine=StackEngine(),
            ),
        ),
        (
            "depth_index",
            DepthIndexConfiguration(
                micro_image_size=3, slices=3, shifts=(-2, 0, 3), max_columns=640, channels=3
            ),
        ),
    ],
)
def test_stack_synthesises(
    library: Path, top: str, core: CoreConfiguration | DepthIndexConfiguration
) -> None:
    generics = [f"-g{k}={str(v).lower()}" for k, v in core.generics().items()]
    done = subprocess.run(
        ["ghdl", "--synth", "--std=93", *generics, "--out=none", top],
        cwd=library,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "latch" not in done.stderr


def models() -> list[Path]:
    """Models of the primitives of all families."""
    folders = (project.root() / "hdl" / "sim").iterdir()
    return [path for folder in sorted(folders) for path in hdl.model_sources(folder.name)]


def test_one_entity_a_file() -> None:
    for path in [*hdl.all_sources(), *models()]:
        words = [line.split() for line in path.read_text().lower().splitlines()]
        units = [
            w[1] for w in words if len(w) > 2 and w[0] in ("entity", "package") and w[2] == "is"
        ]
        assert units == [path.stem], path


def test_every_source_is_listed() -> None:
    folder = project.root() / "hdl"
    sources = [*hdl.all_sources(), *models()]
    assert sorted(sources) == sorted(folder.rglob("*.vhd"))


# Controls of a board have neither a stream nor an equation.
CONTROLS = ("board_control", "hdmi_control", "monitor_edid")


def test_every_entity_has_a_header() -> None:
    """What it does; latency; throughput or equation: a line stands where it says something."""
    for path in hdl.all_sources():
        text = path.read_text()
        assert text.startswith("-- "), path
        if "\nentity " in text:
            header = text[: text.index("\nlibrary ")]
            # Clocks have no latency.
            assert ("-- Latency:" in header) != path.stem.endswith("_clocks"), path
            says = "Throughput:" in header or "-- Equation:" in header
            assert says != (path.stem in CONTROLS), path


def test_every_port_is_explained() -> None:
    for path in hdl.all_sources():
        assert not unexplained_ports(path.read_text()), path


def test_ports_without_a_comment_are_found() -> None:
    text = """entity example is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Explains two
    -- ports.
    first  : in    std_logic;
    second : in    std_logic;

    third  : in    std_logic;
    fourth : out   std_logic; -- beside
    fifth  : out   std_logic
  );
end entity example;
"""
    assert unexplained_ports(text) == ["third", "fifth"]
    comments = [port.comment for port in declarations(text, "port")]
    assert comments == ["", "", "Explains two ports.", "Explains two ports.", "", "beside", ""]


# A larger default is a number of clocks at one frequency, but for STALL, the clocks of a line.
MOST_PLAIN_DEFAULT = 2000
_INSTANCE = re.compile(r": entity work\.(\w+)\s+(?:generic map \((.*?)\n +\)\s+)?port map", re.S)


def test_boards_count_their_own_clocks() -> None:
    """Where a board's frequency is known, no entity keeps the clocks of another one."""
    texts = {path.stem: path.read_text() for path in hdl.all_sources()}
    for path in hdl.all_sources():
        if path.parent.name in ("control", "path", "board"):
            for entity, values in _INSTANCE.findall(path.read_text()):
                for generic in declarations(texts[entity], "generic"):
                    counts = generic.default.isdecimal() and int(generic.default)
                    named = re.search(rf"\b{generic.name}\s+=>", values)
                    fits = counts <= MOST_PLAIN_DEFAULT or generic.name == "STALL"
                    assert fits or named, (path.stem, entity, generic.name)


# The folders that a folder may use, in the order of the data path.
MAY_USE = {
    "common": set(),
    "core": {"common"},
    "sharpen": {"common", "core"},
    "fir": {"common", "core", "sharpen"},
    "moving_sum": {"common", "core", "sharpen"},
    # Each slice of a stack uses the adders of the moving sums.
    "stack": {"common", "core", "moving_sum"},
    # Weights are moving sums of ones.
    "border": {"common", "core", "moving_sum"},
    "refocuser": {"common", "core", "sharpen", "fir", "moving_sum", "stack", "border"},
    "depth": {"common", "core"},
    "resample": {"common", "core"},
    # Cores with registers behind a bus.
    "axi": {"common", "core", "refocuser", "depth", "resample"},
    "serial": {"common"},
    "tmds": {"common"},
    # Registers of the sensor, over I2C.
    "csi": {"common", "serial"},
    "video": {"common", "core", "stack", "depth", "refocuser", "resample", "overlay"},
    "selftest": {"common", "core", "refocuser"},
    # Between the control of a board and its pins, clocks and video path.
    "link": {"common", "resample", "serial", "tmds", "video"},
    "spartan6": {"common"},
    # A camera's lanes.
    "series7": {"common", "tmds"},
    "ecp5": {"common", "csi", "tmds"},
    "nexus": {"common"},
    "gowin": set(),
    "overlay": {"common"},
    # Buttons, serial ports and reports of a board.
    "control": {"common", "link", "resample", "serial", "tmds", "video"},
    # From a camera's or a cable's bits to the picture.
    "path": {
        *("common", "core", "control", "csi", "link", "refocuser", "resample", "serial"),
        *("tmds", "video"),
    },
    "board": {
        *("common", "core", "control", "csi", "link", "path", "refocuser", "resample"),
        *("tmds", "video", "spartan6", "series7", "ecp5", "gowin", "nexus"),
    },
}


def forbidden_uses(texts: dict[str, tuple[str, str]]) -> list[str]:
    """Forbidden uses; the sources are name to folder and text."""
    rooms = {name: folder for name, (folder, _) in texts.items()}
    return sorted(
        f"{rooms[name]}/{name} uses {rooms[used]}/{used}"
        for name, (_, text) in texts.items()
        for used in used_units(text) & texts.keys()
        if rooms[used] != rooms[name] and rooms[used] not in MAY_USE[rooms[name]]
    )


def test_folders_depend_one_way() -> None:
    texts = {path.stem: (path.parent.name, path.read_text()) for path in hdl.all_sources()}
    assert forbidden_uses(texts) == []
    # The table has no circle: each folder comes after all that it uses.
    assert list(TopologicalSorter(MAY_USE).static_order())


def test_use_of_a_folder_above_is_found() -> None:
    texts = {
        "fir_array": ("fir", "use work.math_pkg.all; -- work.atlys_top"),
        "math_pkg": ("common", "use work.refocus_pkg.all;"),
        "refocus_pkg": ("core", "  a : entity work.fir_array\n"),
        "raster_refocuser": ("refocuser", "  a : entity work.fir_array\n"),
    }
    assert forbidden_uses(texts) == [
        "common/math_pkg uses core/refocus_pkg",
        "core/refocus_pkg uses fir/fir_array",
    ]
