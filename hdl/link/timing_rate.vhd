-- SPDX-License-Identifier: Apache-2.0
-- The frame rate of a timing: pixel clock over pixels of a frame, both with blanking.
--
-- The entity only adds. It adds up the lines of a frame; then it adds the clock in CLOCK_STEPS steps, and each time the
-- sum has reached a frame, the frame is subtracted and counted. The sum begins half a frame below zero, which rounds
-- the result.
--
-- Latency: at most 2**13 + CLOCK_STEPS + 2**12 + 4 clocks. Throughput: one rate at a time.
-- Equation: rate = floor((100000 * clock + ceil(pixels / 2)) / pixels), pixels = line_length * frame_lines,
--   at most 4095.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity timing_rate is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- High for one clock while no rate is computed: begin. The timing must be constant until done.
    start : in    std_logic;
    -- Pixel clock in 10 kHz; pixels of a line; lines of a frame.
    pixel_clock : in    std_logic_vector(15 downto 0);
    line_length : in    unsigned(12 downto 0);
    frame_lines : in    unsigned(12 downto 0);
    -- The rate in 0.1 Hz; done is high for one clock with it, and the rate stays until the next start.
    rate : out   unsigned(11 downto 0);
    done : out   std_logic
  );
end entity timing_rate;

architecture rtl of timing_rate is

  -- 100000 = 3125 * 32: a shift by five bits replaces 31 of 32 additions. The factor 100000 is the ratio of the units
  -- 10 kHz and 0.1 Hz.
  constant CLOCK_STEPS : positive := 3125;
  constant HIGHEST     : positive := 2 ** 12 - 1;

  type state_t is (idle, add_lines, divide);

  signal state : state_t := idle;
  -- Lines or steps that are done; the sum; pixels of a frame; frames counted.
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

          -- A multiplier would save little: this runs once for each timing in a monitor's EDID, and takes less than a
          -- byte of it on the line (180 us at 50 kHz).
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
            -- The sum begins half a frame below zero, so a frame counts as soon as half of it is reached.
            sum   <= -shift_right(sum, 1);
            state <= divide;
          end if;

        when divide =>

          -- While a whole frame is in the sum it is subtracted; then the next step is added. The sum never exceeds a
          -- step and a frame.
          if sum >= 0 and frames /= HIGHEST then
            sum    <= sum - pixels;
            frames <= frames + 1;
          elsif sum >= 0 or turns = CLOCK_STEPS then
            -- All steps are done, or the port's limit is reached: a frame without pixels would be counted for ever.
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

  -- Simulation stops at a start while a rate is computed, which has no effect.
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
