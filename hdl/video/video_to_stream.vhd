-- SPDX-License-Identifier: Apache-2.0
-- Follows incoming video and makes an AXI4-Stream of its active pixels.
--
-- Once the measured timing is stable, a raster generator of the same timing is started with a frame. From then on the
-- generator defines the frames of the stream, pixel by pixel in step with the input, so a bit error in data enable
-- makes a pixel black but does not move the raster. When two frames in a row begin elsewhere, or another timing has
-- become stable, the generator is stopped, and started again with the next frame of a stable timing. A stream therefore
-- begins with a whole frame.
--
-- Frames that are not all alike (interlaced frames, a variable refresh rate, lines that differ) cannot be followed.
-- `varying` reports them in two cases: FEW frames in a row differed from the frame before; or a timing was followed and
-- lost four times without FEW equal frames in a row in between. Two equal frames end the first case, FEW the second.
--
-- A timing is followed if its lines have at most MAX_COLUMNS pixels, if its frames and lines are longer than the delay
-- of the output (stream_to_video), and if the vertical blanking is long enough; else `unsupported` is set. With
-- ONLY_COLUMNS and ONLY_ROWS only frames of this size are followed.
--
-- ROW_MODULUS above 1 is for cores whose frames begin a multiple of lines apart. The frames of the stream then have as
-- many lines as fit into a frame with its blanking, rounded down to a multiple of ROW_MODULUS: black lines follow the
-- picture.
--
-- Latency: 3 clocks. Throughput: one pixel each clock; the input cannot wait, so a stall of the stream loses a pixel
-- and sets overflow for a clock.
-- Equation: m_axis_tdata(t) = pixel(t - 3) if active(t - 3), else 0.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.video_pkg.all;

entity video_to_stream is
  generic (
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Lines and pixels by which the output lags; frames and lines must be longer.
    DELAY_LINES  : natural;
    DELAY_PIXELS : natural;
    -- Lines of vertical blanking that the refocuser needs.
    BLANK_LINES : natural := 0;
    -- The number of lines of a frame of the stream is a multiple of this; 1: the stream has the picture only.
    ROW_MODULUS : positive := 1;
    -- The only size that is followed; 0: any.
    ONLY_COLUMNS : natural := 0;
    ONLY_ROWS    : natural := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Restart with the next frame.
    restart : in    std_logic;
    -- Incoming video.
    video : in    video_t;
    -- The active pixels of the video.
    m_axis        : out   stream_t;
    m_axis_tready : in    std_logic;
    -- Timing and place for stream_to_video: the timing that the generator follows; the place of the pixel on m_axis, in
    -- the blanking too; whether the generator runs.
    following : out   following_t;
    -- Lines of a frame of the stream.
    stream_rows : out   std_logic_vector(15 downto 0);
    -- The input has a stable timing that cannot be followed.
    unsupported : out   std_logic := '0';
    -- The input has frames, but they are not all alike.
    varying : out   std_logic;
    -- High for one clock: a pixel was lost because the stream stalled.
    overflow : out   std_logic;
    -- High for one clock: a frame began elsewhere than expected.
    miss : out   std_logic := '0'
  );
end entity video_to_stream;

architecture rtl of video_to_stream is

  -- Frames in a row that begin elsewhere before the generator is stopped.
  constant MAX_MISSES : positive := 2;
  -- Frames in a row that are no accident, and how often a timing may be followed and lost.
  constant FEW        : positive := 8;
  constant MAX_LOSSES : positive := 4;

  signal measured      : timing_t;
  signal stream_timing : timing_t;
  -- padded: the number of the stream's lines is a multiple of ROW_MODULUS; then the measured timing and the timing that
  -- is followed.
  signal padded      : std_logic;
  signal stable      : std_logic;
  signal frame_start : std_logic;
  signal starts      : std_logic_vector(1 downto 0)  := "00";
  signal supported   : std_logic                     := '0';
  signal followed    : timing_t                      := NO_TIMING;
  signal follow      : std_logic                     := '0';
  signal misses      : natural range 0 to MAX_MISSES := 0;
  -- Frames in a row that were equal, or different; losses since FEW frames in a row were equal.
  signal alike          : std_logic                     := '0';
  signal frames         : natural range 0 to FEW        := 0;
  signal losses         : natural range 0 to MAX_LOSSES := 0;
  signal missed         : std_logic;
  signal unlike         : std_logic;
  signal start          : std_logic;
  signal generate_reset : std_logic;
  signal place          : raster_t;
  signal video_1        : video_t                       := NO_VIDEO;
  signal pixel_2        : pixel_t                       := (others => '0');
  signal pixel_3        : pixel_t                       := (others => '0');

