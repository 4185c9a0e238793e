-- SPDX-License-Identifier: Apache-2.0
-- Faults that a bench makes the models have.

package model_faults is

  -- Of the delay lines. A number makes each DELAYF lose its setting now and then: it jumps to any tap, or lets nothing
  -- through. The latter ends with LOADN; with an odd number only when that is low for longer than a search takes it.
  -- The number is the seed; 0: no faults from now on.
  signal delay_faults : natural := 0;

  -- Of the PLLs that have a reset: so many us behind it at least they lock.
  signal slow_lock : natural := 0;

end package model_faults;
