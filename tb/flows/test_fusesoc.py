# SPDX-License-Identifier: Apache-2.0
"""The core files in FuseSoC: the example designs simulated, projects for the vendors' tools."""

import re
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdl_text import declarations
from plenofir.ground import project
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import needed_sources
from self_test import self_test_generics

ROOT = project.root()
VHDL = ROOT / "examples" / "vhdl"
VERSION = re.search(r"^name: .*:(.*)$", (ROOT / "plenofir-refocuser.core").read_text(), re.M)[1]


@pytest.fixture
def fusesoc(need, run):
    """Run FuseSoC for a core and a target; its output."""

    def call(target: str, core: str, *words: str) -> str:
        return run("fusesoc", "--cores-root", ROOT, "run", "--target", target, *words, core)

    need("fusesoc", "ghdl", "make")
    return call


def test_refocuser_in_ghdl(fusesoc) -> None:
    found = fusesoc("sim", "plenofir:ip:refocuser")
    assert "PASS: 4 frames of 23 x 15 pixels" in found


@pytest.mark.parametrize(
    ("core", "passes"),
    [
        ("plenofir:ip:video", "PASS: a picture of 27 x 15 pixels for each slice"),
        ("plenofir:board:ulx3s_self_test", "PASS: the right signature, and no other"),
    ],
)
def test_other_cores_in_ghdl(fusesoc, core: str, passes: str) -> None:
    assert passes in fusesoc("sim", core)


@pytest.mark.parametrize("core", ["plenofir:board:atlys", "plenofir:ip:axi"])
def test_core_elaborates(fusesoc, core: str) -> None:
    found = fusesoc("elaborate", core)
    assert "--no-run" in found


@pytest.mark.slow
def test_generated_verilog(fusesoc, need) -> None:
    need("iverilog", "verilator")
    core = "plenofir:example:refocus_button"
    assert "PASS: 4 frames of 24 x 18 pixels, 3 slices" in fusesoc("sim", core)
    assert "%Warning" not in fusesoc("lint", core)
    fusesoc("synth", core, "--setup")


def project_of(folder: Path, core: str, target: str) -> str:
    """Text of the project that FuseSoC wrote for a core."""
    name = core.replace(":", "_") + f"_{VERSION}"
    files = sorted((folder / "build" / name / target).rglob("*.tcl"))
    return "".join(file.read_text() for file in files)


def test_project_of_the_atlys(fusesoc, tmp_path: Path) -> None:
    core = "plenofir:board:atlys"
    fusesoc("synth", core, "--setup")
    text = project_of(tmp_path, core, "synth-ise")
    added = re.findall(r"/(hdl/\S+\.vhd)$", text, re.M)
    # Each source once, and everything that the board needs.
    assert len(added) == len(set(added))
    sources = hdl.board_sources()
    top = next(path for path in sources if path.stem == "atlys_top")
    needed = [top, *needed_sources(top.read_text(), top.stem, sources)]
    assert {str(path.relative_to(ROOT)) for path in needed} <= set(added)
    assert "constraints/atlys.ucf" in text
    assert 'project set top "atlys_top"' in text
    assert "-loop_iteration_limit 131072" in text


def test_crossings_of_the_video_path(fusesoc, tmp_path: Path) -> None:
    """A design that contains the whole path asks for the constraints by a flag."""
    core, flag = "plenofir:ip:video", ("--flag", "crossings", "--setup")
    fusesoc("synth", core, "--tool", "vivado", *flag)
    fusesoc("gowin", core, *flag)
    for target, file, path in (
        ("synth-vivado", "video.xdc", "crossing_code_reg"),
        ("gowin", "video.gowin.sdc", "crossing_code"),
    ):
        assert f"constraints/{file}" in project_of(tmp_path, core, target)
        assert path in (ROOT / "constraints" / file).read_text()


