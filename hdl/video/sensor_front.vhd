-- SPDX-License-Identifier: Apache-2.0
-- In front of a core whose picture is shown on a screen: makes the raster from a sensor's raw frames (sensor_raster),
-- and computes the delay of the output.
--
-- The raster lines are computed during a whole raw frame but shown without gaps, so the first ones have to wait: line i
-- goes on at raw line `spare` + sensor_delay_lines + i, where `spare` is the number of lines that the raster has fewer
-- than the screen. The lines wait as raw lines in the ring of the resampler. The raster begins at line spare / 2 of the
-- output, in the middle of the frame, so the output is delayed by the rest, and by the lines of the core.
--
-- Micro images wait for the output, which does not take a frame before its place comes. A core would take the first
-- lines of a frame sooner, and they would block the flush lines that push the frame before out of it. A frame therefore
-- goes on to a core when its first line is due; for the core the time between two frames is blanking.
--
-- Another size of the raster, and a change between micro images and refocused pictures, alter the delay: everything
-- then restarts with the next frame. A loaded calibration stays in effect.
--
-- Latency: that of sensor_raster. Throughput: one pixel each clock.
-- Equation: lag = spare - floor(spare / 2) + sensor_delay_lines + CORE_LINES (micro images: without CORE_LINES).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.screen_pkg.all;
use work.sensor_pkg.all;
use work.video_pkg.all;

entity sensor_front is
  generic (
    -- Micro image size M. All other generics of sensor_raster are in sensor_pkg; what can be shown is in screen_pkg: a
    -- letter for each place, r refocused, m micro images.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- Lines of the core's delay.
    CORE_LINES : natural
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Timing of the raw frames, and place of the incoming pixel.
    following : in    following_t;
    -- Place in OUTPUTS of the output asked for; numbers beyond its end mean the first output.
    shown : in    std_logic_vector(1 downto 0);
    -- Load port of the sensor's calibration.
    load : in    load_t;
    -- Raw frames. A grey sensor, or one with a mosaic, has pixels in red (the low bits) only.
    s_axis        : in    stream_t;
    s_axis_tready : out   std_logic;
    -- The raster of micro images.
    m_axis        : out   stream_t;
    m_axis_tready : in    std_logic;
    -- How the raster is shown.
    front : out   front_t;
    -- Faults of the raster by the bits of resampler, each high while it lasts.
    errors : out   std_logic_vector(5 downto 0)
  );
end entity sensor_front;

architecture rtl of sensor_front is

  constant KINDS     : kinds_t                      := output_kinds(OUTPUTS);
  constant RED       : std_logic_vector(1 downto 0) := std_logic_vector(to_unsigned(RED_PLACE, 2));
  constant OWN_LINES : positive                     := sensor_delay_lines(MICRO_IMAGE_SIZE, MOSAIC);

  -- The raster's size as the registers say, which may change with each frame; below, the size when the input began to
  -- be followed.
  signal size_columns : std_logic_vector(15 downto 0);
  signal size_rows    : std_logic_vector(15 downto 0);
  signal raster       : std_logic_vector(8 * PIXEL_CHANNELS - 1 downto 0);
  -- The output asked for; and the output in effect, with the raster's size, until everything restarts.
  signal place_wanted  : std_logic_vector(1 downto 0);
  signal place_now     : std_logic_vector(1 downto 0)  := "00";
  signal columns_now   : std_logic_vector(15 downto 0) := (others => '0');
  signal rows_now      : std_logic_vector(15 downto 0) := (others => '0');
  signal direct_now    : std_logic                     := '0';
  signal frame_columns : std_logic_vector(15 downto 0);
  signal frame_rows    : std_logic_vector(15 downto 0);
  signal raster_valid  : std_logic;
  signal raster_ready  : std_logic;
  signal raster_user   : std_logic_vector(0 downto 0);
  -- due: raw line at which the raster's first line goes on; turn: a frame may go on.
  signal due  : count_t   := (others => '0');
  signal turn : std_logic := '0';
  signal goes : std_logic;

