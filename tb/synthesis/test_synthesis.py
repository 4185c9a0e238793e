# SPDX-License-Identifier: Apache-2.0
"""Synthesis with GHDL and Yosys: recorded counts; what a scene does not need is absent."""

import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from netlist_parts import count_parts, left_out_in_turn, needed_parts
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import TOP as BOARD
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.families import Family
from plenofir.fpga.resources.record import load_record
from plenofir.fpga.synthesis import counts
from plenofir.fpga.synthesis.spartan6 import TMDS_ENDS
from plenofir.fpga.tools import synthesis as tools_module
from plenofir.fpga.tools.primitives import component_package, with_primitives
from plenofir.fpga.tools.synthesis import (
    ghdl_version,
    move_contents,
    plain_verilog,
    run_yosys,
    with_defaults,
    write_verilog,
    yosys_version,
)
from plenofir.ground import project
from plenofir.ground.errors import InputError, ToolError
from plenofir.plan.configure import configure
from plenofir.plan.omissions import full_core
from plenofir_studies.engine_cells import measured_cells
from plenofir_studies.recorded_designs import CORE, Design, core_designs, designs, scene_designs
from plenofir_tb.tools import or_skip

DESIGNS = designs()
SLOW = pytest.mark.slow


def marks_of(design: Design) -> list[pytest.MarkDecorator]:
    """Marks of a design: large ones are slow, and one of the scenes' cores is drawn."""
    if design.slow:
        return [SLOW]
    return [pytest.mark.drawn(1, "cores of scenes")] if design.name.endswith(" core") else []


@pytest.fixture(scope="module", autouse=True)
def tools() -> None:
    with or_skip():
        ghdl_version()
        yosys_version()


@pytest.mark.parametrize(
    "design",
    [pytest.param(design, marks=marks_of(design), id=design.name) for design in DESIGNS],
)
def test_figures(tmp_path: Path, design: Design) -> None:
    record = load_record()
    recorded = record.counted["spartan6"][design.name]
    assert record.yosys == yosys_version()
    figures = design.synthesise(tmp_path).figures
    if record.ghdl == ghdl_version():
        assert figures == recorded, "run make figures if the change is meant"
        return
    # Another GHDL than the recorded one: its Verilog differs in detail.
    assert (figures.ramb16, figures.ramb8, figures.dsp) == (
        recorded.ramb16,
        recorded.ramb8,
        recorded.dsp,
    )
    assert figures.lut == pytest.approx(recorded.lut, rel=0.1)
    assert figures.flip_flops == pytest.approx(recorded.flip_flops, rel=0.05)


def test_contents_of_memories_in_files(tmp_path: Path) -> None:
    def module(assignments: Sequence[str]) -> str:
        lines = "".join(f"    memory[{line};\n" for line in assignments)
        return f"module m;\n  reg [1:0] memory[3:0];\n  initial begin\n{lines}    end\nendmodule\n"

    verilog = tmp_path / "m.v"
    whole = ["3] = 2'b11", "2] = 2'b01", "1] = 2'b00", "0] = 2'b10"]
    verilog.write_text(module(whole))
    move_contents(verilog)
    # It has too few words for a file.
    assert verilog.read_text() == module(whole)
    move_contents(verilog, 4)
    (file,) = tmp_path.glob("*.mem")
    assert file.read_text().split() == ["10", "00", "01", "11"]
    assert f'initial $readmemb("{file.name}", memory);' in verilog.read_text()
    # Contents with gaps are not moved.
    verilog.write_text(module(whole[:3]))
    move_contents(verilog, 2)
    assert verilog.read_text() == module(whole[:3])


def test_every_design_is_recorded() -> None:
    cells = {cell.name for cell in measured_cells()}
    assert load_record().counted["spartan6"].keys() - cells == {d.name for d in DESIGNS}


@pytest.mark.parametrize("design", list(core_designs()), ids=lambda design: design.name)
def test_what_a_scene_does_not_need_is_absent(tmp_path: Path, design: Design) -> None:
    core = design.core
    assert design.plan is not None
    sources = configure(design.plan, tmp_path)
    found = count_parts(write_verilog(sources, design.top, {}, tmp_path).read_text(), design.top)
    # Packages of all engines are analysed, because they count what each needs; entities of the
    # core's own engine alone are, and nothing more is built than needed.
    entities = {source.parent.name for source in sources if not source.stem.endswith("_pkg")}
    assert not core.sharpens
    assert not core.normalises
    assert entities - {tmp_path.name} == {"common", "core", "refocuser", core.engine.kind}
    assert found == {**dict.fromkeys(TMDS_ENDS, 0), **needed_parts(core)}
    assert core.line_buffer_bits < full_core(core).line_buffer_bits


