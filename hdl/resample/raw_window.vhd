-- SPDX-License-Identifier: Apache-2.0
-- Ring of raw lines: stores one pixel each clock, and gives the four pixels around a position each clock.
--
-- Even and odd lines, and even and odd columns, are stored in separate memories. Two neighbouring lines and two
-- neighbouring columns have one pixel in each, so four memories give the four pixels at once. Beyond the borders of the
-- sensor, lines and columns are mirrored at the first and the last one.
--
-- The place of a line in the ring follows from its age: the number of pairs of lines since it was written.
--
-- Latency: WINDOW_LATENCY clocks. Throughput: one pixel in and four pixels out each clock.
-- Equation: pixel_yx = raw(mirrored(floor(position_y) + y), mirrored(floor(position_x) + x)), y and x 0 or 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity raw_window is
  generic (
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Lines that the ring holds, an even number.
    LINES : positive range 4 to 256;
    -- Width of a pixel.
    DATA_BITS : positive;
    -- Fraction bits of positions.
    WEIGHT_BITS : positive
  );
  port (
    clk : in    std_logic;
    -- Pixels for the ring, from raw_writer.
    ring_write : in    ring_write_t;
    write_data : in    std_logic_vector(DATA_BITS - 1 downto 0);
    -- The frame that is read.
    frame : in    raw_frame_t;
    -- The position.
    position_y : in    signed(15 + WEIGHT_BITS downto 0);
    position_x : in    signed(15 + WEIGHT_BITS downto 0);
    -- The pixels around the position (line, column), and the fraction of the position.
    pixel_00 : out   std_logic_vector(DATA_BITS - 1 downto 0);
    pixel_01 : out   std_logic_vector(DATA_BITS - 1 downto 0);
    pixel_10 : out   std_logic_vector(DATA_BITS - 1 downto 0);
    pixel_11 : out   std_logic_vector(DATA_BITS - 1 downto 0);
    weight_y : out   unsigned(WEIGHT_BITS - 1 downto 0);
    weight_x : out   unsigned(WEIGHT_BITS - 1 downto 0)
  );
end entity raw_window;

architecture rtl of raw_window is

  constant ODD_LINES : boolean := not takes(LINES mod 2 = 0, "raw_window: LINES must be even, as memories hold pairs");

  -- Pairs of lines in the ring, and pairs of columns in a line.
  constant PAIRS     : positive := LINES / 2;
  constant HALF      : positive := divide_up(MAX_COLUMNS, 2);
  constant WORDS     : positive := larger(PAIRS * HALF, 2);
  constant ADDR_BITS : positive := bits_for(WORDS - 1);
  -- Bits of an age, 0 to PAIRS.
  constant AGE_BITS : positive := bits_for(PAIRS);

  subtype address_t is unsigned(ADDR_BITS - 1 downto 0);

  subtype age_t is unsigned(AGE_BITS - 1 downto 0);

  subtype slot_t is natural range 0 to PAIRS - 1;

  subtype pixel_t is std_logic_vector(DATA_BITS - 1 downto 0);

  type bases_t is array (natural range 0 to PAIRS - 1) of address_t;

  type pixels_t is array (0 to 3) of pixel_t;

  type weights_t is array (1 to WINDOW_LATENCY) of unsigned(WEIGHT_BITS - 1 downto 0);

  type addresses_t is array (0 to 3) of address_t;

  -- First word of each pair of lines.
  function base_table return bases_t is

    variable table : bases_t;

  begin

    for i in natural range 0 to PAIRS - 1 loop

      table(i) := to_unsigned(i * HALF, ADDR_BITS);

    end loop;

    return table;

  end function base_table;

  constant BASES : bases_t := base_table;

  -- The slot of the pair of lines that is `age` pairs older than the one at `newest`.
  function slot_of (
    newest : slot_t;
    age    : age_t
  ) return slot_t is

    variable place : integer range -2 ** AGE_BITS to PAIRS - 1;

  begin

    place := newest - to_integer(age);

    if place < 0 then
      place := place + PAIRS;
    end if;

    if place < 0 then
      -- This does not happen as long as the reader reads lines in the ring only.
      place := 0;
    end if;

    return place;

  end function slot_of;

  -- Clock 1: lines and columns 0 and 1 of the window.
  signal line_0   : place_t := (others => '0');
  signal line_1   : place_t := (others => '0');
  signal column_0 : place_t := (others => '0');
  signal column_1 : place_t := (others => '0');
  -- Clock 2. Ages need few bits: the ring never holds a line older than PAIRS pairs, so the difference of two line
  -- numbers is cut to AGE_BITS without loss, even if the numbers wrap round.
  signal even_age  : age_t     := (others => '0');
  signal odd_age   : age_t     := (others => '0');
  signal newest_3  : slot_t    := 0;
  signal even_half : address_t := (others => '0');
  signal odd_half  : address_t := (others => '0');
  signal even_3    : address_t := (others => '0');
  signal odd_3     : address_t := (others => '0');
  -- Clocks 3 and 4 are separate, so that neither has a table or an addition behind a comparison.
  signal even_slot : slot_t := 0;
  signal odd_slot  : slot_t := 0;
  -- Values that are delayed as long as addresses and memories delay the pixels.
  signal swap_line_at   : std_logic_vector(1 to WINDOW_LATENCY - 1) := (others => '0');
  signal swap_column_at : std_logic_vector(1 to WINDOW_LATENCY - 1) := (others => '0');
  signal weight_y_at    : weights_t                                 := (others => (others => '0'));
  signal weight_x_at    : weights_t                                 := (others => (others => '0'));
  -- Memory 2 i + j has lines with number mod 2 = i and columns with number mod 2 = j.
  signal addresses     : addresses_t                  := (others => (others => '0'));
  signal pixels        : pixels_t;
  signal write_slot    : slot_t;
  signal write_enables : std_logic_vector(3 downto 0) := (others => '0');
  signal write_address : address_t                    := (others => '0');
  signal write_pixel   : pixel_t;

