-- SPDX-License-Identifier: Apache-2.0
-- Video as records: a pixel with its syncs, a pixel of a stream, a place in a raster, and the timing of a mode.
--
-- Columns are counted from the first active pixel of a line, also in lines without any; lines from the first active
-- line. A pulse lasts from its begin up to, not including, its end. A line of a mode with positive syncs:
--
--   active   ________________
--   _________|               |______________________________
--   h_sync                          ________
--   ________________________________|       |_______________
--   column   0        columns - 1   h_sync_begin  line_length - 1
--                                          h_sync_end

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

package video_pkg is

  -- Counts up to 4095 pixels a line and lines a frame, blanking included: enough for all modes of the pixel clocks
  -- supported here.
  constant COUNT_BITS : positive := 12;

  subtype count_t is unsigned(COUNT_BITS - 1 downto 0);

  -- The timing of a mode. Vertical sync may change anywhere in a line, so its ends have a column too.
  type timing_t is record
    columns             : count_t;
    line_length         : count_t;
    h_sync_begin        : count_t;
    h_sync_end          : count_t;
    rows                : count_t;
    frame_lines         : count_t;
    v_sync_begin_line   : count_t;
    v_sync_begin_column : count_t;
    v_sync_end_line     : count_t;
    v_sync_end_column   : count_t;
    -- Levels of the pulses: '1' for positive syncs.
    h_sync_level : std_logic;
    v_sync_level : std_logic;
  end record timing_t;

  constant NO_TIMING : timing_t :=
  (
    columns             => (others => '0'),
    line_length         => (others => '0'),
    h_sync_begin        => (others => '0'),
    h_sync_end          => (others => '0'),
    rows                => (others => '0'),
    frame_lines         => (others => '0'),
    v_sync_begin_line   => (others => '0'),
    v_sync_begin_column => (others => '0'),
    v_sync_end_line     => (others => '0'),
    v_sync_end_column   => (others => '0'),
    h_sync_level        => '0',
    v_sync_level        => '0'
  );

  -- A colour: red in the low bits, then green, then blue.
  subtype pixel_t is std_logic_vector(23 downto 0);

  -- One pixel clock of video.
  type video_t is record
    -- Inside the picture ("data enable"); outside, the pixel has no meaning.
    active : std_logic;
    h_sync : std_logic;
    v_sync : std_logic;
    pixel  : pixel_t;
  end record video_t;

  constant NO_VIDEO : video_t := ('0', '0', '0', (others => '0'));

  -- The signals that the source of an AXI4-Stream of pixels drives; tready goes the other way and is a port beside
  -- this record.
  type stream_t is record
    tvalid : std_logic;
    tdata  : pixel_t;
    -- The first pixel of a frame.
    tuser : std_logic_vector(0 downto 0);
    -- The last pixel of a line.
    tlast : std_logic;
  end record stream_t;

  -- A place in the raster of a mode, and its marks.
  type raster_t is record
    -- The raster runs; until then all but the place is '0'.
    running : std_logic;
    column  : count_t;
    row     : count_t;
    -- active: inside the picture; frame_first: the picture's first pixel; then the last pixel of each of its
    -- lines.
    active      : std_logic;
    frame_first : std_logic;
    line_last   : std_logic;
    h_sync      : std_logic;
    v_sync      : std_logic;
  end record raster_t;

  -- The output of video_to_stream for those who follow its timing: whether the timing can be followed, the timing,
  -- and the place of the present pixel, in the blanking too.
  type following_t is record
    running : std_logic;
    timing  : timing_t;
    column  : count_t;
    row     : count_t;
  end record following_t;

  -- The timing of a mode, from its parts as data sheets give them. Vertical sync changes with the leading edge of
  -- horizontal sync. Stops elaboration if the parts of a line or of a frame (a board's generics PATTERN_H_ and
  -- PATTERN_V_) add up to more than a count holds; the message begins with the name.
  function mode_timing (
    name       : string;
    h_active   : positive;
    h_front    : positive;
    h_sync     : positive;
    h_back     : positive;
    v_active   : positive;
    v_front    : positive;
    v_sync     : positive;
    v_back     : positive;
    h_positive : boolean;
    v_positive : boolean
  ) return timing_t;

end package video_pkg;

package body video_pkg is

  function to_count (
    value : natural
  ) return count_t is
  begin

    return to_unsigned(value, COUNT_BITS);

  end function to_count;

  function mode_timing (
    name       : string;
    h_active   : positive;
    h_front    : positive;
    h_sync     : positive;
    h_back     : positive;
    v_active   : positive;
    v_front    : positive;
    v_sync     : positive;
    v_back     : positive;
    h_positive : boolean;
    v_positive : boolean
  ) return timing_t is

    variable timing : timing_t;

  begin

    assert h_active + h_front + h_sync + h_back < 2 ** COUNT_BITS
      report name & ": PATTERN_H_ACTIVE and its blanking exceed 4095 pixels"
      severity failure;

    assert v_active + v_front + v_sync + v_back < 2 ** COUNT_BITS
      report name & ": PATTERN_V_ACTIVE and its blanking exceed 4095 lines"
      severity failure;

    -- Vertical sync begins and ends where a horizontal one begins, as in CEA-861's progressive modes.
    timing.columns             := to_count(h_active);
    timing.line_length         := to_count(h_active + h_front + h_sync + h_back);
    timing.h_sync_begin        := to_count(h_active + h_front);
    timing.h_sync_end          := to_count(h_active + h_front + h_sync);
    timing.rows                := to_count(v_active);
    timing.frame_lines         := to_count(v_active + v_front + v_sync + v_back);
    timing.v_sync_begin_line   := to_count(v_active + v_front);
    timing.v_sync_begin_column := timing.h_sync_begin;
    timing.v_sync_end_line     := to_count(v_active + v_front + v_sync);
    timing.v_sync_end_column   := timing.h_sync_begin;
    timing.h_sync_level        := to_logic(h_positive);
    timing.v_sync_level        := to_logic(v_positive);

    return timing;

  end function mode_timing;

end package body video_pkg;
