-- SPDX-License-Identifier: Apache-2.0
-- Video in, refocused video out: the same timing, later by the latency of the refocuser.
--
-- Input -> video_to_stream -> picture_core -> stream_to_video -> output. No frame is stored: the
-- output's syncs are made anew from the measured timing, as much later as the pixels are. With
-- pass_through, or where the timing cannot be followed (lines too long), the input goes to the
-- output as it is.
--
-- Blanking. The refocuser pushes the last lines of a frame out by itself in the vertical blanking,
-- or with the first lines of the next frame where the blanking is shorter than D lines. What
-- arrives meanwhile waits in the refocuser's input FIFO (a line), which empties again in the
-- horizontal blanking. A focal stack gets black lines in the blanking instead.
--
-- Latency: D lines and D + 21 pixels with exact sums of nearest neighbours, D = total_delay of the
--   refocuser (in general picture_delay_lines lines and picture_delay_pixels + 5 pixels), the same for all slices and
--   outputs; 1 clock passed through.
-- Throughput: one pixel each clock.
-- Equation: out frame = picture of the in frame, see picture_core.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.picture_pkg.all;
use work.video_pkg.all;

entity refocus_video is
  generic (
    -- As in picture_core.
    MICRO_IMAGE_SIZE    : positive;
    SHIFTS              : string;
    INTERPOLATION_ORDER : natural := 0;
    HOLD                : boolean := false;
    MAX_COLUMNS         : positive;
    EXACT               : boolean := true;
    FRACTION_BITS       : natural := 8;
    GUARD_BITS          : natural := 2;
    BROADCAST_TAPS      : natural := 0;
    ENGINE              : string  := "fir";
    OUTPUTS             : string  := "r";
    RADIUS              : natural := 1;
    CONFIDENCE          : natural := 0;
    VOTE_RADIUS         : natural := 0;
    COLOURS             : string  := ""
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Show the input as it is.
    pass_through : in    std_logic;
    -- As in picture_core, from the next frame on.
    slice        : in    std_logic_vector(7 downto 0);
    sweep        : in    std_logic;
    sweep_frames : in    std_logic_vector(7 downto 0);
    shown        : in    std_logic_vector(1 downto 0);
    -- Video in: red in the low bits of the pixel.
    in_active : in    std_logic;
    in_h_sync : in    std_logic;
    in_v_sync : in    std_logic;
    in_pixel  : in    std_logic_vector(23 downto 0);
    -- Video out.
    out_active : out   std_logic;
    out_h_sync : out   std_logic;
    out_v_sync : out   std_logic;
    out_pixel  : out   std_logic_vector(23 downto 0);
    -- Of the frame that goes out, from its first pixel on: its slice, the place of its output in OUTPUTS, and whether
    -- it is the input as it is.
    out_slice : out   std_logic_vector(7 downto 0);
    out_shown : out   std_logic_vector(1 downto 0);
    out_raw   : out   std_logic;
    -- The input is understood and refocused.
    following : out   std_logic;
    -- The input has a stable timing that cannot be followed.
    unsupported : out   std_logic;
    -- Timing of the input, see video_pkg.
    timing : out   std_logic_vector(TIMING_BITS - 1 downto 0);
    -- Each for a clock: 0 a pixel was lost at the core's input, 1 one was missing at its
    -- output, 2 a frame began elsewhere, 3 any of the core's error flags.
    errors : out   std_logic_vector(3 downto 0)
  );
end entity refocus_video;

architecture rtl of refocus_video is

  constant MOVING_SUM : boolean := same_text(ENGINE, "moving_sum");

  constant DELAY_LINES  : natural := picture_delay_lines(OUTPUTS, MICRO_IMAGE_SIZE, SHIFTS, INTERPOLATION_ORDER,
                                                         RADIUS, VOTE_RADIUS);
  constant DELAY_PIXELS : natural := picture_delay_pixels(OUTPUTS, MICRO_IMAGE_SIZE, SHIFTS, INTERPOLATION_ORDER,
                                                          RADIUS, VOTE_RADIUS, ENGINE, not EXACT, BROADCAST_TAPS,
                                                          MAX_COLUMNS);

  signal followed       : std_logic;
  signal too_large      : std_logic;
  signal core_reset     : std_logic;
  signal mode           : std_logic_vector(TIMING_BITS - 1 downto 0);
  signal mode_now       : timing_t;
  signal columns        : std_logic_vector(15 downto 0);
  signal rows           : std_logic_vector(15 downto 0);
  signal stream_rows    : std_logic_vector(15 downto 0);
  signal column         : unsigned(COUNT_BITS - 1 downto 0);
  signal row            : unsigned(COUNT_BITS - 1 downto 0);
  signal raw_valid      : std_logic;
  signal raw_ready      : std_logic;
  signal raw_data       : std_logic_vector(23 downto 0);
  signal raw_user       : std_logic_vector(0 downto 0);
  signal raw_last       : std_logic;
  signal refocused      : std_logic;
  signal refocused_take : std_logic;
  signal refocused_data : std_logic_vector(23 downto 0);
  signal refocused_user : std_logic_vector(0 downto 0);
  signal refocused_id   : std_logic_vector(7 downto 0);
  signal refocused_dest : std_logic_vector(1 downto 0);
  signal slice_taken    : std_logic_vector(7 downto 0) := x"00";
  signal shown_taken    : std_logic_vector(1 downto 0) := "00";
  signal shown_active   : std_logic;
  signal shown_h_sync   : std_logic;
  signal shown_v_sync   : std_logic;
  signal shown_pixel    : std_logic_vector(23 downto 0);
  signal core_errors    : std_logic_vector(4 downto 0);
  signal overflow       : std_logic;
  signal underflow      : std_logic;
  signal miss           : std_logic;