begin

  frame_columns <= std_logic_vector(resize(following.timing.columns, 16));
  frame_rows    <= std_logic_vector(resize(following.timing.rows, 16));

  sensor : entity work.sensor_raster
    generic map (
      MOSAIC           => MOSAIC,
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      HEXAGONAL        => HEXAGONAL,
      MAX_COLUMNS      => SENSOR_COLUMNS,
      LINES            => RING_LINES,
      LENSES           => LENSES,
      MOVES            => MOVES,
      GAINS            => GAINS,
      CHANNELS         => PIXEL_CHANNELS
    )
    port map (
      clk            => clk,
      reset          => reset,
      columns        => frame_columns,
      rows           => frame_rows,
      red_place      => RED,
      load_write     => load.write,
      load_kind      => load.kind,
      load_address   => load.address,
      load_data      => load.data,
      s_axis_tvalid  => s_axis.tvalid,
      s_axis_tready  => s_axis_tready,
      s_axis_tdata   => s_axis.tdata(choose(MOSAIC, 1, PIXEL_CHANNELS) * 8 - 1 downto 0),
      s_axis_tuser   => s_axis.tuser,
      s_axis_tlast   => s_axis.tlast,
      m_axis_tvalid  => raster_valid,
      m_axis_tready  => raster_ready,
      m_axis_tdata   => raster,
      m_axis_tuser   => raster_user,
      m_axis_tlast   => m_axis.tlast,
      raster_columns => size_columns,
      raster_rows    => size_rows,
      error_flags    => errors,
      error_clear    => '1'
    );

  all_channels : for i in 0 to 2 generate
    m_axis.tdata(8 * i + 7 downto 8 * i) <= raster(8 * (i mod PIXEL_CHANNELS) + 7 downto 8 * (i mod PIXEL_CHANNELS));
  end generate all_channels;

  -- Only the first pixel of a frame waits: the others follow it as they come.
  goes          <= turn or direct_now or not raster_user(0);
  m_axis.tvalid <= raster_valid and goes;
  raster_ready  <= m_axis_tready and goes;
  m_axis.tuser  <= raster_user;

  place_wanted <= shown when unsigned(shown) < OUTPUTS'length else
                  "00";

  front.columns <= columns_now;
  front.rows    <= rows_now;
  front.direct  <= direct_now;
  front.place   <= place_now;

  follow : process (clk) is

    variable spare : count_t;
    variable first : count_t;

  begin

    if rising_edge(clk) then
      front.restart <= '0';
      -- Taken only between frames. A change under way restarts the core, because the raster then has another size.
      if following.running = '0' then
        columns_now <= size_columns;
        rows_now    <= size_rows;
        place_now   <= place_wanted;
      elsif size_columns /= columns_now or size_rows /= rows_now or place_wanted /= place_now then
        front.restart <= '1';
      end if;

      direct_now <= '0';
      if KINDS(to_integer(unsigned(place_now))) = 3 then
        direct_now <= '1';
      end if;

      -- The picture stands in the middle of the screen: half of the lines that it has fewer lie above it.
      spare := following.timing.rows - unsigned(rows_now(COUNT_BITS - 1 downto 0));

      front.lag <= spare - shift_right(spare, 1) + OWN_LINES + CORE_LINES;
      if direct_now = '1' then
        front.lag <= spare - shift_right(spare, 1) + OWN_LINES;
      end if;

      -- A raster of few lines still goes on before the blanking ends.
      first := spare + OWN_LINES;
      due   <= following.timing.rows;
      if first < following.timing.rows then
        due <= first;
      end if;

      -- The first pixel has gone on, so the next frame waits for its turn.
      if raster_valid = '1' and raster_user(0) = '1' and m_axis_tready = '1' and goes = '1' then
        turn <= '0';
      end if;
      if following.row = due and following.column = 0 then
        turn <= '1';
      end if;
      if following.running = '0' then
        turn <= '0';
      end if;
    end if;

  end process follow;

end architecture rtl;
