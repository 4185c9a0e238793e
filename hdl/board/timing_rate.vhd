-- SPDX-License-Identifier: Apache-2.0
-- The frame rate of a timing: pixel clock over pixels of a frame, both with blanking.
--
-- It only adds. The lines of a frame are added up; then the clock is added in CLOCK_STEPS steps, and each time the sum
-- has reached a frame, that is subtracted and counted. The sum begins half a frame below, which rounds the result.
--
-- Latency: at most 2 ** 13 + CLOCK_STEPS + 2 ** 12 + 4 clocks. Throughput: one rate at a time.
-- Equation: rate = floor((100000 * clock + ceil(pixels / 2)) / pixels), pixels = line_length * frame_lines,
--   at most 4095.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity timing_rate is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Begin, for a clock, while nothing is computed; the timing stands still until it is done.
    start : in    std_logic;
    -- Pixel clock in 10 kHz, pixels of a line and lines of a frame.
    pixel_clock : in    std_logic_vector(15 downto 0);
    line_length : in    unsigned(12 downto 0);
    frame_lines : in    unsigned(12 downto 0);
    -- In 0.1 Hz, while done is high for a clock and until the next start.
    rate : out   unsigned(11 downto 0);
    done : out   std_logic
  );
end entity timing_rate;

architecture rtl of timing_rate is

  -- 100000 = 3125 * 32: a shift by five bits takes the place of 31 of 32 additions. Rate and clock
  -- are in 0.1 Hz and 10 kHz, whose quotient is the 100000.
  constant CLOCK_STEPS : positive := 3125;
  constant HIGHEST     : positive := 2 ** 12 - 1;

  type state_t is (idle, add_lines, divide);

  signal state : state_t := idle;
  -- Lines, or steps, that are done; the sum; pixels of a frame; frames found.
  signal turns  : unsigned(12 downto 0) := (others => '0');
  signal sum    : signed(26 downto 0)   := (others => '0');
  signal pixels : signed(26 downto 0)   := (others => '0');
  signal frames : unsigned(11 downto 0) := (others => '0');

begin

  rate <= frames;

  compute : process (clk) is
  begin

    if rising_edge(clk) then
      done <= '0';

      case state is

        when idle =>

          -- The two factors never meet a multiplier: this runs once for each timing in a monitor's
          -- EDID, and takes less than a byte of it on the line (180 us at 50 kHz).
          if start = '1' then
            turns  <= (others => '0');
            sum    <= (others => '0');
            frames <= (others => '0');
            state  <= add_lines;
          end if;

        when add_lines =>

          if turns /= frame_lines then
            turns <= turns + 1;
            sum   <= sum + signed(resize(line_length, 27));
          else
            turns  <= (others => '0');
            pixels <= sum;
            -- What is below zero by half a frame counts a frame as soon as half of it is reached.
            sum   <= -shift_right(sum, 1);
            state <= divide;
          end if;

        when divide =>

          -- Subtract as long as a whole frame is in the sum, then add the next step: the sum never
          -- grows beyond a step and a frame.
          if sum >= 0 and frames /= HIGHEST then
            sum    <= sum - pixels;
            frames <= frames + 1;
          elsif sum >= 0 or turns = CLOCK_STEPS then
            -- At the end, or where the port can hold no more: a frame of no pixels would be counted
            -- for ever.
            done  <= '1';
            state <= idle;
          else
            turns <= turns + 1;
            sum   <= sum + signed(resize(unsigned(pixel_clock) & "00000", 27));
          end if;

      end case;

      if reset = '1' then
        state <= idle;
        done  <= '0';
      end if;
    end if;

  end process compute;

  -- A start at any other time has no effect.
  watch_starts : process (clk) is
  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert not (reset = '0' and start = '1' and state /= idle)
        report "timing_rate: start came while a rate was computed"
        severity failure;
    end if;

  -- synthesis translate_on

  end process watch_starts;

end architecture rtl;
