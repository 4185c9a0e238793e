-- SPDX-License-Identifier: Apache-2.0
-- Switch table: a ROM with a row of switch states for each slice and each phase of a micro image.
--
-- Only taps that some slice closes have a column in the ROM. All other switches are always open.
--
-- Latency: 1 clock from enable. Throughput: one row each clock.
-- Equation: closed(w) = 1 for the neighbouring taps (M, with hold 1) whose delays TAPS-1-w begin at phase*(shift-1)
-- + origin of the slice.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.fir_pkg.all;

entity switch_table is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- true: the first output of a micro image is held for its others, which are equal.
    HOLD : boolean
  );
  port (
    clk : in    std_logic;
    -- enable loads the row of this slice and phase.
    enable : in    std_logic;
    slice  : in    unsigned(bits_for(GEOMETRY.slices - 1) - 1 downto 0);
    phase  : in    unsigned(bits_for(GEOMETRY.micro_image_size - 1) - 1 downto 0);
    -- '1' closes the switch of a tap; holds until the next row is loaded.
    closed : out   std_logic_vector(0 to tap_count(GEOMETRY, HOLD) - 1)
  );
end entity switch_table;

architecture rtl of switch_table is

  constant TAPS       : positive := tap_count(GEOMETRY, HOLD);
  constant PHASE_BITS : positive := bits_for(GEOMETRY.micro_image_size - 1);
  constant SLICE_BITS : positive := bits_for(GEOMETRY.slices - 1);

  -- A row with all taps; the ROM keeps only those that some slice closes.
  subtype taps_t is std_logic_vector(0 to TAPS - 1);

  -- Switches of all taps. A power of two of rows makes every address valid.
  type switches_t is array (natural range 0 to 2 ** (SLICE_BITS + PHASE_BITS) - 1) of taps_t;

  function all_switches return switches_t is

    variable switches : switches_t;
    variable last     : natural;

  begin

    switches := (others => (others => '0'));

    for s in 0 to GEOMETRY.slices - 1 loop

      for p in 0 to GEOMETRY.micro_image_size - 1 loop

        -- Taps count from the longest delay: the shortest delay is the last tap.
        last := TAPS - 1 - first_delay(GEOMETRY, s, p);

        -- M neighbouring taps are closed, or with hold one.
        for i in 0 to closed_width(GEOMETRY.micro_image_size, HOLD) - 1 loop

          switches(s * 2 ** PHASE_BITS + p)(last - i) := '1';

        end loop;

      end loop;

    end loop;

    return switches;

  end function all_switches;

  constant SWITCHES : switches_t := all_switches;

  -- Columns of the ROM: the taps that some row closes, from tap 0 on.
  function switched_taps return taps_t is

    variable taps_used : taps_t;

  begin

    -- Most of many taps are closed by few phases; a tap that no phase closes needs no column.
    taps_used := (others => '0');

    for r in switches_t'range loop

      taps_used := taps_used or SWITCHES(r);

    end loop;

    return taps_used;

  end function switched_taps;

  constant SWITCHED : taps_t := switched_taps;

  -- ROM column of a tap: the number of switched taps before it.
  function column_of (
    place : natural
  ) return natural is

    variable count : natural;

  begin

    count := 0;

    -- A loop is enough, because it runs only at elaboration.
    for w in natural range 0 to TAPS - 1 loop

      if w < place and SWITCHED(w) = '1' then
        count := count + 1;
      end if;

    end loop;

    return count;

  end function column_of;

  constant COLUMNS : positive := column_of(TAPS);

  subtype row_t is std_logic_vector(0 to COLUMNS - 1);

  type rows_t is array (natural range 0 to 2 ** (SLICE_BITS + PHASE_BITS) - 1) of row_t;

  function all_rows return rows_t is

    variable rows   : rows_t;
    variable column : natural;

  begin

    column := 0;

    for w in 0 to TAPS - 1 loop

      if SWITCHED(w) = '1' then

        for r in rows_t'range loop

          rows(r)(column) := SWITCHES(r)(w);

        end loop;

        column := column + 1;
      end if;

    end loop;

    return rows;

  end function all_rows;

  constant ROWS : rows_t := all_rows;

  signal row : row_t;

begin

  look_up : process (clk) is
  begin

    if rising_edge(clk) then
      -- The row holds between steps, like the filters.
      if enable = '1' then
        row <= ROWS(to_integer(slice & phase));
      end if;
    end if;

  end process look_up;

  tap : for w in 0 to TAPS - 1 generate

    switch : if SWITCHED(w) = '1' generate
      closed(w) <= row(column_of(w));
    end generate switch;

    -- A tap that no slice closes takes no logic: synthesis removes its adder with its switch.
    no_switch : if SWITCHED(w) = '0' generate
      closed(w) <= '0';
    end generate no_switch;

  end generate tap;

end architecture rtl;
