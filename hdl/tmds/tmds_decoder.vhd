-- SPDX-License-Identifier: Apache-2.0
-- TMDS decoder of one channel, for the words of DVI and those that HDMI adds.
--
-- Latency: 2 clocks. Throughput: one word each clock.
-- Equation: DVI 1.0, figure 3-6. Of the 1024 words 460 are data words: the chain must be the one that an encoder
-- chooses for the byte, and a balanced chain is inverted only if it consists of XNORs.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.tmds_pkg.all;

entity tmds_decoder is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The word; bit 0 came first.
    word : in    std_logic_vector(9 downto 0);
    -- What the word may stand for.
    decoded : out   decoded_t
  );
end entity tmds_decoder;

architecture rtl of tmds_decoder is

  -- Clock 1: all readings of the word. The check of the chain needs the byte, so it comes a clock later.
  signal byte_token   : std_logic                    := '1';
  signal byte_word    : std_logic_vector(9 downto 0) := TOKEN_00;
  signal octet        : std_logic_vector(7 downto 0) := (others => '0');
  signal terc4        : std_logic_vector(4 downto 0) := (others => '0');
  signal guard        : std_logic                    := '0';
  signal last_control : std_logic_vector(1 downto 0) := "00";

begin

  decoded.control <= last_control;

  decode : process (clk) is
  begin

    if rising_edge(clk) then
      -- Comparison and selection take a clock each.
      byte_token <= is_token(word);
      byte_word  <= word;
      -- All readings of a word side by side; tmds_periods decides by the earlier words which one counts.
      octet <= decode_byte(word);
      terc4 <= decode_terc4(word);
      guard <= '0';
      if word = ISLAND_GUARD then
        guard <= '1';
      end if;

      -- Registers of the first clock, which come out with the second.
      decoded.is_nibble <= terc4(4);
      decoded.nibble    <= terc4(3 downto 0);
      decoded.is_guard  <= guard;

      decoded.active <= not byte_token;
      decoded.error  <= '0';
      -- Black outside the picture, because a decoded token is no colour.
      decoded.data <= (others => '0');
      if byte_token = '1' then

        case byte_word is

          when TOKEN_00 =>

            last_control <= "00";

          when TOKEN_01 =>

            last_control <= "01";

          when TOKEN_10 =>

            last_control <= "10";

          when others =>

            last_control <= "11";

        end case;

      else
        -- A data word is one that an encoder makes for its byte; any other word has a wrong bit.
        decoded.data <= octet;
        -- An encoder has no choice: it takes the chain that uses_xor names, and inverts a balanced chain only if it
        -- consists of XNORs.
        if byte_word(8) /= uses_xor(octet) or
           (byte_word(9) = byte_word(8) and count_ones(byte_word(7 downto 0)) = 4) then
          decoded.error <= '1';
        end if;
      end if;

      if reset = '1' then
        byte_token     <= '1';
        decoded.active <= '0';
        decoded.error  <= '0';
      end if;
    end if;

  end process decode;

end architecture rtl;
