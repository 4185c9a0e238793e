-- SPDX-License-Identifier: Apache-2.0
-- MIPI CSI-2: types of packets, the code of headers, the checksum of payloads, the packing of raw pixels into bytes,
-- and the record of events.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

package csi_pkg is

  subtype kind_t is std_logic_vector(5 downto 0);

  -- Short packets have types below LONG_KINDS.
  constant FRAME_START_KIND : kind_t := "000000";
  constant FRAME_END_KIND   : kind_t := "000001";
  constant LONG_KINDS       : kind_t := "010000";
  -- GENERIC_KINDS and above: short packets for the user. PIXEL_KINDS and above: long packets with pixels, or with
  -- user-defined data.
  constant GENERIC_KINDS : kind_t := "001000";
  constant PIXEL_KINDS   : kind_t := "011000";

  -- Events and faults reported by the receiver. On the way to the core's clock, FRAME_ENDED takes the place of
  -- WRONG_SIZE, which is detected only there.
  constant CORRECTED_HEADER : natural := 0;
  constant DAMAGED_HEADER   : natural := 1;
  constant DAMAGED_PAYLOAD  : natural := 2;
  constant CUT_PACKET       : natural := 3;
  constant LANE_MISSING     : natural := 4;
  constant OUT_OF_ORDER     : natural := 5;
  constant WRONG_SIZE       : natural := 6;
  constant FRAME_ENDED      : natural := 6;
  constant PIXELS_LOST      : natural := 7;
  -- The first FAULT_KINDS events are faults; the others report packets that were received but are not shown.
  constant FAULT_KINDS   : natural := 8;
  constant OTHER_TYPE    : natural := 8;
  constant OTHER_CHANNEL : natural := 9;
  constant NO_LINES      : natural := 10;
  constant NO_PIXELS     : natural := 11;

  constant EVENT_KINDS : positive := 12;
  constant LEFT_KINDS  : positive := EVENT_KINDS - FAULT_KINDS;

  subtype events_t is std_logic_vector(EVENT_KINDS - 1 downto 0);

  -- Data identifier of a packet: virtual channel, type.
  subtype identifier_t is std_logic_vector(7 downto 0);

  -- Bytes of a line to be unpacked: valid: there are some; bytes: how many; ends: the line has ended, with these bytes
  -- or without any.
  type payload_t is record
    valid : std_logic;
    bytes : natural range 0 to 4;
    ends  : std_logic;
  end record payload_t;

  -- A word of unpacked pixels: last: number of its last pixel; ends: no other word of its line follows, and this one
  -- may be empty.
  type unpacked_t is record
    valid : std_logic;
    last  : natural range 0 to 7;
    ends  : std_logic;
  end record unpacked_t;

  -- Fields that cross to the core's clock with a word: events; identifier of the last packet of pixels that was left
  -- out; has_pixels; first: the first pixels of a frame; ends: the last pixels of a line; last: number of the last
  -- pixel.
  type crossing_t is record
    events     : events_t;
    identifier : identifier_t;
    has_pixels : std_logic;
    first      : std_logic;
    ends       : std_logic;
    last       : natural range 0 to 7;
  end record crossing_t;

  subtype crc_t is std_logic_vector(15 downto 0);

  -- Type of a packet with a line of raw pixels of so many bits.
  function raw_kind (
    pixel_bits : positive
  ) return kind_t;

  -- The fewest pixels that fill whole bytes (unit_pixels), and these bytes (unit_bytes).
  function unit_pixels (
    pixel_bits : positive
  ) return positive;

  function unit_bytes (
    pixel_bits : positive
  ) return positive;

  -- Pixels of a word between the clocks: whole units, at least as many as come in one clock on all lanes, and as leave
  -- in one.
  function pixels_of_word (
    lanes            : positive;
    pixel_bits       : positive;
    pixels_per_clock : positive
  ) return positive;

  -- Pixels of whole units in bytes, from bit 0 on, packed as in a packet.
  function unpacked (
    bytes      : std_logic_vector;
    pixel_bits : positive;
    pixels     : positive
  ) return std_logic_vector;

  -- Syndrome of a header: its wrong check bits. The header has data in bits 23 to 0 and check bits in bits 29 to 24.
  function syndrome (
    header : std_logic_vector(31 downto 0)
  ) return std_logic_vector;

  -- The data bit that a syndrome marks as wrong, or none.
  function wrong_bit (
    wrong : std_logic_vector(5 downto 0)
  ) return std_logic_vector;

  -- The checksum after one more byte.
  function crc_behind (
    crc  : crc_t;
    data : std_logic_vector(7 downto 0)
  ) return crc_t;

end package csi_pkg;