begin

  following   <= followed;
  unsupported <= too_large;
  timing      <= mode;
  core_reset  <= reset or not followed;
  mode_now    <= to_timing(mode);
  columns     <= std_logic_vector(resize(mode_now.columns, 16));
  rows        <= std_logic_vector(resize(mode_now.rows, 16));

  to_stream : entity work.video_to_stream
    generic map (
      MAX_COLUMNS  => MAX_COLUMNS,
      DELAY_LINES  => DELAY_LINES,
      DELAY_PIXELS => DELAY_PIXELS,
      BLANK_LINES  => choose(MOVING_SUM or needs_stack(OUTPUTS), MICRO_IMAGE_SIZE - 1, 0),
      ROW_MODULUS  => choose(needs_stack(OUTPUTS), MICRO_IMAGE_SIZE, 1)
    )
    port map (
      clk           => clk,
      reset         => reset,
      active        => in_active,
      h_sync        => in_h_sync,
      v_sync        => in_v_sync,
      pixel         => in_pixel,
      m_axis_tvalid => raw_valid,
      m_axis_tready => raw_ready,
      m_axis_tdata  => raw_data,
      m_axis_tuser  => raw_user,
      m_axis_tlast  => raw_last,
      timing        => mode,
      stream_rows   => stream_rows,
      column        => column,
      row           => row,
      following     => followed,
      unsupported   => too_large,
      overflow      => overflow,
      miss          => miss
    );

  core : entity work.picture_core
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      MAX_COLUMNS         => MAX_COLUMNS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      OUTPUTS             => OUTPUTS,
      RADIUS              => RADIUS,
      CONFIDENCE          => CONFIDENCE,
      VOTE_RADIUS         => VOTE_RADIUS,
      COLOURS             => COLOURS
    )
    port map (
      clk           => clk,
      reset         => core_reset,
      columns       => columns,
      rows          => stream_rows,
      picture_rows  => rows,
      slice         => slice,
      sweep         => sweep,
      sweep_frames  => sweep_frames,
      shown         => shown,
      s_axis_tvalid => raw_valid,
      s_axis_tready => raw_ready,
      s_axis_tdata  => raw_data,
      s_axis_tuser  => raw_user,
      s_axis_tlast  => raw_last,
      m_axis_tvalid => refocused,
      m_axis_tready => refocused_take,
      m_axis_tdata  => refocused_data,
      m_axis_tuser  => refocused_user,
      m_axis_tid    => refocused_id,
      m_axis_tdest  => refocused_dest,
      m_axis_tlast  => open,
      error_flags   => core_errors,
      error_clear   => '1'
    );

  to_video : entity work.stream_to_video
    generic map (
      DELAY_LINES  => DELAY_LINES,
      DELAY_PIXELS => DELAY_PIXELS
    )
    port map (
      clk           => clk,
      reset         => reset,
      following     => followed,
      timing        => mode,
      column        => column,
      row           => row,
      s_axis_tvalid => refocused,
      s_axis_tready => refocused_take,
      s_axis_tdata  => refocused_data,
      s_axis_tuser  => refocused_user,
      active        => shown_active,
      h_sync        => shown_h_sync,
      v_sync        => shown_v_sync,
      pixel         => shown_pixel,
      running       => open,
      underflow     => underflow
    );

  choose_output : process (clk) is
  begin

    if rising_edge(clk) then
      -- In step with the pixels: stream_to_video has one register.
      if refocused = '1' and refocused_take = '1' and refocused_user = "1" then
        slice_taken <= refocused_id;
        shown_taken <= refocused_dest;
      end if;
      out_slice <= slice_taken;
      out_shown <= shown_taken;
      out_raw   <= pass_through or too_large;
      if pass_through = '1' or too_large = '1' then
        out_active <= in_active;
        out_h_sync <= in_h_sync;
        out_v_sync <= in_v_sync;
        out_pixel  <= in_pixel;
      else
        out_active <= shown_active;
        out_h_sync <= shown_h_sync;
        out_v_sync <= shown_v_sync;
        out_pixel  <= shown_pixel;
      end if;
      errors <= "0000";
      if core_errors /= "00000" then
        errors(3) <= '1';
      end if;
      errors(2) <= miss;
      errors(1) <= underflow;
      errors(0) <= overflow and followed;
      if reset = '1' then
        out_active <= '0';
        errors     <= "0000";
      end if;
    end if;

  end process choose_output;

end architecture rtl;
