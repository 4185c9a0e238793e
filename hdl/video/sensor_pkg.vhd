-- The sensor whose raw frames come in, if there is one; built by scripts/build_hdl.py
-- from plenofir.plan.sensor.board_sensor.

library ieee;
use ieee.std_logic_1164.all;

package sensor_pkg is

  -- Generics of sensor_raster, and the longest line of the raster.
  constant WITH_SENSOR    : boolean  := false;
  constant SENSOR_COLUMNS : positive := 2;
  constant SENSOR_ROWS    : positive := 2;
  constant RASTER_COLUMNS : positive := 1;
  constant PIXEL_CHANNELS : positive := 3;
  constant MOSAIC         : boolean  := false;
  constant RED_PLACE      : natural  := 0;
  constant HEXAGONAL      : boolean  := false;
  constant SKEWED         : boolean  := false;
  constant RING_LINES     : positive := 8;
  constant LENSES         : positive := 2;
  constant MOVES          : boolean  := false;
  constant GAINS          : boolean  := false;

  -- Answer of load_port to the question for the resampler.
  constant RESAMPLER : string := "";

  -- Whether a calibration is built in; words of kind (4 bits), address (20), data (40).
  constant CALIBRATED : boolean := false;

  type words_t is array (natural range <>) of std_logic_vector(63 downto 0);

  constant CALIBRATION : words_t(0 to 0) :=
  (
    0 => x"0000000000000000"
  );

end package sensor_pkg;
