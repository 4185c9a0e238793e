-- SPDX-License-Identifier: Apache-2.0
-- Writes words of pixels, and the marks of lines and frames, into a buffer in their order.
--
-- A word waits until it is known whether it is its line's last one. When the buffer has one place left, the line ends
-- there and the rest of the frame is dropped, so the written part stays well formed.
--
-- Latency: until the next word of the line, or the line's end. Throughput: one word each clock.
-- Equation: first = first word behind a frame's start, ends = no other word of its line follows.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.csi_pkg.all;
use work.math_pkg.all;

entity word_sender is
  generic (
    -- Pixels of a word, and their bits.
    WORD_PIXELS : positive range 1 to 8;
    DATA_BITS   : positive
  );
  port (
    clk : in    std_logic;
    -- Words, as raw_unpacker gives them.
    word      : in    unpacked_t;
    word_data : in    std_logic_vector(DATA_BITS - 1 downto 0);
    -- frame_starts: a frame starts with the next word; events; with them the identifier of the last packet of pixels
    -- that was left out.
    frame_starts    : in    std_logic;
    events          : in    events_t;
    left_identifier : in    identifier_t;
    -- The buffer: full: it has no place; nearly_full: one place at most; the word to write.
    full         : in    std_logic;
    nearly_full  : in    std_logic;
    write_enable : out   std_logic;
    write_word   : out   crossing_t;
    write_data   : out   std_logic_vector(DATA_BITS - 1 downto 0)
  );
end entity word_sender;

architecture rtl of word_sender is

  -- The word that waits; held_ends: its line has ended.
  signal held       : std_logic                                := '0';
  signal held_ends  : std_logic                                := '0';
  signal held_first : std_logic                                := '0';
  signal held_last  : natural range 0 to 7                     := 0;
  signal held_data  : std_logic_vector(DATA_BITS - 1 downto 0) := (others => '0');
  -- at_first: the next word is a frame's first one; dropping: the rest of a frame is dropped.
  signal at_first : std_logic := '0';
  signal dropping : std_logic := '0';
  -- Events that could not be written yet.
  signal untold : events_t := (others => '0');

  signal moves : std_logic;
  signal fits  : std_logic;
  signal tells : std_logic;
  signal news  : events_t;

begin

  -- A word leaves when it is known what follows: another word, or the line's end. If the buffer is full, the word is
  -- lost, and the rest of its frame too.
  moves <= held and (held_ends or word.valid);
  fits  <= moves and not full;
  news  <= untold or events;
  -- Events without pixels wait until there is more than one place: the last place is for the end of the line under way.
  tells <= to_logic(news /= (events_t'range => '0')) and not nearly_full;

  write_enable          <= fits or tells;
  write_word.events     <= news;
  write_word.identifier <= left_identifier;
  write_word.has_pixels <= fits;
  write_word.first      <= held_first;
  -- The line ends in the last place, whether the camera has ended it or not.
  write_word.ends <= held_ends or nearly_full;
  write_word.last <= held_last;
  write_data      <= held_data;

  follow : process (clk) is

    variable drops : std_logic;
    variable left  : events_t;

  begin

    if rising_edge(clk) then
      -- The line cannot go on, or cannot even begin.
      drops := moves and ((nearly_full and not held_ends) or full);
      -- Events go with the first word that is written, and are collected until then.
      left := news;
      if fits = '1' or tells = '1' then
        left := (others => '0');
      end if;
      if drops = '1' then
        left(PIXELS_LOST) := '1';
      end if;
      untold <= left;

      -- A new frame may find room again, so dropping lasts to the end of a frame.
      if frame_starts = '1' then
        at_first <= '1';
        dropping <= '0';
      elsif drops = '1' then
        dropping <= '1';
      end if;

      if moves = '1' then
        held <= '0';
      end if;
      -- The mark of a frame goes with its first word, even if that is dropped: without it the rest would look like the
      -- frame before.
      if word.valid = '1' then
        held       <= not (dropping or drops);
        held_first <= at_first;
        held_last  <= word.last;
        held_data  <= word_data;
        at_first   <= '0';
      end if;
      -- An end may come with a word, or alone for the word that waits.
      if word.valid = '1' or word.ends = '1' then
        held_ends <= word.ends;
      end if;
    end if;

  end process follow;

  -- Simulation stops if the buffer is full without having been nearly full: the last place is for the end of a line.
  watch_places : process (clk) is
  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert not (full = '1' and nearly_full = '0')
        report "word_sender: full came without nearly_full"
        severity failure;
    end if;

  -- synthesis translate_on

  end process watch_places;

end architecture rtl;
