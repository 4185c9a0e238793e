# SPDX-License-Identifier: Apache-2.0
"""Checks of the bitstream's sources and constraints: the board passes, planted faults are found."""

import re
from collections import Counter
from pathlib import Path

import pytest

from bitstream_check import checks as check
from bitstream_check.clock_nets import read_netlist
from bitstream_check.clock_routing import GlobalBuffer, can_place, check_clock_routing
from bitstream_check.sites import device, pins
from bitstream_check.ucf import read_constraints
from plenofir.fpga import hdl
from plenofir.fpga.bitstream import top_level
from plenofir.ground import project
from plenofir.ground.errors import InputError

UCF = check.constraints_file().read_text()
SOURCES = {path.stem: path.read_text() for path in hdl.board_sources()}


def problems(tmp_path: Path, ucf: str = UCF, **changed: str) -> list[str]:
    """What the checks say of a constraint file, and of sources some of which are changed."""
    path = tmp_path / "board.ucf"
    path.write_text(ucf)
    sources = {**SOURCES, **changed}
    netlist = read_netlist(top_level.TOP, sources)
    constraints = read_constraints(path)
    return [
        *check.check_pins(constraints, sources[top_level.TOP]),
        *check.check_clocks(constraints, netlist, sources[top_level.TOP]),
        *check.check_serial_banks(constraints, netlist),
        *check_clock_routing(constraints, netlist),
    ]


def replaced(text: str, pattern: str, new: str) -> str:
    out, number = re.subn(pattern, new, text, count=1, flags=re.M)
    assert number == 1, pattern
    return out


def without(pattern: str) -> str:
    return replaced(UCF, rf"^.*{pattern}.*\n", "")


def test_board_passes(tmp_path: Path) -> None:
    assert problems(tmp_path) == []


