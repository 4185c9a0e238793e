-- SPDX-License-Identifier: Apache-2.0
-- What describes the timing of a video mode, as a record and as a vector for ports.
--
-- Columns are counted from the first active pixel of a line, also in lines without any; lines from
-- the first active line. A pulse lasts from its begin up to, not including, its end.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package video_pkg is

  constant COUNT_BITS : positive := 12;

  subtype count_t is unsigned(COUNT_BITS - 1 downto 0);

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
    h_sync_level        : std_logic;
    v_sync_level        : std_logic;
  end record timing_t;

  constant TIMING_BITS : positive := 10 * COUNT_BITS + 2;

  subtype timing_vector_t is std_logic_vector(TIMING_BITS - 1 downto 0);

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

  function to_vector (
    timing : timing_t
  ) return std_logic_vector;

  function to_timing (
    vector : std_logic_vector(TIMING_BITS - 1 downto 0)
  ) return timing_t;

  -- The timing of a mode given as its parts, as in data sheets; vertical sync changes with the
  -- leading edge of horizontal sync.
  function mode_timing (
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

  function to_vector (
    timing : timing_t
  ) return std_logic_vector is
  begin

    return timing.v_sync_level &
           (timing.h_sync_level & std_logic_vector(timing.v_sync_end_column) &
             std_logic_vector(timing.v_sync_end_line) & std_logic_vector(timing.v_sync_begin_column) &
             std_logic_vector(timing.v_sync_begin_line) & std_logic_vector(timing.frame_lines) &
             std_logic_vector(timing.rows) & std_logic_vector(timing.h_sync_end) &
             std_logic_vector(timing.h_sync_begin) & std_logic_vector(timing.line_length) &
             std_logic_vector(timing.columns));

  end function to_vector;

  -- The n-th count from the low end.

  function count_of (
    vector : std_logic_vector(TIMING_BITS - 1 downto 0);
    n      : natural
  ) return unsigned is
  begin

    return unsigned(vector((n + 1) * COUNT_BITS - 1 downto n * COUNT_BITS));

  end function count_of;

  function to_timing (
    vector : std_logic_vector(TIMING_BITS - 1 downto 0)
  ) return timing_t is

    variable timing : timing_t;

  begin

    timing.columns             := count_of(vector, 0);
    timing.line_length         := count_of(vector, 1);
    timing.h_sync_begin        := count_of(vector, 2);
    timing.h_sync_end          := count_of(vector, 3);
    timing.rows                := count_of(vector, 4);
    timing.frame_lines         := count_of(vector, 5);
    timing.v_sync_begin_line   := count_of(vector, 6);
    timing.v_sync_begin_column := count_of(vector, 7);
    timing.v_sync_end_line     := count_of(vector, 8);
    timing.v_sync_end_column   := count_of(vector, 9);
    timing.h_sync_level        := vector(TIMING_BITS - 2);
    timing.v_sync_level        := vector(TIMING_BITS - 1);
    return timing;

  end function to_timing;

  function mode_timing (
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

    timing.columns             := to_unsigned(h_active, COUNT_BITS);
    timing.line_length         := to_unsigned(h_active + h_front + h_sync + h_back, COUNT_BITS);
    timing.h_sync_begin        := to_unsigned(h_active + h_front, COUNT_BITS);
    timing.h_sync_end          := to_unsigned(h_active + h_front + h_sync, COUNT_BITS);
    timing.rows                := to_unsigned(v_active, COUNT_BITS);
    timing.frame_lines         := to_unsigned(v_active + v_front + v_sync + v_back, COUNT_BITS);
    timing.v_sync_begin_line   := to_unsigned(v_active + v_front, COUNT_BITS);
    timing.v_sync_begin_column := to_unsigned(h_active + h_front, COUNT_BITS);
    timing.v_sync_end_line     := to_unsigned(v_active + v_front + v_sync, COUNT_BITS);
    timing.v_sync_end_column   := to_unsigned(h_active + h_front, COUNT_BITS);
    timing.h_sync_level        := '0';
    timing.v_sync_level        := '0';

    if h_positive then
      timing.h_sync_level := '1';
    end if;

    if v_positive then
      timing.v_sync_level := '1';
    end if;

    return timing;

  end function mode_timing;

end package body video_pkg;
