-- SPDX-License-Identifier: Apache-2.0
-- Video in, refocused video out with the same timing, delayed by the latency of the refocuser; a text over it.
--
-- Input -> video_to_stream -> (sensor_raster -> sensor_front) -> picture_core -> stream_to_video -> (text_overlay)
-- -> output. No frame is stored: the output's syncs are generated from the measured timing, delayed as much as the
-- pixels. With pass_through, or if the timing cannot be followed (lines too long, frames not all alike), the input goes
-- to the output unchanged. screen_pkg has the possible outputs, and the text over them; sensor_pkg says whether the
-- input is a sensor's raw frames.
--
-- Blanking. The refocuser pushes the last lines of a frame out in the vertical blanking, or with the first lines of the
-- next frame if the blanking is shorter than D lines. Pixels that arrive meanwhile wait in its input FIFO (a line),
-- which empties again in the horizontal blanking. A focal stack gets black lines in the blanking instead.
--
-- Sensor. Frames of the sensor's size are raw frames: grey, a mosaic in red, or RGB. The raster of micro images, or the
-- picture refocused from it, is smaller and is shown in the middle with black around it (sensor_front). When another
-- output is chosen or the raster changes its size, everything restarts with the next frame. The outputs are the
-- refocused picture and the micro images.
--
-- Latency: D lines and D + 21 pixels with exact sums of nearest neighbours, D = total_delay of the refocuser (in
-- general picture_delay_lines lines and picture_delay_pixels + 5 pixels), equal for all slices and outputs; 1 clock
-- with pass_through; with a text OVERLAY_LATENCY clocks more. With a sensor sensor_delay_lines more, and half of the
-- lines that the raster has fewer; micro images D lines less.
-- Throughput: one pixel each clock.
-- Equation: out frame = picture of the in frame (picture_core), with the text.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.fault_pkg.all;
use work.core_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.screen_pkg.all;
use work.sensor_pkg.all;
use work.video_pkg.all;

entity refocus_video is
  generic (
    -- The core of the picture (picture_core_of).
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- What is to be shown.
    choice : in    picture_choice_t;
    -- Place of the text: 0 none, 1 at the top, 2 at the bottom; errors whose number the text shows.
    text_place  : in    std_logic_vector(1 downto 0)          := "00";
    text_errors : in    std_logic_vector(ERRORS - 1 downto 0) := (others => '0');
    -- Load port of the sensor's calibration.
    load : in    load_t;
    -- Video in, and out.
    in_video  : in    video_t;
    out_video : out   video_t;
    -- What the outgoing frame shows, from its first pixel on.
    on_show : out   on_show_t;
    -- The input's timing is followed and its frames are refocused.
    following : out   std_logic;
    -- The input has a stable timing that cannot be followed.
    unsupported : out   std_logic;
    -- The input has frames that are not all alike, so it cannot be followed either.
    varying : out   std_logic;
    -- Timing of the input.
    timing : out   timing_t;
    -- The errors of fault_pkg, each high for one clock.
    errors : out   std_logic_vector(VIDEO_ERROR_BITS - 1 downto 0)
  );
end entity refocus_video;