@pytest.mark.parametrize(
    ("ucf", "found"),
    [
        pytest.param(without(r'NET "uart_rx"'), "port uart_rx has no LOC", id="port"),
        pytest.param(without(r'NET "led<3>"'), "port led<3> has no LOC", id="bit"),
        pytest.param(
            UCF + 'NET "led<8>" LOC = "V16" | IOSTANDARD = LVCMOS33;',
            "pin led<8> is no port of atlys_top",
            id="no-port",
        ),
        pytest.param(
            replaced(UCF, '(NET "button_up".*)"N4"', r'\1"P3"'),
            "ball P3 is used by button_up and button_down",
            id="twice",
        ),
        pytest.param(
            UCF + 'NET "uart_rx" LOC = "A15";', "pin uart_rx has several LOC", id="two-pins"
        ),
        pytest.param(replaced(UCF, '"U18"', '"I18"'), "led<0>: I18 is no ball of CSG324", id="I"),
        pytest.param(replaced(UCF, '"U18"', '"U19"'), "led<0>: U19 is no ball of CSG324", id="19"),
        pytest.param(
            replaced(UCF, '"U18"', '"A1"'), "led<0>: ball A1 is GND, no I/O pin", id="ground"
        ),
        pytest.param(
            replaced(UCF, '"U18"', '"A17"'), "led<0>: ball A17 is TCK, no I/O pin", id="jtag"
        ),
        pytest.param(
            replaced(UCF, r'(LOC = "U18") \| IOSTANDARD = LVCMOS33', r"\1"),
            "port led<0> has no IOSTANDARD",
            id="standard",
        ),
        pytest.param(
            replaced(UCF, r'(NET "button_up".*)LVCMOS18', r"\1LVCMOS33"),
            "bank 3: button_up needs 3.3 V, button_down 1.8 V",
            id="supply",
        ),
        pytest.param(
            replaced(UCF, '"U18" . IOSTANDARD = LVCMOS33', '"U18" | IOSTANDARD = LVTTL'),
            "led<0>: LVTTL is none of LVCMOS33, LVCMOS25, LVCMOS18, TMDS_33",
            id="unknown-standard",
        ),
        pytest.param(
            replaced(replaced(UCF, '"K17"', '"K99"'), '"K18"', '"K17"').replace("K99", "K18"),
            "in_data_p<0>, in_data_n<0>: K18 and K17 are no P and N of a pair",
            id="swapped",
        ),
        pytest.param(
            replaced(replaced(UCF, '"A6"', '"C99"'), '"C8"', '"A6"').replace("C99", "C8"),
            "out_clk_p, out_clk_n: B6 and C8 are no P and N of a pair",
            id="mixed",
        ),
        pytest.param(
            replaced(replaced(UCF, '"B6"', '"G16"'), '"A6"', '"G18"'),
            "out_clk_p: bank 1 has no TMDS_33 drivers",
            id="drivers",
        ),
        pytest.param(
            replaced(replaced(UCF, '"K17"', '"D11"'), '"K18"', '"C11"'),
            "receive_clocks/bit_buffer: serialisers in banks 0 (in_data_p<0>) and 1 "
            "(in_data_p<1>), a BUFPLL reaches one",
            id="bufpll",
        ),
        pytest.param(without("CONFIG"), "in_clk_p: TMDS_33 needs CONFIG VCCAUX = 3.3", id="aux"),
        pytest.param(
            replaced(UCF, '(NET "clk_100" +LOC = )"L15"', r'\1"M14"').replace(
                '"led<1>"         LOC = "M14"', '"led<1>"         LOC = "L15"'
            ),
            "clock clk_100: ball M14 (IO_L53P_1) is no clock input",
            id="clock-pin",
        ),
        pytest.param(without('PERIOD "control"'), "clock clk_100 has no period", id="period"),
        pytest.param(without('PERIOD "tmds"'), "clock tx_clk_x2 has no period", id="derived"),
        pytest.param(
            UCF.replace('"clk" ', '"pixel_clk" '),
            "TNM_NET pixel_clk is no net of atlys_top",
            id="net",
        ),
        pytest.param(
            replaced(UCF, 'TIMEGRP "receive"', 'TIMEGRP "received"'),
            "group receive is not declared",
            id="group",
        ),
        pytest.param(
            without("TS_receive_to_transmit"),
            "path/transmitter/crossing: no limit from clk to tx_clk",
            id="elastic",
        ),
        pytest.param(
            without("TS_counted_to_control"),
            "control/meter: no limit from tmds_clk_global to clk_100",
            id="meter",
        ),
        pytest.param(
            without("TS_receive_to_control"),
            "control/report_from_pixels/crossing: no limit from clk to clk_100",
            id="bus",
        ),
        pytest.param(
            replaced(UCF, r'(TO "transmit") 13.468', r"\1 13.5"),
            "path/transmitter/crossing: 13.5 ns from clk to tx_clk, 13.468 at most",
            id="long",
        ),
        pytest.param(
            replaced(UCF, r'(TO "receive" +)10 ns', r"\1 10.1 ns"),
            "control/settings_to_pixels/bus_of_settings: 10.1 ns from clk_100 to clk, 10 at most",
            id="long-copy",
        ),
        pytest.param(
            UCF + 'TIMESPEC "TS_back" = FROM "control" TO "counted" 10 ns DATAPATHONLY;',
            "limit from control to counted: no crossing goes that way",
            id="idle",
        ),
        pytest.param(
            UCF + 'TIMESPEC "TS_own" = FROM "receive" TO "pixels" 10 ns DATAPATHONLY;',
            "limit from receive to pixels: they share a clock",
            id="own",
        ),
        pytest.param(
            UCF.replace("13.468", "15"),
            "receive_clocks/pll: CLKIN1_PERIOD is 13.468 ns, the constraint 15 ns",
            id="pll",
        ),
        pytest.param(
            without(r'NET "led<\*>" +TIG'),
            "port led<0> is in no constraint of timing, not even a TIG",
            id="untimed",
        ),
        pytest.param(UCF + 'NET "in_clk_n" TIG;', "TIG of in_clk_n: a clock", id="untimed-clock"),
        pytest.param(
            UCF + 'NET "tmds_clk" TIG;',
            "TIG of tmds_clk: no port, and no signal that keeps its name",
            id="untimed-net",
        ),
    ],
)
def test_constraint_faults(tmp_path: Path, ucf: str, found: str) -> None:
    assert found in problems(tmp_path, ucf)


