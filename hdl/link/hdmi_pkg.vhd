-- SPDX-License-Identifier: Apache-2.0
-- Records between the entities of an HDMI board: between control and video path, in the pixel clock; between control,
-- pins and clocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.fault_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

package hdmi_pkg is

  -- Bits of the counters of wrong words, of the counters of packets with errors, of the positions of the delay lines,
  -- and of the counters of restarts and hung delay lines.
  constant WORD_ERROR_BITS   : positive := 12;
  constant PACKET_ERROR_BITS : positive := 8;
  constant TAP_BITS          : positive := 8;
  constant RARE_BITS         : positive := 8;

  -- The lines of a display data channel: their levels at the pins, or '1' to pull them low (open drain).
  type ddc_t is record
    scl : std_logic;
    sda : std_logic;
  end record ddc_t;

  -- Buttons and switches, active high.
  type panel_t is record
    -- Step through the slices, up and down; clear the errors.
    button_up    : std_logic;
    button_down  : std_logic;
    button_clear : std_logic;
    -- Show the test pattern; pass the input through; sweep.
    switch_pattern : std_logic;
    switch_pass    : std_logic;
    switch_sweep   : std_logic;
    -- Step through the outputs; hide the text; put it at the bottom. A board may lack these three.
    button_output : std_logic;
    switch_hide   : std_logic;
    switch_bottom : std_logic;
  end record panel_t;

  constant PANEL_CONTACTS : positive := 9;

  function to_vector (
    panel : panel_t
  ) return std_logic_vector;

  function to_panel (
    vector : std_logic_vector(PANEL_CONTACTS - 1 downto 0)
  ) return panel_t;

  -- A command: which one it is (each high for one clock), and its number.
  type command_t is record
    value        : unsigned(7 downto 0);
    set_slice    : std_logic;
    set_sweep    : std_logic;
    set_pass     : std_logic;
    set_pattern  : std_logic;
    set_output   : std_logic;
    set_place    : std_logic;
    set_polarity : std_logic;
    clear_errors : std_logic;
    -- Set the camera's sensor up again.
    set_up : std_logic;
  end record command_t;

  -- State of the clocks of the video path; from any clock.
  type clocks_state_t is record
    -- The board's own pixel clock runs.
    own_ready : std_logic;
    -- The settings of both PLLs are written; the receiver's and the transmitter's PLL have locked.
    configured      : std_logic;
    receive_locked  : std_logic;
    transmit_locked : std_logic;
  end record clocks_state_t;

  -- Orders to the clocks.
  type clocks_order_t is record
    -- Take the board's own pixel clock.
    use_own : std_logic;
    -- Write the settings of both PLLs (high for one clock); high: the settings for 40 to 100 MHz.
    configure : std_logic;
    high      : std_logic;
    -- Resets of the PLLs; run: releases everything that their clocks drive.
    receive_reset  : std_logic;
    transmit_reset : std_logic;
    run            : std_logic;
  end record clocks_order_t;

  -- Reports of the receiver's delay lines (phase_detector_control, phase_search).
  type lanes_t is record
    tracking : std_logic_vector(CHANNELS - 1 downto 0);
    taps     : std_logic_vector(TAP_BITS * CHANNELS - 1 downto 0);
    -- Each change of a bit: a delay line hung.
    hung_toggle : std_logic_vector(CHANNELS - 1 downto 0);
  end record lanes_t;

  -- Result of the last read of the monitor's EDID.
  type monitor_t is record
    -- 0 no answer, 1 an EDID, 2 an answer that is no EDID, 3 a line stays low.
    state : std_logic_vector(1 downto 0);
    -- The preferred mode of an EDID (else 0), its rate in 0.1 Hz; offered: the EDID has the present mode.
    columns : std_logic_vector(11 downto 0);
    rows    : std_logic_vector(11 downto 0);
    rate    : std_logic_vector(11 downto 0);
    offered : std_logic;
  end record monitor_t;

  constant NO_MONITOR : monitor_t := ("00", x"000", x"000", x"000", '0');

  -- Settings of the panel for the video path.
  type video_settings_t is record
    choice : picture_choice_t;
    -- Place of the text: 0 none, 1 at the top, 2 at the bottom.
    text_place : std_logic_vector(1 downto 0);
    -- The test pattern instead of the input.
    show_pattern : std_logic;
    -- Channels of the receiver to invert, or FIND_POLARITY.
    polarity : polarity_t;
    -- Each change clears the errors.
    clear_toggle : std_logic;
    -- Word for the load port of a sensor's resampler; each change of the toggle is a word.
    load_word   : load_word_t;
    load_toggle : std_logic;
  end record video_settings_t;

  -- Reports of the video path.

  type video_state_t is record
    -- Channels of the receiver that are aligned to words.
    aligned : std_logic_vector(CHANNELS - 1 downto 0);
    -- Channels that are inverted (tmds_polarity).
    inverted : std_logic_vector(CHANNELS - 1 downto 0);
    -- following: the timing is understood and the picture refocused; unsupported: the timing is stable but cannot be
    -- followed; varying: the frames are not all alike.
    following   : std_logic;
    unsupported : std_logic;
    varying     : std_logic;
    -- Errors since the last clearing.
    errors : std_logic_vector(ERRORS - 1 downto 0);
    -- Wrong words of each channel since the last clearing.
    word_errors : std_logic_vector(WORD_ERROR_BITS * CHANNELS - 1 downto 0);
    -- The kind of source (tmds_receiver; which YCbCr it sends is not reported). Packets with wrong check bits, and
    -- InfoFrames with a wrong sum, since the last clearing.
    hdmi          : std_logic;
    info          : picture_info_t;
    packet_errors : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0);
    sum_errors    : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0);
    -- Size of the picture, and whether the syncs are positive.
    columns : count_t;
    rows    : count_t;
    h_sync  : std_logic;
    v_sync  : std_logic;
    -- Vertical sync, as it is now.
    v_sync_now : std_logic;
    -- Toggle of the last word for the load port that has arrived.
    load_seen : std_logic;
    -- Result of picture_marks.
    marks : std_logic_vector(1 downto 0);
  end record video_state_t;

  -- Where each field of a packed state begins: behind the field before.
  constant AT_ALIGNED     : natural  := 0;
  constant AT_FOLLOWING   : natural  := AT_ALIGNED + CHANNELS;
  constant AT_UNSUPPORTED : natural  := AT_FOLLOWING + 1;
  constant AT_ERRORS      : natural  := AT_UNSUPPORTED + 1;
  constant AT_WORDS       : natural  := AT_ERRORS + ERRORS;
  constant AT_COLUMNS     : natural  := AT_WORDS + WORD_ERROR_BITS * CHANNELS;
  constant AT_ROWS        : natural  := AT_COLUMNS + COUNT_BITS;
  constant AT_H_SYNC      : natural  := AT_ROWS + COUNT_BITS;
  constant AT_V_SYNC      : natural  := AT_H_SYNC + 1;
  constant AT_SYNC_NOW    : natural  := AT_V_SYNC + 1;
  constant AT_LOAD_SEEN   : natural  := AT_SYNC_NOW + 1;
  constant AT_HDMI        : natural  := AT_LOAD_SEEN + 1;
  constant AT_INFORMED    : natural  := AT_HDMI + 1;
  constant AT_COLOUR      : natural  := AT_INFORMED + 1;
  constant AT_LIMITED     : natural  := AT_COLOUR + 2;
  constant AT_FORMAT      : natural  := AT_LIMITED + 1;
  constant AT_PACKETS     : natural  := AT_FORMAT + 8;
  constant AT_SUMS        : natural  := AT_PACKETS + PACKET_ERROR_BITS;
  constant AT_INVERTED    : natural  := AT_SUMS + PACKET_ERROR_BITS;
  constant AT_MARKS       : natural  := AT_INVERTED + CHANNELS;
  constant AT_VARYING     : natural  := AT_MARKS + 2;
  constant STATE_BITS     : positive := AT_VARYING + 1;

  subtype state_vector_t is std_logic_vector(STATE_BITS - 1 downto 0);

  function to_vector (
    state : video_state_t
  ) return std_logic_vector;

  function to_state (
    vector : state_vector_t
  ) return video_state_t;

