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
    Promise(
        "moving_sum_control",
        "GEOMETRY => G",
        "clk => clk, reset => low, advance => high, first => first, live => high, slice => NONE,"
        "ring => open, age_3 => open, choice_3 => open, command_3 => open",
        "moving_sum_control: a line began less than output_delay + 1 steps behind the one before",
    ),
    Promise(
        "lane_control",
        "BUILD => to_lanes(G, 2, 1, 8)",
        "clk => clk, reset => low, strobe => high, first => first, live => high, slice => NONE,"
        "write_1 => open, fresh_1 => open, ahead_1 => open, held_1 => open, read_1 => open",
        "lane_control: a line began less than lane_delay + 1 tokens behind the one before",
    ),
    Promise(
        "index_vote",
        "BUILD => BUILD",
        "clk => clk, reset => low, active => active, lens => lens, index => NONE, most => FEW,"
        "least => FEW, live => high, same => ROWS, starts => low, voted_write => open,"
        "voted_lens => open, voted_index => open, voted_kept => open",
        "index_vote: a scan began less than vote_latency clocks behind the one before",
    ),
    Promise(
        "lane_merge",
        "LANES => 1",
        "clk => clk, lane_valid(0) => valid, lane_sync(0) => sync, lane_data => BYTE,"
        "word_first => open, word_live => open, word_data => open, lane_missing => open",
        "lane_merge: a lane has a sync in the midst of a burst",
    ),
    Promise(
        "sensor_setup",
        'REGISTERS => "010001", QUARTER => 3',
        "clk => clk, reset => low, scl => scl, sda => high, scl_low => scl_low, sda_low => open,"
        "start => start, busy => open, done => open, fault => open, entry => open,"
        "retried => open",
        "sensor_setup: start came while busy",
    ),
    Promise(
        "i2c_master",
        "QUARTER => 3, STRETCH => 9",
        "clk => clk, reset => low, scl => high, sda => high, scl_low => open, sda_low => open,"
        "order => order, result => open",
        "i2c_master: an order went before it was over",
    ),
    Promise(
        "i2c_reader",
        "QUARTER => 3",
        "clk => clk, reset => low, scl => scl, sda => high, scl_low => scl_low, sda_low => open,"
        "start => start, next_byte => high, more => low, valid => open, data => open,"
        "done => open, complete => open, stuck => open",
        "i2c_reader: start came while a read was under way",
    ),
    Promise(
        "timing_rate",
        "",
        "clk => clk, reset => low, start => start, pixel_clock => CLOCK, line_length => LONG,"
        "frame_lines => LONG, rate => open, done => open",
        "timing_rate: start came while a rate was computed",
    ),
    Promise(
        "row_gather",
        "PARALLEL_ROWS => 2, MAX_COLUMNS => 4, DATA_BITS => 2",
        "clk => clk, reset => low, token => token, token_row => 0, token_data => pair,"
        "array_token => open, array_image => open, array_data => open",
        "row_gather: a line is longer than MAX_COLUMNS",
    ),
    Promise(
        "lens_registers",
        "NEEDED => 1",
        "clk => clk, load => NO_LOAD, incomplete => open, frame_accepted => accepted,"
        "frame_start => start, copy => low, copied => open, registers => open",
        "lens_registers: a frame began that was not accepted before",
    ),
    Promise(
        "word_sender",
        "WORD_PIXELS => 1, DATA_BITS => 8",
        "clk => clk, word => word, word_data => BYTE, frame_starts => low, events => NONE,"
        "left_identifier => BYTE, full => full, nearly_full => ready, write_enable => open,"
        "write_word => open, write_data => open",
        "word_sender: full came without nearly_full",
    ),
    Promise(
        "pixel_stream",
        "WORD_PIXELS => 2, PIXELS_PER_CLOCK => 1, PIXEL_BITS => 8",
        "clk => clk, reset => low, columns => SIZE, rows => SIZE, word_valid => write,"
        "word_ready => ready, word => word, word_data => SIZE, m_axis_tvalid => open,"
        "m_axis_tready => high, m_axis_tdata => open, m_axis_tuser => open, m_axis_tlast => open,"
        "faults => open",
        "pixel_stream: a word within a line is not full",
    ),
    Promise(
        "report_crossing",
        "",
        "pixel_clk => clk, state => state, lanes => lanes, clk => other, state_here => open,"
        "lanes_here => open, clear => low, hung_counts => open",
        "report_crossing: a delay line hung again before its last toggle had arrived",
    ),
    Promise(
        "stack_columns",
        "GEOMETRY => G, COLUMNS => 4, LANES => 1, LANE_BITS => 8",
        "clk => clk, reset => low, token => token, data => BYTE, out_token => open,"
        "out_data => open",
        "stack_columns: frames begin too few lines apart, or no multiple of M lines",
    ),
)

