-- SPDX-License-Identifier: Apache-2.0
-- Delays a tag (bits that accompany data) by a number of enabled clocks.
--
-- Latency: LENGTH enabled clocks (0: a wire). Throughput: one tag each clock.
-- Equation: delayed(t) = tag(t - LENGTH), t counting enabled clocks.

library ieee;
use ieee.std_logic_1164.all;

entity tag_delay is
  generic (
    -- Bits of a tag.
    WIDTH : positive;
    -- Delay in enabled clocks.
    LENGTH : natural
  );
  port (
    clk : in    std_logic;
    -- Clears bit 0 of all stored tags, by convention the valid bit. The other bits have no reset and so fit
    -- shift register LUTs, which have none.
    reset : in    std_logic := '0';
    -- Moves the tags on.
    enable : in    std_logic := '1';
    -- A tag, and the tag of LENGTH enabled clocks before.
    tag     : in    std_logic_vector(WIDTH - 1 downto 0);
    delayed : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity tag_delay;

architecture rtl of tag_delay is

begin

  no_delay : if LENGTH = 0 generate
    delayed <= tag;
  end generate no_delay;

  line : if LENGTH > 0 generate

    type tags_t is array (1 to LENGTH) of std_logic_vector(WIDTH - 1 downto 0);

    signal tags : tags_t := (others => (others => '0'));

  begin

    move : process (clk) is
    begin

      if rising_edge(clk) then
        if enable = '1' then
          tags(1) <= tag;

          for i in 2 to LENGTH loop

            tags(i) <= tags(i - 1);

          end loop;

        end if;
        -- Whatever enable says: a reset must not leave tags of before in a line that stands still.
        if reset = '1' then

          for i in 1 to LENGTH loop

            tags(i)(0) <= '0';

          end loop;

        end if;
      end if;

    end process move;

    delayed <= tags(LENGTH);

  end generate line;

end architecture rtl;