# The board's clock input as it once was: one BUFIO2 for a BUFG and a BUFGMUX.
ONE_BUFIO2 = re.sub(
    r"  counted_way : .*?;\n\n",
    "",
    SOURCES["clock_input"].replace("i => counted", "i => clk"),
    flags=re.S,
)


@pytest.mark.parametrize(
    ("entity", "text", "found"),
    [
        pytest.param(
            "clock_input",
            ONE_BUFIO2,
            "clock_pins/net: no clock multiplexer that tmds_clk reaches, beside "
            "clock_select/choose",
            id="one-bufio2",
        ),
        pytest.param(
            "clock_input",
            SOURCES["clock_input"].replace("i => counted", "i => from_pins"),
            "clock_pins/net: no way from ibufds.o of clock_pins/pins to i",
            id="no-bufio2",
        ),
        pytest.param(
            "pixel_clock_select",
            SOURCES["pixel_clock_select"].replace("i1 => own_clk", "i1 => clk_100"),
            "clock_select/choose: no way from pin to i1",
            id="buffer-behind-buffer",
        ),
        pytest.param(
            "serial_clocks",
            SOURCES["serial_clocks"].replace("=> pll_bit,\n      gclk", "=> pll_half,\n      gclk"),
            "receive_clocks/bit_buffer: no way from pll_adv.clkout2 of receive_clocks/pll to pllin",
            id="slow-output",
        ),
        pytest.param(
            "serial_clocks",
            SOURCES["serial_clocks"].replace(
                "gclk         => half_clk", "gclk         => pll_half"
            ),
            "receive_clocks/bit_buffer: no way from pll_adv.clkout2 of receive_clocks/pll to gclk",
            id="no-global",
        ),
        pytest.param(
            "atlys_top",
            SOURCES["atlys_top"].replace(
                "clk_in        => source_clk", "clk_in        => tmds_clk"
            ),
            "",
            id="bufio2-to-pll",
        ),
        pytest.param(
            "serial_clocks",
            replaced(SOURCES["serial_clocks"], r"clkin1 +=> clk_in", "clkin1 => gated"),
            "receive_clocks/pll: no way from logic or a port to clkin1",
            id="logic",
        ),
    ],
)
def test_clock_routing_faults(tmp_path: Path, entity: str, text: str, found: str) -> None:
    assert text != SOURCES[entity]
    given = problems(tmp_path, **{entity: text})
    assert found in given if found else not any("no way" in line for line in given)


def test_locked_of_another_pll(tmp_path: Path) -> None:
    """A BUFPLL takes its clock and the signal that it is locked from one PLL."""
    clocks = replaced(SOURCES["serial_clocks"], r"pllin +=> pll_bit", "pllin => other")
    clocks = replaced(
        clocks, r"^    clk_in : in    std_logic;", "    clk_in, other : in std_logic;"
    )
    clocks = clocks.replace("    locked : out", "    bit_out : out   std_logic;\n    locked : out")
    clocks = replaced(clocks, r"clkout0 +=> pll_bit", "clkout0 => bit_out")
    top = SOURCES["atlys_top"]
    for mine, other in (("receive", "transmit"), ("transmit", "receive")):
        top = replaced(
            top,
            rf"({mine}_clocks : entity work.serial_clocks\n    port map \(\n)",
            rf"\1      other         => {other}_bit,\n      bit_out       => {mine}_bit,\n",
        )
    given = problems(tmp_path, serial_clocks=clocks, atlys_top=top)
    assert "receive_clocks/bit_buffer: pllin and locked come from two PLLs" in given


