# SPDX-License-Identifier: Apache-2.0
"""Asserts at run time: each ends the simulation of a bench that breaks the promise on purpose."""

import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import write_verilog
from plenofir.plan.configure import needed_sources


@dataclass(frozen=True)
class Promise:
    """An entity, how a bench uses it, and what it says when the promise is broken or kept."""

    entity: str
    generics: str
    ports: str  # beside clocks; `number` counts the clocks of clk
    message: str


# `odd` is what a bench does differently: 0 keeps the promise.
PROMISES = (
    Promise(
        "gray_crossing",
        "WIDTH => 4",
        "clk_in => clk, clk_out => other, count_out => open,count_in => count",
        "gray_crossing: the count moved by more than one",
    ),
    Promise(
        "crossing_fifo",
        "WIDTH => 2, ADDRESS_BITS => 2",
        "write_clk => clk, write_enable => write, write_word => pair, full => full,"
        "nearly_full => open, read_clk => other, read_drop => low, read_valid => open,"
        "read_ready => low, read_word => open",
        "crossing_fifo: a word came while the FIFO was full",
    ),
    Promise(
        "axis_fifo",
        "WIDTH => 2, ADDRESS_BITS => 2, MUST_FIT => true",
        "clk => clk, reset => low, s_axis_tvalid => write, s_axis_tready => ready,"
        "s_axis_tdata => pair, m_axis_tvalid => open, m_axis_tready => low,"
        "m_axis_tdata => open, level => open",
        "a word came while the FIFO was full",
    ),
    Promise(
        "row_scatter",
        "PARALLEL_ROWS => 1, MAX_COLUMNS => 4, DATA_BITS => 2, SLICE_BITS => 0, UNDER_WAY => 3",
        "clk => clk, reset => low, results(0) => result, data => pair, m_axis_tvalid => open,"
        "m_axis_tready => low, m_axis_tdata => open, m_axis_tuser => open, m_axis_tid => open,"
        "m_axis_tlast => open, credit => credit, drained => open",
        "a word came while the FIFO was full",
    ),
    Promise(
        "raw_unpacker",
        "LANES => 1, PIXEL_BITS => 8, WORD_PIXELS => 1",
        'clk => clk, payload => payload, payload_data => x"00", word => open, word_data => open',
        "raw_unpacker: bytes came in the clock behind a line's end",
    ),
    Promise(
        "clock_meter",
        "WINDOW => 20",
        "clk => clk, measured_clk => fast, count => open, updated => open",
        "clock_meter: measured_clk is not slower than 4 times clk",
    ),
    Promise(
        "stream_shell",
        "MAX_COLUMNS => 4, IN_BITS => 2, OUT_BITS => 2, COLUMN_DELAY => 0, ENGINE_LATENCY => 3,"
        "MIN_STEPS => 4",
        "clk => clk, reset => low, order => order, s_axis_marks => marks, s_axis_tready => ready,"
        "s_axis_tdata => pair, m_axis_marks => open, m_axis_tready => high, m_axis_tdata => open,"
        "m_axis_tid => open, error_flags => open, error_clear => low, token => token,"
        "token_rows => open, token_data => open, line_end => open, results(0) => result,"
        "result_data => pair",
        "a result came later than ENGINE_LATENCY tells",
    ),
    Promise(
        "load_crossing",
        "",
        "clk => clk, reset => low, port_write => write, port_word => word, port_busy => full,"
        "seen => seen, pixel_clk => other, load_word => open, load_toggle => seen",
        "load_crossing: a word came while port_busy",
    ),
)

