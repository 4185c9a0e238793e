# SPDX-License-Identifier: Apache-2.0
"""The table of devices, and estimates for each family beside Yosys's counts."""

import json
from importlib.util import find_spec
from pathlib import Path

import pytest

from plenofir.fpga.devices import DEVICES, Usage, device_name
from plenofir.fpga.families import FAMILIES
from plenofir.fpga.hdl import hdl_sources
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.resources.record import load_record
from plenofir.fpga.synthesis import counts
from plenofir.fpga.synthesis.counts import count_cells
from plenofir.fpga.synthesis.placers import PLACERS, open_carries
from plenofir.fpga.tools.synthesis import run_yosys
from plenofir.plan import load_scene, make_plan
from plenofir_studies.counted_cores import COUNTED, counted_cores
from plenofir_studies.few_pins import three_pins
from plenofir_studies.placed_cores import REPORTED, place_core
from plenofir_studies.records import load_builds

CORE = """
module core
  (input  clk,
   input  [3:0] mode,
   input  [31:0] data,
   output reg [31:0] result,
   output reg ready);
  always @(posedge clk) begin
    result <= data + mode;
    ready <= ^data;
  end
endmodule
"""


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("xc7a35t", "xc7a35t"),
        ("XC7A35TICSG324-1L", "xc7a35t"),
        ("xc7a100tcsg324-1", "xc7a100t"),
        ("xc7z020", "xc7z020"),
        ("5ceba4", "5ceba4"),
        ("5CSEBA6U23I7", "5cseba6"),
        ("gw2ar-18", "gw2ar-18"),
        ("gw2a-18", "gw2ar-18"),
        ("GW2AR-LV18QN88C8/I7", "gw2ar-18"),
        ("gw5a-25", "gw5a-25"),
        ("lifcl-40", "lifcl-40"),
        ("LIFCL-40-9", "lifcl-40"),
        ("ccgm1a1", "ccgm1a1"),
        ("xc6slx45-2csg324", "xc6slx45"),
        ("LFE5U-12F-6BG381C", "lfe5u-12f"),
        ("xc7a3500t", "xc7a3500t"),
    ],
)
def test_names_as_people_type_them(typed: str, name: str) -> None:
    assert device_name(typed) == name


def test_every_device_has_all_that_a_plan_needs() -> None:
    for name, device in DEVICES.items():
        assert device_name(device.part) == name
        assert device.total.lut
        assert device.total.ramb16
        assert device.clock_mhz(1)
        assert device.source
        assert bool(device.total.dsp) == bool(FAMILIES[device.family].multipliers)


@pytest.mark.parametrize("family", COUNTED)
def test_estimates_of_a_family(family: str) -> None:
    """Block RAM and multipliers are exact, look-up tables and flip-flops within 15 %."""
    known = load_record().counted[family]
    for name, core in counted_cores():
        counted, usage = known[name].usage, estimate(core.blocks, family)  # type: ignore[arg-type]
        assert (usage.block_rams, usage.dsp) == (counted.block_rams, counted.dsp), name
        assert usage.lut == pytest.approx(counted.lut, rel=0.15), name
        assert usage.flip_flops == pytest.approx(counted.flip_flops, rel=0.15), name


def test_counted_cores_are_those_of_the_comparison() -> None:
    named = {name for name, _ in counted_cores()}
    assert len(named & set(load_record().counted["spartan6"])) >= 30
    assert {e.split()[0] for e in named} == {"fir", "moving_sum"}


def test_cells_of_a_family() -> None:
    usage = count_cells("series7", {"LUT6": 3, "RAM64M": 2, "FDRE": 5, "RAMB36E1": 2}).usage
    assert (usage.lut, usage.flip_flops, usage.block_rams, usage.dsp) == (11, 5, 4, 0)
    assert count_cells("cyclonev", {"MISTRAL_ALUT6": 1, "MISTRAL_ALUT3": 4}).lut == 3


