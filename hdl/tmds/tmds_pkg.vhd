-- SPDX-License-Identifier: Apache-2.0
-- Words and steps of TMDS coding (DVI 1.0, section 3) and of data islands (HDMI 1.4, section 5).
--
-- A word has ten bits; bit 0 is sent first. In the blanking it is one of four control tokens, else a byte as a chain of
-- XORs (bit 8 set) or XNORs, inverted or not (bit 9) for DC balance. In data islands it is one of 16 words for four
-- bits.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package tmds_pkg is

  subtype tmds_word_t is std_logic_vector(9 downto 0);

  -- Number of channels. Words and bytes of all channels stand side by side, channel 0 (blue) in the low bits.
  constant CHANNELS : positive := 3;

  -- The words of all channels.
  type words_t is array (0 to CHANNELS - 1) of tmds_word_t;

  -- What a word of a channel may stand for. The period decides (tmds_periods), which one channel alone does not know.
  type decoded_t is record
    -- The word is no control token.
    active : std_logic;
    -- C1 and C0 of the last token.
    control : std_logic_vector(1 downto 0);
    -- The word read as a byte.
    data : std_logic_vector(7 downto 0);
    -- The word is neither a token nor a word that an encoder sends for a byte.
    error : std_logic;
    -- Read as a word of a data island: whether it stands for four bits, and these bits (else 0).
    is_nibble : std_logic;
    nibble    : std_logic_vector(3 downto 0);
    -- The word belongs to the guard band of islands, or in channel 1 to that of video.
    is_guard : std_logic;
  end record decoded_t;

  constant NO_WORD : decoded_t := ('0', "00", x"00", '0', '0', "0000", '0');

  type decoded_words_t is array (0 to CHANNELS - 1) of decoded_t;

  -- Channels that are inverted. With the highest bit set, tmds_polarity finds the swapped channels.
  subtype polarity_t is std_logic_vector(CHANNELS downto 0);

  constant FIND_POLARITY : polarity_t := "1000";

  -- A word of a data island.
  type island_t is record
    -- An island begins.
    start : std_logic;
    -- The word holds a bit of the packet's header, and two bits of each subpacket.
    valid  : std_logic;
    header : std_logic;
    even   : std_logic_vector(3 downto 0);
    odd    : std_logic_vector(3 downto 0);
  end record island_t;

  -- What an HDMI source says about its picture.
  type picture_info_t is record
    -- The source has sent an AVI InfoFrame; the other fields are zero until then.
    informed : std_logic;
    -- 0 RGB, 1 YCbCr 4:2:2, 2 YCbCr 4:4:4, 3 YCbCr 4:2:0.
    colour : std_logic_vector(1 downto 0);
    -- limited: limited range; bt601: YCbCr of BT.601, else of BT.709.
    limited : std_logic;
    bt601   : std_logic;
    -- Video format (VIC).
    format_code : std_logic_vector(7 downto 0);
  end record picture_info_t;

  constant NO_INFO : picture_info_t := ('0', "00", '0', '0', x"00");

  -- Control tokens for C1 & C0.
  constant TOKEN_00 : tmds_word_t := "1101010100";
  constant TOKEN_01 : tmds_word_t := "0010101011";
  constant TOKEN_10 : tmds_word_t := "0101010100";
  constant TOKEN_11 : tmds_word_t := "1010101011";

  -- Words of a preamble (HDMI 1.4, section 5.2.1.1).
  constant PREAMBLE_WORDS : positive := 8;
  -- Guard band of data islands in channels 1 and 2, and of video in channel 1. Its inverse is the guard band of video
  -- in channels 0 and 2.
  constant ISLAND_GUARD : tmds_word_t := "0100110011";
  -- The four bits of the guard band of video in channels 0 and 2.
  constant VIDEO_GUARD_NIBBLE : std_logic_vector(3 downto 0) := "1000";

  -- Whether a word is a control token.
  function is_token (
    word : std_logic_vector(9 downto 0)
  ) return std_logic;

  -- Bit 4: whether it is a word of data islands; below it the word's four bits, else 0.
  function decode_terc4 (
    word : std_logic_vector(9 downto 0)
  ) return std_logic_vector;

  -- Check bits of a header or subpacket after one more bit: 1 + x^6 + x^7 + x^8.
  function next_check (
    check     : std_logic_vector(7 downto 0);
    bit_value : std_logic
  ) return std_logic_vector;

  -- Number of ones in a byte.
  function count_ones (
    byte : std_logic_vector(7 downto 0)
  ) return natural;

  -- Whether a byte is sent as a chain of XORs (else of XNORs).
  function uses_xor (
    byte : std_logic_vector(7 downto 0)
  ) return std_logic;

  -- The byte as a chain; bit 8 is 1 for XOR and 0 for XNOR.
  function minimise_transitions (
    byte : std_logic_vector(7 downto 0)
  ) return std_logic_vector;

  -- The byte of a data word.
  function decode_byte (
    word : std_logic_vector(9 downto 0)
  ) return std_logic_vector;

