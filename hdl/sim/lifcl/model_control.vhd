-- SPDX-License-Identifier: Apache-2.0
-- Controls that a bench has over the models.

package model_control is

  -- Stops the oscillator, so that a simulation can end.
  signal stopped : boolean := false;

end package model_control;
