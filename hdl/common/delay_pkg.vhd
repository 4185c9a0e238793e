-- SPDX-License-Identifier: Apache-2.0
-- Delays of tags (bits that accompany data) by a number of enabled clocks.
--
-- The caller keeps the tags under way in a signal, one word beside the other, and moves them in its own process.
-- Delays are functions and no entity, because a process seldom does nothing but delay.
--
-- Latency: length enabled clocks (0: a wire). Throughput: one tag each clock.
-- Equation: delayed(t) = tag(t - length), t counting enabled clocks.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

package delay_pkg is

  -- Width of the signal that keeps the tags under way. For a length of 0 the signal has one word that nothing
  -- reads, because some tools refuse a vector without elements.
  function delay_bits (
    width  : positive;
    length : natural
  ) return positive;

  -- The tags a clock later, the new one in the low bits. reset clears bit 0 of each tag, by convention the valid
  -- bit. The other bits have no reset and so fit shift registers in LUTs, which have none.
  function moved_on (
    tags   : std_logic_vector;
    tag    : std_logic_vector;
    enable : std_logic := '1';
    reset  : std_logic := '0'
  ) return std_logic_vector;

  -- The tag that is length enabled clocks old; with a length of 0 the new tag itself.
  function delayed (
    tags   : std_logic_vector;
    tag    : std_logic_vector;
    length : natural
  ) return std_logic_vector;

end package delay_pkg;

package body delay_pkg is

  function delay_bits (
    width  : positive;
    length : natural
  ) return positive is
  begin

    return larger(length, 1) * width;

  end function delay_bits;

  function moved_on (
    tags   : std_logic_vector;
    tag    : std_logic_vector;
    enable : std_logic := '1';
    reset  : std_logic := '0'
  ) return std_logic_vector is

    constant WIDTH : positive := tag'length;

    variable longer : std_logic_vector(tags'length + WIDTH - 1 downto 0);
    variable moved  : std_logic_vector(tags'length - 1 downto 0);

  begin

    longer := tags & tag;
    moved  := tags;

    if enable = '1' then
      moved := longer(tags'length - 1 downto 0);
    end if;

    if reset = '1' then

      for i in 0 to tags'length / WIDTH - 1 loop

        moved(i * WIDTH) := '0';

      end loop;

    end if;

    return moved;

  end function moved_on;

  function delayed (
    tags   : std_logic_vector;
    tag    : std_logic_vector;
    length : natural
  ) return std_logic_vector is

    variable all_tags : std_logic_vector(tags'length - 1 downto 0);

  begin

    all_tags := tags;

    if length = 0 then
      return tag;
    end if;

    return all_tags(length * tag'length - 1 downto (length - 1) * tag'length);

  end function delayed;

end package body delay_pkg;