def buffers(*inputs: tuple[tuple[str, str], ...]) -> list[GlobalBuffer]:
    """Buffers whose inputs are nets at the BUFIO2s of a clock pin, or of a PLL (no pin)."""
    lines = {"": frozenset(range(16))} | {ball: pins()[ball].clock_lines for ball in CLOCK_BALLS}
    return [
        GlobalBuffer(f"b{n}", tuple((("", net), lines[ball]) for net, ball in pairs))
        for n, pairs in enumerate(inputs)
    ]


CLOCK_BALLS = ("H17", "L15", "K15", "B9", "R10", "K4")


def test_lines_of_clock_pins() -> None:
    """Two groups at each edge; banks 0 and 1 share lines 0 to 7, banks 2 and 3 lines 8 to 15."""
    assert {ball: sorted(pins()[ball].clock_lines) for ball in CLOCK_BALLS} == {
        "H17": [2, 3, 6, 7],
        "L15": [0, 1, 4, 5],
        "K15": [2, 3, 6, 7],
        "B9": [2, 3, 6, 7],
        "R10": [8, 9, 12, 13],
        "K4": [10, 11, 14, 15],
    }


@pytest.mark.parametrize(
    ("wanted", "possible"),
    [
        pytest.param([(("a", "H17"),)] * 2, False, id="a BUFIO2 has one BUFG"),
        pytest.param([((n, "H17"),) for n in "abcd"], True, id="four BUFIO2s of a pin"),
        pytest.param([((n, "H17"),) for n in "abcde"], False, id="not five"),
        pytest.param(
            [(("a", "H17"),), (("b", "H17"),), (("c", "B9"),), (("d", "B9"),), (("e", "K15"),)],
            False,
            id="pins of banks that share lines",
        ),
        pytest.param([(("a", "H17"), ("b", "L15"))], True, id="pins of two groups"),
        pytest.param([(("a", "H17"), ("b", "H17"))], True, id="two BUFIO2s of a pin"),
        pytest.param([(("a", "H17"), ("b", "R10"))], False, id="pins of far edges"),
        pytest.param([(("a", "H17"), ("p", "")), (("p", ""), ("a", "H17"))], True, id="neighbours"),
        pytest.param([(("a", "H17"), ("p", "")), (("q", ""), ("a", "H17"))], False, id="two more"),
        pytest.param([(("p", ""),)] * 16, True, id="sixteen of a PLL"),
        pytest.param([(("p", ""),)] * 17, False, id="seventeen"),
        pytest.param([(("p", ""), ("q", ""))] * 8, True, id="a choice for each two"),
        pytest.param([(("p", ""), ("q", ""))] * 9, False, id="nine choices"),
    ],
)
def test_places(wanted: list[tuple[tuple[str, str], ...]], possible: bool) -> None:
    assert can_place(buffers(*wanted)) == possible


def test_new_port_without_pin(tmp_path: Path) -> None:
    top = replaced(
        SOURCES[top_level.TOP],
        r"^    uart_tx ",
        "    beeper         : out   std_logic;\n    uart_tx ",
    )
    assert problems(tmp_path, atlys_top=top) == [
        "port beeper has no LOC",
        "port beeper has no IOSTANDARD",
        "port beeper is in no constraint of timing, not even a TIG",
    ]


def test_name_of_net_not_kept(tmp_path: Path) -> None:
    top = replaced(SOURCES[top_level.TOP], r"^  attribute keep of clk .*\n", "")
    assert problems(tmp_path, atlys_top=top) == [
        "TNM_NET clk: without the attribute keep its name may vanish"
    ]


