-- SPDX-License-Identifier: Apache-2.0
-- The two lines of I2C as their levels hold, for masters and slaves: synchronised, and without spikes.
--
-- A level changes when SPIKE samples in a row differ from it: a spike on a long cable, and the slow slope of a line
-- with a pull-up resistor, make no edges. A slave also sets HOLD: then all edges but the falling ones of the clock
-- line come HOLD clocks later. So a data line that changes together with a falling clock line, or shortly before or
-- behind it, as edges are slow, is seen to change while the clock line is low, and makes no start or stop; UM10204
-- asks devices for 300 ns. The clock line must stay high for SPIKE + HOLD clocks.
--
-- Latency: SPIKE + 2 clocks, 2 if SPIKE is 1, and HOLD more but for the falling clock line. Throughput: not
-- applicable.
-- Equation: level(n) = level(n - 1) until that many samples in a row differ from it.

library ieee;
use ieee.std_logic_1164.all;

entity i2c_lines is
  generic (
    SPIKE : positive;
    HOLD  : natural := 0
  );
  port (
    clk : in    std_logic;
    -- The lines, as they are at the pins.
    scl : in    std_logic;
    sda : in    std_logic;
    -- The levels that hold.
    scl_level : out   std_logic;
    sda_level : out   std_logic
  );
end entity i2c_lines;

architecture rtl of i2c_lines is

  constant LONG : positive := SPIKE + HOLD;

  signal lines   : std_logic_vector(1 downto 0);
  signal arrived : std_logic_vector(1 downto 0);
  -- Samples that differ from the level that holds, and the levels.
  signal scl_count : natural range 0 to LONG := 0;
  signal sda_count : natural range 0 to LONG := 0;
  signal scl_now   : std_logic               := '1';
  signal sda_now   : std_logic               := '1';

begin

  lines     <= scl & sda;
  scl_level <= scl_now;
  sda_level <= sda_now;

  crossing : entity work.synchroniser
    generic map (
      WIDTH => 2
    )
    port map (
      clk         => clk,
      level       => lines,
      synchronous => arrived
    );

  -- A single sample is a level: nothing is counted, and no clock is lost.
  direct : if LONG = 1 generate
    scl_now <= arrived(1);
    sda_now <= arrived(0);
  end generate direct;

  counted : if LONG > 1 generate

    hold_levels : process (clk) is
    begin

      if rising_edge(clk) then
        if arrived(1) = scl_now then
          scl_count <= 0;
        elsif scl_count = LONG - 1 or (scl_now = '1' and scl_count >= SPIKE - 1) then
          scl_now   <= arrived(1);
          scl_count <= 0;
        else
          scl_count <= scl_count + 1;
        end if;
        if arrived(0) = sda_now then
          sda_count <= 0;
        elsif sda_count = LONG - 1 then
          sda_now   <= arrived(0);
          sda_count <= 0;
        else
          sda_count <= sda_count + 1;
        end if;
      end if;

    end process hold_levels;

  end generate counted;

end architecture rtl;