begin

  meter : entity work.video_timing_meter
    port map (
      clk         => clk,
      reset       => reset,
      video       => video,
      frame_start => frame_start,
      timing      => measured,
      stable      => stable
    );

  following.timing  <= followed;
  following.column  <= place.column;
  following.row     <= place.row;
  following.running <= follow;

  -- Frame starts are in step with the pixels: frame_start with pixel_1, starts(0) with pixel_2. The generator is at the
  -- first pixel a clock behind `start`, with pixel_3 and starts(1). `start` only starts it: while it follows, the
  -- raster runs free, and frame starts are merely compared with it.
  start          <= starts(0) and stable and supported and not follow and not restart and
                    to_logic(losses /= MAX_LOSSES);
  generate_reset <= reset or not (follow or start);

  raster : entity work.raster_generator
    port map (
      clk    => clk,
      reset  => generate_reset,
      timing => stream_timing,
      start  => start,
      raster => place
    );

  picture_rows : if ROW_MODULUS = 1 generate
    -- Without a modulus any number of lines is right.
    padded        <= '1';
    stream_timing <= followed;
    stream_rows   <= std_logic_vector(resize(followed.rows, 16));
  end generate picture_rows;

  more_rows : if ROW_MODULUS > 1 generate

    -- divided: lines of the measured frame; over: those that exceed a multiple, computed by subtraction; rows_now:
    -- lines of the stream's frames.
    signal divided  : count_t := (others => '0');
    signal over     : count_t := (others => '0');
    signal rows_now : count_t := (others => '0');

  begin

    padded <= '1' when divided = measured.frame_lines and over < ROW_MODULUS else
              '0';

    divide : process (clk) is
    begin

      if rising_edge(clk) then
        -- Repeated subtraction needs no divider, and there is a whole frame of time.
        if divided /= measured.frame_lines then
          divided <= measured.frame_lines;
          over    <= measured.frame_lines;
        elsif over >= ROW_MODULUS then
          over <= over - ROW_MODULUS;
        end if;
        if follow = '0' then
          rows_now <= divided - over;
        end if;
      end if;

    end process divide;

    replace_rows : process (followed, rows_now) is
    begin

      stream_timing      <= followed;
      stream_timing.rows <= rows_now;

    end process replace_rows;

    stream_rows <= std_logic_vector(resize(rows_now, 16));

  end generate more_rows;

  m_axis.tvalid   <= place.active;
  m_axis.tdata    <= pixel_3;
  m_axis.tuser(0) <= place.frame_first;
  m_axis.tlast    <= place.line_last;
  overflow        <= place.active and not m_axis_tready;

  -- While a timing is followed, a frame with damaged words does not count as different, unless it begins elsewhere.
  missed  <= follow and place.frame_first and not starts(1);
  unlike  <= missed or (starts(0) and not stable and not follow);
  varying <= to_logic(losses = MAX_LOSSES or (frames = FEW and alike = '0'));

  judge_frames : process (clk) is
  begin

    if rising_edge(clk) then
      if unlike = '1' or (starts(0) and stable) = '1' then
        alike <= not unlike;
        if alike = unlike then
          frames <= 1;
        elsif frames /= FEW then
          frames <= frames + 1;
        end if;
      end if;

      if alike = '1' and frames = FEW then
        losses <= 0;
      elsif follow = '1' and misses = MAX_MISSES and losses /= MAX_LOSSES then
        losses <= losses + 1;
      end if;

      if reset = '1' then
        alike  <= '0';
        frames <= 0;
        losses <= 0;
      end if;
    end if;

  end process judge_frames;

  follow_input : process (clk) is
  begin

    if rising_edge(clk) then
      video_1 <= video;
      pixel_2 <= (others => '0');
      -- Black outside the picture, so that a line whose end was lost does not show what the cable carried in the
      -- blanking.
      if video_1.active = '1' then
        pixel_2 <= video_1.pixel;
      end if;
      pixel_3 <= pixel_2;
      starts  <= starts(0) & frame_start;

      supported <= '0';
      if measured.columns <= MAX_COLUMNS and measured.line_length > DELAY_PIXELS and
         measured.frame_lines > DELAY_LINES and
         measured.frame_lines - measured.rows >= BLANK_LINES and padded = '1' then
        supported <= '1';
      end if;
      -- A core built for one size has no memory for another and would show it torn.
      if ONLY_COLUMNS /= 0 and (measured.columns /= ONLY_COLUMNS or measured.rows /= ONLY_ROWS) then
        supported <= '0';
      end if;
      unsupported <= stable and not supported;

      miss <= '0';
      if follow = '0' then
        followed <= measured;
        misses   <= 0;
        follow   <= start;
      else
        if place.frame_first = '1' then
          misses <= 0;
          -- A frame start that is missing, or at another place, is counted; a single one may be a damaged word.
          if missed = '1' then
            miss   <= '1';
            misses <= misses + 1;
          end if;
        end if;
        if restart = '1' or misses = MAX_MISSES or (stable = '1' and measured /= followed) then
          follow <= '0';
        end if;
      end if;

      if reset = '1' then
        follow <= '0';
        starts <= "00";
      end if;
    end if;

  end process follow_input;

end architecture rtl;