def test_an_ecp5_counts_what_is_left_for_placement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Registers that block RAM has of its own are none, as in what `plan` estimates."""
    cells = {"num_cells_by_type": {"TRELLIS_FF": 3, "DP16KD": 1, "LUT4": 7}}

    def yosys(_commands: object, log: Path, **_files: object) -> None:
        log.with_name("cells.json").write_text(f"stat\n{json.dumps({'design': cells})}")

    moved = iter([2])
    monkeypatch.setattr(counts, "write_verilog", lambda *_: tmp_path / "top.v")
    monkeypatch.setattr(counts, "run_yosys", yosys)
    monkeypatch.setattr(counts, "use_output_registers", lambda _: next(moved))
    found = {f: counts.count(f, [], "top", {}, tmp_path) for f in ("ecp5", "nexus")}
    assert (found["ecp5"].flip_flops, found["ecp5"].lut) == (1, 7)
    assert next(moved, None) is None


STILL = """
name = "still"
[camera]
micro_image_size = 3
[frame]
columns = 640
rows = 480
colour = "grey"
[depth]
slices = ["1/3"]
"""


@pytest.mark.parametrize("name", list(DEVICES))
def test_a_scene_on_any_device(name: str, tmp_path: Path) -> None:
    (tmp_path / "still.toml").write_text(STILL)
    plan = make_plan(load_scene(tmp_path / "still.toml", name))
    assert plan.device == name
    assert list(plan.needs) == list(FAMILIES[DEVICES[name].family].names)
    assert all(plan.needs[what] <= plan.available[what] for what in plan.needs)


def test_placed_cores_keep_the_clocks_that_the_planner_counts_on() -> None:
    placed = {name: cores for name, cores in load_record().placed.items() if name in DEVICES}
    assert set(placed) <= set(PLACERS)
    assert len(placed) >= 3
    for name, cores in placed.items():
        for scene, core in cores.items():
            pixels = make_plan(load_scene(scene.removesuffix(" core"))).core.pixels_per_clock
            assert core.fmax_mhz >= DEVICES[name].clock_mhz(pixels), (name, scene)


def test_three_pins_keep_every_bit(tmp_path: Path) -> None:
    (tmp_path / "core.v").write_text(CORE + three_pins(CORE, "core"))
    run_yosys(
        [
            "read_verilog core.v",
            "hierarchy -check -top few_pins; proc; flatten; simplemap; opt -full; clean",
            # The inputs' register, the result, ready, the register that folds both.
            f"select -assert-count {36 + 32 + 1 + 33} t:$_DFF_P_",
        ],
        tmp_path / "yosys.log",
    )


def test_a_constant_at_a_chain_is_left_open(tmp_path: Path) -> None:
    def cell(carry_in: int, carry_out: int, first: str) -> dict[str, object]:
        return {
            "type": "CCU2",
            "parameters": {"INIT0": first},
            "connections": {"CIN": [carry_in], "COUT": [carry_out]},
        }

    cells = {"first": cell(2, 3, "0xFFFF"), "second": cell(3, 4, "0x00AA")}
    file = tmp_path / "netlist.json"
    file.write_text(json.dumps({"modules": {"core": {"cells": cells}}}))
    open_carries(file)
    found = json.loads(file.read_text())["modules"]["core"]["cells"]
    assert [c["connections"]["CIN"] for c in found.values()] == [["x"], [3]]
    cells["first"] = cell(2, 3, "0x00AA")
    file.write_text(json.dumps({"modules": {"core": {"cells": cells}}}))
    with pytest.raises(AssertionError, match="begins with INIT0"):
        open_carries(file)


def test_amounts_of_ecp5_are_those_of_recorded_builds() -> None:
    for build in load_builds().values():
        device = DEVICES[build.device]
        for kind, amount in device.amounts(device.total).items():
            assert build.utilisation[kind][1] == amount


@pytest.mark.slow
@pytest.mark.parametrize("name", list(PLACERS))
def test_amounts_are_what_nextpnr_counts(name: str, tmp_path: Path) -> None:
    """A counter, placed: the report says what the device has."""
    if find_spec(PLACERS[name].package) is None:
        pytest.skip("nextpnr is not installed (scripts/setup.sh pnr)")
    sources = [path for path in hdl_sources() if path.stem in ("math_pkg", "uart_transmitter")]
    device = DEVICES[name]
    place_core(name, device.family, sources, "uart_transmitter", {"BIT_CLOCKS": 200}, tmp_path)
    there = json.loads((tmp_path / "report.json").read_text())["utilization"]
    lut, flip_flops, blocks, multipliers = (
        there[kinds[0]]["available"] if kinds else 0 for kinds in REPORTED[device.family]
    )
    assert Usage(lut, flip_flops, blocks, dsp=multipliers) == device.total