package body csi_pkg is

  -- The check bits of a header are a Hamming code, extended so that each data bit takes part in an odd number of
  -- checks.
  type codes_t is array (natural range 0 to 23) of std_logic_vector(5 downto 0);

  -- The check bits in which each data bit takes part: all different, with an odd number of ones, more than one. One
  -- wrong bit is therefore found, and two wrong bits match no data bit.
  constant CODES : codes_t :=
  (
    "000111", "001011", "001101", "001110", "010011", "010101", "010110", "011001",
    "011010", "011100", "100011", "100101", "100110", "101001", "101010", "101100",
    "110001", "110010", "110100", "111000", "011111", "101111", "110111", "111011"
  );

  function raw_kind (
    pixel_bits : positive
  ) return kind_t is
  begin

    -- The standard numbers RAW8, RAW10 and RAW12 from 2A hexadecimal on.
    return std_logic_vector(to_unsigned(38 + pixel_bits / 2, 6));

  end function raw_kind;

  function unit_pixels (
    pixel_bits : positive
  ) return positive is
  begin

    -- The fewest pixels whose bits fill whole bytes: 1 of 8 bits, 4 of 10, 2 of 12.
    return 8 / common_divisor(8, pixel_bits);

  end function unit_pixels;

  function unit_bytes (
    pixel_bits : positive
  ) return positive is
  begin

    return unit_pixels(pixel_bits) * pixel_bits / 8;

  end function unit_bytes;

  function pixels_of_word (
    lanes            : positive;
    pixel_bits       : positive;
    pixels_per_clock : positive
  ) return positive is

    variable pixels : positive;

  begin

    -- Whole units keep each pixel in one word. Doubling keeps the number a power of two and a multiple of the pixels
    -- that leave at once.
    pixels := unit_pixels(pixel_bits);

    while pixels * pixel_bits < 8 * lanes loop

      pixels := 2 * pixels;

    end loop;

    return larger(pixels, pixels_per_clock);

  end function pixels_of_word;

  function unpacked (
    bytes      : std_logic_vector;
    pixel_bits : positive;
    pixels     : positive
  ) return std_logic_vector is

    constant UNIT     : positive := unit_pixels(pixel_bits);
    constant STEP     : positive := unit_bytes(pixel_bits);
    constant LOW_BITS : natural  := pixel_bits - 8;

    variable result : std_logic_vector(pixels * pixel_bits - 1 downto 0);
    variable place  : natural;

  begin

    -- All indices follow from the generics, so this is wiring.
    for p in 0 to pixels - 1 loop

      -- The high bits of all pixels of a unit come first, then a byte with the low bits of all.
      place := 8 * (p / UNIT * STEP + p mod UNIT);

      for b in 0 to 7 loop

        result(p * pixel_bits + LOW_BITS + b) := bytes(place + b);

      end loop;

      -- This pixel's share of the byte with low bits: two bits for each of four pixels, or four bits for each of two.
      place := 8 * (p / UNIT * STEP + STEP - 1) + p mod UNIT * LOW_BITS;

      -- With 8 bits there are no low bits: the loop's range stays constant, and the condition is never true.
      for b in 0 to 7 loop

        if b < LOW_BITS then
          result(p * pixel_bits + b) := bytes(place + b);
        end if;

      end loop;

    end loop;

    return result;

  end function unpacked;

  function syndrome (
    header : std_logic_vector(31 downto 0)
  ) return std_logic_vector is

    variable wrong : std_logic_vector(5 downto 0);

  begin

    -- Each data bit that is one inverts its check bits in those received. Bits that remain do not agree.
    wrong := header(29 downto 24);

    for i in 0 to 23 loop

      if header(i) = '1' then
        wrong := wrong xor CODES(i);
      end if;

    end loop;

    return wrong;

  end function syndrome;

  function wrong_bit (
    wrong : std_logic_vector(5 downto 0)
  ) return std_logic_vector is

    variable place : std_logic_vector(23 downto 0);

  begin

    -- At most one data bit matches, because all codes differ. Two wrong bits match none, because the sum of two codes
    -- with odd numbers of ones has an even number.
    for i in 0 to 23 loop

      place(i) := to_logic(wrong = CODES(i));

    end loop;

    return place;

  end function wrong_bit;

  function crc_behind (
    crc  : crc_t;
    data : std_logic_vector(7 downto 0)
  ) return crc_t is

    variable left : crc_t;

  begin

    -- Bits come lowest first, so the polynomial is reversed: 8408 hexadecimal is x^12 + x^5 + 1, and the bit shifted
    -- out stands for x^16.
    left := crc xor (x"00" & data);

    for i in 0 to 7 loop

      if left(0) = '1' then
        left := ('0' & left(15 downto 1)) xor x"8408";
      else
        left := '0' & left(15 downto 1);
      end if;

    end loop;

    return left;

  end function crc_behind;

end package body csi_pkg;
