-- SPDX-License-Identifier: Apache-2.0
-- What a bench tells the models.

package model_control is

  -- The oscillator stands still, so that a simulation can end.
  signal stopped : boolean := false;

end package model_control;
