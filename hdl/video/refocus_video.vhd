-- SPDX-License-Identifier: Apache-2.0
-- Video in, refocused video out: the same timing, later by the latency of the refocuser.
--
-- Input -> video_to_stream -> (sensor_raster) -> picture_core -> stream_to_video -> output. No frame is stored: the
-- output's syncs are made anew from the measured timing, as much later as the pixels are. With
-- pass_through, or where the timing cannot be followed (lines too long), the input goes to the
-- output as it is.
--
-- Blanking. The refocuser pushes the last lines of a frame out by itself in the vertical blanking,
-- or with the first lines of the next frame where the blanking is shorter than D lines. What
-- arrives meanwhile waits in the refocuser's input FIFO (a line), which empties again in the
-- horizontal blanking. A focal stack gets black lines in the blanking instead.
--
-- Sensor. With SENSOR frames of RAW_COLUMNS x RAW_ROWS pixels are those of a sensor, grey or a mosaic in red, or RGB.
-- Their raster of micro images, or what is refocused of it, is smaller and shown in the middle, with black around; see
-- sensor_front. When another output is chosen or the raster gets another size, all begins again with the next frame.
-- Outputs: refocused and micro images.
--
-- Latency: D lines and D + 21 pixels with exact sums of nearest neighbours, D = total_delay of the
--   refocuser (in general picture_delay_lines lines and picture_delay_pixels + 5 pixels), the same for all slices and
--   outputs; 1 clock passed through. With a sensor sensor_delay_lines and half of what the raster has less lines more,
--   micro images D lines less.
-- Throughput: one pixel each clock.
-- Equation: out frame = picture of the in frame, see picture_core.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.arithmetic_pkg.all;
use work.picture_pkg.all;
use work.video_pkg.all;

entity refocus_video is
  generic (
    -- M, the slices, how they are computed, what can be shown; see picture_core.
    MICRO_IMAGE_SIZE    : positive range 1 to 128;
    SHIFTS              : string;
    INTERPOLATION_ORDER : natural range 0 to 3          := 0;
    HOLD                : boolean                       := false;
    MAX_COLUMNS         : positive range 1 to 8192;
    EXACT               : boolean                       := true;
    FRACTION_BITS       : natural range 0 to 12         := 8;
    GUARD_BITS          : natural range 0 to 12         := 2;
    BROADCAST_TAPS      : natural                       := 0;
    ENGINE              : string                        := "fir";
    CHANNELS            : positive range 1 to 3         := 3;
    OUTPUTS             : string                        := "r";
    RADIUS              : natural range 0 to 8          := 1;
    CONFIDENCE          : natural range 0 to 1073741823 := 0;
    VOTE_RADIUS         : natural range 0 to 4          := 0;
    COLOURS             : string                        := "";
    -- Whether raw frames of a sensor come in, and their size; MAX_COLUMNS is then that of the raster.
    SENSOR      : boolean                  := false;
    RAW_COLUMNS : positive range 2 to 4095 := 2;
    RAW_ROWS    : positive range 1 to 4095 := 2;
    -- What the sensor's resampler is built for; RED_PLACE: line (2) and column (1) of the mosaic's first red pixel.
    MOSAIC    : boolean                     := false;
    RED_PLACE : natural range 0 to 3        := 0;
    HEXAGONAL : boolean                     := false;
    LINES     : positive range 4 to 256     := 4;
    LENSES    : positive range 2 to 1048576 := 2;
    MOVES     : boolean                     := false;
    GAINS     : boolean                     := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Show the input as it is.
    pass_through : in    std_logic;
    -- Slice, sweep and its frames for each slice, place in OUTPUTS; from the next frame on.
    slice        : in    std_logic_vector(7 downto 0);
    sweep        : in    std_logic;
    sweep_frames : in    std_logic_vector(7 downto 0);
    shown        : in    std_logic_vector(1 downto 0);
    -- Load port of the sensor's calibration, see resampler.
    load_write   : in    std_logic;
    load_kind    : in    std_logic_vector(1 downto 0);
    load_address : in    std_logic_vector(19 downto 0);
    load_data    : in    std_logic_vector(39 downto 0);
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
    -- output, 2 a frame began elsewhere, 3 any of the core's error flags, of the sensor's, or a raster larger than
    -- the frame.
    errors : out   std_logic_vector(3 downto 0)
  );
end entity refocus_video;

