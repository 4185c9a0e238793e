-- SPDX-License-Identifier: Apache-2.0
-- Faults that a bench injects into the models.

package model_faults is

  -- Faults of the delay lines. A number makes each DELAYF lose its setting now and then: it jumps to any tap, or blocks
  -- its signal. The latter ends with LOADN; with an odd number only when LOADN is low for longer than a search takes.
  -- The number is the seed; 0: no faults from now on.
  signal delay_faults : natural := 0;

  -- Faults of the PLLs with a reset: microseconds behind the reset before which they do not lock.
  signal slow_lock : natural := 0;

end package model_faults;
