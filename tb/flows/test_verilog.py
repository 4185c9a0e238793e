# SPDX-License-Identifier: Apache-2.0
"""A scene in Verilog: the example design around it, in Icarus Verilog and Verilator."""

import re
from pathlib import Path

import pytest

from plenofir.plan import load_scene, make_plan
from plenofir.plan.verilog import sizes_header
from plenofir_tb.flows import EXAMPLES, icarus

FILES = [EXAMPLES / "verilog" / f"{name}.v" for name in ("refocus_button", "tb_refocus_button")]


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
