-- SPDX-License-Identifier: Apache-2.0
-- Shows an AXI4-Stream of pixels under the timing of the video that it was made from.
--
-- A second raster generator repeats the input's timing, started once each frame when the input is
-- DELAY_LINES lines and DELAY_PIXELS pixels behind the beginning of its frame: so the output lags by
-- the latency of what lies between, syncs and all, and no frame is stored. Where the generator is in
-- step already, the start changes nothing. When the input is lost, the generator goes on by itself and
-- shows black, so that a monitor need not search again.
--
-- Pixels are taken while the raster is active; in the blanking the stream waits. A frame
-- that does not begin where it should (after a fault) is dropped up to the next start of frame.
--
-- Latency: 1 clock from the generator to the outputs. Throughput: one pixel each clock.
-- Equation: output position(t) = input position(t) - DELAY_LINES lines - DELAY_PIXELS - 2 pixels.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.video_pkg.all;

entity stream_to_video is
  generic (
    -- Lines and pixels by which the output lags.
    DELAY_LINES  : natural;
    DELAY_PIXELS : natural
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- From video_to_stream: whether there is a timing, which one, and the position of its pixel.
    following : in    std_logic;
    timing    : in    std_logic_vector(TIMING_BITS - 1 downto 0);
    column    : in    unsigned(COUNT_BITS - 1 downto 0);
    row       : in    unsigned(COUNT_BITS - 1 downto 0);
    -- Pixels to show.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(23 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    -- Video: red in the low bits of pixel.
    active : out   std_logic;
    h_sync : out   std_logic;
    v_sync : out   std_logic;
    pixel  : out   std_logic_vector(23 downto 0);
    -- There is a timing to show.
    running : out   std_logic;
    -- The stream had no pixel for an active one, for a clock.
    underflow : out   std_logic
  );
end entity stream_to_video;

architecture rtl of stream_to_video is

  signal shown         : std_logic_vector(TIMING_BITS - 1 downto 0) := (others => '0');
  signal start         : std_logic                                  := '0';
  signal raster_on     : std_logic;
  signal raster_active : std_logic;
  signal raster_first  : std_logic;
  signal raster_h      : std_logic;
  signal raster_v      : std_logic;
  -- The frame on the screen is the frame of the stream.
  signal in_step   : std_logic := '0';
  signal take      : std_logic;
  signal begins    : std_logic;
  signal connected : std_logic := '0';

begin

  raster : entity work.raster_generator
    port map (
      clk         => clk,
      reset       => reset,
      timing      => shown,
      start       => start,
      running     => raster_on,
      column      => open,
      row         => open,
      active      => raster_active,
      frame_first => raster_first,
      line_last   => open,
      h_sync      => raster_h,
      v_sync      => raster_v
    );

  -- A start of frame waits for its place; anything else is taken there, or dropped.
  begins        <= raster_first and s_axis_tvalid and s_axis_tuser(0);
  take          <= begins or (raster_active and not raster_first and in_step and not s_axis_tuser(0));
  s_axis_tready <= take or (not in_step and not s_axis_tuser(0));

  show : process (clk) is
  begin

    if rising_edge(clk) then
      start     <= '0';
      connected <= following;
      if following = '1' and row = DELAY_LINES and column = DELAY_PIXELS then
        start <= '1';
        shown <= timing;
      end if;

      active    <= raster_active;
      h_sync    <= raster_h and raster_on;
      v_sync    <= raster_v and raster_on;
      running   <= raster_on;
      pixel     <= (others => '0');
      underflow <= '0';
      if take = '1' and s_axis_tvalid = '1' then
        pixel <= s_axis_tdata;
      elsif raster_active = '1' and (in_step = '1' or raster_first = '1') then
        underflow <= connected;
      end if;
      if raster_first = '1' then
        in_step <= begins;
      elsif raster_active = '1' and (s_axis_tvalid = '0' or s_axis_tuser(0) = '1') then
        in_step <= '0';
      end if;

      if reset = '1' then
        start     <= '0';
        in_step   <= '0';
        active    <= '0';
        running   <= '0';
        underflow <= '0';
      end if;
    end if;

  end process show;

end architecture rtl;
