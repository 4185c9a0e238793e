-- SPDX-License-Identifier: Apache-2.0
-- mode_timing of video_pkg as an entity.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.video_pkg.all;

entity mode_ports is
  generic (
    H_ACTIVE   : positive := 1;
    H_FRONT    : positive := 1;
    H_SYNC     : positive := 1;
    H_BACK     : positive := 1;
    V_ACTIVE   : positive := 1;
    V_FRONT    : positive := 1;
    V_SYNC     : positive := 1;
    V_BACK     : positive := 1;
    H_POSITIVE : boolean  := false;
    V_POSITIVE : boolean  := false
  );
  port (
    timing : out   timing_t
  );
end entity mode_ports;

architecture test of mode_ports is

  -- A constant is evaluated at elaboration, as in the boards: a mode that is too large is refused there.
  constant MODE : timing_t := mode_timing("mode_ports", H_ACTIVE, H_FRONT, H_SYNC, H_BACK, V_ACTIVE, V_FRONT, V_SYNC,
                                          V_BACK, H_POSITIVE, V_POSITIVE);

begin

  timing <= MODE;

end architecture test;
