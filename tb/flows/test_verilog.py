# SPDX-License-Identifier: Apache-2.0
"""A scene in Verilog: the example design around it, in Icarus Verilog and Verilator."""

import re
import sys
from pathlib import Path

import pytest

from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure, top_of
from plenofir.plan.loaded_scene import scene_files
from plenofir.plan.verilog import _without_doubles, sizes_header
from plenofir_tb.flows import EXAMPLES, icarus

FILES = [
    EXAMPLES / "verilog" / f"{name}.v"
    for name in ("refocus_button", "tb_refocus_button", "check_frames")
]


def test_example_in_icarus(need, run, tmp_path: Path, verilog_scene: Path) -> None:
    need("iverilog")
    includes = [verilog_scene, EXAMPLES / "verilog"]
    files = [*FILES, verilog_scene / "scene_top.v"]
    found = icarus(run, includes, files, tmp_path / "bench")
    assert found == "PASS: 4 frames of 24 x 18 pixels, 3 slices\n"


def test_bench_finds_a_wrong_slice(need, run, tmp_path: Path, verilog_scene: Path) -> None:
    need("iverilog")
    header = (verilog_scene / "scene_top.vh").read_text()
    (tmp_path / "scene_top.vh").write_text(header.replace("fffe", "ffff"))
    includes = [tmp_path, EXAMPLES / "verilog"]
    files = [*FILES, verilog_scene / "scene_top.v"]
    found = icarus(run, includes, files, tmp_path / "bench")
    assert found.startswith("FAIL: frame 0, row 0, column "), found


def test_own_cocotb_test(need, run, tmp_path: Path, verilog_scene: Path) -> None:
    """The example of a user's own test; a wrong a is found."""
    need("iverilog")
    text = (EXAMPLES / "cocotb" / "refocuser_test.py").read_text()
    own = tmp_path / "refocuser_test.py"
    own.write_text(text)
    (tmp_path / "scene_top.v").write_text((verilog_scene / "scene_top.v").read_text())
    found = run(sys.executable, own, "scene_top.v")
    assert "TESTS=1 PASS=1 FAIL=0" in found
    own.write_text(text.replace('"1/3"', '"2/3"'))
    found = run(sys.executable, own, "scene_top.v", status=1)
    assert "TESTS=1 PASS=0 FAIL=1" in found


GHDL_ENDS = pytest.mark.xfail(
    strict=True, reason="GHDL 2.0 ends with an assertion in netlists-memories.adb"
)


def lint(run, top: str, *files: Path) -> str:
    return run("verilator", "--lint-only", "--no-timing", "--top-module", top, *files)


def test_verilator_has_no_warning(need, run, verilog_scene: Path) -> None:
    need("verilator")
    include = f"-I{verilog_scene}"
    files = [EXAMPLES / "verilog" / "refocus_button.v", verilog_scene / "scene_top.v"]
    assert "%" not in run("verilator", "--lint-only", include, "--no-timing", *files)


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(name, marks=GHDL_ENDS if name == "lifcl40-360" else ())
        for name in (path.stem for path in scene_files())
    ],
)
def test_no_shipped_scene_has_a_warning(scene: str, need, run, tmp_path: Path) -> None:
    """Boards instantiate their vendor's cells, which Verilator alone does not know."""
    need("verilator", "ghdl")
    plan = make_plan(load_scene(scene))
    configure(plan, tmp_path, verilog=True)
    top = top_of(plan)
    if plan.path == "core":
        assert "%" not in lint(run, top, tmp_path / f"{top}.v")
        return
    found = run(
        *("sh", "-c", f"verilator --lint-only --no-timing --top-module {top} {top}.v || true")
    )
    codes = set(re.findall(r"^%([\w-]+): \S+?\.v", found, re.M))
    assert codes == {"Error-MODMISSING"}, found


def test_what_ghdl_writes_twice_is_left_out() -> None:
    module = """\
module top (input clk, output locked);
  wire deskew_locked;
  wire [3:0] word;
  wire empty;
  wire deskew_locked;
  assign deskew_locked = deskew_locked;
  assign empty = "";
  assign locked = deskew_locked;
endmodule"""
    (match,) = re.finditer(r"^module .*?^endmodule", module, re.S | re.M)
    tidy = _without_doubles(match).splitlines()
    assert tidy == [
        "module top (input clk, output locked);",
        "  wire deskew_locked;",
        "  wire [3:0] word;",
        "  wire empty;",
        "  assign empty = 1'b0;",
        "  assign locked = deskew_locked;",
        "endmodule",
    ]


@pytest.mark.slow
def test_example_in_verilator(need, run, tmp_path: Path, verilog_scene: Path) -> None:
    need("verilator", "g++")
    run(
        *("verilator", "--binary", "--timing", "-Wno-fatal", "-Wno-lint", "-Wno-style"),
        *("-CFLAGS", "-std=gnu++20"),
        *("-MAKEFLAGS", "CFG_CXXFLAGS_PCH_I=-include OPT_FAST=-O0 PYTHON3=python3"),
        *(f"-I{verilog_scene}", f"-I{EXAMPLES / 'verilog'}"),
        *("--top-module", "tb_refocus_button", "--Mdir", tmp_path / "model"),
        *(*FILES, verilog_scene / "scene_top.v"),
    )
    found = run(tmp_path / "model" / "Vtb_refocus_button")
    assert "PASS: 4 frames of 24 x 18 pixels, 3 slices" in found


def test_verilog_names_no_place(verilog_scene: Path) -> None:
    text = (verilog_scene / "scene_top.v").read_text()
    assert text.startswith("// The scene verilog-example, written by plenofir configure --verilog")
    assert "/*" not in text
    assert ".vhd" not in text
    # Verilator's lint rules about blocking and non-blocking assignments.
    assert not re.search(r"^  (?:initial|always @\*)\n    \w+ <= ", text, re.M)


def test_names_say_what_it_is(verilog_scene: Path) -> None:
    """Memories are named as in the VHDL, modules after their entities; names are unique."""
    text = (verilog_scene / "scene_top.v").read_text()
    modules = re.findall(r"^module (\w+)\n(.*?)^endmodule", text, re.S | re.M)
    names = [name for name, _ in modules]
    assert len(set(names)) == len(names)
    assert not [name for name in names if re.search("[0-9a-f]{20}", name)]
    assert {"raster_refocuser", "moving_sum_array", "moving_sum_stage_1"} <= set(names)
    tables = set()
    for _, body in modules:
        declared = re.findall(r"^ *(?:reg|wire) (?:\[\d+:0\] )?(\w+)(\[)?", body, re.M)
        assert len({name for name, _ in declared}) == len(declared)
        tables |= {name for name, memory in declared if memory}
    assert not [name for name in tables if re.fullmatch(r"n\d+", name)]
    assert {"part_n1_synthesised_memory", "step_of_table", "skip_of_table_2"} <= tables


def test_header_has_the_slices() -> None:
    header = sizes_header(make_plan(load_scene("rgb-480p")), "scene_top")
    assert "`define SCENE_SHIFTS 32'h0004_0000\n" in header
    assert "`define SCENE_COLUMNS 640\n" in header
