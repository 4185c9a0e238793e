-- SPDX-License-Identifier: Apache-2.0
-- The picture made of the sharpest slices: the pixels of a stack wait until the index of their micro image is known.
--
-- The pixels go round in a ring of lines and leave it when the index of their row of micro images has been written;
-- then they are picked by it. Beside it goes the pixel of a slice that the frame has chosen.
--
-- Latency: RING_LINES lines and INDEX_LATENCY + 3 clocks. Throughput: one pixel of all slices each clock.
-- Equation: out_data = data(index of its micro image), out_chosen = data(slice), RING_LINES lines before.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity sharpest_pixels is
  generic (
    -- Slices of the stack.
    SLICES : positive;
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Micro images of the longest line.
    LENSES : positive;
    -- Lines from a pixel to the first one that is judged with the index of its micro image.
    RING_LINES : positive;
    -- Clocks from the last token of a row of micro images until the index of the first one is written.
    INDEX_LATENCY : positive;
    -- Width of a pixel, all channels.
    PIXEL_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Marks a pixel, the first and the last one of a line.
    active     : in    std_logic;
    line_first : in    std_logic;
    line_last  : in    std_logic;
    -- Marks the pixels of a frame's first line, and those of the image.
    frame_first : in    std_logic;
    image       : in    std_logic;
    -- The slice that its frame has chosen.
    slice : in    unsigned(bits_for(SLICES - 1) - 1 downto 0);
    -- Its micro image.
    lens : in    unsigned(bits_for(LENSES - 1) - 1 downto 0);
    -- Its slices, the first in the low bits.
    data : in    std_logic_vector(SLICES * PIXEL_BITS - 1 downto 0);
    -- Marks the index of a micro image, which one it is, and its index.
    index_write : in    std_logic;
    index_lens  : in    unsigned(bits_for(LENSES - 1) - 1 downto 0);
    index       : in    unsigned(bits_for(SLICES - 1) - 1 downto 0);
    -- Marks a pixel of the picture, the first of a frame, the last of a line.
    out_valid : out   std_logic;
    out_start : out   std_logic;
    out_last  : out   std_logic;
    -- Its slice and the pixel.
    out_index : out   unsigned(bits_for(SLICES - 1) - 1 downto 0);
    out_data  : out   std_logic_vector(PIXEL_BITS - 1 downto 0);
    -- The slice that its frame has chosen, and the pixel there.
    out_slice  : out   unsigned(bits_for(SLICES - 1) - 1 downto 0);
    out_chosen : out   std_logic_vector(PIXEL_BITS - 1 downto 0)
  );
end entity sharpest_pixels;

architecture rtl of sharpest_pixels is

  constant LENS_BITS  : positive := bits_for(LENSES - 1);
  constant INDEX_BITS : positive := bits_for(SLICES - 1);
  constant STACK_BITS : positive := SLICES * PIXEL_BITS;
  constant RING_WORDS : positive := RING_LINES * MAX_COLUMNS;
  constant RING_BITS  : positive := bits_for(RING_WORDS - 1);

  -- Side information of a pixel, in front of its micro image and its slices. Bit 0 is the one that reset clears.
  constant ACTIVE_BIT      : natural := 0;
  constant FIRST_BIT       : natural := 1;
  constant LAST_BIT        : natural := 2;
  constant IMAGE_BIT       : natural := 3;
  constant FRAME_FIRST_BIT : natural := 4;
  constant SLICE_LOW       : natural := 5;
  constant LENS_LOW        : natural := SLICE_LOW + INDEX_BITS;
  constant DATA_LOW        : natural := LENS_LOW + LENS_BITS;

  -- Pixels wait twice: a few clocks until the scan that their row begins is ahead of them, then whole lines in the
  -- ring until the index is known.
  signal token      : std_logic_vector(DATA_LOW + STACK_BITS - 1 downto 0);
  signal token_late : std_logic_vector(DATA_LOW + STACK_BITS - 1 downto 0);
  signal token_now  : std_logic_vector(DATA_LOW + STACK_BITS - 1 downto 0) := (others => '0');
  signal new_line   : std_logic;
  -- First word of the line in the ring that is written and read, and the word of the pixel. Each word is read just
  -- before it is overwritten, so the ring is a delay of RING_LINES lines, whatever their length.
  signal ring_line : unsigned(RING_BITS - 1 downto 0) := (others => '0');
  signal ring_word : unsigned(RING_BITS - 1 downto 0) := (others => '0');
  -- The pixels of all slices that leave, their micro image, its index as it is written and as it is read.
  signal delayed    : std_logic_vector(STACK_BITS - 1 downto 0);
  signal lens_now   : unsigned(LENS_BITS - 1 downto 0) := (others => '0');
  signal index_word : std_logic_vector(INDEX_BITS - 1 downto 0);
  signal index_read : std_logic_vector(INDEX_BITS - 1 downto 0);

  -- Of the line that leaves the ring: its slice, whether it begins a frame, whether it is of the image; and the same
  -- of its pixels behind those of the one that enters, with the ring's address, its word and the result.
  signal line_due   : std_logic_vector(INDEX_BITS + 1 downto 0);
  signal result_in  : std_logic_vector(INDEX_BITS + 4 downto 0);
  signal result_due : std_logic_vector(INDEX_BITS + 4 downto 0);
  signal result     : std_logic_vector(INDEX_BITS + 4 downto 0) := (others => '0');

