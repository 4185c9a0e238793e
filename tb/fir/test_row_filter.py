# SPDX-License-Identifier: Apache-2.0
"""The three nets of the study's row filter give the sums of Eq. 6.1, line by line, with pauses."""

import random
import re
from pathlib import Path

import pytest

from plenofir_studies.systolic import (
    FILTERS,
    NETS,
    SOURCE,
    RowFilter,
    load_placed,
    row_filters,
    summary,
)
from plenofir_tb.refusals import Elaborator

_BENCH = """
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity nets is
end entity;

architecture bench of nets is
  type numbers_t is array (natural range <>) of integer;
  constant PIXELS : numbers_t := ({pixels});
  constant FIRSTS : std_logic_vector(0 to PIXELS'length - 1) := "{firsts}";
  constant PAUSES : std_logic_vector(0 to PIXELS'length - 1) := "{pauses}";
  signal clk, step, first : std_logic := '0';
  signal data : std_logic_vector(7 downto 0);
begin
  process is
    procedure tick is
    begin
      wait for 1 ns; clk <= '1'; wait for 1 ns; clk <= '0';
    end procedure;
  begin
    for i in PIXELS'range loop
      if PAUSES(i) = '1' then
        step <= '0'; first <= '1'; data <= (others => '1');
        tick; tick;
      end if;
      step <= '1'; first <= FIRSTS(i); data <= std_logic_vector(to_unsigned(PIXELS(i), 8));
      tick;
    end loop;
    step <= '0';
    for i in 0 to {clocks} loop
      tick;
    end loop;
    wait;
  end process;
{instances}
end architecture;
"""
_INSTANCE = """
  net_{k} : block is
    signal sum : std_logic_vector({high} downto 0);
    signal valid : std_logic;
  begin
    dut : entity work.row_filter
      generic map ({generics})
      port map (clk => clk, step => step, first => first, data => data, sum => sum,
                sum_valid => valid);
    process (clk) is
    begin
      if rising_edge(clk) and valid = '1' then
        report "<{k}=" & integer'image(to_integer(unsigned(sum))) & ">";
      end if;
    end process;
  end block;
"""


def expected(lines: list[list[int]], row: RowFilter) -> list[int]:
    """Sums of the lines by Eq. 6.1, after the delay of the centred picture."""
    m, shift, delay = row.micro_image_size, row.shift, (row.taps - 1) // 2
    sums = []
    for line in lines:
        places = [0] * (len(line) + 2 * row.taps)
        for k, pixel in enumerate(line):
            for n in range(m):
                places[k + n + (k % m) * (shift - 1)] += pixel
        sums += places[delay : delay + len(line)]
    return sums


@pytest.mark.parametrize(("m", "shift"), [(3, 1), (5, 2), (4, 5)])
def test_nets_give_the_same_sums(tmp_path: Path, m: int, shift: int) -> None:
    seed = 100 * m + shift
    print(f"seed {seed}")
    rng = random.Random(seed)
    filters = [RowFilter(m, shift, net) for net in NETS]
    taps = filters[0].taps
    lines = [[rng.choice((0, 255, rng.randrange(256))) for _ in range(taps + k)] for k in (3, 9, 4)]
    pixels = [pixel for line in lines for pixel in line]
    firsts = [int(k == 0) for line in lines for k in range(len(line))]
    high = (255 * m).bit_length() - 1
    instances = [
        _INSTANCE.format(
            k=k,
            high=high,
            generics=", ".join(f"{name} => {value}" for name, value in row.generics().items()),
        )
        for k, row in enumerate(filters)
    ]
    bench = tmp_path / "nets.vhd"
    bench.write_text(
        _BENCH.format(
            pixels=", ".join(map(str, pixels)),
            firsts="".join(map(str, firsts)),
            pauses="".join(str(int(rng.random() < 0.2)) for _ in pixels),
            clocks=taps + 4,
            instances="".join(instances),
        )
    )
    printed = Elaborator("ghdl", tmp_path, SOURCE, bench).printed("nets")
    delay = (taps - 1) // 2
    want = expected(lines, filters[0])[: len(pixels) - delay]
    for k, row in enumerate(filters):
        found = [int(n) for n in re.findall(rf"<{k}=(\d+)>", printed)]
        assert len(found) == len(pixels), row.name
        assert found[delay:] == want, row.name


def test_recorded_nets() -> None:
    """All nets of each filter were placed; full-systolic ones take more registers."""
    placed = load_placed()
    filters = list(row_filters())
    assert set(placed) == {row.name for row in filters}
    for m, shift in FILTERS:
        nets = {net: placed[RowFilter(m, shift, net).name] for net in NETS}
        assert nets[-1].flip_flops > 2 * nets[0].flip_flops
        assert nets[8].flip_flops > nets[0].flip_flops
    assert len(summary()) == 2 + len(filters)
