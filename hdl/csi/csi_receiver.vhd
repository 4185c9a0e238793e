-- SPDX-License-Identifier: Apache-2.0
-- Receives a camera's MIPI CSI-2: from the bytes of a D-PHY's lanes to raw frames.
--
-- Lanes are aligned (lane_merge), packets found and checked (packet_parser), pixels unpacked (raw_unpacker) and brought
-- into the core's clock (word_sender, crossing_fifo, pixel_stream). A camera does not wait, so nothing in front of the
-- buffer waits, and no line is stored. Counters report faults, and reception recovers with each packet and each frame:
--
-- - A header is corrected, or its packet is left out. Payloads go out as they arrive; a wrong checksum is reported
--   behind them.
-- - A line that is cut short ends early, a lost line is missing, and one that is sent twice comes out twice. The cores
--   fill up and cut off lines (frame_sequencer).
-- - Lines between a frame's end and the next frame's start are left out, and so are packets of other types and
--   channels: all are counted, and the last one with pixels is named.
-- - Pixels that the core does not take in time end their frame.
--
-- There is no reset in byte_clk. If the camera stops it between packets, data under way stay until it continues. A
-- reset drops pixels up to the first pixel of the next frame.
--
-- Latency: about 12 clocks of byte_clk and 5 clocks of clk, from the last lane's byte to a pixel.
-- Throughput: LANES bytes each clock of byte_clk, PIXELS_PER_CLOCK pixels each clock of clk; the buffer takes up lines
-- that come faster.
-- Equation: that of packet_parser, followed by that of raw_unpacker.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.count_pkg.all;
use work.csi_pkg.all;
use work.delay_pkg.all;
use work.math_pkg.all;

entity csi_receiver is
  generic (
    -- Lanes: 1, 2 or 4.
    LANES : positive range 1 to 4;
    -- Bits of a pixel: 8, 10 or 12 for RAW8, RAW10 or RAW12.
    PIXEL_BITS : positive range 8 to 12;
    -- Neighbouring pixels in one transfer: 1, 2, 4 or 8.
    PIXELS_PER_CLOCK : positive range 1 to 8 := 1;
    -- Clocks of byte_clk by which a lane may be later than another.
    MAX_SKEW : natural range 0 to 7 := 3;
    -- The buffer between the clocks holds 2**BUFFER_BITS words of at least PIXELS_PER_CLOCK pixels.
    BUFFER_BITS : positive range 4 to 12 := 5;
    -- Bits of a count of faults.
    COUNT_BITS : positive range 1 to 16 := 16
  );
  port (
    -- Outputs of the D-PHY in byte_clk, for each lane: lane_valid: high from the first byte behind a burst's sync
    -- sequence to its end; lane_sync: high with that first byte; the bytes, lane 0 in the low bits. Between bursts
    -- lanes are low for at least a clock. A burst that a lane begins too late, or not at all, may destroy the next
    -- burst if that one's syncs come within MAX_SKEW clocks of its own; a D-PHY takes longer from one burst to the
    -- next.
    byte_clk   : in    std_logic;
    lane_valid : in    std_logic_vector(LANES - 1 downto 0);
    lane_sync  : in    std_logic_vector(LANES - 1 downto 0);
    lane_data  : in    std_logic_vector(8 * LANES - 1 downto 0);
    -- High for one clock: a burst has ended on the lane without a sync. Low for a D-PHY that does not report this.
    lane_missed : in    std_logic_vector(LANES - 1 downto 0) := (others => '0');

    clk   : in    std_logic;
    reset : in    std_logic;
    -- The virtual channel whose frames come out, and the size that they should have; must be constant.
    virtual_channel : in    std_logic_vector(1 downto 0) := "00";
    columns         : in    std_logic_vector(15 downto 0);
    rows            : in    std_logic_vector(15 downto 0);
    -- AXI4-Stream video: tuser(0) = start of frame, tlast = end of line, the first pixel in the low bits. Pixels behind
    -- a line's last one are undefined.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Counters of faults, COUNT_BITS each, from the low bits; they stay at the largest number. 0 headers corrected, 1
    -- headers beyond correction, 2 payloads with a wrong checksum, 3 packets cut short, 4 bursts that not all lanes
    -- began, 5 ends of frames and lines without a frame's start, and starts without an end, 6 lines and frames of
    -- another size, 7 frames cut because their pixels were not taken.
    fault_counts : out   std_logic_vector(8 * COUNT_BITS - 1 downto 0);
    -- Counters of packets that are received but not shown, which is no fault, COUNT_BITS each. Packets of pixels (types
    -- of 18 hexadecimal and above): 0 of another type, 1 of another virtual channel. 2 frames without lines (they are
    -- of another size, too). 3 packets without pixels (embedded data, blanking, short packets for the user, all others
    -- of other channels).
    left_counts : out   std_logic_vector(4 * COUNT_BITS - 1 downto 0);
    -- Data identifier of the last packet of pixels that was left out: virtual channel in bits 7 and 6, then the type;
    -- 0: none.
    left_identifier : out   std_logic_vector(7 downto 0) := (others => '0');
    -- Clears all counters, and the identifier.
    fault_clear : in    std_logic
  );
