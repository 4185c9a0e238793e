-- SPDX-License-Identifier: Apache-2.0
-- Shows an AXI4-Stream of pixels with the timing of the video that it was made from.
--
-- A second raster generator repeats the input's timing. It is started once each frame, when the input is delay_lines
-- lines and DELAY_PIXELS pixels behind the beginning of its frame. The output, syncs included, is therefore delayed by
-- the latency of the core in between, and no frame is stored. If the generator is in step already, the start changes
-- nothing. When the input is lost, the generator goes on and shows black, so that a monitor need not search again.
--
-- Pixels are taken while the raster is active; in the blanking the stream waits. A frame that does not begin at its
-- place (after a fault) is dropped up to the next start of frame. With WINDOW the stream's frames are smaller than the
-- video's and shown in the middle with black around them; a larger frame is dropped.
--
-- Latency: 1 clock from the generator to the outputs, with WINDOW 2 clocks. Throughput: one pixel each clock.
-- Equation: output position(t) = input position(t) - delay_lines lines - DELAY_PIXELS - 2 (3) pixels.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.video_pkg.all;

entity stream_to_video is
  generic (
    -- Pixels by which the output lags, besides the lines.
    DELAY_PIXELS : natural := 0;
    -- true: the picture has a size of its own.
    WINDOW : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Lines by which the output lags.
    delay_lines : in    count_t := (others => '0');
    -- With WINDOW: size of the picture; too_large: it does not fit the timing.
    picture_columns : in    std_logic_vector(15 downto 0);
    picture_rows    : in    std_logic_vector(15 downto 0);
    too_large       : out   std_logic;
    -- Timing and place of the input, from video_to_stream.
    following : in    following_t;
    -- Pixels to show. The raster defines where lines end, so tlast is not read.
    s_axis        : in    stream_t;
    s_axis_tready : out   std_logic;
    -- Video out.
    video : out   video_t := NO_VIDEO;
    -- There is a timing to show.
    running : out   std_logic := '0';
    -- High for one clock: the stream had no pixel for an active place.
    underflow : out   std_logic := '0'
  );
end entity stream_to_video;

architecture rtl of stream_to_video is

  -- The timing that is shown; kept when the input is lost. start: starts the generator; place: its place.
  signal shown : timing_t  := NO_TIMING;
  signal start : std_logic := '0';
  signal place : raster_t;
  -- placed: the place in step with picture; picture: it is a pixel of the picture; picture_first: its first one; drop:
  -- the stream's pixel is dropped.
  signal placed        : raster_t;
  signal picture       : std_logic;
  signal picture_first : std_logic;
  signal drop          : std_logic;
  -- With WINDOW: the raster has not been started since the input came, so its place is wrong.
  signal early : std_logic;
  -- in_step: the frame on the screen is the frame of the stream; take: its pixel is taken; begins: a frame begins;
  -- connected: the raster follows the input.
  signal in_step   : std_logic := '0';
  signal take      : std_logic;
  signal begins    : std_logic;
  signal connected : std_logic := '0';

begin

  raster : entity work.raster_generator
    port map (
      clk    => clk,
      reset  => reset,
      timing => shown,
      start  => start,
      raster => place
    );

  whole : if not WINDOW generate
    -- A picture of the mode's size is placed by its first pixel alone.
    early         <= '0';
    too_large     <= '0';
    drop          <= '0';
    placed        <= place;
    picture       <= place.active;
    picture_first <= place.frame_first;
  end generate whole;

  middle : if WINDOW generate

    signal left    : count_t   := (others => '0');
    signal top     : count_t   := (others => '0');
    signal right   : count_t   := (others => '0');
    signal bottom  : count_t   := (others => '0');
    signal outside : std_logic := '1';

  begin

    early     <= not connected;
    too_large <= outside;
    drop      <= outside;

    locate : process (clk) is

      variable mode : timing_t;

    begin

      if rising_edge(clk) then
        mode := following.timing;
        -- Decided a clock ahead; sizes change only between frames.
        outside <= '1';
        if unsigned(picture_columns) <= mode.columns and unsigned(picture_rows) <= mode.rows and
           unsigned(picture_rows) /= 0 then
          outside <= '0';
        end if;
        -- For a picture that is too large these wrap round; `outside` then keeps it from the screen.
        left   <= shift_right(mode.columns - unsigned(picture_columns(COUNT_BITS - 1 downto 0)), 1);
        top    <= shift_right(mode.rows - unsigned(picture_rows(COUNT_BITS - 1 downto 0)), 1);
        right  <= left + unsigned(picture_columns(COUNT_BITS - 1 downto 0));
        bottom <= top + unsigned(picture_rows(COUNT_BITS - 1 downto 0));

        -- A register for the comparisons; the other fields of the place wait as long.
        placed        <= place;
        picture       <= '0';
        picture_first <= '0';
        if place.active = '1' and outside = '0' and place.column >= left and place.column < right and
           place.row >= top and place.row < bottom then
          picture <= '1';
        end if;
        if place.active = '1' and outside = '0' and place.column = left and place.row = top then
          picture_first <= '1';
        end if;

        if reset = '1' then
          placed.running <= '0';
          placed.active  <= '0';
          picture        <= '0';
          picture_first  <= '0';
        end if;
      end if;

    end process locate;

  end generate middle;

  -- A start of frame waits for its place; other pixels are taken there, or dropped. One comparison a frame is enough:
  -- behind it stream and raster count the same pixels.
  begins        <= picture_first and not early and s_axis.tvalid and s_axis.tuser(0);
  take          <= begins or (picture and not picture_first and in_step and not s_axis.tuser(0));
  s_axis_tready <= take or (not in_step and not s_axis.tuser(0)) or drop;

  show : process (clk) is
  begin

    if rising_edge(clk) then
      start <= '0';
      -- A frame must not begin in the middle: the raster stays connected up to a frame's end, and connects only with
      -- the next frame.
      connected <= following.running and not early;
      if following.running = '1' and following.row = delay_lines and following.column = DELAY_PIXELS then
        connected <= '1';
        start     <= '1';
        shown     <= following.timing;
      end if;

      -- Without a timing to show, the syncs stand still: a monitor then finds no signal rather than a wrong one.
      video.active <= placed.active;
      video.h_sync <= placed.h_sync and placed.running;
      video.v_sync <= placed.v_sync and placed.running;
      video.pixel  <= (others => '0');
      running      <= placed.running;
      -- High for one clock for each missing pixel, for a counter behind it.
      underflow <= '0';
      if take = '1' and s_axis.tvalid = '1' then
        video.pixel <= s_axis.tdata;
      elsif picture = '1' and (in_step = '1' or picture_first = '1') then
        underflow <= connected;
      end if;
      if picture_first = '1' then
        in_step <= begins;
      elsif picture = '1' and (s_axis.tvalid = '0' or s_axis.tuser(0) = '1') then
        -- A pixel too few, or a frame too soon: black up to the next start of frame at its place.
        in_step <= '0';
      end if;

      if reset = '1' then
        start     <= '0';
        connected <= '0';
        in_step   <= '0';
        running   <= '0';
        underflow <= '0';

        video.active <= '0';
      end if;
    end if;

  end process show;

end architecture rtl;
