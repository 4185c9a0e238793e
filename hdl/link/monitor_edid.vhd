-- SPDX-License-Identifier: Apache-2.0
-- Reads the EDID of the monitor at the HDMI output again and again, because there is no hot-plug line.
--
-- Only the last eight bytes of the first block, and of a CEA-861 extension behind it, are kept as they arrive. That is
-- enough for the header, for both bytes of a standard timing, and for size and rate of a detailed timing, the first of
-- which is the preferred mode. A mode counts as offered if its size and its rate (within 1 Hz) are those of a detailed
-- timing, or if it is one of KNOWN_MODES and is among the established timings, the standard timings, or the codes of
-- the extension. For an interlaced timing rows and rate are those of its fields.
--
-- Latency: a read of 256 bytes takes 50 ms at 50 kHz; PAUSE clocks lie between the beginnings of two reads.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.edid_pkg.all;
use work.hdmi_pkg.all;
use work.video_pkg.all;

entity monitor_edid is
  generic (
    -- Clocks in a quarter of a bit; clocks for which the monitor may hold the clock line low.
    QUARTER : positive;
    STRETCH : positive;
    -- Clocks between two reads.
    PAUSE : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The display data channel of the output: levels at the pins, and '1' to pull its lines low.
    scl     : in    std_logic;
    sda     : in    std_logic;
    scl_low : out   std_logic;
    sda_low : out   std_logic;
    -- The present mode; its rate in 0.1 Hz.
    shown_columns : in    count_t;
    shown_rows    : in    count_t;
    shown_rate    : in    std_logic_vector(14 downto 0);
    -- Result of the last read.
    monitor : out   monitor_t
  );
end entity monitor_edid;