def test_board_has_the_tmds_ends_and_its_core_no_more_than_it_needs(tmp_path: Path) -> None:
    boards = [design for design in scene_designs() if design.top == BOARD]
    design = boards[0]
    assert len(boards) == 2
    assert design.plan is not None
    sources = configure(design.plan, tmp_path)
    verilog = write_verilog(sources, design.top, {}, tmp_path, primitives="unisim").read_text()
    assert count_parts(verilog, design.top) == {**TMDS_ENDS, **needed_parts(design.core)}


@pytest.mark.parametrize(
    ("what", "core"), list(left_out_in_turn()), ids=lambda value: str(value)[:20]
)
def test_what_is_left_out_in_turn_is_absent(
    tmp_path: Path, what: str, core: CoreConfiguration
) -> None:
    verilog = write_verilog(hdl.hdl_sources(), CORE, core.generics(), tmp_path).read_text()
    assert count_parts(verilog, CORE) == {**dict.fromkeys(TMDS_ENDS, 0), **needed_parts(core)}


def test_sharpener_is_there_for_those_that_want_it(tmp_path: Path) -> None:
    for weights, count in (((0, 4), 1), ((0, 0), 0)):
        core = CoreConfiguration(
            micro_image_size=3, shifts=(3, 2), max_columns=16, sharpening=weights
        )
        folder = tmp_path / str(count)
        folder.mkdir()
        verilog = write_verilog(hdl.hdl_sources(), CORE, core.generics(), folder).read_text()
        assert needed_parts(core)["sharpeners"] == count
        assert count_parts(verilog, CORE) == {
            **dict.fromkeys(TMDS_ENDS, 0),
            **needed_parts(core),
        }


# A core of each engine and its products: of each value two taps of a sharpener and a division.
MULTIPLIED = [
    (FirEngine(), {"shifts": (0, 2), "sharpening": (4, 3)}, 3),
    (MovingSumEngine(), {"shifts": (-1, 2), "sharpening": (3, 4), "channels": 3}, 9),
    (StackEngine(pixels_per_clock=2), {"shifts": (-1, 0)}, 4),
]


@pytest.mark.parametrize(
    ("engine", "more", "count"),
    [
        pytest.param(*row, id=row[0].kind, marks=pytest.mark.drawn(1, "multipliers"))
        for row in MULTIPLIED
    ],
)
def test_each_product_takes_one_multiplier(
    tmp_path: Path, engine: FirEngine | MovingSumEngine | StackEngine, more: dict, count: int
) -> None:
    """Yosys splits a product into two if it does not see that a factor is signed."""
    core = CoreConfiguration(micro_image_size=3, max_columns=16, engine=engine, **more)
    verilog = write_verilog(hdl.hdl_sources(), engine.ENTITY, core.generics(), tmp_path)
    synth = f"synth_xilinx -family xc6s -flatten -ise -top {engine.ENTITY} -run begin:map_memory"
    commands = [
        f"read_verilog {verilog.name}",
        synth,
        "tee -q -o cells.txt select -count t:DSP48A1",
    ]
    run_yosys(commands, tmp_path / "yosys.log", reads=[verilog], writes=["cells.txt"])
    assert (tmp_path / "cells.txt").read_text().split()[0] == str(count)


def test_what_is_left_out_saves_parts_and_area() -> None:
    cores = dict(left_out_in_turn())
    full = needed_parts(cores.pop("nothing"))
    fewer = {
        "two of three channels": {"filters", "taps", "stored products"},
        "six of seven slices": {"taps"},
        "interpolation": {"stages", "filters", "taps", "stored products"},
        "stored products (exact sums)": {"stored products"},
        "the second row at once": {"filters", "taps", "stored products", "lane registers"},
        "all of these": {"stages", "filters", "taps", "stored products", "lane registers"},
    }
    assert cores.keys() == fewer.keys()
    for what, core in cores.items():
        parts = needed_parts(core)
        assert {name for name in parts if parts[name] < full[name]} == fewer[what], what
    figures = load_record().counted["spartan6"]
    # The TMDS ends, and all that drives them.
    assert figures["rgb-480p"].lut > figures["rgb-480p core"].lut + 2000
    assert figures["rgb-480p"].flip_flops > figures["rgb-480p core"].flip_flops + 2000