end package tmds_pkg;

package body tmds_pkg is

  -- The words for four bits, by their value (HDMI 1.4, section 5.4.3).
  type terc4_t is array (0 to 15) of tmds_word_t;

  constant TERC4 : terc4_t :=
  (
    "1010011100",
    "1001100011",
    "1011100100",
    "1011100010",
    "0101110001",
    "0100011110",
    "0110001110",
    "0100111100",
    "1011001100",
    "0100111001",
    "0110011100",
    "1011000110",
    "1010001110",
    "1001110001",
    "0101100011",
    "1011000011"
  );

  function is_token (
    word : std_logic_vector(9 downto 0)
  ) return std_logic is
  begin

    -- The four tokens are one pattern of nine bits and its complement, with either tenth bit.
    if word(8 downto 0) = TOKEN_00(8 downto 0) or word(8 downto 0) = TOKEN_01(8 downto 0) then
      return '1';
    end if;

    return '0';

  end function is_token;

  function decode_terc4 (
    word : std_logic_vector(9 downto 0)
  ) return std_logic_vector is

    variable value : std_logic_vector(4 downto 0);

  begin

    value := "00000";

    for i in TERC4'range loop

      if word = TERC4(i) then
        value := '1' & std_logic_vector(to_unsigned(i, 4));
      end if;

    end loop;

    return value;

  end function decode_terc4;

  function next_check (
    check     : std_logic_vector(7 downto 0);
    bit_value : std_logic
  ) return std_logic_vector is

    variable feedback : std_logic;

  begin

    -- Bits come lowest first, so the polynomial is reversed.
    feedback := check(0) xor bit_value;
    return feedback & check(7 downto 3) & (check(2) xor feedback) & (check(1) xor feedback);

  end function next_check;

  -- A table is faster than a chain of additions: this is in the decoder's longest path.

  function ones_of_four (
    bits : std_logic_vector(3 downto 0)
  ) return natural is

    variable ones : natural range 0 to 4;

  begin

    case bits is

      when "0000" =>

        ones := 0;

      when "0001" | "0010" | "0100" | "1000" =>

        ones := 1;

      when "0111" | "1011" | "1101" | "1110" =>

        ones := 3;

      when "1111" =>

        ones := 4;

      when others =>

        ones := 2;

    end case;

    return ones;

  end function ones_of_four;

  function count_ones (
    byte : std_logic_vector(7 downto 0)
  ) return natural is
  begin

    -- Two tables of four bits fit lookup tables; one of eight bits does not.
    return ones_of_four(byte(7 downto 4)) + ones_of_four(byte(3 downto 0));

  end function count_ones;

  function uses_xor (
    byte : std_logic_vector(7 downto 0)
  ) return std_logic is
  begin

    -- With more ones than zeros, XNORs make the chain with fewer changes; a tie is decided by the first bit (DVI 1.0,
    -- figure 3-5).
    if count_ones(byte) > 4 or (count_ones(byte) = 4 and byte(0) = '0') then
      return '0';
    end if;

    return '1';

  end function uses_xor;

  function minimise_transitions (
    byte : std_logic_vector(7 downto 0)
  ) return std_logic_vector is

    variable chain : std_logic_vector(8 downto 0);

  begin

    chain(0) := byte(0);
    chain(8) := uses_xor(byte);

    -- Bit 8 = 0 turns each XOR into an XNOR.
    for i in 1 to 7 loop

      chain(i) := not (chain(i - 1) xor byte(i) xor chain(8));

    end loop;

    return chain;

  end function minimise_transitions;

  function decode_byte (
    word : std_logic_vector(9 downto 0)
  ) return std_logic_vector is

    variable byte : std_logic_vector(7 downto 0);

  begin

    -- Inversion cancels out between neighbouring bits.
    byte(0) := word(0) xor word(9);

    for i in 1 to 7 loop

      byte(i) := not (word(i) xor word(i - 1) xor word(8));

    end loop;

    return byte;

  end function decode_byte;

end package body tmds_pkg;