architecture rtl of refocus_video is

  constant M       : positive := CORE.geometry.micro_image_size;
  constant BETWEEN : boolean  := shades(slices_of(CORE), COLOURS) > 1;

  constant DELAY_LINES  : natural := picture_delay_lines(CORE, SHARPNESS_RADIUS, VOTE_RADIUS);
  constant DELAY_PIXELS : natural := picture_delay_pixels(CORE, SHARPNESS_RADIUS, VOTE_RADIUS, BETWEEN);

  -- Blank lines that the core needs behind a frame: moving sums and a stack go on to a multiple of M lines.
  constant CORE_BLANK : natural := CORE.plan.modulus - 1;

  signal followed    : following_t;
  signal too_large   : std_logic;
  signal unequal     : std_logic;
  signal passes      : std_logic;
  signal core_reset  : std_logic;
  signal rows        : std_logic_vector(15 downto 0);
  signal stream_rows : std_logic_vector(15 downto 0);

  -- Streams: pixels of the input (raw), of the raster of micro images (lens), to the core, from the core, and to the
  -- screen.
  signal raw           : stream_t;
  signal raw_ready     : std_logic;
  signal lens          : stream_t;
  signal lens_ready    : std_logic;
  signal front         : front_t;
  signal to_core       : stream_t;
  signal to_core_ready : std_logic;
  signal from_core     : stream_t;
  signal from_core_id  : std_logic_vector(7 downto 0);
  signal core_place    : std_logic_vector(1 downto 0);
  signal core_take     : std_logic;
  signal shown         : stream_t;
  signal shown_ready   : std_logic;
  signal shown_place   : std_logic_vector(1 downto 0);
  signal shown_video   : video_t;

  -- Slice and output of the frame that is shown, read with its first pixel.
  signal slice_taken : std_logic_vector(7 downto 0) := x"00";
  signal place_taken : std_logic_vector(1 downto 0) := "00";

  -- Video before the text is laid over it, and what that video shows.
  signal bare_video : video_t;
  signal on_bare    : on_show_t;

  signal sensor_errors : std_logic_vector(5 downto 0);
  signal unfit         : std_logic;
  signal core_errors   : std_logic_vector(STREAM_FAULT_BITS - 1 downto 0);
  signal overflow      : std_logic;
  signal underflow     : std_logic;
  signal miss          : std_logic;

