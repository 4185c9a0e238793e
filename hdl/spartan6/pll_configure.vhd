-- SPDX-License-Identifier: Apache-2.0
-- Writes a setting into a PLL through its reconfiguration port.
--
-- Each register is read, its masked bits are replaced, and it is written back (XAPP879). If the port does not answer
-- within TIMEOUT clocks, done still comes, and the PLL's missing lock shows the failure.
--
-- Latency: about 10 clocks for each register. Throughput: one setting at a time.
-- Equation: register = (register and not mask) or setting.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.pll_settings_pkg.all;

entity pll_configure is
  generic (
    -- Clocks to wait for an answer.
    TIMEOUT : positive := 255
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- start: write the setting; high: for 40 to 100 MHz, else for 25 to 50 MHz.
    start : in    std_logic;
    high  : in    std_logic;
    -- No setting is being written.
    done : out   std_logic;
    -- The PLL's reconfiguration port. The PLL must be in reset while it is in use.
    drp_enable  : out   std_logic;
    drp_write   : out   std_logic;
    drp_address : out   std_logic_vector(4 downto 0);
    drp_in      : out   std_logic_vector(15 downto 0);
    drp_out     : in    std_logic_vector(15 downto 0);
    drp_ready   : in    std_logic
  );
end entity pll_configure;

architecture rtl of pll_configure is

  type state_t is (idle, fetch, wait_read, put, wait_write);

  -- The state; the register that is written; clocks waited for an answer; whether no setting is being written; the
  -- register's entry and its new bits.
  signal state    : state_t                               := idle;
  signal index    : natural range 0 to PLL_REGISTERS'high := 0;
  signal clocks   : natural range 0 to TIMEOUT            := 0;
  signal done_now : std_logic                             := '1';
  signal entry    : pll_register_t;
  signal contents : std_logic_vector(15 downto 0);

begin

  done <= done_now;

  entry <= PLL_REGISTERS(index);
  -- The control keeps the choice constant while the setting is written.
  contents <= entry.high when high = '1' else
              entry.low;

  configure : process (clk) is
  begin

    if rising_edge(clk) then
      drp_enable <= '0';
      drp_write  <= '0';
      if clocks /= TIMEOUT then
        clocks <= clocks + 1;
      end if;

      case state is

        when idle =>

          clocks <= 0;
          index  <= 0;
          if start = '1' then
            state <= fetch;
            -- Low from the first clock on, so that the end of the last setting is not taken for this one's.
            done_now <= '0';
          end if;

        when fetch =>

          drp_address <= entry.address;
          drp_enable  <= '1';
          clocks      <= 0;
          state       <= wait_read;

        when wait_read =>

          if drp_ready = '1' then
            -- The register has further bits, which must stay, so it is read first.
            drp_in <= (drp_out and not entry.mask) or contents;
            state  <= put;
          end if;

        when put =>

          -- Address and data stay from the read.
          drp_enable <= '1';
          drp_write  <= '1';
          clocks     <= 0;
          state      <= wait_write;

        when wait_write =>

          if drp_ready = '1' then
            if index = PLL_REGISTERS'high then
              state    <= idle;
              done_now <= '1';
            else
              index <= index + 1;
              state <= fetch;
            end if;
          end if;

      end case;

      -- A PLL that does not answer must not stop the board: it goes on with its present clock, and the lock shows the
      -- failure.
      if clocks = TIMEOUT then
        state    <= idle;
        done_now <= '1';
      end if;

      if reset = '1' then
        state    <= idle;
        done_now <= '1';
      end if;
    end if;

  end process configure;

end architecture rtl;