end entity csi_receiver;

architecture rtl of csi_receiver is

  constant TAKES_LANES  : boolean := takes(LANES /= 3, "csi_receiver: LANES is 3, expected 1, 2 or 4");
  constant TAKES_BITS   : boolean := takes(PIXEL_BITS mod 2 = 0,
                                           "csi_receiver: PIXEL_BITS is odd, expected 8, 10 or 12");
  constant TAKES_PIXELS : boolean := takes(8 mod PIXELS_PER_CLOCK = 0,
                                           "csi_receiver: PIXELS_PER_CLOCK is not 1, 2, 4 or 8");

  -- Pixels of a word between the clocks; then the fields of the word: number of the last pixel, pixels, events,
  -- identifier, and three marks.
  constant PIXELS    : positive := pixels_of_word(LANES, PIXEL_BITS, PIXELS_PER_CLOCK);
  constant LAST_BITS : positive := bits_for(PIXELS - 1);
  constant DATA_BITS : positive := PIXELS * PIXEL_BITS;
  constant MARKS     : positive := EVENT_KINDS + identifier_t'length;
  constant WORD_BITS : positive := DATA_BITS + LAST_BITS + MARKS + 3;
  -- Clocks that the last word of a line takes through raw_unpacker.
  constant UNPACK_CLOCKS : positive := 4;

  -- Signals in byte_clk.
  signal channel      : std_logic_vector(1 downto 0);
  signal word_first   : std_logic;
  signal word_live    : std_logic_vector(LANES - 1 downto 0);
  signal word_data    : std_logic_vector(8 * LANES - 1 downto 0);
  signal missing      : std_logic;
  signal payload      : payload_t;
  signal payload_data : std_logic_vector(8 * LANES - 1 downto 0);
  signal frame_starts : std_logic;
  signal events       : events_t;
  signal identifier   : identifier_t;
  signal told         : std_logic_vector(EVENT_KINDS downto 0);
  signal told_late    : std_logic_vector(EVENT_KINDS downto 0);
  signal tolds        : std_logic_vector(delay_bits(EVENT_KINDS + 1, UNPACK_CLOCKS) - 1 downto 0) := (others => '0');
  signal pixels_word  : unpacked_t;
  signal pixels_data  : std_logic_vector(DATA_BITS - 1 downto 0);
  signal full         : std_logic;
  signal nearly_full  : std_logic;
  signal write_enable : std_logic;
  signal write_data   : std_logic_vector(DATA_BITS - 1 downto 0);
  signal write_word   : crossing_t;
  signal write_bits   : std_logic_vector(WORD_BITS - 1 downto 0);
  -- Signals in clk.
  signal read_valid : std_logic;
  signal read_ready : std_logic;
  signal read_word  : std_logic_vector(WORD_BITS - 1 downto 0);
  signal read_mark  : crossing_t;
  signal faults     : events_t;
  signal counts     : std_logic_vector(EVENT_KINDS * COUNT_BITS - 1 downto 0) := (others => '0');

