-- SPDX-License-Identifier: Apache-2.0
-- Writes the schedule of sum_schedule_pkg and moving_sum_pkg into schedule.txt, a number a line with what it is of.

library ieee;
use ieee.std_logic_1164.all;

library std;
use std.textio.all;

library work;
use work.refocus_pkg.all;
use work.core_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;
use work.sum_plan_pkg.all;

entity moving_sum_schedule is
  generic (
    MICRO_IMAGE_SIZE : positive := 3;
    SHIFTS           : string   := "1";
    CENTRED          : boolean  := true;
    BOX              : string   := ""
  );
end entity moving_sum_schedule;

architecture bench of moving_sum_schedule is

  constant GEOMETRY : geometry_t := geometry_of("moving_sum_schedule", MICRO_IMAGE_SIZE, SHIFTS, CENTRED, BOX);

  -- The plan of a core of these passes and pixels a token.
  function plan_with (
    stored : boolean;
    order  : natural;
    pixels : positive
  ) return plan_t is

    variable core : core_t;

  begin

    core.geometry          := GEOMETRY;
    core.arithmetic.exact  := not stored;
    core.arithmetic.passes := order + 1;
    core.pixels            := pixels;

    return plan_of(core);

  end function plan_with;

begin

  -- Python computes the same numbers by itself and compares: a schedule that both have is the one
  -- that is built.
  write_all : process is

    file results : text open write_mode is "schedule.txt";

    procedure put (
      name  : string;
      value : integer
    ) is

      variable row : line;

    begin

      write(row, name & " " & integer'image(value));
      writeline(results, row);

    end procedure put;

    procedure put (
      name  : string;
      first : integer;
      value : integer
    ) is
    begin

      put(name & " " & integer'image(first), value);

    end procedure put;

    procedure put (
      name   : string;
      first  : integer;
      second : integer;
      value  : integer
    ) is
    begin

      put(name & " " & integer'image(first) & " " & integer'image(second), value);

    end procedure put;

    procedure put (
      name   : string;
      first  : integer;
      second : integer;
      third  : integer;
      value  : integer
    ) is
    begin

      put(name & " " & integer'image(first) & " " & integer'image(second), third, value);

    end procedure put;

    -- Of so many pixels a token.

    procedure put_lanes (
      p : positive
    ) is

      constant ROWS : row_range_t := row_range(GEOMETRY, p);

    begin

      put("lane_delay", p, lane_delay(GEOMETRY, p));
      put("bank_count", p, bank_count(MICRO_IMAGE_SIZE, p));
      put("bank_rows", p, bank_rows(GEOMETRY, p));
      put("line_tokens", p, line_tokens(37, p));
      put("lowest_row", p, ROWS.lowest);
      put("highest_row", p, ROWS.highest);

      for order in 0 to 1 loop

        put("row_tokens", p, order, plan_with(false, order, p).row_tokens);
        put("lanes_clocks", p, order, plan_with(false, order, p).sum_clocks);

      end loop;

      for s in 0 to GEOMETRY.slices - 1 loop

        for r in 0 to bank_count(MICRO_IMAGE_SIZE, p) - 1 loop

          put("entering_bank", p, s, r, entering_bank(GEOMETRY, p, s, r));
          put("entering_row", p, s, r, entering_row(GEOMETRY, p, s, r));
          put("left_bank", p, s, r, left_pixel(GEOMETRY, p, s, r).bank);
          put("left_rows", p, s, r, left_pixel(GEOMETRY, p, s, r).rows);

        end loop;

        for i in 0 to p - 1 loop

          for held in boolean loop

            put("is_ahead " & integer'image(p) & " " & integer'image(s), i, boolean'pos(held),
                boolean'pos(is_ahead(GEOMETRY, s, i, held)));

          end loop;

        end loop;

      end loop;

    end procedure put_lanes;

    constant M : positive := MICRO_IMAGE_SIZE;

  begin

    put("output_delay", GEOMETRY.output_delay);
    put("reach", reach(GEOMETRY));
    put("holds_outputs", boolean'pos(holds_outputs(GEOMETRY)));
    put("pixels_leave", boolean'pos(pixels_leave(GEOMETRY)));
    put("alternates", boolean'pos(alternates(GEOMETRY)));
    put("begins_within_group", boolean'pos(begins_within_group(GEOMETRY)));

    -- The least, a middle and the largest number of pixels a token.
    put_lanes(2);
    put_lanes(8);
    put_lanes(32);

    for any_rows in boolean loop

      for v in 0 to M - 1 loop

        put("ring_lines", boolean'pos(any_rows), v, ring_lines(GEOMETRY, any_rows, v));

      end loop;

      for g in 0 to group_count(GEOMETRY) - 1 loop

        put("bank_lines", boolean'pos(any_rows), g, bank_lines(GEOMETRY, any_rows, g, M));

      end loop;

      for order in 0 to 1 loop

        put("least_frame", boolean'pos(any_rows), order, least_frame(GEOMETRY, order, any_rows));

      end loop;

    end loop;

    for stored in boolean loop

      for order in 0 to 1 loop

        put("sum_clocks", boolean'pos(stored), order, plan_with(stored, order, 1).sum_clocks);

      end loop;

    end loop;

    for v in 0 to M - 1 loop

      put("bank_group", v, bank_groups(GEOMETRY)(v));

    end loop;

    -- Of each slice, by phase; `held` as in initial_index.
    for s in 0 to GEOMETRY.slices - 1 loop

      put("group_size", s, group_size(GEOMETRY, s));

      for v in 0 to M - 1 loop

        put("entering_phase", s, v, entering_phase(GEOMETRY, s, v));
        put("entering_age", s, v, entering_age(GEOMETRY, s, v));
        put("leaving_phase", s, v, leaving_phase(GEOMETRY, s, v));
        put("leaving_age", s, v, leaving_age(GEOMETRY, s, v));
        put("begins_group", s, v, boolean'pos(begins_group(GEOMETRY, s, v)));

        for held in boolean loop

          put("initial_index " & boolean'image(held), s, v, initial_index(GEOMETRY, s, v, held));
          put("is_initial " & boolean'image(held), s, v, boolean'pos(is_initial(GEOMETRY, s, v, held)));

        end loop;

      end loop;

    end loop;

    wait;

  end process write_all;

end architecture bench;
