-- SPDX-License-Identifier: Apache-2.0
-- Reads the packets of data islands: checks all of them, and keeps what the AVI InfoFrame says about the picture.
--
-- The check bits of header and subpackets are computed as the bits come; behind a whole packet all must be 0. The bytes
-- of an InfoFrame add up to 0. An AVI InfoFrame that passes both checks replaces the one before.
--
-- Latency: 2 clocks from the last word of a packet. Throughput: one word each clock.
-- Equation: HDMI 1.4, sections 5.2.3.4 and 5.2.3.5; CEA-861-D, section 6.4. If the range is not told, RGB is limited in
-- the formats of TV (VIC 2 and above). If the coding is not told, YCbCr is BT.601 in formats of up to 576 lines, else
-- BT.709.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.tmds_pkg.all;

entity info_frame_reader is
  port (
    clk : in    std_logic;
    -- Clears what was read.
    reset : in    std_logic;
    -- Words of data islands.
    island : in    island_t;
    -- Content of the last correct AVI InfoFrame.
    info : out   picture_info_t;
    -- High for one clock: a packet with wrong check bits; an InfoFrame with a wrong sum.
    packet_error : out   std_logic;
    sum_error    : out   std_logic
  );
end entity info_frame_reader;

architecture rtl of info_frame_reader is

  -- A packet has 32 words. Each word brings a bit of the header (24 bits, 8 check bits) and two bits of each subpacket
  -- (56 bits, 8 check bits).
  constant LAST_WORD       : natural := 31;
  constant HEADER_WORDS    : natural := 24;
  constant SUBPACKET_WORDS : natural := 28;

  subtype byte_t is std_logic_vector(7 downto 0);

  constant AVI : byte_t := x"82";

  type checks_t is array (0 to 3) of byte_t;

  type tails_t is array (0 to 3) of std_logic_vector(5 downto 0);

  -- The packet's next word, and the check bits of header and subpackets so far.
  signal place        : unsigned(4 downto 0) := (others => '0');
  signal header_check : byte_t               := (others => '0');
  signal checks       : checks_t             := (others => (others => '0'));
  -- The last bits of the subpackets; all bits of the header and of the first subpacket.
  signal tails      : tails_t                       := (others => (others => '0'));
  signal header_all : std_logic_vector(23 downto 0) := (others => '0');
  signal first_all  : std_logic_vector(55 downto 0) := (others => '0');
  -- Sum of the four bytes that have just become complete, one of each subpacket; sum of all bytes so far; done: the
  -- packet is complete.
  signal column : unsigned(7 downto 0) := (others => '0');
  signal sum    : unsigned(7 downto 0) := (others => '0');
  signal done   : std_logic            := '0';

  -- Whether a format of this code has at most 576 lines.

  function is_small (
    code : std_logic_vector(7 downto 0)
  ) return std_logic is
  begin

    -- The codes of CEA-861-D with up to 576 lines; the others have 720 or 1080.
    case to_integer(unsigned(code)) is

      when 1 to 3 | 6 to 15 | 17 to 18 | 21 to 30 | 35 to 38 | 42 to 45 | 48 to 59 =>

        return '1';

      when others =>

        return '0';

    end case;

  end function is_small;

  -- Whether the range is limited, for RGB (rgb) or YCbCr (ycc).

  function is_limited (
    space : std_logic_vector(1 downto 0);
    rgb   : std_logic_vector(1 downto 0);
    ycc   : std_logic_vector(1 downto 0);
    code  : byte_t
  ) return std_logic is
  begin

    -- RGB and YCbCr have a field each for the range; if the field leaves it open, the format decides.
    if space /= "00" then
      return to_logic(ycc = "00");
    end if;

    return to_logic(rgb = "01" or (rgb = "00" and unsigned(code) > 1));

  end function is_limited;

  function is_bt601 (
    coding : std_logic_vector(1 downto 0);
    more   : std_logic_vector(2 downto 0);
    code   : byte_t
  ) return std_logic is
  begin

    -- The coding: not told, BT.601, BT.709, or named by the field of the extended coding.
    case coding is

      when "00" =>

        return is_small(code);

      when "01" =>

        return '1';

      when "10" =>

        return '0';

      when others =>

        -- xvYCC601, sYCC601 and Adobe's YCC.
        return to_logic(more = "000" or more = "010" or more = "011");

    end case;

  end function is_bt601;

  -- Behind the last word of a packet: its check bits are wrong; it is an InfoFrame whose sum is wrong.
  signal bad_checks : std_logic;
  signal bad_sum    : std_logic;