end package hdmi_pkg;

package body hdmi_pkg is

  -- The place of each contact in a vector.
  constant AT_BUTTON_UP      : natural := 0;
  constant AT_BUTTON_DOWN    : natural := 1;
  constant AT_BUTTON_CLEAR   : natural := 2;
  constant AT_SWITCH_PATTERN : natural := 3;
  constant AT_SWITCH_PASS    : natural := 4;
  constant AT_SWITCH_SWEEP   : natural := 5;
  constant AT_BUTTON_OUTPUT  : natural := 6;
  constant AT_SWITCH_HIDE    : natural := 7;
  constant AT_SWITCH_BOTTOM  : natural := 8;

  function to_vector (
    panel : panel_t
  ) return std_logic_vector is

    variable vector : std_logic_vector(PANEL_CONTACTS - 1 downto 0);

  begin

    vector(AT_BUTTON_UP)      := panel.button_up;
    vector(AT_BUTTON_DOWN)    := panel.button_down;
    vector(AT_BUTTON_CLEAR)   := panel.button_clear;
    vector(AT_SWITCH_PATTERN) := panel.switch_pattern;
    vector(AT_SWITCH_PASS)    := panel.switch_pass;
    vector(AT_SWITCH_SWEEP)   := panel.switch_sweep;
    vector(AT_BUTTON_OUTPUT)  := panel.button_output;
    vector(AT_SWITCH_HIDE)    := panel.switch_hide;
    vector(AT_SWITCH_BOTTOM)  := panel.switch_bottom;
    return vector;

  end function to_vector;

  function to_panel (
    vector : std_logic_vector(PANEL_CONTACTS - 1 downto 0)
  ) return panel_t is
  begin

    return
    (
      button_up      => vector(AT_BUTTON_UP),
      button_down    => vector(AT_BUTTON_DOWN),
      button_clear   => vector(AT_BUTTON_CLEAR),
      switch_pattern => vector(AT_SWITCH_PATTERN),
      switch_pass    => vector(AT_SWITCH_PASS),
      switch_sweep   => vector(AT_SWITCH_SWEEP),
      button_output  => vector(AT_BUTTON_OUTPUT),
      switch_hide    => vector(AT_SWITCH_HIDE),
      switch_bottom  => vector(AT_SWITCH_BOTTOM)
    );

  end function to_panel;

  function to_vector (
    state : video_state_t
  ) return std_logic_vector is

    variable vector : state_vector_t;

  begin

    vector(AT_FOLLOWING - 1 downto AT_ALIGNED) := state.aligned;
    vector(AT_FOLLOWING)                       := state.following;
    vector(AT_UNSUPPORTED)                     := state.unsupported;
    vector(AT_WORDS - 1 downto AT_ERRORS)      := state.errors;
    vector(AT_COLUMNS - 1 downto AT_WORDS)     := state.word_errors;
    vector(AT_ROWS - 1 downto AT_COLUMNS)      := std_logic_vector(state.columns);
    vector(AT_H_SYNC - 1 downto AT_ROWS)       := std_logic_vector(state.rows);
    vector(AT_H_SYNC)                          := state.h_sync;
    vector(AT_V_SYNC)                          := state.v_sync;
    vector(AT_SYNC_NOW)                        := state.v_sync_now;
    vector(AT_LOAD_SEEN)                       := state.load_seen;
    vector(AT_HDMI)                            := state.hdmi;
    vector(AT_INFORMED)                        := state.info.informed;
    vector(AT_LIMITED - 1 downto AT_COLOUR)    := state.info.colour;
    vector(AT_LIMITED)                         := state.info.limited;
    vector(AT_PACKETS - 1 downto AT_FORMAT)    := state.info.format_code;
    vector(AT_SUMS - 1 downto AT_PACKETS)      := state.packet_errors;
    vector(AT_INVERTED - 1 downto AT_SUMS)     := state.sum_errors;
    vector(AT_MARKS - 1 downto AT_INVERTED)    := state.inverted;
    vector(AT_VARYING - 1 downto AT_MARKS)     := state.marks;
    vector(AT_VARYING)                         := state.varying;
    return vector;

  end function to_vector;

  function to_state (
    vector : state_vector_t
  ) return video_state_t is

    variable state : video_state_t;

  begin

    state.aligned          := vector(AT_FOLLOWING - 1 downto AT_ALIGNED);
    state.following        := vector(AT_FOLLOWING);
    state.unsupported      := vector(AT_UNSUPPORTED);
    state.errors           := vector(AT_WORDS - 1 downto AT_ERRORS);
    state.word_errors      := vector(AT_COLUMNS - 1 downto AT_WORDS);
    state.columns          := unsigned(vector(AT_ROWS - 1 downto AT_COLUMNS));
    state.rows             := unsigned(vector(AT_H_SYNC - 1 downto AT_ROWS));
    state.h_sync           := vector(AT_H_SYNC);
    state.v_sync           := vector(AT_V_SYNC);
    state.v_sync_now       := vector(AT_SYNC_NOW);
    state.load_seen        := vector(AT_LOAD_SEEN);
    state.hdmi             := vector(AT_HDMI);
    state.info.informed    := vector(AT_INFORMED);
    state.info.colour      := vector(AT_LIMITED - 1 downto AT_COLOUR);
    state.info.limited     := vector(AT_LIMITED);
    state.info.format_code := vector(AT_PACKETS - 1 downto AT_FORMAT);
    state.packet_errors    := vector(AT_SUMS - 1 downto AT_PACKETS);
    state.sum_errors       := vector(AT_INVERTED - 1 downto AT_SUMS);
    state.inverted         := vector(AT_MARKS - 1 downto AT_INVERTED);
    state.marks            := vector(AT_VARYING - 1 downto AT_MARKS);
    state.varying          := vector(AT_VARYING);
    -- Only the conversion to RGB needs to know which YCbCr it is, and it stands in the pixel clock: this bit does not
    -- cross.
    state.info.bt601 := '0';
    return state;

  end function to_state;

end package body hdmi_pkg;
