-- SPDX-License-Identifier: Apache-2.0
-- Switch table: a ROM with a row of switch states for each slice and each phase of a micro image.
--
-- Only taps that some slice closes have a column in the ROM. All other switches are always open.
--
-- Latency: 1 clock from enable. Throughput: one row each clock.
-- Equation: closed(w) = 1 for the neighbouring taps (those of the box, with hold 1) whose delays TAPS-1-w begin at
-- phase*(shift-1) + origin of the slice.

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

  -- Switches of all taps for a slice and a phase. A power of two of rows makes every address valid.
  type switches_t is array (natural range 0 to 2 ** (SLICE_BITS + PHASE_BITS) - 1) of std_logic_vector(0 to TAPS - 1);

  -- For each tap, the number of taps before it that some row closes: its column in the ROM.
  type columns_t is array (natural range 0 to TAPS) of natural range 0 to TAPS;

  type table_t is record
    switches : switches_t;
    columns  : columns_t;
  end record table_t;

  function all_switches return table_t is

    variable table : table_t;
    variable last  : natural;
    variable used  : std_logic_vector(0 to TAPS - 1);

  begin

    table.switches := (others => (others => '0'));

    used := (others => '0');

    for s in 0 to GEOMETRY.slices - 1 loop

      for p in 0 to GEOMETRY.micro_image_size - 1 loop

        -- Taps count from the longest delay: the shortest delay is the last tap.
        last := TAPS - 1 - first_delay(GEOMETRY, s, p);

        -- The taps of the box are closed, or with hold one.
        for i in 0 to closed_width(GEOMETRY, s, HOLD) - 1 loop

          table.switches(s * 2 ** PHASE_BITS + p)(last - i) := '1';

          used(last - i) := '1';

        end loop;

      end loop;

    end loop;

    table.columns(0) := 0;

    -- Most of many taps are closed by few phases; a tap that no phase closes needs no column.
    for w in 0 to TAPS - 1 loop

      table.columns(w + 1) := table.columns(w) + choose(used(w) = '1', 1, 0);

    end loop;

    return table;

  end function all_switches;

  constant TABLE : table_t := all_switches;

  subtype row_t is std_logic_vector(0 to TABLE.columns(TAPS) - 1);

  type rows_t is array (natural range 0 to 2 ** (SLICE_BITS + PHASE_BITS) - 1) of row_t;

  function all_rows return rows_t is

    variable rows : rows_t;

  begin

    for w in 0 to TAPS - 1 loop

      for r in rows_t'range loop

        if TABLE.columns(w + 1) > TABLE.columns(w) then
          rows(r)(TABLE.columns(w)) := TABLE.switches(r)(w);
        end if;

      end loop;

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

    switch : if TABLE.columns(w + 1) > TABLE.columns(w) generate
      closed(w) <= row(TABLE.columns(w));
    end generate switch;

    -- A tap that no slice closes takes no logic: synthesis removes its adder with its switch.
    no_switch : if TABLE.columns(w + 1) = TABLE.columns(w) generate
      closed(w) <= '0';
    end generate no_switch;

  end generate tap;

end architecture rtl;
