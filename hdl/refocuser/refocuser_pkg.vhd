-- SPDX-License-Identifier: Apache-2.0
-- What the tops need to know of their engines. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.fir_pkg.all;
use work.moving_sum_pkg.all;

package refocuser_pkg is

  -- Clocks from a token at an engine's input ("fir", "moving_sum") to its result.
  function engine_latency (
    engine         : string;
    stored         : boolean;
    order          : natural;
    broadcast_taps : natural;
    max_columns    : positive
  ) return positive;

  -- The shortest line in tokens that an engine ("fir", "moving_sum", "stack") takes without a pause.
  function engine_line_steps (
    engine        : string;
    delay         : natural;
    parallel_rows : positive;
    max_columns   : positive
  ) return positive;

end package refocuser_pkg;

package body refocuser_pkg is

  function engine_latency (
    engine         : string;
    stored         : boolean;
    order          : natural;
    broadcast_taps : natural;
    max_columns    : positive
  ) return positive is
  begin

    if same_text(engine, "moving_sum") then
      return sum_array_latency(stored, order, max_columns);
    end if;

    return array_latency(stored, broadcast_taps, order);

  end function engine_latency;

  function engine_line_steps (
    engine        : string;
    delay         : natural;
    parallel_rows : positive;
    max_columns   : positive
  ) return positive is
  begin

    if not same_text(engine, "fir") and delay >= PARTIAL_SUM_LOOP then
      return delay + 1;
    end if;

    return min_line_steps(parallel_rows, max_columns);

  end function engine_line_steps;

end package body refocuser_pkg;
