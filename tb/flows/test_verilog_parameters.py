# SPDX-License-Identifier: Apache-2.0
"""The Verilog module with parameters of sizes: its example in Icarus, Verilator and Yosys."""

import sys
from pathlib import Path

import pytest

from plenofir import InputError
from plenofir.fpga.tools import yosys_process
from plenofir.plan import load_scene, make_plan
from plenofir.plan.verilog_parameters import MODULE, module_text, write_module
from plenofir_tb.flows import EXAMPLES, Run, icarus

FOLDER = EXAMPLES / "verilog"
DESIGN = FOLDER / "two_cameras.v"
BENCH = [FOLDER / "tb_two_cameras.v", FOLDER / "check_frames.v"]
PASSES = {
    "PASS: 4 frames of 21 x 15 pixels, 3 slices",
    "PASS: 3 frames of 37 x 11 pixels, 2 slices",
}
MISSING = f"{MODULE}_has_no_core_of_these_sizes"


@pytest.fixture(scope="module")
def module(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example's two scenes as one module."""
    plans = [make_plan(load_scene(FOLDER / f"{name}.toml")) for name in ("scene", "wide")]
    return write_module(plans, tmp_path_factory.mktemp("module"))


def yosys(run: Run, *commands: str, status: int = 0) -> str:
    return run(sys.executable, "-m", yosys_process.__name__, *commands, status=status)


def test_both_cameras_in_icarus(need, run: Run, tmp_path: Path, module: Path) -> None:
    need("ghdl", "iverilog")
    found = icarus(run, [FOLDER], [DESIGN, *BENCH, module], tmp_path / "bench")
    assert set(found.splitlines()) == PASSES


def test_both_cameras_by_yosys(need, run: Run, tmp_path: Path, module: Path) -> None:
    """What Yosys makes of the parameters, in the same bench."""
    need("ghdl", "iverilog", "pyosys")
    yosys(
        run,
        f"read_verilog {module} {DESIGN}",
        "prep -top two_cameras",
        "check -assert",
        "write_verilog -noattr netlist.v",
    )
    found = icarus(run, [FOLDER], [tmp_path / "netlist.v", *BENCH], tmp_path / "bench")
    assert set(found.splitlines()) == PASSES


def test_verilator_warns_of_nothing(need, run: Run, module: Path) -> None:
    need("ghdl", "verilator")
    top = ("--top-module", "two_cameras")
    assert "%" not in run("verilator", "--lint-only", "--no-timing", *top, DESIGN, module)


@pytest.mark.slow
def test_both_cameras_in_verilator(need, run: Run, tmp_path: Path, module: Path) -> None:
    need("ghdl", "verilator", "g++")
    run(
        *("verilator", "--binary", "--timing", "-Wno-fatal", "-Wno-lint", "-Wno-style"),
        *("-CFLAGS", "-std=gnu++20"),
        *("-MAKEFLAGS", "CFG_CXXFLAGS_PCH_I=-include OPT_FAST=-O0 PYTHON3=python3"),
        *(f"-I{FOLDER}", "--top-module", "tb_two_cameras", "--Mdir", tmp_path / "model"),
        *(DESIGN, *BENCH, module),
    )
    found = run(tmp_path / "model" / "Vtb_two_cameras")
    assert set(found.splitlines()) > PASSES


def test_sizes_of_no_core_end_in_one_name(need, run: Run, module: Path) -> None:
    need("ghdl", "iverilog", "verilator", "pyosys")
    # No such core, a line too long for the one core of its sizes, frames without lines and with
    # more than the port counts.
    for wrong in ("SLICES=2", "COLUMNS=25", "ROWS=0", "ROWS=65536"):
        top = ("-s", MODULE, "-o", "bench", f"-P{MODULE}.{wrong}")
        assert f"Unknown module type: {MISSING}" in run(
            "iverilog", "-g2005", *top, module, status=1
        )
    lint = ("--lint-only", "--no-timing", "--top-module", MODULE, f"-G{wrong}")
    assert f"module: '{MISSING}'" in run("verilator", *lint, module, status=1)
    hierarchy = f"hierarchy -check -top {MODULE} -chparam {wrong.replace('=', ' ')}"
    found = yosys(run, f"read_verilog {module}", hierarchy, status=1)
    assert f"ERROR: Module `\\{MISSING}'" in found


def test_the_shortest_core_that_is_long_enough() -> None:
    plan = make_plan(load_scene(FOLDER / "scene.toml"))
    longer = plan.core.model_copy(update={"max_columns": 99})
    text = module_text([plan.model_copy(update={"core": longer}), plan])
    assert text.index("COLUMNS <= 24)") < text.index("COLUMNS <= 99)")
    assert text.index(f"{MODULE}_2 core") < text.index(f"{MODULE}_1 core")


@pytest.mark.parametrize(
    ("second", "says"),
    [
        ("rgb-480p", "has the sizes of rgb-480p (MICRO_IMAGE_SIZE 3, "),
        ("lytro1-raw", "has a sensor, "),
        ("stack-1080p", "has all slices at once, "),
    ],
)
def test_scenes_that_no_parameter_chooses(second: str, says: str, tmp_path: Path) -> None:
    plans = [make_plan(load_scene(name, core=True)) for name in ("rgb-480p", second)]
    with pytest.raises(InputError) as error:
        write_module(plans, tmp_path)
    assert str(error.value).startswith(f"{second}: {says}")
    assert not list(tmp_path.iterdir())
