-- SPDX-License-Identifier: Apache-2.0
-- Makes a stream of PIXELS_PER_CLOCK pixels each clock from the buffer's words, and checks the size of lines and
-- frames.
--
-- After a reset the stream begins with a whole frame.
--
-- Latency: 1 clock. Throughput: PIXELS_PER_CLOCK pixels each clock; a word without pixels takes a clock, too.
-- Equation: tuser(0) = first pixels of a frame, tlast = last pixels of a line.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.csi_pkg.all;
use work.math_pkg.all;

entity pixel_stream is
  generic (
    -- Pixels of a word, a multiple of the pixels of a transfer.
    WORD_PIXELS      : positive range 1 to 8;
    PIXELS_PER_CLOCK : positive range 1 to 8;
    PIXEL_BITS       : positive range 8 to 12
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The size that frames should have.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Words, as word_sender writes them.
    word_valid : in    std_logic;
    word_ready : out   std_logic;
    word       : in    crossing_t;
    word_data  : in    std_logic_vector(WORD_PIXELS * PIXEL_BITS - 1 downto 0);
    -- AXI4-Stream video, the first pixel in the low bits.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Events and faults, each high for one clock.
    faults : out   events_t
  );
end entity pixel_stream;

architecture rtl of pixel_stream is

  constant PARTS     : positive := WORD_PIXELS / PIXELS_PER_CLOCK;
  constant PART_BITS : positive := PIXELS_PER_CLOCK * PIXEL_BITS;

  signal valid : std_logic := '0';
  -- A frame has begun since the reset.
  signal running : std_logic := '0';
  -- part: the part of the word that goes out next; part_ends: it is the last part with a pixel.
  signal part      : natural range 0 to larger(PARTS - 1, 1) := 0;
  signal part_ends : std_logic;
  signal free      : std_logic;
  signal passes    : std_logic;
  signal done      : std_logic;
  -- Pixels of the line, and lines of the frame, so far.
  signal pixels : unsigned(16 downto 0) := (others => '0');
  signal lines  : unsigned(15 downto 0) := (others => '0');

begin

  m_axis_tvalid <= valid;
  -- The register of the stream is empty, or is emptied in this clock.
  free <= m_axis_tready or not valid;
  -- After a reset words pass from a frame's first one on; the rest of the frame under way is dropped.
  passes    <= word_valid and word.has_pixels and (running or word.first);
  part_ends <= to_logic(part = word.last / PIXELS_PER_CLOCK);
  -- A word is done with its last part; a word without pixels, or one that is dropped, at once.
  done       <= word_valid and ((part_ends and free) or not passes);
  word_ready <= done;

  send : process (clk) is
  begin

    if rising_edge(clk) then
      if free = '1' then
        valid           <= passes;
        m_axis_tuser(0) <= word.first and to_logic(part = 0);
        m_axis_tlast    <= word.ends and part_ends;

        for i in 0 to PARTS - 1 loop

          if part = i then
            m_axis_tdata <= word_data((i + 1) * PART_BITS - 1 downto i * PART_BITS);
          end if;

        end loop;

        if passes = '1' then
          running <= '1';
          if part_ends = '1' then
            part <= 0;
          else
            part <= part + 1;
          end if;
        end if;
      end if;
      -- Only valid needs a reset, because it validates data and marks.
      if reset = '1' then
        valid   <= '0';
        running <= '0';
        part    <= 0;
      end if;
    end if;

  end process send;

  -- A wrong size is only reported: the stream goes on to the core, which fills up and cuts off lines (frame_sequencer).
  check_sizes : process (clk) is

    variable length : unsigned(16 downto 0);
    variable wrong  : std_logic;

  begin

    if rising_edge(clk) then
      -- The line's pixels, with those of this word if it is the line's last.
      length := pixels + word.last + 1;
      wrong  := '0';
      faults <= (others => '0');
      if done = '1' then
        faults <= word.events;
        -- Lines are counted where frames end. Before the first whole frame there is nothing to compare, but a frame
        -- without lines is wrong in any case.
        if word.events(FRAME_ENDED) = '1' then
          wrong := (running and to_logic(lines /= unsigned(rows))) or word.events(NO_LINES);
          lines <= (others => '0');
        end if;
        if passes = '1' then
          -- If the end of the frame before was lost, its lines must not count for this frame.
          if word.first = '1' then
            lines <= (others => '0');
          end if;
          pixels <= length;
          if word.ends = '1' then
            wrong  := wrong or to_logic(length /= unsigned(columns));
            pixels <= (others => '0');
            if word.first = '1' then
              lines <= to_unsigned(1, 16);
            else
              lines <= lines + 1;
            end if;
          end if;
        end if;
        faults(WRONG_SIZE) <= wrong;
      end if;
      if reset = '1' then
        pixels <= (others => '0');
        lines  <= (others => '0');
      end if;
    end if;

  end process check_sizes;

  -- Simulation stops if a word within a line is not full: missing pixels would lie in the middle of the line.
  watch_words : process (clk) is
  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert not (word_valid = '1' and word.has_pixels = '1' and word.ends = '0' and word.last /= WORD_PIXELS - 1)
        report "pixel_stream: a word within a line is not full"
        severity failure;
    end if;

  -- synthesis translate_on

  end process watch_words;

end architecture rtl;