# GHDL 2.0 declares a module for a component and writes texts as bits, GHDL 5 does neither.
@pytest.mark.parametrize(
    ("module", "value"),
    [
        (
            "module pll_adv\n  #(parameter\n    TEXT)\n  (input  a);\nendmodule\n",
            "16'b0100100001001001",
        ),
        ("", '"HI"'),
    ],
    ids=["2.0", "5.0"],
)
def test_primitives_become_cells(tmp_path: Path, module: str, value: str) -> None:
    models = tmp_path / "cells.v"
    models.write_text(
        'module PLL_ADV (A);\n  parameter TEXT = "X";\n  parameter FLAG = "FALSE";\n'
        "  parameter real SHARE = 0.0;\n  parameter integer COUNT = 1;\nendmodule\n"
    )
    text = f"""{module}module top
  (input  a);
  pll_adv #(
    .TEXT({value}),
    .FLAG(1'b1),
    .SHARE(64'b0011111111100000000000000000000000000000000000000000000000000000),
    .COUNT(4'b0101),
    .OTHER(1'b1))
    pll (
    .a(a));
endmodule
"""
    assert with_primitives(text, component_package("unisim"), [models]) == (
        'module top\n  (input  a);\n  PLL_ADV #(.TEXT("HI"), .FLAG("TRUE"), .SHARE(0.5), '
        ".COUNT(4'b0101)) pll (\n    .A(a));\nendmodule\n"
    )


def data_path_adders(core: CoreConfiguration, folder: Path) -> tuple[int, int]:
    """Additions and subtractions of pixels and sums in GHDL's Verilog of the adders."""
    file = next(s for s in hdl.hdl_sources() if s.stem == "moving_sum_adder")
    lines = file.read_text().splitlines()
    begin = next(n for n, line in enumerate(lines, 1) if "add : process" in line)
    end = next(n for n, line in enumerate(lines, 1) if "end process add;" in line)
    text = write_verilog(hdl.hdl_sources(), CORE, core.generics(), folder).read_text()
    found = re.findall(
        r"moving_sum_adder\.vhd:(\d+):\d+ +\*/\n  assign \w+ = \S+ ([+-]) \S+;", text
    )
    signs = [sign for line, sign in found if begin <= int(line) <= end]
    return signs.count("+"), signs.count("-")


def test_adders_do_not_grow_with_m_or_a(tmp_path: Path) -> None:
    # For each dimension: a pixel in less one out, the running sum, the first sum of the next line.
    for m, shift in ((3, 2), (5, -3), (11, 13)):
        core = CoreConfiguration(
            micro_image_size=m, shifts=(shift,), max_columns=16, engine=MovingSumEngine()
        )
        folder = tmp_path / f"m{m}"
        folder.mkdir()
        assert data_path_adders(core, folder) == (2 * 2, 2 * 1)


@pytest.mark.parametrize(
    ("family", "m", "shifts"), [("ecp5", 23, "2 3 4"), ("cyclonev", 5, "0 1 2 3 4")]
)
def test_tables_of_steps_are_logic(tmp_path: Path, family: Family, m: int, shifts: str) -> None:
    """Block RAM would give the words of `moving_sum_control` too late in the clock."""
    ports = project.root() / "tb" / "moving_sum" / "control_ports.vhd"
    generics = {"MICRO_IMAGE_SIZE": m, "SHIFTS": shifts}
    figures = counts.count(family, [*hdl.hdl_sources(), ports], "control_ports", generics, tmp_path)
    assert figures.usage.block_rams == 0


def test_scene_is_smaller_than_its_full_build() -> None:
    figures = load_record().counted["spartan6"]
    scene, full = figures["grey-microscope"], figures["grey-microscope full"]
    assert scene.lut < full.lut / 1.2
    assert scene.usage.block_rams < full.usage.block_rams / 1.2
    assert (scene.dsp, full.dsp) == (1, 3)
    # Stored products divide nothing, whatever the number of rows.
    assert figures["thesis-m3"].dsp == 0


def test_missing_yosys_is_said_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib.util

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="Yosys is not installed"):
        yosys_version()


def test_verilog_that_ghdl_leaves_unfinished() -> None:
    text = """
  localparam n1_o = 0'b;
  assign n2_o = {n3_o, 4'bZ};
  always @*
    case (n4_o)
      2'b10: n5_o <= n6_o;
      2'b01: n5_o <= 1'b0;
    endcase
  initial begin
    memory[1] = 2'b00;
    memory[0] = 2'b00;
    end
  initial begin
    rom[1] = 2'b00;
    rom[0] = 2'b01;
    end
"""
    plain = plain_verilog(text)
    assert "0'b;" not in plain.replace("1'b0;", "")
    assert "4'bX" in plain
    assert "memory[" not in plain
    assert "rom[0] = 2'b01;" in plain
    # A constant of more than 32 bits is no text.
    bits = "10" * 17
    assert plain_verilog(f'  mask <= "{bits}";') == f"  mask <= 34'b{bits};"
    assert plain_verilog('  .TEXT("11")') == '  .TEXT("11")'


