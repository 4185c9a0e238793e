-- SPDX-License-Identifier: Apache-2.0
-- Counts and latencies of the normalised border.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.core_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_plan_pkg.all;

package border_pkg is

  -- The largest count in one dimension behind so many passes: the count of an output that all views reach.
  function largest_count (
    box    : positive;
    number : natural
  ) return positive;

  -- Clocks from a token to the weights of its pixels, besides the lines and tokens of the delays.
  function border_latency (
    core : core_t
  ) return positive;

  -- Clocks that tokens wait in front of the engine.
  function border_wait (
    core : core_t
  ) return natural;

end package border_pkg;

package body border_pkg is

  function largest_count (
    box    : positive;
    number : natural
  ) return positive is
  begin

    -- Each pass adds up to B counts, so the largest count is a power of B.
    return box ** number;

  end function largest_count;

  function border_latency (
    core : core_t
  ) return positive is

    constant ORDER : natural range 0 to 3 := core.arithmetic.passes - 1;

    variable clocks : positive;

  begin

    -- Each pass has a stage of lines and a stage of tokens; the product takes a clock.
    clocks := 1;

    for i in 0 to ORDER loop

      clocks := clocks + sum_stage_latency(false, 1) + rows_latency(core, i);

    end loop;

    return clocks;

  end function border_latency;

  function border_wait (
    core : core_t
  ) return natural is
  begin

    -- The difference is negative if the engine is slower than the weights; then the weights wait.
    return larger(border_latency(core) - core.plan.sum_clocks, 0);

  end function border_wait;

end package body border_pkg;