begin

  -- Behind the last bit of a packet, each check byte is 0 if all bits were right.
  bad_checks <= to_logic(header_check /= x"00" or checks(0) /= x"00" or checks(1) /= x"00" or checks(2) /= x"00" or
                         checks(3) /= x"00");
  -- InfoFrames are the packet types from 80 hexadecimal on; only they have a sum.
  bad_sum <= header_all(7) and to_logic(sum /= 0);

  take_words : process (clk) is

    variable header_before : byte_t;
    variable check_before  : byte_t;

  begin

    if rising_edge(clk) then
      done <= '0';

      if island.valid = '1' then
        -- Packets of an island follow each other without a gap, so the count wraps round behind the last word.
        place <= place + 1;
        if place = LAST_WORD then
          done <= '1';
        end if;

        -- Check bytes are updated with each bit, so that the packet need not be stored; the remainder must be zero.
        header_before := header_check;
        if place = 0 then
          header_before := (others => '0');
        end if;
        header_check <= next_check(header_before, island.header);
        if place < HEADER_WORDS then
          header_all <= island.header & header_all(23 downto 1);
        end if;
        -- Only the first subpacket is stored, because it has all fields used here. Two bits come with each word, so all
        -- 56 are there after 28 words.
        if place < SUBPACKET_WORDS then
          first_all <= island.odd(0) & island.even(0) & first_all(55 downto 2);
        end if;

        for i in 0 to 3 loop

          check_before := checks(i);
          if place = 0 then
            check_before := (others => '0');
          end if;
          checks(i) <= next_check(next_check(check_before, island.even(i)), island.odd(i));
          tails(i)  <= island.odd(i) & island.even(i) & tails(i)(5 downto 2);

        end loop;

      end if;

      if island.start = '1' then
        place <= (others => '0');
      end if;
      if reset = '1' then
        done <= '0';
      end if;
    end if;

  end process take_words;

  -- A byte of each subpacket is complete every four words, a byte of the header every eight. The four bytes are added
  -- up a word before they enter the sum, which keeps the chain of adders short.
  add_bytes : process (clk) is

    variable byte  : byte_t;
    variable added : unsigned(7 downto 0);

  begin

    if rising_edge(clk) then
      if island.valid = '1' then
        added := (others => '0');

        for i in 0 to 3 loop

          -- The byte ends with this word's two bits.
          byte  := island.odd(i) & island.even(i) & tails(i);
          added := added + unsigned(byte);

        end loop;

        -- The column is cleared once it has entered the sum below, so that nothing is added twice.
        column <= (others => '0');
        if place(1 downto 0) = 3 and place < SUBPACKET_WORDS then
          column <= added;
        end if;
        -- The sum starts again with the first word of the next packet; keep_told has read it by then.
        if place = 0 then
          sum <= (others => '0');
        elsif place(2 downto 0) = 0 and place <= HEADER_WORDS then
          -- A byte of the header was completed by the word before.
          sum <= sum + column + unsigned(header_all(23 downto 16));
        else
          sum <= sum + column;
        end if;
      end if;
    end if;

  end process add_bytes;

  keep_told : process (clk) is
  begin

    if rising_edge(clk) then
      packet_error <= done and bad_checks;
      sum_error    <= done and not bad_checks and bad_sum;

      -- A packet with an error changes nothing; earlier values stay valid.
      if done = '1' and bad_checks = '0' and bad_sum = '0' and header_all(7 downto 0) = AVI then
        -- The InfoFrame's checksum is byte 0; Y is in byte 1, C in 2, EC and Q in 3, VIC in 4, YQ in 5.
        info.informed    <= '1';
        info.colour      <= first_all(14 downto 13);
        info.format_code <= first_all(39 downto 32);
        info.limited     <= is_limited(first_all(14 downto 13), first_all(27 downto 26), first_all(47 downto 46),
                                       first_all(39 downto 32));
        info.bt601       <= is_bt601(first_all(23 downto 22), first_all(30 downto 28), first_all(39 downto 32));
      end if;

      if reset = '1' then
        packet_error <= '0';
        sum_error    <= '0';
        info         <= NO_INFO;
      end if;
    end if;

  end process keep_told;

end architecture rtl;
