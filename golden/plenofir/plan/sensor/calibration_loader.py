# SPDX-License-Identifier: Apache-2.0
"""A calibration as constants in VHDL: an entity that fills a resampler through its load port."""

from collections.abc import Sequence

from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration

LOADER = "calibration_loader"

_TEXT = """\
-- Loads a resampler with the calibration {name}: registers and tables, after each reset.
-- Written by plenofir resampler, as are these generics of the resampler:
--
{generics}
--
-- Latency: a word a clock, {count} words, beginning 2 clocks after the reset.
-- Throughput: one word each clock.
-- Equation: what plenofir.plan.sensor.chip.loads gives.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity {entity} is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- To the load port.
    load_write   : out   std_logic;
    load_kind    : out   std_logic_vector(1 downto 0);
    load_address : out   std_logic_vector(19 downto 0);
    load_data    : out   std_logic_vector(39 downto 0);
    -- All is loaded.
    done : out   std_logic
  );
end entity {entity};

architecture rtl of {entity} is

  constant COUNT : positive := {count};

  -- Kind (2 bits), address (20), word (40), in 16 hexadecimal digits.
  type words_t is array (0 to COUNT - 1) of std_logic_vector(63 downto 0);

  constant WORDS : words_t := (
{words}
  );

  signal number : natural range 0 to COUNT            := 0;
  signal word   : std_logic_vector(63 downto 0)       := (others => '0');
  signal valid  : std_logic                           := '0';

begin

  play : process (clk) is
  begin

    if rising_edge(clk) then
      valid <= '0';
      if number < COUNT then
        word   <= WORDS(number);
        valid  <= '1';
        number <= number + 1;
      end if;
      if reset = '1' then
        number <= 0;
        valid  <= '0';
      end if;
    end if;

  end process play;

  load_write   <= valid;
  load_kind    <= word(61 downto 60);
  load_address <= word(59 downto 40);
  load_data    <= word(39 downto 0);
  done         <= '1' when number = COUNT and valid = '0' else
                  '0';

end architecture rtl;
"""


def loader_text(core: ResamplerConfiguration, loads: Sequence[Load], name: str) -> str:
    """VHDL-93 of the entity `LOADER`, all words in a ROM; its header names the calibration."""
    words = [
        f'    {number} => x"{kind << 60 | address << 40 | word:016X}"'
        for number, (kind, address, word) in enumerate(loads)
    ]
    width = max(map(len, core.generics()))
    generics = [
        f"--   {key.ljust(width)} => {str(value).lower()}" for key, value in core.generics().items()
    ]
    return _TEXT.format(
        name="".join(c for c in name if c.isprintable()),
        generics="\n".join(generics),
        count=len(loads),
        entity=LOADER,
        words=",\n".join(words),
    )