begin

  following   <= followed.running;
  unsupported <= too_large;
  varying     <= unequal;
  passes      <= choice.pass_through or too_large or unequal;
  timing      <= followed.timing;
  -- A stream that broke off leaves nothing in the core.
  core_reset <= reset or not followed.running;
  rows       <= std_logic_vector(resize(followed.timing.rows, 16));

  -- The raster of video_to_stream defines the frames for all that follows: bit errors of the input do not move them.
  to_stream : entity work.video_to_stream
    generic map (
      MAX_COLUMNS  => choose(WITH_SENSOR, SENSOR_COLUMNS, CORE.columns),
      DELAY_LINES  => picture_lag_lines(CORE, SHARPNESS_RADIUS, VOTE_RADIUS),
      DELAY_PIXELS => DELAY_PIXELS,
      BLANK_LINES  => larger(CORE_BLANK, choose(WITH_SENSOR, 3, 0)),
      ROW_MODULUS  => choose(CORE.engine = stack, M, 1),
      ONLY_COLUMNS => choose(WITH_SENSOR, SENSOR_COLUMNS, 0),
      ONLY_ROWS    => choose(WITH_SENSOR, SENSOR_ROWS, 0)
    )
    port map (
      clk           => clk,
      reset         => reset,
      restart       => front.restart,
      video         => in_video,
      m_axis        => raw,
      m_axis_tready => raw_ready,
      following     => followed,
      stream_rows   => stream_rows,
      unsupported   => too_large,
      varying       => unequal,
      overflow      => overflow,
      miss          => miss
    );

  no_sensor : if not WITH_SENSOR generate
    lens          <= raw;
    raw_ready     <= lens_ready;
    front.columns <= std_logic_vector(resize(followed.timing.columns, 16));
    front.rows    <= stream_rows;
    front.direct  <= '0';
    front.place   <= "00";
    front.lag     <= to_unsigned(DELAY_LINES, COUNT_BITS);
    front.restart <= '0';
    sensor_errors <= (others => '0');
  end generate no_sensor;

  sensor_first : if WITH_SENSOR generate

    constant RED : std_logic_vector(1 downto 0) := std_logic_vector(to_unsigned(RED_PLACE, 2));

    signal followed_before : std_logic := '0';
    signal front_reset     : std_logic;
    signal frame_columns   : std_logic_vector(15 downto 0);
    signal raster          : stream_t;
    signal raster_ready    : std_logic;
    signal raster_data     : std_logic_vector(8 * PIXEL_CHANNELS - 1 downto 0);
    signal raster_columns  : std_logic_vector(15 downto 0);
    signal raster_rows     : std_logic_vector(15 downto 0);

  begin

    -- The reset ends before the next frame begins, so that an entity without an input FIFO can take its first pixel.
    front_reset <= reset or (followed_before and not followed.running);

    note_following : process (clk) is
    begin

      if rising_edge(clk) then
        followed_before <= followed.running;
      end if;

    end process note_following;

    frame_columns <= std_logic_vector(resize(followed.timing.columns, 16));

    -- A grey sensor, or one with a mosaic, has pixels in red (the low bits) only.
    sensor : entity work.sensor_raster
      generic map (
        MOSAIC           => MOSAIC,
        MICRO_IMAGE_SIZE => M,
        HEXAGONAL        => HEXAGONAL,
        SKEWED           => SKEWED,
        MAX_COLUMNS      => SENSOR_COLUMNS,
        LINES            => RING_LINES,
        LENSES           => LENSES,
        MOVES            => MOVES,
        GAINS            => GAINS,
        CHANNELS         => PIXEL_CHANNELS
      )
      port map (
        clk            => clk,
        reset          => front_reset,
        columns        => frame_columns,
        rows           => rows,
        red_place      => RED,
        load_write     => load.write,
        load_kind      => load.kind,
        load_address   => load.address,
        load_data      => load.data,
        s_axis_tvalid  => raw.tvalid,
        s_axis_tready  => raw_ready,
        s_axis_tdata   => raw.tdata(choose(MOSAIC, 1, PIXEL_CHANNELS) * 8 - 1 downto 0),
        s_axis_tuser   => raw.tuser,
        s_axis_tlast   => raw.tlast,
        m_axis_tvalid  => raster.tvalid,
        m_axis_tready  => raster_ready,
        m_axis_tdata   => raster_data,
        m_axis_tuser   => raster.tuser,
        m_axis_tlast   => raster.tlast,
        raster_columns => raster_columns,
        raster_rows    => raster_rows,
        error_flags    => sensor_errors,
        error_clear    => '1'
      );

    all_channels : for i in 0 to 2 generate
      raster.tdata(8 * i + 7 downto 8 * i) <= raster_data(8 * (i mod PIXEL_CHANNELS) + 7 downto
                                                          8 * (i mod PIXEL_CHANNELS));
    end generate all_channels;

    in_front : entity work.sensor_front
      generic map (
        MICRO_IMAGE_SIZE => M,
        CORE_LINES       => DELAY_LINES
      )
      port map (
        clk           => clk,
        reset         => front_reset,
        following     => followed,
        shown         => choice.shown,
        s_axis        => raster,
        s_axis_tready => raster_ready,
        size_columns  => raster_columns,
        size_rows     => raster_rows,
        m_axis        => lens,
        m_axis_tready => lens_ready,
        front         => front
      );

  end generate sensor_first;

  -- Micro images go past the core, which then gets and gives no pixels.
  go_past : process (lens, front, from_core, core_place, shown_ready, to_core_ready) is
  begin

    to_core     <= lens;
    shown       <= from_core;
    lens_ready  <= to_core_ready;
    core_take   <= shown_ready;
    shown_place <= core_place;

    if front.direct = '1' then
      to_core.tvalid <= '0';
      shown          <= lens;
      lens_ready     <= shown_ready;
      core_take      <= '0';
    end if;

    if WITH_SENSOR then
      shown_place <= front.place;
    end if;

  end process go_past;

  picture : entity work.picture_core
    generic map (
      CORE        => CORE,
      OUTPUTS     => OUTPUTS,
      RADIUS      => SHARPNESS_RADIUS,
      CONFIDENCE  => CONFIDENCE,
      VOTE_RADIUS => VOTE_RADIUS,
      COLOURS     => COLOURS
    )
    port map (
      clk           => clk,
      reset         => core_reset,
      columns       => front.columns,
      rows          => front.rows,
      picture_rows  => rows,
      choice        => choice,
      s_axis        => to_core,
      s_axis_tready => to_core_ready,
      m_axis        => from_core,
      m_axis_tready => core_take,
      m_axis_tid    => from_core_id,
      m_axis_tdest  => core_place,
      error_flags   => core_errors
    );

  -- The timing again, as late as the core; a picture of another size is shown in the middle.
  to_video : entity work.stream_to_video
    generic map (
      DELAY_PIXELS => DELAY_PIXELS,
      WINDOW       => WITH_SENSOR
    )
    port map (
      clk             => clk,
      reset           => reset,
      delay_lines     => front.lag,
      picture_columns => front.columns,
      picture_rows    => front.rows,
      too_large       => unfit,
      following       => followed,
      s_axis          => shown,
      s_axis_tready   => shown_ready,
      video           => shown_video,
      underflow       => underflow
    );

  choose_output : process (clk) is
  begin

    if rising_edge(clk) then
      -- Read with the first pixel, in step with the register behind stream_to_video, so that the text changes with the
      -- picture.
      if shown.tvalid = '1' and shown_ready = '1' and shown.tuser = "1" then
        slice_taken <= from_core_id;
        place_taken <= shown_place;
      end if;
      on_bare.slice <= slice_taken;
      on_bare.place <= place_taken;
      -- Video that passes through has no delay, so its frames are not those of the core.
      on_bare.raw <= passes;
      if passes = '1' then
        bare_video <= in_video;
      else
        bare_video <= shown_video;
      end if;
      -- Each error is high for one clock; board_control collects them.
      errors <= (others => '0');
      if core_errors /= "00000" or sensor_errors /= "000000" or (followed.running and unfit) = '1' then
        errors(CORE_FAULT) <= '1';
      end if;
      errors(FRAME_MOVED)   <= miss;
      errors(PIXEL_MISSING) <= underflow;
      -- While no timing is followed, no pixel counts as lost.
      errors(PIXEL_LOST) <= overflow and followed.running;
      if reset = '1' then
        bare_video.active <= '0';
        errors            <= (others => '0');
      end if;
    end if;

  end process choose_output;

  on_show <= on_bare;

  -- A board without a text has no overlay.
  no_text : if not WITH_TEXT generate
    out_video <= bare_video;
  end generate no_text;

  text : if WITH_TEXT generate

    -- The meaning of an output's number depends on the build; the text names the kind of output.
    constant KINDS : kinds_t := output_kinds(OUTPUTS);

    -- For text_overlay: whether the text is shown, whether at the bottom, what is shown, and the lines of the picture.
    signal show   : std_logic;
    signal bottom : std_logic;
    signal kind   : std_logic_vector(1 downto 0);
    signal lines  : std_logic_vector(11 downto 0);

  begin

    -- 1: at the top, 2: at the bottom. 3 does not occur and would act like 2.
    show   <= text_place(0) or text_place(1);
    bottom <= text_place(1);
    kind   <= std_logic_vector(to_unsigned(KINDS(to_integer(unsigned(on_bare.place))), 2));
    lines  <= std_logic_vector(followed.timing.rows);

    -- The ruler under the text has a field for each slice.
    overlay : entity work.text_overlay
      generic map (
        SLICES        => slices_of(CORE),
        FONT          => FONT,
        TEXTS         => TEXTS,
        TEXT_COLUMNS  => TEXT_COLUMNS,
        LABELS        => LABELS,
        LABEL_COLUMNS => LABEL_COLUMNS,
        COLOURS       => COLOURS
      )
      port map (
        clk       => clk,
        reset     => reset,
        show      => show,
        bottom    => bottom,
        rows      => lines,
        slice     => on_bare.slice,
        kind      => kind,
        raw       => on_bare.raw,
        errors    => text_errors,
        in_video  => bare_video,
        out_video => out_video
      );

  end generate text;

end architecture rtl;