BENCH = """
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
library work;
{packages}
entity {entity}_bench is
  generic (odd : natural);
end entity {entity}_bench;
architecture simulated of {entity}_bench is
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
# Lines that begin as soon as they may.
LINES = (
    'constant G : geometry_t := geometry_of("bench", 3, "-4 4", false);'
    'constant NONE : unsigned(0 downto 0) := "0"; signal first : std_logic;'
)
# An order while the one before is carried out.
ORDERS = "start <= '1' when number = 5 or (odd = 1 and number = 20) else '0'; scl <= not scl_low;"
# What single entities need beside that: packages, signals, statements.
OWN = {
    "moving_sum_control": (
        "use work.refocus_pkg.all;",
        LINES,
        "first <= '1' when number mod (G.output_delay + 1 - odd) = 0 else '0';",
    ),
    "lane_control": (
        "use work.refocus_pkg.all; use work.sum_lanes_pkg.all;",
        LINES,
        "first <= '1' when number mod (lane_delay(G, 2) + 1 - odd) = 0 else '0';",
    ),
    "index_vote": (
        "use work.index_pkg.all;",
        "constant BUILD : index_build_t := (micro_image_size => 2, slices => 2, boxes => 1,"
        "pixels => 1, shifts => (others => 0), columns => 8,"
        "tokens => 8, lenses => 4, channels => 1, pixel_bits => 2, pixel_width => 2, radius => 0,"
        "vote_radius => 1, confidence => 1, cropped => false, between => false, picture => true,"
        "chosen_too => false, sum_bits => 4, row_bits => 4, sharpness_bits => 4, ring_lines => 2,"
        "stack_width => 4, index_latency => 8);"
        'constant NONE : unsigned(0 downto 0) := "0"; constant FEW : unsigned(3 downto 0) := x"1";'
        'constant ROWS : std_logic_vector(2 downto 0) := "111";'
        "signal active : std_logic; signal lens : unsigned(1 downto 0);",
        # Four micro images, and as many clocks as the votes take.
        "lens <= to_unsigned(number mod (12 - odd) mod 4, 2);"
        "active <= '1' when number mod (12 - odd) < 4 else '0';",
    ),
    "lane_merge": (
        "",
        'constant BYTE : std_logic_vector(7 downto 0) := x"00"; signal valid, sync : std_logic;',
        "valid <= '1' when number mod 8 > 0 or odd = 1 else '0';"
        "sync <= '1' when number mod 8 = 1 else '0';",
    ),
    "sensor_setup": ("", "signal start, scl, scl_low : std_logic;", ORDERS),
    "i2c_master": (
        "use work.i2c_pkg.all;",
        "signal order : i2c_order_t := ('0', '0', '0', '0', x\"00\", '0');",
        "order.receive <= '0' when number > 8 and odd = 1 else '1';",
    ),
    "i2c_reader": ("", "signal start, scl, scl_low : std_logic;", ORDERS),
    "timing_rate": (
        "",
        'constant CLOCK : std_logic_vector(15 downto 0) := x"0001";'
        "constant LONG : unsigned(12 downto 0) := (others => '1');"
        "signal start, scl : std_logic; constant scl_low : std_logic := '0';",
        ORDERS,
    ),
    "row_gather": (
        "use work.token_pkg.all;",
        "signal token : token_t := NO_TOKEN;",
        "token.strobe <= '1'; token.pixel <= '1';"
        "token.line_first <= '1' when number mod (4 + odd) = 0 else '0';",
    ),
    "lens_registers": (
        "use work.resample_pkg.all;",
        "constant NO_LOAD : load_t := ('0', \"00\", (others => '0'), (others => '0'));"
        "signal accepted, start : std_logic;",
        "accepted <= '1' when number mod 8 = 2 else '0';"
        "start <= '1' when number mod 8 = 3 - odd else '0';",
    ),
    "word_sender": (
        "use work.csi_pkg.all;",
        "constant NONE : events_t := (others => '0');"
        'constant BYTE : std_logic_vector(7 downto 0) := x"00";'
        "constant word : unpacked_t := ('0', 0, '0');",
        "full <= '1' when number > 20 else '0'; ready <= full when odd = 0 else '0';",
    ),
    "pixel_stream": (
        "use work.csi_pkg.all;",
        'constant SIZE : std_logic_vector(15 downto 0) := x"0004"; signal word : crossing_t;',
        "word.has_pixels <= '1'; word.ends <= '1' when number mod 4 = 3 else '0';"
        "word.first <= '0'; word.events <= (others => '0'); word.last <= 1 - odd;",
    ),
    "report_crossing": (
        "use work.hdmi_pkg.all;",
        "signal state : video_state_t; signal lanes : lanes_t;",
        "lanes.hung_toggle <= (others => '1') when number / (30 - 27 * odd) mod 2 = 1 else"
        "(others => '0');",
    ),
    "stack_columns": (
        "use work.refocus_pkg.all; use work.token_pkg.all;",
        'constant G : geometry_t := geometry_of("bench", 2, "1 2", true);'
        'constant BYTE : std_logic_vector(7 downto 0) := x"00";'
        "signal token : token_t := NO_TOKEN;",
        "token.strobe <= '1'; token.pixel <= '1'; token.image <= '1';"
        "token.line_first <= '1' when number mod 4 = 0 else '0';"
        "token.frame_first <= '1' when number / 4 mod (2 * G.output_delay + 2 + odd) = 0 else '0';",
    ),
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


def bench_of(promise: Promise) -> str:
    packages, signals, statements = OWN.get(promise.entity, ("", "", ""))
    return BENCH.format(
        packages=packages,
        signals=signals,
        statements=statements,
        entity=promise.entity,
        generics=f"generic map ({promise.generics})" if promise.generics else "",
        ports=promise.ports,
    )


class Library:
    """What the benches use, analysed once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._environment = {**os.environ, **find_simulator("ghdl", brief=True).environment}
        # A board's words cross only in a build with a sensor.
        (sensor,) = (source for source in hdl.all_sources() if source.stem == "sensor_pkg")
        built = re.sub("(WITH_SENSOR +: boolean +:=) false", r"\1 true", sensor.read_text())
        benches = "".join(map(bench_of, PROMISES))
        sources = needed_sources(benches, "benches", hdl.all_sources())
        sources = hdl.with_packages(sources, {"sensor_pkg": built}, folder)
        done = self.ghdl("-a", *map(str, sources))
        assert not done.returncode, done.stderr

    def ghdl(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        command, *rest = arguments
        return subprocess.run(
            ["ghdl", command, "--std=93", *rest],
            cwd=self._folder,
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
        )


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library(tmp_path_factory.mktemp("library"))


@pytest.mark.parametrize("promise", PROMISES, ids=lambda promise: promise.entity)
def test_a_broken_promise_ends_the_simulation(
    promise: Promise, library: Library, tmp_path: Path
) -> None:
    bench = tmp_path / "bench.vhd"
    bench.write_text(bench_of(promise))
    done = library.ghdl("-a", str(bench))
    assert not done.returncode, done.stderr
    kept, broken = (
        library.ghdl(
            *("--elab-run", f"{promise.entity}_bench", f"-godd={odd}"),
            "--ieee-asserts=disable",
        )
        for odd in (0, 1)
    )
    assert (kept.returncode, kept.stdout + kept.stderr) == (0, "")
    assert broken.returncode
    assert promise.message in broken.stdout + broken.stderr


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
