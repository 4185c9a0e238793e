-- SPDX-License-Identifier: Apache-2.0
-- Adds black columns on either side of a picture, for lines that are longer than a core takes.
--
-- The input video has the picture's columns only, with the syncs of the longer lines. Its horizontal blanking must be
-- longer than both sides.
--
-- Latency: COLUMNS + 2 clocks. Throughput: one pixel each clock.
-- Equation: line out = COLUMNS black pixels, line in, COLUMNS black pixels.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.video_pkg.all;

entity black_sides is
  generic (
    -- Columns on either side.
    COLUMNS : positive range 3 to 1024
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video in; video out with the sides added.
    in_video  : in    video_t;
    out_video : out   video_t
  );
end entity black_sides;

architecture rtl of black_sides is

  -- Clocks that the memory keeps a pixel; the memory's two registers and the output register take the rest.
  constant WORDS     : positive := COLUMNS - 1;
  constant CODE_BITS : positive := 27;

  signal place : unsigned(bits_for(WORDS - 1) - 1 downto 0) := (others => '0');
  signal code  : std_logic_vector(CODE_BITS - 1 downto 0);
  signal kept  : std_logic_vector(CODE_BITS - 1 downto 0);
  -- Clocks for which the line goes on behind the last active pixel that came in.
  signal left : natural range 0 to 2 * COLUMNS := 0;
  -- going: the output line is under way; then marks of the clock before: a pixel came in, the output line began or
  -- ended.
  signal going : std_logic := '0';

begin

  code <= in_video.active & in_video.h_sync & in_video.v_sync & in_video.pixel;

  -- A ring: each word is read one round after it was written.
  memory : entity work.ram_simple_dual_port
    generic map (
      WIDTH => CODE_BITS,
      WORDS => WORDS
    )
    port map (
      clk           => clk,
      write_enable  => '1',
      write_address => place,
      write_data    => code,
      read_address  => place,
      read_data     => kept
    );

  widen : process (clk) is
  begin

    if rising_edge(clk) then
      place <= place + 1;
      if place = WORDS - 1 then
        place <= (others => '0');
      end if;

      -- A line begins with the first pixel that comes in; that pixel comes out a side later, so black stands in front
      -- of it. Behind the last pixel the line goes on for both sides.
      going <= '1';
      if in_video.active = '1' then
        left <= 2 * COLUMNS;
      elsif left > 0 then
        left <= left - 1;
      else
        going <= '0';
      end if;

      out_video.active <= going;
      -- The syncs are delayed like the pixels, so each side takes its columns from the porch next to it.
      out_video.h_sync <= kept(25);
      out_video.v_sync <= kept(24);
      out_video.pixel  <= (others => '0');
      if kept(26) = '1' then
        out_video.pixel <= kept(23 downto 0);
      end if;

      if reset = '1' then
        left             <= 0;
        going            <= '0';
        out_video.active <= '0';
      end if;
    end if;

  end process widen;

end architecture rtl;