begin

  --------------------------------------------------------------------------------------------------
  -- Entities in byte_clk.

  -- Both bits are constant while in use, so each may cross by itself.
  take_channel : entity work.synchroniser
    generic map (
      WIDTH => 2
    )
    port map (
      clk         => byte_clk,
      level       => virtual_channel,
      synchronous => channel
    );

  merge : entity work.lane_merge
    generic map (
      LANES    => LANES,
      MAX_SKEW => MAX_SKEW
    )
    port map (
      clk          => byte_clk,
      lane_valid   => lane_valid,
      lane_sync    => lane_sync,
      lane_data    => lane_data,
      lane_missed  => lane_missed,
      word_first   => word_first,
      word_live    => word_live,
      word_data    => word_data,
      lane_missing => missing
    );

  parser : entity work.packet_parser
    generic map (
      LANES      => LANES,
      PIXEL_BITS => PIXEL_BITS
    )
    port map (
      clk             => byte_clk,
      word_first      => word_first,
      word_live       => word_live,
      word_data       => word_data,
      virtual_channel => channel,
      payload         => payload,
      payload_data    => payload_data,
      frame_starts    => frame_starts,
      events          => events,
      left_identifier => identifier
    );

  unpacker : entity work.raw_unpacker
    generic map (
      LANES       => LANES,
      PIXEL_BITS  => PIXEL_BITS,
      WORD_PIXELS => PIXELS
    )
    port map (
      clk          => byte_clk,
      payload      => payload,
      payload_data => payload_data,
      word         => pixels_word,
      word_data    => pixels_data
    );

  -- All events on one bus. A missing lane is found in front of the parser, so the parser leaves that bit free.
  told <= events(events'high downto LANE_MISSING + 1) & missing & events(LANE_MISSING - 1 downto 0) & frame_starts;

  -- Marks and events wait as long as a line's last word takes through the unpacker, so that they stay behind the line.
  wait_for_pixels : process (byte_clk) is
  begin

    if rising_edge(byte_clk) then
      tolds <= moved_on(tolds, told);
    end if;

  end process wait_for_pixels;

  told_late <= delayed(tolds, told, UNPACK_CLOCKS);

  sender : entity work.word_sender
    generic map (
      WORD_PIXELS => PIXELS,
      DATA_BITS   => DATA_BITS
    )
    port map (
      clk             => byte_clk,
      word            => pixels_word,
      word_data       => pixels_data,
      frame_starts    => told_late(0),
      events          => told_late(EVENT_KINDS downto 1),
      left_identifier => identifier,
      full            => full,
      nearly_full     => nearly_full,
      write_enable    => write_enable,
      write_word      => write_word,
      write_data      => write_data
    );

  write_bits <= write_data & std_logic_vector(to_unsigned(write_word.last, LAST_BITS)) & write_word.ends &
                write_word.first & write_word.has_pixels & write_word.identifier & write_word.events;

  --------------------------------------------------------------------------------------------------
  -- Crossing to the core's clock.

  -- The only crossing of the pixels. It cannot make the camera wait: nearly_full tells word_sender to end the frame
  -- well.
  to_core : entity work.crossing_fifo
    generic map (
      WIDTH        => WORD_BITS,
      ADDRESS_BITS => BUFFER_BITS
    )
    port map (
      write_clk    => byte_clk,
      write_enable => write_enable,
      write_word   => write_bits,
      full         => full,
      nearly_full  => nearly_full,
      read_clk     => clk,
      read_drop    => reset,
      read_valid   => read_valid,
      read_ready   => read_ready,
      read_word    => read_word
    );

  read_mark <=
  (
    events     => read_word(EVENT_KINDS - 1 downto 0),
    identifier => read_word(MARKS - 1 downto EVENT_KINDS),
    has_pixels => read_word(MARKS),
    first      => read_word(MARKS + 1),
    ends       => read_word(MARKS + 2),
    last       => to_integer(unsigned(read_word(LAST_BITS + MARKS + 2 downto MARKS + 3)))
  );

  stream : entity work.pixel_stream
    generic map (
      WORD_PIXELS      => PIXELS,
      PIXELS_PER_CLOCK => PIXELS_PER_CLOCK,
      PIXEL_BITS       => PIXEL_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns,
      rows          => rows,
      word_valid    => read_valid,
      word_ready    => read_ready,
      word          => read_mark,
      word_data     => read_word(WORD_BITS - 1 downto WORD_BITS - DATA_BITS),
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tlast  => m_axis_tlast,
      faults        => faults
    );

  fault_counts <= counts(fault_counts'range);
  left_counts  <= counts(counts'high downto FAULT_KINDS * COUNT_BITS);

  -- A counter for each event, in the core's clock. Events cross in words, so none is lost whatever the clocks are.
  count_faults : process (clk) is
  begin

    if rising_edge(clk) then
      counts <= each_counted(counts, faults, fault_clear);
      -- left_identifier changes only with events that name a packet of pixels, so it stays 0 after a clearing.
      if fault_clear = '1' then
        left_identifier <= (others => '0');
      elsif read_valid = '1' and read_ready = '1' and
            (read_mark.events(OTHER_TYPE) = '1' or read_mark.events(OTHER_CHANNEL) = '1') then
        left_identifier <= read_mark.identifier;
      end if;
    end if;

  end process count_faults;

end architecture rtl;