begin

  token <= data & std_logic_vector(lens) & std_logic_vector(slice) &
           (frame_first & image & line_last & line_first & active);

  delay_token : entity work.tag_delay
    generic map (
      WIDTH  => DATA_LOW + STACK_BITS,
      LENGTH => INDEX_LATENCY - 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => token,
      delayed => token_late
    );

  new_line <= token_late(ACTIVE_BIT) and token_late(FIRST_BIT);

  lines_due : entity work.tag_delay
    generic map (
      WIDTH  => INDEX_BITS + 2,
      LENGTH => RING_LINES + 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => new_line,
      tag     => token_late(LENS_LOW - 1 downto IMAGE_BIT),
      delayed => line_due
    );

  find_word : process (clk) is
  begin

    if rising_edge(clk) then
      if new_line = '1' then
        if ring_line = (RING_LINES - 1) * MAX_COLUMNS then
          ring_line <= (others => '0');
          ring_word <= (others => '0');
        else
          ring_line <= ring_line + MAX_COLUMNS;
          ring_word <= ring_line + MAX_COLUMNS;
        end if;
      -- No line is longer than MAX_COLUMNS, so a line never runs into the next one's words.
      elsif token_late(ACTIVE_BIT) = '1' then
        ring_word <= ring_word + 1;
      end if;
      token_now <= token_late;
      lens_now  <= unsigned(token_now(DATA_LOW - 1 downto LENS_LOW));
      if reset = '1' then
        ring_line <= (others => '0');
      end if;
    end if;

  end process find_word;

  ring : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => STACK_BITS,
      ADDRESS_BITS => RING_BITS,
      WORDS        => RING_WORDS
    )
    port map (
      clk           => clk,
      write_enable  => token_now(ACTIVE_BIT),
      write_address => ring_word,
      write_data    => token_now(token_now'high downto DATA_LOW),
      read_address  => ring_word,
      read_data     => delayed
    );

  index_word <= std_logic_vector(index);

  indices : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => INDEX_BITS,
      ADDRESS_BITS => LENS_BITS,
      WORDS        => LENSES,
      READ_LATENCY => 1
    )
    port map (
      clk           => clk,
      write_enable  => index_write,
      write_address => index_lens,
      write_data    => index_word,
      read_address  => lens_now,
      read_data     => index_read
    );

  pick : process (clk) is

    variable sharpest : natural range 0 to 2 ** INDEX_BITS - 1;
    variable chosen   : natural range 0 to 2 ** INDEX_BITS - 1;

  begin

    if rising_edge(clk) then
      sharpest   := to_integer(unsigned(index_read));
      chosen     := to_integer(unsigned(result_due(INDEX_BITS + 4 downto 5)));
      out_index  <= unsigned(index_read);
      out_data   <= delayed(PIXEL_BITS - 1 downto 0);
      out_chosen <= delayed(PIXEL_BITS - 1 downto 0);

      for s in 1 to SLICES - 1 loop

        if sharpest = s then
          out_data <= delayed((s + 1) * PIXEL_BITS - 1 downto s * PIXEL_BITS);
        end if;
        if chosen = s then
          out_chosen <= delayed((s + 1) * PIXEL_BITS - 1 downto s * PIXEL_BITS);
        end if;

      end loop;

      result <= result_due;
      if reset = '1' then
        result(ACTIVE_BIT) <= '0';
      end if;
    end if;

  end process pick;

  result_in <= line_due & token_now(LAST_BIT downto ACTIVE_BIT);

  delay_result : entity work.tag_delay
    generic map (
      WIDTH  => INDEX_BITS + 5,
      LENGTH => 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => result_in,
      delayed => result_due
    );

  out_valid <= result(ACTIVE_BIT) and result(IMAGE_BIT);
  out_last  <= result(LAST_BIT);
  out_start <= result(FIRST_BIT) and result(FRAME_FIRST_BIT);
  out_slice <= unsigned(result(INDEX_BITS + 4 downto 5));

end architecture rtl;