BENCH = """
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
library work;
{packages}
entity bench is
  generic (odd : natural);
end entity bench;
architecture simulated of bench is
  constant low : std_logic := '0';
  constant high : std_logic := '1';
  constant pair : std_logic_vector(1 downto 0) := "01";
  signal clk, other, fast, write, full, ready, credit : std_logic := '0';
  signal number : natural := 0;
{signals}
begin
  clk <= not clk after 5 ns when number < 150 else '0';
  other <= not other after 7 ns when number < 150 else '0';
  -- 2.5 or 10 times the frequency of clk.
  fast <= not fast after (2000 - 1500 * odd) * 1 ps when number < 150 else '0';
  write <= '1' when number > 3 and (full = '0' or odd = 1) and (ready = '1' or odd = 1) else '0';
  number <= number + 1 when rising_edge(clk);
{statements}
  unit : entity work.{entity}
    {generics}
    port map ({ports});
end architecture simulated;
"""
# What single entities need beside that: packages, signals, statements.
OWN = {
    "gray_crossing": (
        "",
        "  signal count : unsigned(3 downto 0);",
        "  count <= to_unsigned((number + odd * (number / 9)) mod 16, 4);",
    ),
    "stream_shell": (
        "use work.token_pkg.all;",
        '  constant order : frame_order_t := (x"0004", x"0002", x"00", \'0\', x"00");'
        "  signal marks : marks_t := ('0', \"0\", '0');"
        "  signal token : token_t;"
        "  signal result : result_t := NO_RESULT;"
        '  signal strobes : std_logic_vector(1 to 4) := "0000";',
        # Four pixels, then a pause.
        "  marks.tvalid <= '1' when number > 3 and number mod 16 < 4 else '0';"
        '  marks.tuser <= "1" when number mod 32 = 16 else "0";'
        "  marks.tlast <= '1' when number mod 16 = 3 else '0';"
        "  strobes <= token.strobe & strobes(1 to 3) when rising_edge(clk);"
        "  result.valid <= strobes(3 + odd);",
    ),
    "load_crossing": (
        "use work.resample_pkg.all;",
        "  signal seen : std_logic; signal word : load_word_t := (others => '0');",
        "  ready <= '1';",
    ),
    "crossing_fifo": ("", "", "  ready <= '1';"),
    "row_scatter": (
        "use work.token_pkg.all;",
        "  signal result : result_t := NO_RESULT;",
        "  result.valid <= '1' when number > 3 and (credit = '1' or odd = 1) else '0';",
    ),
    "raw_unpacker": (
        "use work.csi_pkg.all;",
        "  signal payload : payload_t := ('0', 0, '0');",
        "  payload.bytes <= 1;"
        "  payload.ends <= '1' when number mod 8 = 7 else '0';"
        "  payload.valid <= '1' when number mod 8 > 1 or (odd = 1 and number > 7) else '0';",
    ),
}


@pytest.mark.parametrize("promise", PROMISES, ids=lambda promise: promise.entity)
def test_a_broken_promise_ends_the_simulation(promise: Promise, tmp_path: Path) -> None:
    packages, signals, statements = OWN.get(promise.entity, ("", "", ""))
    bench = tmp_path / "bench.vhd"
    bench.write_text(
        BENCH.format(
            packages=packages,
            signals=signals,
            statements=statements,
            entity=promise.entity,
            generics=f"generic map ({promise.generics})" if promise.generics else "",
            ports=promise.ports,
        )
    )
    sources = needed_sources(bench.read_text(), "bench", hdl.all_sources())
    # A board's words cross only in a build with a sensor.
    (sensor,) = (source for source in hdl.all_sources() if source.stem == "sensor_pkg")
    built = re.sub("(WITH_SENSOR +: boolean +:=) false", r"\1 true", sensor.read_text())
    sources = hdl.with_packages(sources, {"sensor_pkg": built}, tmp_path)
    environment = {**os.environ, **find_simulator("ghdl", brief=True).environment}

    def ghdl(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["ghdl", *arguments],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )

    done = ghdl("-a", "--std=93", *map(str, sources), "bench.vhd")
    assert not done.returncode, done.stderr
    said = {}
    for odd in ("0", "1"):
        done = ghdl(
            "--elab-run", "--std=93", "bench", f"-godd={odd}", "--ieee-asserts=disable-at-0"
        )
        said[odd] = (done.returncode, done.stdout + done.stderr)
    assert said["0"] == (0, "")
    assert said["1"][0]
    assert promise.message in said["1"][1]


@pytest.mark.parametrize(
    ("top", "generics"), [("csi_receiver", {"LANES": 2, "PIXEL_BITS": 10}), ("clock_meter", {})]
)
def test_synthesis_ignores_promises(top: str, generics: dict[str, int], tmp_path: Path) -> None:
    (own,) = (path for path in hdl.all_sources() if path.stem == top)
    sources = [*needed_sources(own.read_text(), top, hdl.all_sources()), own]
    assert any("synthesis translate_off" in source.read_text() for source in sources)
    verilog = write_verilog(sources, top, generics, tmp_path).read_text()
    assert "$fatal" not in verilog


def test_every_promise_is_broken_once() -> None:
    """Asserts of processes: those of packages refuse generics."""
    promising = {
        source.stem
        for source in hdl.all_sources()
        if re.search(r"^architecture[^;]*$.*^ +assert ", source.read_text(), re.M | re.S)
    }
    assert promising == {promise.entity for promise in PROMISES} - {"row_scatter"}
