-- SPDX-License-Identifier: Apache-2.0
-- The sharpest slice of a micro image, and the sharpness of its neighbours and of the dullest slice.
--
-- Each pipeline stage makes one comparison, slice after slice, instead of a tree of comparisons in one clock. Of
-- equally sharp slices the first counts. With a depth between slices they are weighted before the comparison.
--
-- Latency: SLICES - 1 clocks, 1 more with weights. Throughput: one micro image each clock.
-- Equation: index = argmax over the slices s of weight(s) sharpness(s), weight = slice_weight / 16 with a depth between
--   slices, else 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;

entity sharpest_slice is
  generic (
    -- Without a depth between slices all slices have weight 1.
    BUILD : index_build_t
  );
  port (
    clk : in    std_logic;
    -- Sharpness of all slices, the first in the low bits.
    sharpness : in    std_logic_vector(BUILD.slices * BUILD.sharpness_bits - 1 downto 0);
    -- The sharpest slice, its sharpness, and the sharpness of the dullest slice.
    index : out   unsigned(bits_for(BUILD.slices - 1) - 1 downto 0);
    most  : out   unsigned(BUILD.sharpness_bits - 1 downto 0);
    least : out   unsigned(BUILD.sharpness_bits - 1 downto 0);
    -- Sharpness of the slices before and behind the sharpest; undefined beside the first and the last slice.
    prior  : out   unsigned(BUILD.sharpness_bits - 1 downto 0);
    behind : out   unsigned(BUILD.sharpness_bits - 1 downto 0)
  );
end entity sharpest_slice;

architecture rtl of sharpest_slice is

  constant INDEX_BITS : positive := bits_for(BUILD.slices - 1);

  subtype sharpness_t is unsigned(BUILD.sharpness_bits - 1 downto 0);

  type sharpness_list_t is array (natural range 0 to BUILD.slices - 1) of sharpness_t;

  type indices_t is array (natural range 0 to BUILD.slices - 1) of unsigned(INDEX_BITS - 1 downto 0);

  -- weighed: the weighted sharpness of each slice. Of the slices up to each one: the most, the least, the best slice,
  -- the last one's sharpness, and the sharpness of the best slice's neighbours.
  signal weighed   : sharpness_list_t;
  signal most_of   : sharpness_list_t;
  signal least_of  : sharpness_list_t;
  signal best_of   : indices_t;
  signal last_of   : sharpness_list_t;
  signal before_of : sharpness_list_t;
  signal behind_of : sharpness_list_t;

begin

  slice : for s in 0 to BUILD.slices - 1 generate

    signal new_value : sharpness_t;

  begin

    -- Stage s compares slice s with the best of the slices before it.
    new_value <= unsigned(sharpness((s + 1) * BUILD.sharpness_bits - 1 downto s * BUILD.sharpness_bits));

    alike : if not BUILD.between generate
      weighed(s) <= new_value;
    end generate alike;

    by_weight : if BUILD.between generate

      -- By how many sixteenths the slice counts less: 0, 1 or 4.
      constant LESS : natural := 16 - slice_weight(BUILD.micro_image_size, BUILD.shifts(s));

    begin

      weigh : process (clk) is

        variable sixteen : unsigned(BUILD.sharpness_bits + 3 downto 0);

      begin

        if rising_edge(clk) then
          sixteen := new_value & "0000";
          -- The weight takes one subtraction, because LESS is a power of two.
          if LESS = 1 then
            sixteen := sixteen - new_value;
          elsif LESS > 1 then
            sixteen := sixteen - (new_value & "00");
          end if;
          weighed(s) <= sixteen(BUILD.sharpness_bits + 3 downto 4);
        end if;

      end process weigh;

    end generate by_weight;

    -- The first slice is the best so far and has no slice before it.
    first_slice : if s = 0 generate
      most_of(0)   <= weighed(0);
      least_of(0)  <= weighed(0);
      best_of(0)   <= (others => '0');
      last_of(0)   <= weighed(0);
      before_of(0) <= weighed(0);
      behind_of(0) <= weighed(0);
    end generate first_slice;

    next_slice : if s > 0 generate

      signal value   : sharpness_t;
      signal found   : std_logic_vector(BUILD.sharpness_bits - 1 downto 0);
      signal waiting : std_logic_vector(delay_bits(BUILD.sharpness_bits, s - 1) - 1 downto 0) := (others => '0');

    begin

      found <= std_logic_vector(weighed(s));
      -- The sharpness of slice s waits until the stage before has compared the slices before it.
      value <= unsigned(delayed(waiting, found, s - 1));

      compare : process (clk) is
      begin

        if rising_edge(clk) then
          waiting     <= moved_on(waiting, found);
          most_of(s)  <= most_of(s - 1);
          best_of(s)  <= best_of(s - 1);
          least_of(s) <= least_of(s - 1);
          if value < least_of(s - 1) then
            least_of(s) <= value;
          end if;
          -- Synthesis removes the neighbours if no depth between slices is wanted.
          last_of(s)   <= value;
          before_of(s) <= before_of(s - 1);
          behind_of(s) <= behind_of(s - 1);
          -- The best slice so far is the last one, so this slice is its neighbour behind.
          if best_of(s - 1) = s - 1 then
            behind_of(s) <= value;
          end if;
          -- Only a strictly larger sharpness wins, so the first of equal slices counts.
          if value > most_of(s - 1) then
            most_of(s)   <= value;
            best_of(s)   <= to_unsigned(s, INDEX_BITS);
            before_of(s) <= last_of(s - 1);
          end if;
        end if;

      end process compare;

    end generate next_slice;

  end generate slice;

  index  <= best_of(BUILD.slices - 1);
  most   <= most_of(BUILD.slices - 1);
  least  <= least_of(BUILD.slices - 1);
  prior  <= before_of(BUILD.slices - 1);
  behind <= behind_of(BUILD.slices - 1);

end architecture rtl;