architecture rtl of refocus_video is

  constant ARITHMETIC : arithmetic_t :=
  (EXACT, MICRO_IMAGE_SIZE, 8, FRACTION_BITS, GUARD_BITS,
    INTERPOLATION_ORDER + 1
  );
  constant REFUSED    : boolean      := not takes_picture("refocus_video", ARITHMETIC, SHIFTS, HOLD, MAX_COLUMNS,
                                                          CHANNELS, BROADCAST_TAPS, ENGINE, OUTPUTS, RADIUS,
                                                          VOTE_RADIUS, COLOURS);
  constant SENSORLESS : boolean      := not takes(SENSOR or not has_output(OUTPUTS, 'm'),
                                                  "refocus_video: OUTPUTS of the letter m need SENSOR");
  constant STACKED    : boolean      := not takes(not (SENSOR and needs_stack(OUTPUTS)),
                                                  "refocus_video: SENSOR needs OUTPUTS of the letters r and m");

  constant MOVING_SUM : boolean := same_text(ENGINE, "moving_sum");

  constant DELAY_LINES  : natural := picture_delay_lines(OUTPUTS, MICRO_IMAGE_SIZE, SHIFTS, INTERPOLATION_ORDER,
                                                         RADIUS, VOTE_RADIUS);
  constant DELAY_PIXELS : natural := picture_delay_pixels(OUTPUTS, MICRO_IMAGE_SIZE, SHIFTS, INTERPOLATION_ORDER,
                                                          RADIUS, VOTE_RADIUS, ENGINE, not EXACT, BROADCAST_TAPS);

  -- The largest lag.
  constant LAG_LINES : natural := DELAY_LINES +
                                  choose(SENSOR, sensor_delay_lines(MICRO_IMAGE_SIZE, MOSAIC) + (RAW_ROWS + 1) / 2, 0);

  constant TOO_LATE : boolean := not takes(LAG_LINES < 2 ** COUNT_BITS,
                                           "refocus_video: SHIFTS and RAW_ROWS need a lag of more than 4095 lines");

  -- Blanking: what the core needs behind a frame; between frames of a sensor some lines.
  constant CORE_BLANK : natural := choose(MOVING_SUM or needs_stack(OUTPUTS), MICRO_IMAGE_SIZE - 1, 0);

  signal followed       : std_logic;
  signal too_large      : std_logic;
  signal core_reset     : std_logic;
  signal mode           : std_logic_vector(TIMING_BITS - 1 downto 0);
  signal mode_now       : timing_t;
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
  signal restart        : std_logic;
  signal lag            : count_t;
  signal lens_valid     : std_logic;
  signal lens_ready     : std_logic;
  signal lens_data      : std_logic_vector(23 downto 0);
  signal lens_user      : std_logic_vector(0 downto 0);
  signal lens_last      : std_logic;
  signal lens_columns   : std_logic_vector(15 downto 0);
  signal lens_rows      : std_logic_vector(15 downto 0);
  signal direct         : std_logic;
  signal place          : std_logic_vector(1 downto 0);
  signal core_valid     : std_logic;
  signal core_ready     : std_logic;
  signal core_take      : std_logic;
  signal core_new       : std_logic;
  signal core_data      : std_logic_vector(23 downto 0);
  signal core_user      : std_logic_vector(0 downto 0);
  signal core_dest      : std_logic_vector(1 downto 0);
  signal sensor_errors  : std_logic_vector(5 downto 0);
  signal unfit          : std_logic;
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
  rows        <= std_logic_vector(resize(mode_now.rows, 16));

  to_stream : entity work.video_to_stream
    generic map (
      MAX_COLUMNS  => choose(SENSOR, RAW_COLUMNS, MAX_COLUMNS),
      DELAY_LINES  => LAG_LINES,
      DELAY_PIXELS => DELAY_PIXELS,
      BLANK_LINES  => larger(CORE_BLANK, choose(SENSOR, 3, 0)),
      ROW_MODULUS  => choose(needs_stack(OUTPUTS), MICRO_IMAGE_SIZE, 1),
      ONLY_COLUMNS => choose(SENSOR, RAW_COLUMNS, 0),
      ONLY_ROWS    => choose(SENSOR, RAW_ROWS, 0)
    )
    port map (
      clk           => clk,
      reset         => reset,
      restart       => restart,
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

  no_sensor : if not SENSOR generate
    lens_valid    <= raw_valid;
    raw_ready     <= lens_ready;
    lens_data     <= raw_data;
    lens_user     <= raw_user;
    lens_last     <= raw_last;
    lens_columns  <= std_logic_vector(resize(mode_now.columns, 16));
    lens_rows     <= stream_rows;
    direct        <= '0';
    place         <= "00";
    restart       <= '0';
    lag           <= to_unsigned(DELAY_LINES, COUNT_BITS);
    sensor_errors <= (others => '0');
  end generate no_sensor;

  sensor_first : if SENSOR generate

    signal followed_before : std_logic := '0';
    signal front_reset     : std_logic;

  begin

    -- Over before the next frame begins: what has no FIFO at its input takes its first pixel.
    front_reset <= reset or (followed_before and not followed);

    note_following : process (clk) is
    begin

      if rising_edge(clk) then
        followed_before <= followed;
      end if;

    end process note_following;

    front : entity work.sensor_front
      generic map (
        MOSAIC           => MOSAIC,
        RED_PLACE        => RED_PLACE,
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        HEXAGONAL        => HEXAGONAL,
        MAX_COLUMNS      => RAW_COLUMNS,
        LINES            => LINES,
        LENSES           => LENSES,
        MOVES            => MOVES,
        GAINS            => GAINS,
        CHANNELS         => CHANNELS,
        OUTPUTS          => OUTPUTS,
        CORE_LINES       => DELAY_LINES
      )
      port map (
        clk            => clk,
        reset          => front_reset,
        following      => followed,
        columns        => mode_now.columns,
        rows           => mode_now.rows,
        column         => column,
        row            => row,
        shown          => shown,
        load_write     => load_write,
        load_kind      => load_kind,
        load_address   => load_address,
        load_data      => load_data,
        s_axis_tvalid  => raw_valid,
        s_axis_tready  => raw_ready,
        s_axis_tdata   => raw_data,
        s_axis_tuser   => raw_user,
        s_axis_tlast   => raw_last,
        m_axis_tvalid  => lens_valid,
        m_axis_tready  => lens_ready,
        m_axis_tdata   => lens_data,
        m_axis_tuser   => lens_user,
        m_axis_tlast   => lens_last,
        raster_columns => lens_columns,
        raster_rows    => lens_rows,
        direct         => direct,
        place          => place,
        lag            => lag,
        restart        => restart,
        error_flags    => sensor_errors,
        error_clear    => '1'
      );

  end generate sensor_first;

  -- Micro images go past the core.
  core_valid     <= lens_valid and not direct;
  lens_ready     <= refocused_take when direct = '1' else
                    core_ready;
  core_take      <= refocused_take and not direct;
  refocused      <= lens_valid when direct = '1' else
                    core_new;
  refocused_data <= lens_data when direct = '1' else
                    core_data;
  refocused_user <= lens_user when direct = '1' else
                    core_user;
  refocused_dest <= place when SENSOR else
                    core_dest;

  core : entity work.picture_core
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      MAX_COLUMNS         => MAX_COLUMNS,
      CHANNELS            => CHANNELS,
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
      columns       => lens_columns,
      rows          => lens_rows,
      picture_rows  => rows,
      slice         => slice,
      sweep         => sweep,
      sweep_frames  => sweep_frames,
      shown         => shown,
      s_axis_tvalid => core_valid,
      s_axis_tready => core_ready,
      s_axis_tdata  => lens_data,
      s_axis_tuser  => lens_user,
      s_axis_tlast  => lens_last,
      m_axis_tvalid => core_new,
      m_axis_tready => core_take,
      m_axis_tdata  => core_data,
      m_axis_tuser  => core_user,
      m_axis_tid    => refocused_id,
      m_axis_tdest  => core_dest,
      m_axis_tlast  => open,
      error_flags   => core_errors,
      error_clear   => '1'
    );

  to_video : entity work.stream_to_video
    generic map (
      DELAY_PIXELS => DELAY_PIXELS,
      WINDOW       => SENSOR
    )
    port map (
      clk             => clk,
      reset           => reset,
      delay_lines     => lag,
      picture_columns => lens_columns,
      picture_rows    => lens_rows,
      too_large       => unfit,
      following       => followed,
      timing          => mode,
      column          => column,
      row             => row,
      s_axis_tvalid   => refocused,
      s_axis_tready   => refocused_take,
      s_axis_tdata    => refocused_data,
      s_axis_tuser    => refocused_user,
      active          => shown_active,
      h_sync          => shown_h_sync,
      v_sync          => shown_v_sync,
      pixel           => shown_pixel,
      running         => open,
      underflow       => underflow
    );

  choose_output : process (clk) is
  begin

    if rising_edge(clk) then
      -- In step with the pixels: stream_to_video has one register behind them.
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
      if core_errors /= "00000" or sensor_errors /= "000000" or (followed and unfit) = '1' then
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