begin

  -- Whether line 0 (column 0) is odd: the memories give lines and columns by parity, so lines and columns that were
  -- swapped on the way in are swapped back in clock 8.
  swap_line_at(1)   <= line_0(0);
  swap_column_at(1) <= column_0(0);

  locate : process (clk) is

    variable line_now    : place_t;
    variable column_now  : place_t;
    variable even_line   : place_t;
    variable odd_line    : place_t;
    variable even_column : place_t;
    variable odd_column  : place_t;
    variable number      : place_t;

  begin

    if rising_edge(clk) then
      -- The fraction of a position is the weight of the four pixels; it is needed when they come out.
      weight_y_at(1)                          <= unsigned(position_y(WEIGHT_BITS - 1 downto 0));
      weight_x_at(1)                          <= unsigned(position_x(WEIGHT_BITS - 1 downto 0));
      weight_y_at(2 to WINDOW_LATENCY)        <= weight_y_at(1 to WINDOW_LATENCY - 1);
      weight_x_at(2 to WINDOW_LATENCY)        <= weight_x_at(1 to WINDOW_LATENCY - 1);
      swap_line_at(2 to WINDOW_LATENCY - 1)   <= swap_line_at(1 to WINDOW_LATENCY - 2);
      swap_column_at(2 to WINDOW_LATENCY - 1) <= swap_column_at(1 to WINDOW_LATENCY - 2);

      -- Clock 1: lines by their numbers, and columns, mirrored. The second line and column are mirrored separately: at
      -- a border the two are no neighbours any more, but one is still even and one odd.
      line_now   := position_y(15 + WEIGHT_BITS downto WEIGHT_BITS);
      column_now := position_x(15 + WEIGHT_BITS downto WEIGHT_BITS);
      line_0     <= mirrored(line_now, frame.last_line) + frame.base;
      line_1     <= mirrored(line_now + 1, frame.last_line) + frame.base;
      column_0   <= mirrored(column_now, frame.last_column);
      column_1   <= mirrored(column_now + 1, frame.last_column);

      -- Clock 2: which line is even, and how old the lines are.
      if line_0(0) = '0' then
        even_line := line_0;
        odd_line  := line_1;
      else
        even_line := line_1;
        odd_line  := line_0;
      end if;
      if column_0(0) = '0' then
        even_column := column_0;
        odd_column  := column_1;
      else
        even_column := column_1;
        odd_column  := column_0;
      end if;
      -- Ages count pairs of lines, so parity is cut off.
      number    := shift_right(ring_write.line, 1) - shift_right(even_line, 1);
      even_age  <= unsigned(number(AGE_BITS - 1 downto 0));
      number    := shift_right(ring_write.line, 1) - shift_right(odd_line, 1);
      odd_age   <= unsigned(number(AGE_BITS - 1 downto 0));
      newest_3  <= ring_write.slot;
      even_half <= resize(unsigned(even_column(14 downto 1)), ADDR_BITS);
      odd_half  <= resize(unsigned(odd_column(14 downto 1)), ADDR_BITS);

      -- Clock 3: slots in the ring. A slot is computed relative to the newest one, which is written when the age is
      -- measured.
      even_slot <= slot_of(newest_3, even_age);
      odd_slot  <= slot_of(newest_3, odd_age);
      even_3    <= even_half;
      odd_3     <= odd_half;

      -- Clock 4: addresses. Each memory has its own combination of line and column.
      addresses(0) <= BASES(even_slot) + even_3;
      addresses(1) <= BASES(even_slot) + odd_3;
      addresses(2) <= BASES(odd_slot) + even_3;
      addresses(3) <= BASES(odd_slot) + odd_3;

      -- Clock 8: pixels in order.
      if swap_line_at(WINDOW_LATENCY - 1) = '0' then
        if swap_column_at(WINDOW_LATENCY - 1) = '0' then
          pixel_00 <= pixels(0);
          pixel_01 <= pixels(1);
          pixel_10 <= pixels(2);
          pixel_11 <= pixels(3);
        else
          pixel_00 <= pixels(1);
          pixel_01 <= pixels(0);
          pixel_10 <= pixels(3);
          pixel_11 <= pixels(2);
        end if;
      else
        if swap_column_at(WINDOW_LATENCY - 1) = '0' then
          pixel_00 <= pixels(2);
          pixel_01 <= pixels(3);
          pixel_10 <= pixels(0);
          pixel_11 <= pixels(1);
        else
          pixel_00 <= pixels(3);
          pixel_01 <= pixels(2);
          pixel_10 <= pixels(1);
          pixel_11 <= pixels(0);
        end if;
      end if;
    end if;

  end process locate;

  -- The record's slot has the range of the largest ring; this one has the range of this ring.
  write_slot <= ring_write.slot;

  -- Pixels are written a clock behind their places. The four memories share the address.
  write_pixels : process (clk) is
  begin

    if rising_edge(clk) then
      write_enables <= (others => '0');
      if ring_write.line(0) = '0' and ring_write.column(0) = '0' then
        write_enables(0) <= ring_write.enable;
      elsif ring_write.line(0) = '0' then
        write_enables(1) <= ring_write.enable;
      elsif ring_write.column(0) = '0' then
        write_enables(2) <= ring_write.enable;
      else
        write_enables(3) <= ring_write.enable;
      end if;
      write_address <= BASES(write_slot) + resize(shift_right(ring_write.column, 1), ADDR_BITS);
      write_pixel   <= write_data;
    end if;

  end process write_pixels;

  memories : for i in 0 to 3 generate

    -- Deep memories are divided into blocks with a register behind each, which block RAM needs at sensor clocks.
    memory : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => DATA_BITS,
        WORDS        => WORDS,
        READ_LATENCY => 3,
        DIVIDED      => true
      )
      port map (
        clk           => clk,
        write_enable  => write_enables(i),
        write_address => write_address,
        write_data    => write_pixel,
        read_address  => addresses(i),
        read_data     => pixels(i)
      );

  end generate memories;

  weight_y <= weight_y_at(WINDOW_LATENCY);
  weight_x <= weight_x_at(WINDOW_LATENCY);

end architecture rtl;
