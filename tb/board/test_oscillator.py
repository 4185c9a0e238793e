# SPDX-License-Identifier: Apache-2.0
"""Clocks that `oscillator_clocks` makes of a board's oscillator, on the model of its PLL."""

import re
import subprocess
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.ground import project
from plenofir_tb.tools import or_skip

BENCH = """
library ieee;
use ieee.std_logic_1164.all;
library work;
entity oscillator_bench is
  generic (OSCILLATOR_MHZ : positive; HALF_NS : positive);
end entity oscillator_bench;
architecture bench of oscillator_bench is
  signal oscillator, control_clk, own_clk, locked : std_logic := '0';
  signal ended : boolean := false;
begin
  oscillator <= not oscillator after HALF_NS * 1 ns when not ended;
  clocks : entity work.oscillator_clocks
    generic map (OSCILLATOR_MHZ => OSCILLATOR_MHZ)
    port map (oscillator_clk => oscillator, control_clk => control_clk, own_clk => own_clk,
              locked => locked);
  count : process is
    variable control, own : natural := 0;
    variable begun : time;
  begin
    wait until locked = '1' for 100 us;
    begun := now;
    while now - begun < 4 us loop
      wait on control_clk, own_clk for 1 us;
      if rising_edge(control_clk) then control := control + 1; end if;
      if rising_edge(own_clk) then own := own + 1; end if;
    end loop;
    assert abs (control - 200) <= 1 and abs (own - 100) <= 1
      report "bench: " & integer'image(control) & " and " & integer'image(own) & " edges in 4 us"
      severity failure;
    ended <= true;
    wait;
  end process count;
end architecture bench;
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Library with the entity, the model of its PLL, and the bench."""
    folder = tmp_path_factory.mktemp("library")
    (folder / "oscillator_bench.vhd").write_text(BENCH)
    sources = {path.stem: path for path in hdl.board_sources("ulx3s")}
    with or_skip():
        for library, files in (
            ("ecp5u", hdl.model_sources("ecp5u")),
            ("work", [sources["math_pkg"], sources["oscillator_clocks"]]),
            ("work", [folder / "oscillator_bench.vhd"]),
        ):
            command = ["ghdl", "-a", "--std=93", f"--work={library}", *map(str, files)]
            subprocess.run(command, cwd=folder, check=True)
    return folder


@pytest.mark.parametrize(
    ("mhz", "half_ns", "message"),
    [
        (25, 20, ""),
        # A divider that is not that of 25 MHz would make 100 MHz of this one.
        (50, 10, ""),
        (125, 4, "CLKI_DIV = 1"),
        (27, 18, "oscillator_clocks: OSCILLATOR_MHZ and CONTROL_MHZ must have a common divisor"),
    ],
)
def test_clocks_have_their_frequency_or_are_refused(
    folder: Path, mhz: int, half_ns: int, message: str
) -> None:
    command = ["ghdl", "--elab-run", "--std=93", "--syn-binding", "oscillator_bench"]
    command += [f"-gOSCILLATOR_MHZ={mhz}", f"-gHALF_NS={half_ns}"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) == (not message), done.stdout + done.stderr
    assert message in done.stdout + done.stderr


@pytest.mark.parametrize("board", ["ulx3s", "ulx3s_camera"])
def test_tops_tell_the_frequency_of_their_oscillator(board: str) -> None:
    top = (project.root() / "hdl" / "board" / f"{board}_top.vhd").read_text()
    pins = (project.root() / "constraints" / f"{board}.lpf").read_text()
    (told,) = re.findall(r"OSCILLATOR_MHZ +=> (\d+)", top)
    assert re.findall(r'FREQUENCY PORT "clk_25" (\d+) MHZ;', pins) == [told]