CASES = """
  always @*
    case (n4_o)
      2'b10: n5_o <= n6_o;
      2'b01: n5_o <= 1'b0;
    endcase
  always @*
    case (n7_o)
      2'b10: n8_o <= 4'b0001;
      2'b01: n8_o <= 4'b0100;
    endcase
"""


def cases_in_vhdl(first: str, second: str, name: str = "n8_o") -> str:
    return f"""
  with n4_o select n5_o <=
    n6_o when "10",
    '0' when "01",
    {first} when others;
  -- source.vhd:12:3
  with n7_o select {name} <=
    "0001" when "10",
    "0100" when "01",
    {second} when others;
"""


@pytest.mark.parametrize(
    ("first", "second", "defaults"),
    [
        ("'X'", '"1101"', ("1'bX", "4'b1101")),
        ("n9_o", "word (7 downto 4)", ("n9_o", "word[7:4]")),
        ("word (3)", '"XXXX"', ("word[3]", "4'bXXXX")),
        ("'1'", "(3 downto 0 => 'X')", ("1'b1", "4'bXXXX")),
    ],
)
def test_default_of_cases(first: str, second: str, defaults: tuple[str, str]) -> None:
    text = with_defaults(CASES, cases_in_vhdl(first, second))
    places = [text.index(f"default: n5_o <= {defaults[0]};"), text.index("case (n7_o)")]
    assert places == sorted(places)
    assert f"    default: n8_o <= {defaults[1]};\n    endcase" in text


def test_complete_cases_are_left() -> None:
    """As GHDL 5.0 prints them: with a default, or with all choices."""
    complete = """
    case (n1_o)
      1'b0: n2_o = 2'b10;
      1'b1: n2_o = 2'b01;
    endcase
    case (n4_o)
      2'b10: n5_o = n6_o;
      default: n5_o = 1'b0;
    endcase
"""
    assert with_defaults(complete, cases_in_vhdl("'0'", '"0000"', "n8")) == complete


@pytest.mark.parametrize(
    ("vhdl", "message"),
    [
        ("", "2 cases, its VHDL 0"),
        (cases_in_vhdl("'0'", '"0000"', "n3_o"), "n3_o"),
        (cases_in_vhdl("a & b", '"0000"'), "not understood: a & b"),
    ],
)
def test_cases_that_differ(vhdl: str, message: str) -> None:
    with pytest.raises(ToolError, match=message):
        with_defaults(CASES, vhdl)


def test_tmds_tables_as_verilog(tmp_path: Path) -> None:
    """Tables whose last row is ``when others``: tokens of a channel, in Verilog as in VHDL."""
    text = write_verilog(hdl.hdl_sources(), "tmds_decoder", {}, tmp_path).read_text()
    tokens = re.search(r"3'b100: (n\d+_o <?=) 2'b10;.*?endcase", text, re.S)
    assert tokens is not None
    assert f"default: {tokens[1]} 2'b11;" in tokens[0]


def test_core_is_a_design() -> None:
    parts = {"moving_sum_stage", "lane_stage", "pixel_banks", "prefix_sums"}
    assert {design.top for design in DESIGNS} - parts == {
        CORE,
        "fir_array",
        "focal_stack",
        "depth_index",
        "picture_core",
        "text_overlay",
        "sensor_raster",
        "scene_top",
        BOARD,
    }


def test_yosys_runs_once_for_the_same_verilog(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(project, "root", lambda: tmp_path)
    monkeypatch.setattr(project, "in_checkout", lambda: True)
    runs = []

    def run(command: list[str], log: Path) -> None:
        runs.append(command)
        log.write_text("log")
        (log.parent / "out.v").write_text(f"result {len(runs)}")

    monkeypatch.setattr(tools_module, "run_tool", run)

    def result(text: str, command: str = "stat") -> str:
        (tmp_path / "in.v").write_text(text)
        out = tmp_path / "out.v"
        out.unlink(missing_ok=True)
        run_yosys([command], tmp_path / "log", reads=[tmp_path / "in.v"], writes=[out.name])
        return out.read_text()

    assert result("/* a.vhd:1 */ assign a = b;") == "result 1"
    assert result("/* a.vhd:2 */ assign a = b;") == "result 1"
    assert result("assign a = c;") == "result 2"
    assert result("assign a = c;", "ltp") == "result 3"
    assert len(runs) == 3
