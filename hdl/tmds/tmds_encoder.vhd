-- SPDX-License-Identifier: Apache-2.0
-- TMDS encoder of one channel.
--
-- Latency: 3 clocks. Throughput: one word each clock.
-- Equation: DVI 1.0, figure 3-5: transitions are minimised, and the word is inverted if that brings the running
-- disparity (ones minus zeros since the last control token) nearer to zero.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.tmds_pkg.all;

entity tmds_encoder is
  port (
    clk : in    std_logic;
    -- Clears the running disparity.
    reset : in    std_logic;
    -- Data enable: data is sent while high, control while low.
    active : in    std_logic;
    -- C1 and C0.
    control : in    std_logic_vector(1 downto 0);
    -- Byte to send.
    data : in    std_logic_vector(7 downto 0);
    -- The word; bit 0 is sent first.
    word : out   std_logic_vector(9 downto 0)
  );
end entity tmds_encoder;

architecture rtl of tmds_encoder is

  -- Half of ones minus zeros, for a byte's chain and for all words so far.
  subtype half_t is integer range -4 to 4;

  -- Clock 1: the byte as a chain, and the other inputs.
  signal chain         : std_logic_vector(8 downto 0) := (others => '0');
  signal chain_active  : std_logic                    := '0';
  signal chain_control : std_logic_vector(1 downto 0) := "00";
  -- Clock 2: ones of the chain above four. Clock 3 chooses the word by this number and the sum so far; counting and
  -- choosing take a clock each.
  signal excess         : half_t                       := 0;
  signal excess_chain   : std_logic_vector(8 downto 0) := (others => '0');
  signal excess_active  : std_logic                    := '0';
  signal excess_control : std_logic_vector(1 downto 0) := "00";
  -- The sum never leaves -4 to 4: a word is inverted whenever that brings the sum nearer to zero.
  signal disparity : half_t := 0;

begin

  encode : process (clk) is
  begin

    if rising_edge(clk) then
      -- Three clocks: the chain, its ones, the word.
      chain         <= minimise_transitions(data);
      chain_active  <= active;
      chain_control <= control;

      -- Registered, so that counting and choosing are not one path.
      excess         <= count_ones(chain(7 downto 0)) - 4;
      excess_chain   <= chain;
      excess_active  <= chain_active;
      excess_control <= chain_control;

      if excess_active = '0' then
        -- Each run of tokens restarts the sum, as in DVI, so lines do not depend on each other.
        disparity <= 0;

        case excess_control is

          when "00" =>

            word <= TOKEN_00;

          when "01" =>

            word <= TOKEN_01;

          when "10" =>

            word <= TOKEN_10;

          when others =>

            word <= TOKEN_11;

        end case;

      elsif disparity = 0 or excess = 0 then
        -- Both ways are equally balanced, so bit 8 decides (DVI 1.0): bit 9 is its complement.
        if excess_chain(8) = '1' then
          word      <= '0' & excess_chain;
          disparity <= disparity + excess;
        else
          word      <= "10" & not excess_chain(7 downto 0);
          disparity <= disparity - excess;
        end if;
      elsif (disparity > 0) = (excess > 0) then
        -- The chain has more of the kind of bits that the words so far have too many of: it goes out inverted.
        word <= '1' & excess_chain(8) & not excess_chain(7 downto 0);
        -- Bits 8 and 9 count too: two ones are one more in halves, two zeros one less.
        if excess_chain(8) = '1' then
          disparity <= disparity - excess + 1;
        else
          disparity <= disparity - excess;
        end if;
      else
        word <= '0' & excess_chain;
        if excess_chain(8) = '1' then
          disparity <= disparity + excess;
        else
          disparity <= disparity + excess - 1;
        end if;
      end if;

      if reset = '1' then
        chain_active  <= '0';
        excess_active <= '0';
        disparity     <= 0;
      end if;
    end if;

  end process encode;

end architecture rtl;
