-- SPDX-License-Identifier: Apache-2.0
-- What control and video path of an HDMI board tell each other, both in the pixel clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.tmds_pkg.all;
use work.video_pkg.all;

package hdmi_pkg is

  -- Errors: those of refocus_video, then words that no encoder sends.
  constant WRONG_WORD : natural  := 4;
  constant ERRORS     : positive := 5;

  -- Bits of the counters of such words, of packets with errors, of the positions of the delay lines, and of the
  -- counters of restarts and of their hangs.
  constant WORD_ERROR_BITS   : positive := 12;
  constant PACKET_ERROR_BITS : positive := 8;
  constant TAP_BITS          : positive := 8;
  constant RARE_BITS         : positive := 8;

  -- What the panel wants of the video path.

  type video_settings_t is record
    -- The input as it is; slice, sweep through all slices, frames for each.
    pass_through : std_logic;
    slice        : std_logic_vector(7 downto 0);
    sweep        : std_logic;
    sweep_frames : std_logic_vector(7 downto 0);
    -- Place of the output that is shown; place of the text: 0 none, 1 at the top, 2 at the bottom.
    shown      : std_logic_vector(1 downto 0);
    text_place : std_logic_vector(1 downto 0);
    -- The test pattern instead of the input.
    show_pattern : std_logic;
    -- Each change of it clears the errors.
    clear_toggle : std_logic;
    -- Word for the load port of a sensor's resampler: kind (2 bits), address (20), data (40). Each change of the toggle
    -- is a word.
    load_word   : std_logic_vector(61 downto 0);
    load_toggle : std_logic;
  end record video_settings_t;

  -- What the video path reports.

  type video_state_t is record
    -- Channels of the receiver that are aligned to words.
    aligned : std_logic_vector(CHANNELS - 1 downto 0);
    -- The timing is understood and the picture refocused; it is stable but cannot be followed.
    following   : std_logic;
    unsupported : std_logic;
    -- Errors since the last clearing.
    errors : std_logic_vector(ERRORS - 1 downto 0);
    -- Words of each channel that no encoder sends, since the last clearing.
    word_errors : std_logic_vector(WORD_ERROR_BITS * CHANNELS - 1 downto 0);
    -- What the source sends, see tmds_receiver; packets with wrong check bits and InfoFrames with a wrong
    -- sum, since the last clearing.
    hdmi          : std_logic;
    informed      : std_logic;
    colour        : std_logic_vector(1 downto 0);
    limited       : std_logic;
    format_code   : std_logic_vector(7 downto 0);
    packet_errors : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0);
    sum_errors    : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0);
    -- Size of the picture, and whether the syncs are positive.
    columns : count_t;
    rows    : count_t;
    h_sync  : std_logic;
    v_sync  : std_logic;
    -- Vertical sync itself.
    v_sync_now : std_logic;
    -- Toggle of the last word for the load port that has arrived.
    load_seen : std_logic;
  end record video_state_t;

  constant SOURCE_BITS : positive := 13 + 2 * PACKET_ERROR_BITS;

  constant STATE_BITS : positive := CHANNELS + 2 + ERRORS + WORD_ERROR_BITS * CHANNELS + 2 * COUNT_BITS + 4 +
                                    SOURCE_BITS;

  subtype state_vector_t is std_logic_vector(STATE_BITS - 1 downto 0);

  function to_vector (
    state : video_state_t
  ) return std_logic_vector;

  function to_state (
    vector : std_logic_vector(STATE_BITS - 1 downto 0)
  ) return video_state_t;

end package hdmi_pkg;

package body hdmi_pkg is

  function to_vector (
    state : video_state_t
  ) return std_logic_vector is
  begin

    return state.sum_errors & state.packet_errors & state.format_code & state.limited & state.colour &
           (state.informed & state.hdmi) & state.load_seen & state.v_sync_now & state.v_sync & state.h_sync &
           std_logic_vector(state.rows) & std_logic_vector(state.columns) & state.word_errors &
           (state.errors & state.unsupported & state.following & state.aligned);

  end function to_vector;

  function to_state (
    vector : std_logic_vector(STATE_BITS - 1 downto 0)
  ) return video_state_t is

    constant FLAGS : positive := CHANNELS + 2;
    constant WORDS : positive := FLAGS + ERRORS;
    constant SIZE  : positive := WORDS + WORD_ERROR_BITS * CHANNELS;
    constant SYNCS : positive := SIZE + 2 * COUNT_BITS;
    constant TOLD  : positive := SYNCS + 4;
    constant WRONG : positive := TOLD + 13;
    variable state : video_state_t;

  begin

    state.aligned     := vector(CHANNELS - 1 downto 0);
    state.following   := vector(CHANNELS);
    state.unsupported := vector(CHANNELS + 1);
    state.errors      := vector(WORDS - 1 downto FLAGS);
    state.word_errors := vector(SIZE - 1 downto WORDS);
    state.columns     := unsigned(vector(SIZE + COUNT_BITS - 1 downto SIZE));
    state.rows        := unsigned(vector(SYNCS - 1 downto SIZE + COUNT_BITS));
    state.h_sync      := vector(SYNCS);
    state.v_sync      := vector(SYNCS + 1);
    state.v_sync_now  := vector(SYNCS + 2);
    state.load_seen   := vector(SYNCS + 3);

    state.hdmi          := vector(TOLD);
    state.informed      := vector(TOLD + 1);
    state.colour        := vector(TOLD + 3 downto TOLD + 2);
    state.limited       := vector(TOLD + 4);
    state.format_code   := vector(TOLD + 12 downto TOLD + 5);
    state.packet_errors := vector(WRONG + PACKET_ERROR_BITS - 1 downto WRONG);
    state.sum_errors    := vector(WRONG + 2 * PACKET_ERROR_BITS - 1 downto WRONG + PACKET_ERROR_BITS);
    return state;

  end function to_state;

end package body hdmi_pkg;
