-- SPDX-License-Identifier: Apache-2.0
-- Finds packets in bursts, and in them frames and lines of raw pixels.
--
-- A burst begins with the header of a packet; bytes behind the packet are filler. Bit errors of the header are
-- corrected or detected, and payloads are checked, those of other types and virtual channels included. Bytes of lines
-- leave as they arrive, so a fault in a line is known only afterwards. Lines count between a frame's start and its end.
--
-- Outputs of one clock happen in this order: a line ends, a frame ends, a frame starts. A byte comes before or after
-- all of these, because a clock has either bytes or the start of a frame.
--
-- Latency: 5 clocks. Throughput: LANES bytes each clock.
-- Equation: payload(n) = burst(4 + n), n < word count, of packets of type raw_kind(PIXEL_BITS) on the virtual channel.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.csi_pkg.all;
use work.delay_pkg.all;
use work.math_pkg.all;

entity packet_parser is
  generic (
    LANES      : positive range 1 to 4;
    PIXEL_BITS : positive range 8 to 12
  );
  port (
    clk : in    std_logic;
    -- Words of bursts, as lane_merge gives them.
    word_first : in    std_logic;
    word_live  : in    std_logic_vector(LANES - 1 downto 0);
    word_data  : in    std_logic_vector(8 * LANES - 1 downto 0);
    -- The virtual channel whose frames come out.
    virtual_channel : in    std_logic_vector(1 downto 0);
    -- Bytes of a line, and how many; the line has ended, with this clock's bytes if there are any.
    payload      : out   payload_t;
    payload_data : out   std_logic_vector(8 * LANES - 1 downto 0);
    -- A frame starts; events: a frame ended, faults, packets that are left out. PIXELS_LOST is always low here.
    frame_starts : out   std_logic;
    events       : out   events_t;
    -- The last packet of pixels that was left out.
    left_identifier : out   identifier_t
  );
end entity packet_parser;

architecture rtl of packet_parser is

  -- A header has four bytes, so that many words of all lanes.
  constant HEADER_WORDS : positive                             := 4 / LANES;
  constant ALL_LIVE     : std_logic_vector(LANES - 1 downto 0) := (others => '1');
  constant WORD_BITS    : positive                             := 8 * LANES;
  -- Clocks from a word to the checked data of its header.
  constant DELAY    : positive := 3;
  constant TAG_BITS : positive := 1 + LANES + WORD_BITS;

  -- Words of a header that are still to come, its bytes so far, whether it is complete, whether it was cut.
  signal header_left : natural range 0 to 3          := 0;
  signal header      : std_logic_vector(31 downto 0) := (others => '0');
  signal header_full : std_logic                     := '0';
  signal header_cut  : std_logic                     := '0';
  -- The checked header (known: it is there; known_bad: damaged; mended: corrected; facts: its data), and the word that
  -- came with its last byte.
  signal known     : std_logic;
  signal known_bad : std_logic;
  signal mended    : std_logic;
  signal facts     : std_logic_vector(23 downto 0);
  signal tag       : std_logic_vector(TAG_BITS - 1 downto 0);
  signal tag_late  : std_logic_vector(TAG_BITS - 1 downto 0);
  signal tags      : std_logic_vector(delay_bits(TAG_BITS, DELAY) - 1 downto 0) := (others => '0');
  signal first     : std_logic;
  signal live      : std_logic_vector(LANES - 1 downto 0);
  signal data      : std_logic_vector(WORD_BITS - 1 downto 0);
  -- busy: a long packet is under way; left: bytes of payload and checksum that are still to come; near_end: so few that
  -- not all bytes of a word are payload; is_line: the payload is a line.
  signal busy     : std_logic             := '0';
  signal left     : unsigned(16 downto 0) := (others => '0');
  signal near_end : std_logic             := '0';
  signal is_line  : std_logic             := '0';

  -- The word on offer: its bytes in the packet, and in the payload; cut: one of them is missing; ends: the packet ends.
  signal needed : natural range 0 to LANES;
  signal bytes  : natural range 0 to 7;
  signal cut    : std_logic;
  signal ends   : std_logic;

  -- The virtual channel is between a frame's start and its end.
  signal frame_open : std_logic := '0';
  -- A packet of this frame was a line.
  signal has_lines : std_logic := '0';

  -- Inputs of the checksum, and its result.
  signal crc_restart : std_logic                                := '0';
  signal crc_strobe  : std_logic                                := '0';
  signal crc_last    : std_logic                                := '0';
  signal crc_data    : std_logic_vector(WORD_BITS - 1 downto 0) := (others => '0');
  signal crc_wrong   : std_logic;
  signal told        : events_t                                 := (others => '0');

