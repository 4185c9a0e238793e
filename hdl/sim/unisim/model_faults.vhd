-- SPDX-License-Identifier: Apache-2.0
-- Faults that a bench injects into the models.

package model_faults is

  -- Faults of the delay lines. An even number makes each IODELAY2 go wrong at one command in four: it hangs (BUSY stays
  -- high), ignores all commands (BUSY stays low), or answers late. Either of the first two ends with RST; with an odd
  -- number only when CLK has stood still. The number is the seed; 0: no faults from now on.
  signal delay_faults : natural := 0;

end package model_faults;
