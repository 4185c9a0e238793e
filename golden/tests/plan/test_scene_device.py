# SPDX-License-Identifier: Apache-2.0
"""A device of the user's own, and names that are not in the table."""

import json
import random
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.families import FAMILIES
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.synthesis.counts import count
from plenofir.fpga.tools.synthesis import run_yosys
from plenofir.ground.errors import InputError, ToolError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.plan import Plan
from plenofir.plan.project_files import TOOLS, tool_of, write_project
from plenofir_studies.counted_cores import counted_cores

SCENE = """
name = "own"
[camera]
micro_image_size = 5
[frame]
columns = 640
rows = 480
colour = "grey"
[depth]
slices = ["1/5"]
"""
OWN = """
[device]
name = "xc7a50t-other"
family = "Artix-7"
lut = 32600
flip_flops = 65200
block_rams = 150
multipliers = 120
pins = 30
part = "xc7a50tcpg236-2"
"""


def planned(folder: Path, text: str, device: str | None = None) -> Plan:
    path = folder / "scene.toml"
    path.write_text(text)
    return make_plan(load_scene(path, device))


def test_a_part_by_its_facts(tmp_path: Path) -> None:
    plan = planned(tmp_path, SCENE + OWN)
    in_table = planned(tmp_path, SCENE, "xc7a50t")
    assert (plan.device, plan.part) == ("xc7a50t-other", "xc7a50tcpg236-2")
    assert (plan.needs, plan.available, plan.kept_mhz) == (
        in_table.needs,
        in_table.available,
        in_table.kept_mhz,
    )
    files = write_project(plan, tool_of(plan, None)[0], tmp_path / "out")
    assert "scene_top.xdc" in files
    assert "part xc7a50tcpg236-2" in (tmp_path / "out" / "scene_top.tcl").read_text()
    assert "has 30 pins" in (tmp_path / "out" / "README").read_text()
    # A device that is given with the command takes its place.
    assert planned(tmp_path, SCENE + OWN, "lfe5u-25f").device == "lfe5u-25f"


def test_facts_of_any_row_plan_like_the_row(tmp_path: Path) -> None:
    """Drawn rows of the table, written as a part of one's own."""
    seed = random.randrange(1 << 30)
    print(f"seed {seed}")
    for name in random.Random(seed).sample(list(DEVICES), 6):
        row = DEVICES[name]
        facts = (
            f'[device]\nname = "{name}"\nfamily = "{FAMILIES[row.family].title}"\n'
            f"lut = {row.total.lut}\nflip_flops = {row.total.flip_flops}\n"
            f"block_rams = {row.total.block_rams}\nmultipliers = {row.total.dsp}\n"
            f'part = "{row.part}"\n'
        )
        own, there = planned(tmp_path, SCENE + facts), planned(tmp_path, SCENE, name)
        same = ("needs", "available", "part", "built_mhz", "kept_mhz", "core")
        for field in same:
            assert getattr(own, field) == getattr(there, field), (name, field)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("Artix-7", "Artix-8"), "the nearest is 'artix-7'"),
        (("Artix-7", "MAX 10"), "not count a MAX 10; the nearest is 'cyclone v'"),
        (("lut = 32600\n", ""), "device.lut"),
        (("lut = 32600", "lut = 60"), "the XC7A50T-OTHER is too small: it needs"),
        (("[device]", '[build]\ndevice = "xc7a35t"\n[device]'), "takes the place of build.device"),
        (("[device]", '[build]\npath = "video"\n[device]'), r"device needs build\.path = 'core'"),
        (("pins = 30", "pins = -1"), "device.pins"),
        (("pins = 30", "balls = 30"), "device.balls"),
    ],
)
def test_refused_facts(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        planned(tmp_path, SCENE + OWN.replace(*change))


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("xc7a51t", "the nearest is xc7a50t;"),
        ("xc7k325t", "the nearest is xc7k"),
        ("xczu4eg", "the nearest is xczu"),
        ("LFE5UM-85F", "the nearest is lfe5u-85f;"),
        ("5cgxfc5", "the nearest is 5ce"),
        ("10M50DAF484C7G", "the nearest is 5ceba4, as Yosys does not count a MAX 10 as Quartus"),
        ("10cl025", "the nearest is 5ceba4, as Yosys does not count a Cyclone 10 LP"),
        ("none", "= 'none': not in the table of devices; plenofir devices lists"),
    ],
)
def test_the_nearest_device_is_named(typed: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"{message}.* \[device\] takes the facts"):
        planned(tmp_path, SCENE, typed)


def cells(verilog: str, command: str, folder: Path) -> dict[str, int]:
    (folder / "top.v").write_text(verilog)
    steps = ["read_verilog top.v", command, "tee -q -o stat.json stat -json"]
    run_yosys(steps, folder / "yosys.log")
    text = (folder / "stat.json").read_text()
    counted: dict[str, int] = json.loads(text[text.index("{") :])["design"]["num_cells_by_type"]
    return counted


@pytest.mark.slow
def test_intel_families_that_are_not_counted(tmp_path: Path) -> None:
    """What the page on resources says of Yosys; a version that counts them fails here."""
    adder = """module top(input clk, input [15:0] a, b, output reg [16:0] q);
      always @(posedge clk) q <= a + b; endmodule"""
    memory = """module top(input clk, we, input [5:0] w, r, input [8:0] d, output reg [8:0] q);
      reg [8:0] m[0:63]; CONTENTS
      always @(posedge clk) begin if (we) m[w] <= d; q <= m[r]; end endmodule"""
    empty, filled = (memory.replace("CONTENTS", text) for text in ("", "initial m[3] = 9'h1a5;"))
    for family, name in (("max10", "fiftyfivenm"), ("cyclone10lp", "cyclone10lp")):
        counted = cells(adder, f"synth_intel -family {family} -top top", tmp_path)
        assert counted[f"{name}_lcell_comb"] == 49
    with pytest.raises(ToolError, match="Can't find object for defparam"):
        cells(filled, "synth_intel -family max10 -top top", tmp_path)
    assert (
        cells(empty, "synth_intel -family cyclone10lp -top top", tmp_path)["dffeas"] == 64 * 9 + 9
    )
    with pytest.raises(ToolError, match="no specify entries"):
        cells(adder, "synth_intel_alm -family cyclone10gx -top top", tmp_path)


def test_trellis_takes_no_part_that_it_does_not_know(tmp_path: Path) -> None:
    plan = planned(tmp_path, SCENE + OWN.replace("Artix-7", "ECP5"))
    assert tool_of(plan, None)[0] == "diamond"
    with pytest.raises(InputError, match="Project Trellis does not know the XC7A50T-OTHER"):
        tool_of(plan, "trellis")


def test_every_family_has_a_tool() -> None:
    assert set(FAMILIES) == {family for tool in TOOLS.values() for family in tool.families}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fir M=5 a'=2 grey", "moving_sum M=7 a'=2 grey"])
def test_ultrascale_is_estimated_like_the_7_series(name: str, tmp_path: Path) -> None:
    """Its look-up tables, flip-flops and block RAM are alike; its multipliers are wider."""
    core = dict(counted_cores())[name]
    sources = hdl.hdl_sources()
    counted = count("usplus", sources, "raster_refocuser", core.generics(), tmp_path).usage
    usage = estimate(core.blocks, "usplus")
    assert (usage.block_rams, usage.dsp) == (counted.block_rams, counted.dsp)
    assert usage.lut == pytest.approx(counted.lut, rel=0.15)
    assert usage.flip_flops == pytest.approx(counted.flip_flops, rel=0.15)