EXAMPLES = {
    "plenofir:ip:refocuser": "refocus_button",
    "plenofir:ip:video": "pattern_video",
    "plenofir:ip:axi": "refocuser_wishbone",
}


@pytest.mark.slow
@pytest.mark.parametrize("core", EXAMPLES)
def test_projects(fusesoc, tmp_path: Path, core: str) -> None:
    """One for each vendor's tool: the example's sources, its top, and the tool's device."""
    for tool, device in (
        ("ise", "xc6slx45"),
        ("vivado", "xc7a35t"),
        ("quartus", "5CEBA4"),
        ("radiant", "LIFCL-40"),
        ("diamond", "LFE5U-45F"),
        ("gowin", "GW2AR-LV18QN88C8/I7"),
    ):
        own = tool == "gowin"  # a target of its own
        fusesoc(*(["gowin", core] if own else ["synth", core, "--tool", tool]), "--setup")
        text = project_of(tmp_path, core, "gowin" if own else f"synth-{tool}")
        top = VHDL / f"{EXAMPLES[core]}.vhd"
        needed = needed_sources(top.read_text(), top.stem, hdl.hdl_sources())
        for file in (top, *needed):
            assert str(file.relative_to(ROOT)) in text, (tool, file)
        assert device in text, tool
        assert ("-loop_iteration_limit 131072" in text) == (tool == "ise")
        assert re.search(rf"\b{top.stem}\b(?!\.vhd)", text), tool


@pytest.mark.slow
def test_project_of_the_ulx3s(fusesoc, tmp_path: Path) -> None:
    core = "plenofir:board:ulx3s_self_test"
    fusesoc("synth", core, "--setup", "--tool", "diamond")
    assert "constraints/ulx3s_self_test.lpf" in project_of(tmp_path, core, "synth-diamond")


def defaults_of(name: str) -> dict[str, str]:
    """Defaults of an entity's generics, or of the parameters of a function of ``picture_pkg``."""
    sources = {path.stem: path.read_text() for path in hdl.all_sources()}
    if name in sources:
        return {part.name: part.default for part in declarations(sources[name], "generic")}
    declared = re.search(rf"function {name} \((.*?)\n  \) return", sources["picture_pkg"], re.S)
    assert declared is not None
    return {
        parameter.upper(): default
        for parameter, default in re.findall(r"(\w+) +: \w+ +:= ([^;\n]+)", declared[1])
    }


@pytest.mark.parametrize(
    ("example", "call", "scene"),
    [
        ("refocus_button", "raster_refocuser", "grey-microscope"),
        ("pattern_video", "picture_core_of", "rgb-480p"),
    ],
)
def test_examples_have_the_generics_of_a_scene(example: str, call: str, scene: str) -> None:
    text = (VHDL / f"{example}.vhd").read_text()
    values = re.search(rf"\b{call}\n(?: +generic map)? *\((.*?)\n +\)", text, re.S)
    assert values is not None
    # A function's parameters have small letters; its first one is the name in messages.
    pairs = re.findall(r'(\w+) +=> "?([^",\n]*)', values[1])
    found = {name.upper(): value for name, value in pairs if name != "name"}
    want = {k: str(v) for k, v in make_plan(load_scene(scene)).core.generics().items()}
    assert {k: v.capitalize() if v in ("true", "false") else v for k, v in found.items()} == {
        name: want[name] for name in found
    }
    # Generics left out have the entity's defaults; the channels of a picture are those of a sensor.
    defaults = defaults_of(call)
    for name in (want.keys() & defaults.keys()) - found.keys() - {"CHANNELS"}:
        assert defaults[name].strip('"').capitalize() == want[name].capitalize(), name


def test_self_test_bench_has_the_golden_signature() -> None:
    core = CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=20)
    want = self_test_generics(core, 12)
    text = (VHDL / "tb_self_test.vhd").read_text()
    found = {part.name: int(part.default) for part in declarations(text, "generic")}
    assert found == {name: want[name] for name in found}
