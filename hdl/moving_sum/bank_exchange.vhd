-- SPDX-License-Identifier: Apache-2.0
-- Moves the words of the banks to the places of the outputs that add them; the order depends on the slice.
--
-- The pixel that an output adds comes from a bank that depends on the output's place and the slice alone
-- (sum_lanes_pkg). Over all slices a place needs only a few banks, and the slice selects one of these.
--
-- Latency: 1 clock (with one slice 0 clocks). Throughput: one word of each bank each clock.
-- Equation: exchanged word r = words_in word entering_bank(slice, r).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;

entity bank_exchange is
  generic (
    -- Sizes of lane_stage.
    BUILD : lanes_build_t
  );
  port (
    clk : in    std_logic;
    -- Slice, a clock ahead of its words.
    slice : in    unsigned(bits_for(BUILD.geometry.slices - 1) - 1 downto 0);
    -- A word of each bank, bank 0 in the low bits.
    words_in : in    std_logic_vector(BUILD.banks * BUILD.channels * (BUILD.pixel_bits + 1) - 1 downto 0);
    -- The word of each place, place 0 in the low bits.
    exchanged : out   std_logic_vector(BUILD.banks * BUILD.channels * (BUILD.pixel_bits + 1) - 1 downto 0)
  );
end entity bank_exchange;

architecture rtl of bank_exchange is

  -- With a fixed slice the geometry is that slice alone, and the exchange becomes wires.
  constant GEOMETRY : geometry_t := BUILD.geometry;

  constant SLICES : positive := GEOMETRY.slices;
  constant WIDTH  : positive := BUILD.channels * (BUILD.pixel_bits + 1);
  constant BANKS  : positive := bank_count(BUILD.geometry.micro_image_size, BUILD.pixels);

  subtype bank_t is natural range 0 to larger(BANKS - 1, 1);

  type banks_t is array (natural range 0 to BANKS - 1) of bank_t;

  type words_t is array (natural range 0 to BANKS - 1) of std_logic_vector(WIDTH - 1 downto 0);

  -- The words as an array.
  signal words : words_t;

begin

  every_bank : for b in 0 to BANKS - 1 generate
    words(b) <= words_in((b + 1) * WIDTH - 1 downto b * WIDTH);
  end generate every_bank;

  -- With one slice the exchange is a fixed permutation, which is wires.
  one_slice : if SLICES = 1 generate

    place : for r in 0 to BANKS - 1 generate
      exchanged((r + 1) * WIDTH - 1 downto r * WIDTH) <= words(entering_bank(GEOMETRY, BUILD.pixels, 0, r));
    end generate place;

  end generate one_slice;

  set_of_slices : if SLICES > 1 generate

    type codes_t is array (natural range 0 to SLICES - 1) of bank_t;

    -- candidates: banks from which any slice takes the word of a place; codes: by slice, which of them. A place has
    -- fewer candidates than there are banks, so the multiplexer is small.
    type choice_t is record
      candidates : banks_t;
      codes      : codes_t;
    end record choice_t;

    type choices_t is array (natural range 0 to BANKS - 1) of choice_t;

    function all_choices return choices_t is

      variable choices : choices_t;
      variable bank    : bank_t;
      variable count   : natural;
      variable code    : natural;

    begin

      for r in 0 to BANKS - 1 loop

        -- Unused entries repeat the first bank, so that none is undefined.
        choices(r).candidates := (others => entering_bank(GEOMETRY, BUILD.pixels, 0, r));
        count                 := 0;

        for s in 0 to SLICES - 1 loop

          -- A bank that several slices take the word from is listed once.
          bank := entering_bank(GEOMETRY, BUILD.pixels, s, r);
          code := count;

          for i in 0 to BANKS - 1 loop

            if i < count and choices(r).candidates(i) = bank then
              code := i;
            end if;

          end loop;

          if code = count then
            choices(r).candidates(code) := bank;
            count                       := count + 1;
          end if;

          choices(r).codes(s) := code;

        end loop;

      end loop;

      return choices;

    end function all_choices;

    constant CHOICE_OF : choices_t := all_choices;

    -- The codes that belong to the words of this clock.
    signal codes : banks_t := (others => 0);

  begin

    exchange : process (clk) is
    begin

      if rising_edge(clk) then

        for r in 0 to BANKS - 1 loop

          -- The code is looked up a clock ahead of the words, so the words' multiplexer decides with few bits.
          codes(r) <= CHOICE_OF(r).codes(0);

          for s in 1 to SLICES - 1 loop

            if slice = s then
              codes(r) <= CHOICE_OF(r).codes(s);
            end if;

          end loop;

          -- Comparing with constants wires no more candidates than there are.
          for i in 0 to BANKS - 1 loop

            if codes(r) = i then
              exchanged((r + 1) * WIDTH - 1 downto r * WIDTH) <= words(CHOICE_OF(r).candidates(i));
            end if;

          end loop;

        end loop;

      end if;

    end process exchange;

  end generate set_of_slices;

end architecture rtl;
