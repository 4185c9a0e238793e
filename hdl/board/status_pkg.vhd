-- The status line of the serial port; built by scripts/build_hdl.py from the list of its fields in
-- plenofir.fpga.hdmi.status, docs/boards.md says what each means.

library ieee;
use ieee.std_logic_1164.all;

package status_pkg is

  -- The line: each # stands for the next number.
  constant STATUS_LINE : string := "slice=# " &
                                   "slices=# " &
                                   "sweep=# " &
                                   "output=# " &
                                   "outputs=# " &
                                   "text=# " &
                                   "pass=# " &
                                   "pattern=# " &
                                   "clock=# " &
                                   "present=# " &
                                   "running=# " &
                                   "restarts=# " &
                                   "lost_locks=# " &
                                   "tracking=# " &
                                   "taps=#/#/# " &
                                   "hung=#/#/# " &
                                   "aligned=# " &
                                   "inverted=# " &
                                   "word_errors=#/#/# " &
                                   "hdmi=# " &
                                   "avi=# " &
                                   "colour=# " &
                                   "limited=# " &
                                   "vic=# " &
                                   "packet_errors=#/# " &
                                   "following=# " &
                                   "unsupported=# " &
                                   "columns=# " &
                                   "rows=# " &
                                   "rate=# " &
                                   "hsync=# " &
                                   "vsync=# " &
                                   "marks=# " &
                                   "errors=# " &
                                   "edid=# " &
                                   "monitor=# " &
                                   "monitor_mode=#/#/# " &
                                   "monitor_ok=#";

  constant STATUS_NUMBERS : positive := 47;

  -- Two's complement.
  subtype number_t is std_logic_vector(15 downto 0);

  subtype status_vector_t is std_logic_vector(16 * STATUS_NUMBERS - 1 downto 0);

  -- The numbers; of a field with several the first is in the low bits.

  type status_t is record
    slice         : number_t;
    slices        : number_t;
    sweep         : number_t;
    output        : number_t;
    outputs       : number_t;
    text          : number_t;
    pass          : number_t;
    pattern       : number_t;
    clock         : number_t;
    present       : number_t;
    running       : number_t;
    restarts      : number_t;
    lost_locks    : number_t;
    tracking      : number_t;
    taps          : std_logic_vector(47 downto 0);
    hung          : std_logic_vector(47 downto 0);
    aligned       : number_t;
    inverted      : number_t;
    word_errors   : std_logic_vector(47 downto 0);
    hdmi          : number_t;
    avi           : number_t;
    colour        : number_t;
    limited       : number_t;
    vic           : number_t;
    packet_errors : std_logic_vector(31 downto 0);
    following     : number_t;
    unsupported   : number_t;
    columns       : number_t;
    rows          : number_t;
    rate          : number_t;
    hsync         : number_t;
    vsync         : number_t;
    marks         : number_t;
    errors        : number_t;
    edid          : number_t;
    monitor       : number_t;
    monitor_mode  : std_logic_vector(47 downto 0);
    monitor_ok    : number_t;
  end record status_t;

  -- All numbers in order, the first one in the low bits.
  function to_vector (
    status : status_t
  ) return std_logic_vector;

end package status_pkg;

package body status_pkg is

  function to_vector (
    status : status_t
  ) return std_logic_vector is
  begin

    return status.monitor_ok &
           status.monitor_mode &
           status.monitor &
           status.edid &
           status.errors &
           status.marks &
           status.vsync &
           status.hsync &
           status.rate &
           status.rows &
           status.columns &
           status.unsupported &
           status.following &
           status.packet_errors &
           status.vic &
           status.limited &
           status.colour &
           status.avi &
           status.hdmi &
           status.word_errors &
           status.inverted &
           status.aligned &
           status.hung &
           status.taps &
           status.tracking &
           status.lost_locks &
           status.restarts &
           status.running &
           status.present &
           status.clock &
           status.pattern &
           status.pass &
           status.text &
           status.outputs &
           status.output &
           status.sweep &
           status.slices &
           status.slice;

  end function to_vector;

end package body status_pkg;
