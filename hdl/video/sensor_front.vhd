-- SPDX-License-Identifier: Apache-2.0
-- Between sensor_raster and a core whose picture is shown on a screen: lets the raster of a sensor's frames go on in
-- time, and computes the delay of the output.
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
-- Latency: the wait of a frame for its place. Throughput: one pixel each clock.
-- Equation: lag = spare - floor(spare / 2) + sensor_delay_lines + CORE_LINES (micro images: without CORE_LINES).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.picture_pkg.all;
use work.screen_pkg.all;
use work.sensor_pkg.all;
use work.video_pkg.all;

entity sensor_front is
  generic (
    -- Micro image size M. What can be shown is in screen_pkg: a letter for each place, r refocused, m micro images.
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
    -- The raster of micro images, and the raster's size as the registers say, which may change with each frame.
    s_axis        : in    stream_t;
    s_axis_tready : out   std_logic;
    size_columns  : in    std_logic_vector(15 downto 0);
    size_rows     : in    std_logic_vector(15 downto 0);
    -- The raster on its way to the core.
    m_axis        : out   stream_t;
    m_axis_tready : in    std_logic;
    -- How the raster is shown.
    front : out   front_t
  );
end entity sensor_front;

architecture rtl of sensor_front is

  constant KINDS     : kinds_t  := output_kinds(OUTPUTS);
  constant OWN_LINES : positive := sensor_delay_lines(MICRO_IMAGE_SIZE, MOSAIC);

  -- The output asked for; and the output in effect, with the raster's size when the input began to be followed, until
  -- everything restarts.
  signal place_asked : std_logic_vector(1 downto 0);
  signal place_now   : std_logic_vector(1 downto 0)  := "00";
  signal columns_now : std_logic_vector(15 downto 0) := (others => '0');
  signal rows_now    : std_logic_vector(15 downto 0) := (others => '0');
  signal direct_now  : std_logic                     := '0';
  -- due: raw line at which the raster's first line goes on; turn: a frame may go on.
  signal due  : count_t   := (others => '0');
  signal turn : std_logic := '0';
  signal goes : std_logic;

begin

  -- Only the first pixel of a frame waits: the others follow it as they come.
  goes          <= turn or direct_now or not s_axis.tuser(0);
  s_axis_tready <= m_axis_tready and goes;
  m_axis.tvalid <= s_axis.tvalid and goes;
  m_axis.tdata  <= s_axis.tdata;
  m_axis.tuser  <= s_axis.tuser;
  m_axis.tlast  <= s_axis.tlast;

  place_asked <= shown when unsigned(shown) < OUTPUTS'length else
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
        place_now   <= place_asked;
      elsif size_columns /= columns_now or size_rows /= rows_now or place_asked /= place_now then
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
      if s_axis.tvalid = '1' and s_axis.tuser(0) = '1' and m_axis_tready = '1' and goes = '1' then
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
