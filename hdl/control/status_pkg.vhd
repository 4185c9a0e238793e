-- The status line of the serial port; built by scripts/build_hdl.py from the list of its fields in
-- plenofir_tb.hdmi.status.

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
                                   "polarity=# " &
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
                                   "varying=# " &
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

  constant STATUS_NUMBERS : positive := 49;

  -- Two's complement.
  subtype number_t is std_logic_vector(15 downto 0);

  subtype status_vector_t is std_logic_vector(16 * STATUS_NUMBERS - 1 downto 0);

  -- The numbers; of a field with several the first is in the low bits.

  type status_t is record
    -- The slice that is shown.
    slice : number_t;
    -- Number of slices.
    slices : number_t;
    -- Frames for each slice of a sweep, 0: none.
    sweep : number_t;
    -- The output that is shown, by its place in the scene's list of outputs, from 0.
    output : number_t;
    -- Number of outputs.
    outputs : number_t;
    -- Text over the picture, 0: none, 1: at the top, 2: at the bottom.
    text : number_t;
    -- 1: the input is passed through.
    pass : number_t;
    -- 1: test pattern instead of J3.
    pattern : number_t;
    -- TMDS clock at J3 in units of 100 kHz.
    clock : number_t;
    -- 1: the TMDS clock is steady and in range.
    present : number_t;
    -- 1: both PLLs are locked and the logic runs.
    running : number_t;
    -- Times that a running link was restarted, for a lost clock, a lost lock, or no data.
    restarts : number_t;
    -- Times that a PLL did not lock within 50 ms (Atlys: 10 ms) and was started again.
    lost_locks : number_t;
    -- Sum of 1, 2, 4: delay lines of channels 0, 1, 2 work.
    tracking : number_t;
    -- Steps that the delay of channels 0/1/2 has moved from the middle of a bit, to follow it.
    taps : std_logic_vector(47 downto 0);
    -- Times that delay lines of channels 0/1/2 did not answer and were reset.
    hung : std_logic_vector(47 downto 0);
    -- Sum of 1, 2, 4: word boundaries found in channels 0, 1, 2.
    aligned : number_t;
    -- What `i` has set: 8: swapped wires are found with an HDMI source, 0 to 7: sum of 1, 2, 4 for
    -- channels that are inverted.
    polarity : number_t;
    -- Sum of 1, 2, 4: channels 0, 1, 2 are inverted, as their wires are swapped; 7: the whole
    -- connector is the wrong way round (ULX3S: both rows of the header).
    inverted : number_t;
    -- Words in channels 0/1/2 that no encoder sends.
    word_errors : std_logic_vector(47 downto 0);
    -- 1: the source sends HDMI, 0: DVI.
    hdmi : number_t;
    -- 1: an HDMI source has described its picture (AVI InfoFrame).
    avi : number_t;
    -- Colours of the source: 0: RGB, 1: YCbCr 4:2:2, 2: YCbCr 4:4:4, 3: YCbCr 4:2:0; 2 is converted
    -- to RGB, 1 and 3 are not.
    colour : number_t;
    -- 1: the source sends black as 16 and white as 235; converted to full range, except where
    -- colour is 1 or 3.
    limited : number_t;
    -- Video format of the source (VIC of CEA-861), 0: none.
    vic : number_t;
    -- Packets of an HDMI source with wrong check bits / InfoFrames with a wrong checksum.
    packet_errors : std_logic_vector(31 downto 0);
    -- 1: timing understood, picture refocused.
    following : number_t;
    -- 1: timing is stable, but lines are too long or blanking is too short: the input is passed
    -- through.
    unsupported : number_t;
    -- 1: frames are not all alike (interlaced, variable refresh rate, lines or blanking that
    -- differ): the input is passed through.
    varying : number_t;
    -- Measured width.
    columns : number_t;
    -- Measured height.
    rows : number_t;
    -- Frames in ten seconds: 600 is 60 Hz; 0: no frames.
    rate : number_t;
    -- 1: horizontal sync is positive.
    hsync : number_t;
    -- 1: vertical sync is positive.
    vsync : number_t;
    -- 2: the picture arrives as `plenofir board picture` made it, to the bit; 1: its colours were
    -- changed; 0: it has no marks, or was scaled or moved.
    marks : number_t;
    -- Sum of 1: pixel lost at the refocuser's input, 2: pixel missing at its output, 4: a frame
    -- began elsewhere, 8: the refocuser saw a broken frame, 16: a word that no encoder sends.
    errors : number_t;
    -- Bytes that the source has read from the EDID.
    edid : number_t;
    -- EDID of the monitor at J2: 0: no answer, 1: read, 2: it answers, but header or checksum is
    -- wrong, 3: a line of its data channel stays low.
    monitor : number_t;
    -- The monitor's preferred columns/rows/rate (in 0.1 Hz; rows and rate of fields if it is
    -- interlaced).
    monitor_mode : std_logic_vector(47 downto 0);
    -- 1: the EDID of the monitor has the current mode.
    monitor_ok : number_t;
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
           status.varying &
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
           status.polarity &
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
