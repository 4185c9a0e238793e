-- The camera whose lanes come in; built by scripts/build_hdl.py from
-- plenofir.plan.sensor.board_camera.

library ieee;
use ieee.std_logic_1164.all;

package camera_pkg is

  -- Lanes; bits of a raw pixel; channels behind the mosaic; BUFFER_BITS of csi_receiver;
  -- SETTLE of dphy_lane; the line of the raw frame at which a screen begins its frame.
  constant CAMERA_LANES    : natural := 4;
  constant RAW_BITS        : natural := 10;
  constant CAMERA_CHANNELS : natural := 1;
  constant BUFFER_BITS     : natural := 6;
  constant LANE_SETTLE     : natural := 10;
  constant START_LINE      : natural := 0;

  -- Generics DEVICE and REGISTERS of sensor_setup.
  constant SENSOR_ADDRESS : std_logic_vector(6 downto 0) := "0010000";

  constant SENSOR_REGISTERS : string := "ffff00";

end package camera_pkg;