begin

  collect_header : process (clk) is

    variable joined : std_logic_vector(WORD_BITS + 31 downto 0);

  begin

    if rising_edge(clk) then
      -- Earlier bytes move down as a word is put on top; when all have come, the last four are the header.
      joined      := word_data & header;
      header_full <= '0';
      tags        <= moved_on(tags, tag);
      -- A burst that begins inside a header cuts it.
      header_cut <= word_first and to_logic(header_left /= 0);
      if word_first = '1' or header_left /= 0 then
        if word_live = ALL_LIVE then
          header <= joined(WORD_BITS + 31 downto WORD_BITS);
          if word_first = '1' then
            header_left <= HEADER_WORDS - 1;
            header_full <= to_logic(HEADER_WORDS = 1);
          else
            header_left <= header_left - 1;
            header_full <= to_logic(header_left = 1);
          end if;
        else
          -- A lane has ended before the header was complete.
          header_left <= 0;
          header_cut  <= '1';
        end if;
      end if;
    end if;

  end process collect_header;

  check_header : entity work.header_ecc
    port map (
      clk        => clk,
      strobe     => header_full,
      header     => header,
      out_strobe => known,
      data       => facts,
      corrected  => mended,
      damaged    => known_bad
    );

  -- Words wait until their header has been checked, so a payload's first word meets a header that is known.
  tag <= word_data & word_live & word_first;

  tag_late <= delayed(tags, tag, DELAY);

  first <= tag_late(0);
  live  <= tag_late(LANES downto 1);
  data  <= tag_late(TAG_BITS - 1 downto LANES + 1);

  -- The share of the packet in the word on offer. Missing bytes, or a new burst, cut a packet short; bytes that have
  -- left stay. Bytes behind the checksum are filler and enter the checksum as zeros, which leave its result unchanged.
  share_word : process (left, near_end, first, live) is

    variable few   : natural range 0 to 7;
    variable share : natural range 0 to LANES;
    variable lost  : std_logic;

  begin

    few   := to_integer(left(2 downto 0));
    share := LANES;
    bytes <= LANES;

    if near_end = '1' then
      bytes <= 0;
      if few >= 2 then
        bytes <= few - 2;
      end if;
      if few < LANES then
        share := few;
      end if;
    end if;

    lost := first;

    for i in 0 to LANES - 1 loop

      if i < share then
        lost := lost or not live(i);
      end if;

    end loop;

    needed <= share;
    cut    <= lost;
    ends   <= near_end and to_logic(few <= LANES);

  end process share_word;

  follow_packets : process (clk) is

    variable kind : kind_t;
    variable ours : std_logic;

  begin

    if rising_edge(clk) then
      payload.valid <= '0';
      payload_data  <= data;
      payload.ends  <= '0';
      frame_starts  <= '0';
      crc_restart   <= '0';
      crc_strobe    <= '0';
      crc_last      <= '0';
      crc_data      <= data;
      told          <= (others => '0');

      for i in 0 to LANES - 1 loop

        if i >= needed then
          crc_data(8 * i + 7 downto 8 * i) <= (others => '0');
        end if;

      end loop;

      if busy = '1' then
        if cut = '1' then
          busy             <= '0';
          payload.ends     <= is_line;
          told(CUT_PACKET) <= '1';
        else
          payload.valid <= is_line and to_logic(bytes > 0);
          payload.bytes <= bytes;
          payload.ends  <= is_line and ends;
          crc_strobe    <= '1';
          crc_last      <= ends;
          left          <= left - LANES;
          -- Compared a clock ahead, so that no subtraction stands in front of the decision about the next word.
          near_end <= to_logic(left < 2 * LANES + 2);
          busy     <= not ends;
        end if;
      end if;

      -- This overrides the assignments above: with four lanes a header's only word also cuts a packet that was under
      -- way.
      if known = '1' then
        told(CORRECTED_HEADER) <= mended;
        told(DAMAGED_HEADER)   <= known_bad;
        kind                   := facts(5 downto 0);
        ours                   := to_logic(facts(7 downto 6) = virtual_channel);
        -- A damaged header is reliable in nothing, not even its length: everything up to the next burst is filler.
        if known_bad = '0' then
          -- Payload and checksum. Packets of other types are followed too, because a wrong checksum tells about the
          -- link.
          if kind >= LONG_KINDS then
            busy        <= '1';
            left        <= resize(unsigned(facts(23 downto 8)), 17) + 2;
            near_end    <= to_logic(unsigned(facts(23 downto 8)) < LANES);
            crc_restart <= '1';
          end if;
          is_line <= '0';
          -- Packets that do not belong to the frames are counted, and the last one with pixels is named.
          if kind >= PIXEL_KINDS then
            if ours = '0' or kind /= raw_kind(PIXEL_BITS) then
              left_identifier <= facts(7 downto 0);
            end if;
            told(OTHER_CHANNEL) <= not ours;
            told(OTHER_TYPE)    <= ours and to_logic(kind /= raw_kind(PIXEL_BITS));
          else
            told(NO_PIXELS) <= not ours or to_logic(kind >= GENERIC_KINDS);
          end if;
          if ours = '1' then
            if kind = FRAME_START_KIND then
              frame_starts       <= '1';
              frame_open         <= '1';
              has_lines          <= '0';
              told(OUT_OF_ORDER) <= frame_open;
            elsif kind = FRAME_END_KIND then
              frame_open         <= '0';
              told(FRAME_ENDED)  <= frame_open;
              told(NO_LINES)     <= frame_open and not has_lines;
              told(OUT_OF_ORDER) <= not frame_open;
            elsif kind = raw_kind(PIXEL_BITS) then
              is_line            <= frame_open;
              has_lines          <= '1';
              told(OUT_OF_ORDER) <= not frame_open;
            end if;
          end if;
        end if;
      end if;
    end if;

  end process follow_packets;

  check_payload : entity work.payload_crc
    generic map (
      LANES => LANES
    )
    port map (
      clk     => clk,
      restart => crc_restart,
      strobe  => crc_strobe,
      last    => crc_last,
      data    => crc_data,
      damaged => crc_wrong
    );

  tell : process (told, crc_wrong, header_cut) is
  begin

    events                  <= told;
    events(DAMAGED_PAYLOAD) <= crc_wrong;
    events(CUT_PACKET)      <= told(CUT_PACKET) or header_cut;

  end process tell;

end architecture rtl;
