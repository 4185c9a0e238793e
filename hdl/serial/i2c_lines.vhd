-- SPDX-License-Identifier: Apache-2.0
-- The levels of the two I2C lines for masters and slaves: synchronised, and without spikes.
--
-- A level changes when SPIKE samples in a row differ from it, so neither a spike on a long cable nor the slow slope
-- of a line with a pull-up resistor makes extra edges.
--
-- A slave also sets HOLD, which delays all edges by HOLD clocks except the falling edge of the clock line. A data
-- line that changes about when the clock line falls is then seen to change while the clock line is low, and makes no
-- start or stop. UM10204 asks devices for 300 ns. A spike just as the clock line falls uses up to its length and
-- SPIKE - 1 clocks of HOLD. The clock line must stay high for SPIKE + HOLD clocks.
--
-- Latency: SPIKE + 2 clocks (2 if SPIKE = 1); with HOLD > 0 HOLD + 1 clocks more, for the falling clock line 1 clock
-- more.
-- Throughput: one sample of both lines each clock.
-- Equation: level(n) = level(n - 1) until SPIKE samples in a row differ from it.

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
    -- The levels behind the filter.
    scl_level : out   std_logic;
    sda_level : out   std_logic
  );
end entity i2c_lines;

architecture rtl of i2c_lines is

  signal lines   : std_logic_vector(1 downto 0);
  signal arrived : std_logic_vector(1 downto 0);
  -- Samples in a row that differ from the level; and the levels without spikes, before HOLD.
  signal scl_count : natural range 0 to SPIKE := 0;
  signal sda_count : natural range 0 to SPIKE := 0;
  signal scl_now   : std_logic                := '1';
  signal sda_now   : std_logic                := '1';
  -- Clocks since the levels without spikes began to differ from the ports' levels.
  signal scl_wait : natural range 0 to HOLD + 1 := 0;
  signal sda_wait : natural range 0 to HOLD + 1 := 0;
  signal scl_held : std_logic                   := '1';
  signal sda_held : std_logic                   := '1';

begin

  lines     <= scl & sda;
  scl_level <= scl_held;
  sda_level <= sda_held;

  crossing : entity work.synchroniser
    generic map (
      WIDTH => 2
    )
    port map (
      clk         => clk,
      level       => lines,
      synchronous => arrived
    );

  -- With SPIKE = 1 each sample is a level: there is no counter and no delay.
  direct : if SPIKE = 1 generate
    scl_now <= arrived(1);
    sda_now <= arrived(0);
  end generate direct;

  counted : if SPIKE > 1 generate

    drop_spikes : process (clk) is
    begin

      if rising_edge(clk) then
        if arrived(1) = scl_now then
          scl_count <= 0;
        elsif scl_count = SPIKE - 1 then
          scl_now   <= arrived(1);
          scl_count <= 0;
        else
          scl_count <= scl_count + 1;
        end if;
        if arrived(0) = sda_now then
          sda_count <= 0;
        elsif sda_count = SPIKE - 1 then
          sda_now   <= arrived(0);
          sda_count <= 0;
        else
          sda_count <= sda_count + 1;
        end if;
      end if;

    end process drop_spikes;

  end generate counted;

  at_once : if HOLD = 0 generate
    scl_held <= scl_now;
    sda_held <= sda_now;
  end generate at_once;

  later : if HOLD > 0 generate

    hold_levels : process (clk) is
    begin

      if rising_edge(clk) then
        -- The falling clock line alone passes at once.
        if scl_now = scl_held or scl_now = '0' then
          scl_wait <= 0;
          scl_held <= scl_held and scl_now;
        elsif scl_wait = HOLD - 1 then
          scl_wait <= 0;
          scl_held <= scl_now;
        else
          scl_wait <= scl_wait + 1;
        end if;
        if sda_now = sda_held then
          sda_wait <= 0;
        elsif sda_wait = HOLD - 1 then
          sda_wait <= 0;
          sda_held <= sda_now;
        else
          sda_wait <= sda_wait + 1;
        end if;
      end if;

    end process hold_levels;

  end generate later;

end architecture rtl;