def test_clock_of_no_constraint(tmp_path: Path) -> None:
    """A register on a clock that no period reaches, deep in the design."""
    meter = replaced(
        SOURCES["clock_meter"],
        r"^  divided\(0\) <= ",
        "  slow : process (divided(0)) is\n  begin\n    if rising_edge(inner) then\n"
        "    end if;\n  end process slow;\n\n  divided(0) <= ",
    )
    assert problems(tmp_path, clock_meter=meter) == ["clock control/meter/inner has no period"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('NET "a" LOC = "A2"', "no ; behind"),
        ('NET "a" LOCK = "A2";', "'LOCK = \"A2\"' is not understood"),
        ('NET "a" PULLUP = 3;', "is not understood"),
        ('TIMESPEC "TS_a" = PERIOD "a" 10 MHz HIGH 50 %;', "is not understood"),
        ('TIMESPEC "TS_a" = FROM "a" TO "b" 5 ns;', "is not understood"),
        ('TIMESPEC "TS_a" = FROM "a" TO "b" TIG;', "use CONFIG, NET"),
    ],
)
def test_constraint_syntax(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.ucf"
    path.write_text(f"CONFIG VCCAUX = 3.3;\n{text}\n")
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        read_constraints(path)
    assert caught.value.where == f"{path}:2"


def test_constraints_of_the_core_are_understood() -> None:
    folder = project.root() / "constraints"
    assert read_constraints(folder / "raster_refocuser.ucf").periods == {"clk": 13.468}


def test_package() -> None:
    """The grid, and what the device has of I/O pins (DS160)."""
    letters = "ABCDEFGHJKLMNPRTUV"
    assert set(pins()) == {f"{a}{i}" for a in letters for i in range(1, 19)}
    io = [pin for pin in pins().values() if pin.is_io]
    assert len(io) == device().sites["IOB"]
    assert len({pin.name for pin in io}) == len(io)
    sides = Counter((pin.bank, pin.pair, pin.is_positive) for pin in io)
    assert set(sides.values()) == {1}
    assert {(bank, pair) for bank, pair, _ in sides} == {
        (bank, pair) for bank, pair, positive in sides if positive
    }
    assert sum(pin.is_clock for pin in io) == 32


def test_sites() -> None:
    assert check.check_sites({"pll_adv": 4, "bufg": 15, "bufgmux": 1, "iserdes2": 376}) == []
    assert check.check_sites({"pll_adv": 5}) == ["5 PLL_ADV, the device has 4"]
    assert check.check_sites({"bufg": 16, "bufgmux": 1}) == ["17 BUFG, the device has 16"]
    assert check.check_sites({"mmcme2_adv": 1}) == ["mmcme2_adv is no primitive of the device"]
    assert check.check_sites({"ibufds": 100, "obufds": 10}) == ["220 IOB, the device has 218"]


def test_project() -> None:
    lines = top_level.project_lines()
    assert check.check_project(lines) == []
    first, last = check.source_of_line(lines[0]), check.source_of_line(lines[-1])
    assert last == top_level.top_source()
    assert check.check_project(lines[1:]) == [f"{first} is missing"]
    assert check.check_project([*lines, lines[0]]) == [f"{first} is listed twice"]
    model = hdl.model_sources()[0]
    other = Path("/nowhere/a.vhd")
    assert check.check_project([*lines, f'vhdl work "{model}"', f'vhdl work "{other}"']) == [
        f"{other}: no such file",
        f"{model} is no synthesisable source",
        f"{other} is no synthesisable source",
    ]
    with pytest.raises(InputError, match="project file"):
        check.check_project(["verilog work a.v"])


def test_options(tmp_path: Path) -> None:
    folder = project.root() / "scripts" / "ise"
    assert check.check_options(folder) == []
    for name in check.OPTION_FILES:
        (tmp_path / name).write_text((folder / name).read_text())
    (tmp_path / "par.opt").unlink()
    with (tmp_path / "map.opt").open("a") as file:
        file.write("-ol std\n")
    with (tmp_path / "xst.opt").open("a") as file:
        file.write("set -opt_mode Area\n")
    found = check.check_options(tmp_path)
    assert "map.opt: -ol is there twice" in found
    assert any(line.startswith(f"{tmp_path}/par.opt: no such file") for line in found)
    assert any("'set -opt_mode Area' is not an option" in line for line in found)
    assert len(found) == 3