architecture rtl of monitor_edid is

  constant NO_ANSWER : std_logic_vector(1 downto 0) := "00";
  constant AN_EDID   : std_logic_vector(1 downto 0) := "01";
  constant NO_EDID   : std_logic_vector(1 downto 0) := "10";
  constant LINE_LOW  : std_logic_vector(1 downto 0) := "11";

  -- Places of bytes in the first block, and in the extension, which begins at 128.
  constant HEADER_LAST      : natural := 7;
  constant ESTABLISHED_LAST : natural := 36;
  constant STANDARD_FIRST   : natural := 38;
  constant STANDARD_LAST    : natural := 53;
  constant DETAILED_FIRST   : natural := 54;
  constant DETAILED_LAST    : natural := 125;
  constant EXTENSIONS       : natural := 126;
  constant BLOCK_LAST       : natural := 127;
  constant EXTENSION_FIRST  : natural := 128;
  constant DETAILED_AT      : natural := 130;
  constant CODES_FIRST      : natural := 132;
  constant LAST             : natural := 255;

  -- The beginning of each EDID, the tag of a CEA-861 extension, and the head of a block of video codes.
  constant HEADER      : std_logic_vector(63 downto 0) := x"00FFFFFFFFFFFF00";
  constant CEA_TAG     : std_logic_vector(7 downto 0)  := x"02";
  constant VIDEO_CODES : std_logic_vector(2 downto 0)  := "010";

  -- Bytes of a descriptor; the first eight of them have size and rate.
  constant DESCRIPTOR : positive := 18;
  constant TIMING     : positive := 8;

  -- 1 Hz in 0.1 Hz: 59.94 and 60 Hz are one mode to a monitor.
  constant TOLERANCE : positive := 10;

  -- Clocks since the last read began; whether a read is under way.
  signal paused  : natural range 0 to larger(PAUSE - 1, 1) := 0;
  signal reading : std_logic                               := '0';

  -- Signals of the reader.
  signal start     : std_logic;
  signal next_byte : std_logic;
  signal more      : std_logic;
  signal valid     : std_logic;
  signal data      : std_logic_vector(7 downto 0);
  signal done      : std_logic;
  signal complete  : std_logic;
  signal stuck     : std_logic;

  -- window: the last eight bytes; index: the number of the newest; look: the clock in which all processes below read
  -- them.
  signal window : std_logic_vector(63 downto 0) := (others => '0');
  signal look   : std_logic                     := '0';
  signal index  : natural range 0 to LAST       := 0;

  -- none_yet: no byte has come; sum of the block's bytes; right: header and sums are right so far; extended: there is
  -- an extension.
  signal none_yet : std_logic            := '0';
  signal sum      : unsigned(7 downto 0) := (others => '0');
  signal right    : std_logic            := '0';
  signal extended : std_logic            := '0';

  -- In the extension: detailed: where its detailed timings begin; in_codes: among the blocks of codes; codes: bytes
  -- left of a block; video: the block has video codes.
  signal detailed : unsigned(6 downto 0) := (others => '0');
  signal in_codes : std_logic            := '0';
  signal codes    : unsigned(4 downto 0) := (others => '0');
  signal video    : std_logic            := '0';

  -- in_detailed: among descriptors; place: the byte within one; divide: its rate is to be computed; dividing: the next
  -- byte waits for the rate.
  signal in_detailed     : std_logic                         := '0';
  signal place           : natural range 0 to DESCRIPTOR - 1 := 0;
  signal begins_detailed : std_logic;
  signal divide          : std_logic                         := '0';
  signal dividing        : std_logic                         := '0';
  signal divided         : std_logic;

  -- found: the present mode is in the EDID; the preferred mode; shown: which of the known modes is the present one.
  signal found     : std_logic                     := '0';
  signal preferred : std_logic_vector(35 downto 0) := (others => '0');
  signal shown     : std_logic_vector(KNOWN_MODES'range);

  -- Fields of the descriptor whose first eight bytes are in the window.
  signal width       : unsigned(11 downto 0);
  signal height      : unsigned(11 downto 0);
  signal clock       : std_logic_vector(15 downto 0);
  signal line_length : unsigned(12 downto 0);
  signal frame_lines : unsigned(12 downto 0);
  signal rate_found  : unsigned(11 downto 0);

  function near (
    a : unsigned(14 downto 0);
    b : unsigned(11 downto 0)
  ) return boolean is

    -- One bit more than both, so that the sums do not overflow.
    constant WIDE : positive := 16;

  begin

    return resize(a, WIDE) + TOLERANCE >= b and a <= resize(b, WIDE) + TOLERANCE;

  end function near;

begin

  -- The bytes come one by one when they are asked for, so no EDID is stored.
  reader : entity work.i2c_reader
    generic map (
      QUARTER => QUARTER,
      STRETCH => STRETCH
    )
    port map (
      clk       => clk,
      reset     => reset,
      scl       => scl,
      sda       => sda,
      scl_low   => scl_low,
      sda_low   => sda_low,
      start     => start,
      next_byte => next_byte,
      more      => more,
      valid     => valid,
      data      => data,
      done      => done,
      complete  => complete,
      stuck     => stuck
    );

  start <= '1' when reading = '0' and paused = PAUSE - 1 else
           '0';
  -- The reader waits with the clock line low while a byte is evaluated or a rate computed; to a monitor this is a slow
  -- master.
  next_byte <= not (valid or look or dividing);
  -- A monitor without an extension is not read beyond its first block: it may send its first block again, or not
  -- answer.
  more <= '0' when index = LAST or (index = BLOCK_LAST and extended = '0') else
          '1';

  -- The layout of a descriptor (VESA E-EDID). The first byte is at the left of the window, the newest at the right. Of
  -- width and height, and of their blanking, the low bytes come first, and the high halves share a byte.
  clock       <= window(55 downto 48) & window(63 downto 56);
  width       <= unsigned(window(31 downto 28)) & unsigned(window(47 downto 40));
  height      <= unsigned(window(7 downto 4)) & unsigned(window(23 downto 16));
  line_length <= ('0' & width) + (unsigned(window(27 downto 24)) & unsigned(window(39 downto 32)));
  frame_lines <= ('0' & height) + (unsigned(window(3 downto 0)) & unsigned(window(15 downto 8)));

  -- A rate takes longer than a byte, so it is computed for timings only.
  rate_of_timing : entity work.timing_rate
    port map (
      clk         => clk,
      reset       => start,
      start       => divide,
      pixel_clock => clock,
      line_length => line_length,
      frame_lines => frame_lines,
      rate        => rate_found,
      done        => divided
    );

  -- A mode that an EDID names by a bit or a code has no numbers there, so each known mode is compared with the present
  -- one, once for all reads.
  which_known : process (shown_columns, shown_rows, shown_rate) is
  begin

    for i in KNOWN_MODES'range loop

      shown(i) <= '0';

      if shown_columns = KNOWN_MODES(i).columns and shown_rows = KNOWN_MODES(i).rows and
         near(unsigned(shown_rate), to_unsigned(KNOWN_MODES(i).rate, 12)) then
        shown(i) <= '1';
      end if;

    end loop;

  end process which_known;

  -- Each of the processes below starts again with a read, and evaluates the window once for each byte, a clock after
  -- the byte came in.
  follow_bytes : process (clk) is
  begin

    if rising_edge(clk) then
      look <= valid;
      if valid = '1' then
        window   <= window(55 downto 0) & data;
        sum      <= sum + unsigned(data);
        none_yet <= '0';
      end if;
      if look = '1' and index /= LAST then
        index <= index + 1;
      end if;
      if start = '1' then
        index    <= 0;
        none_yet <= '1';
        sum      <= (others => '0');
      end if;
    end if;

  end process follow_bytes;

  check_blocks : process (clk) is
  begin

    if rising_edge(clk) then
      if look = '1' then
        -- From here on index is the number of the byte at the right of the window.
        if index = HEADER_LAST and window /= HEADER then
          right <= '0';
        end if;
        -- The bytes of a block add up to 0, and so do those of both blocks.
        if (index = BLOCK_LAST or index = LAST) and sum /= 0 then
          right <= '0';
        end if;
        if index = EXTENSIONS and window(7 downto 0) /= x"00" then
          extended <= '1';
        end if;
      end if;
      if start = '1' then
        right    <= '1';
        extended <= '0';
      end if;
    end if;

  end process check_blocks;

  -- Blocks of codes in the extension; a byte in front of each block has its kind and its length.
  follow_codes : process (clk) is
  begin

    if rising_edge(clk) then
      if look = '1' then
        -- Extensions of other kinds are ignored.
        if index = DETAILED_AT and window(23 downto 16) = CEA_TAG then
          detailed <= unsigned(window(6 downto 0));
        end if;
        if in_codes = '1' then
          -- Bytes of the present block; the byte behind its last one is the head of the next block.
          if codes /= 0 then
            codes <= codes - 1;
          else
            codes <= unsigned(window(4 downto 0));
            video <= to_logic(window(7 downto 5) = VIDEO_CODES);
          end if;
        end if;
        -- If the detailed timings begin here there are no codes.
        if index = CODES_FIRST - 1 and detailed > CODES_FIRST - EXTENSION_FIRST then
          in_codes <= '1';
        end if;
        if begins_detailed = '1' then
          in_codes <= '0';
        end if;
      end if;
      if start = '1' then
        detailed <= (others => '0');
        in_codes <= '0';
        codes    <= (others => '0');
      end if;
    end if;

  end process follow_codes;

  begins_detailed <= to_logic(index = DETAILED_FIRST - 1 or
                              (detailed /= 0 and index = EXTENSION_FIRST - 1 + to_integer(detailed)));

  -- Descriptors, one behind the other. A descriptor with a clock of 0 is no timing but a name or a limit. Those of the
  -- extension end with zeros up to its last byte, which are no timings either.
  follow_descriptors : process (clk) is
  begin

    if rising_edge(clk) then
      divide <= '0';
      if look = '1' then
        if place = DESCRIPTOR - 1 then
          place <= 0;
        else
          place <= place + 1;
        end if;
        -- Computing the rate needs the window for a thousand clocks or more; dividing keeps the next byte away until it
        -- is done.
        if in_detailed = '1' and place = TIMING - 1 and clock /= x"0000" then
          divide   <= '1';
          dividing <= '1';
        end if;
        if begins_detailed = '1' then
          in_detailed <= '1';
          place       <= 0;
        end if;
        if index = DETAILED_LAST then
          in_detailed <= '0';
        end if;
      end if;
      if divided = '1' then
        dividing <= '0';
      end if;
      if start = '1' then
        in_detailed <= '0';
        dividing    <= '0';
      end if;
    end if;

  end process follow_descriptors;

  search : process (clk) is
  begin

    if rising_edge(clk) then
      -- Timings that are named by a bit, two bytes or a code.
      for i in KNOWN_MODES'range loop

        if look = '1' and shown(i) = '1' then
          if index = ESTABLISHED_LAST and (window(15 downto 0) and KNOWN_MODES(i).established) /= x"0000" then
            found <= '1';
          end if;
          -- Both bytes of a standard timing are in the window when the second one has come; they begin at an even
          -- place.
          if index > STANDARD_FIRST and index <= STANDARD_LAST and index mod 2 = 1 and
             window(15 downto 0) = KNOWN_MODES(i).standard then
            found <= '1';
          end if;
          -- A code has 7 bits; the eighth marks a native mode.
          if in_codes = '1' and codes /= 0 and video = '1' and window(6 downto 0) = KNOWN_MODES(i).vic then
            found <= '1';
          end if;
        end if;

      end loop;

      -- Timings that are given with all their numbers. No byte comes during the division, so the window still has them.
      if divided = '1' then
        -- The index has counted on to the byte behind the eight.
        if index = DETAILED_FIRST + TIMING then
          preferred <= std_logic_vector(rate_found) & std_logic_vector(height) & std_logic_vector(width);
        end if;
        if shown_columns = width and shown_rows = height and near(unsigned(shown_rate), rate_found) then
          found <= '1';
        end if;
      end if;

      if start = '1' then
        found     <= '0';
        preferred <= (others => '0');
      end if;
    end if;

  end process search;

  report_read : process (clk) is
  begin

    if rising_edge(clk) then
      if reading = '0' and paused /= PAUSE - 1 then
        paused <= paused + 1;
      end if;
      if start = '1' then
        reading <= '1';
        paused  <= 0;
      end if;
      if done = '1' then
        reading <= '0';
        -- Nothing of an earlier read stays, because another monitor may be plugged in by now.
        monitor <= NO_MONITOR;
        if stuck = '1' then
          monitor.state <= LINE_LOW;
        elsif none_yet = '1' then
          monitor.state <= NO_ANSWER;
        elsif complete = '0' or right = '0' then
          -- The read broke off, or the bytes are no EDID.
          monitor.state <= NO_EDID;
        else
          monitor <=
          (
            state   => AN_EDID,
            columns => preferred(11 downto 0),
            rows    => preferred(23 downto 12),
            rate    => preferred(35 downto 24),
            offered => found
          );
        end if;
      end if;
      if reset = '1' then
        reading <= '0';
        paused  <= 0;
        monitor <= NO_MONITOR;
      end if;
    end if;

  end process report_read;

end architecture rtl;
