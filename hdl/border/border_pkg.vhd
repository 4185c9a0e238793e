-- SPDX-License-Identifier: Apache-2.0
-- Counts and latencies of the normalised border.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;

package border_pkg is

  -- The largest count in one dimension behind so many passes: the count of an output that all views reach.
  function largest_count (
    micro_image_size : positive;
    number           : natural
  ) return positive;

  -- Latency of border_counts in clocks.
  function border_latency (
    geometry : geometry_t;
    order    : natural range 0 to 3;
    pixels   : positive
  ) return positive;

  -- Clocks that tokens wait in front of an engine whose sums come sum_clocks behind its tokens.
  function border_wait (
    geometry   : geometry_t;
    order      : natural;
    pixels     : positive;
    sum_clocks : positive
  ) return natural;

  -- Latency of an engine in clocks; `clocks` is its latency with a division by a constant.
  function normalised_latency (
    normalised : boolean;
    geometry   : geometry_t;
    order      : natural;
    pixels     : positive;
    pixel_bits : positive;
    clocks     : positive
  ) return positive;

end package border_pkg;

package body border_pkg is

  function largest_count (
    micro_image_size : positive;
    number           : natural
  ) return positive is
  begin

    -- Each pass adds up to M counts, so the largest count is a power of M.
    return micro_image_size ** number;

  end function largest_count;

  function border_latency (
    geometry : geometry_t;
    order    : natural range 0 to 3;
    pixels   : positive
  ) return positive is

    variable clocks : positive;

  begin

    -- Each pass has a stage of lines and a stage of tokens; the product takes a clock.
    clocks := 1;

    for i in 0 to order loop

      clocks := clocks + sum_stage_latency(false, 1);

      if pixels = 1 then
        -- Rows have the same stage as in an engine with as many pixels a clock.
        clocks := clocks + sum_stage_latency(false, 1);
      else
        clocks := clocks + lane_stage_latency(pass_geometry(geometry, i), pixels);
      end if;

    end loop;

    return clocks;

  end function border_latency;

  function border_wait (
    geometry   : geometry_t;
    order      : natural;
    pixels     : positive;
    sum_clocks : positive
  ) return natural is
  begin

    -- The difference is negative if the engine is slower than the weights; then the weights wait.
    return larger(border_latency(geometry, order, pixels) - sum_clocks, 0);

  end function border_wait;

  function normalised_latency (
    normalised : boolean;
    geometry   : geometry_t;
    order      : natural;
    pixels     : positive;
    pixel_bits : positive;
    clocks     : positive
  ) return positive is
  begin

    if not normalised then
      return clocks;
    end if;

    -- The division by a constant is left out, so the slower of sums and weights sets the latency.
    return larger(clocks - DIVIDE_LATENCY, border_latency(geometry, order, pixels)) + scaler_latency(true, pixel_bits);

  end function normalised_latency;

end package body border_pkg;
