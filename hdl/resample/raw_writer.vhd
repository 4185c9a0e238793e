-- SPDX-License-Identifier: Apache-2.0
-- Numbers the lines of the raw frames that go into the ring of lines, and says when there is room for another line.
--
-- Lines are numbered without end, even over resets. A line may be overwritten when the reader needs only lines from
-- `keep` on. A new frame, with the number of its first line, waits until the reader has finished the one before and
-- takes it; meanwhile its lines go into the ring as far as there is room.
--
-- Latency: 1 clock. Throughput: one pixel each clock.
-- Equation: room = (number of the next pixel's line) - keep < LINES, keep the first line of a frame that waits if the
--   reader needs no other.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;
use work.token_pkg.all;

entity raw_writer is
  generic (
    -- What the resampler is built for.
    BUILD : resample_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Tokens of the frame sequencer: pixels of lines that are all whole.
    token      : in    token_t;
    token_data : in    std_logic_vector(BUILD.data_bits - 1 downto 0);
    -- The next pixel has a place.
    room : out   std_logic;
    -- To the ring.
    ring_write : out   ring_write_t;
    write_data : out   std_logic_vector(BUILD.data_bits - 1 downto 0);
    -- What the ring has, and what its reader needs.
    ring : out   ring_state_t;
    need : in    ring_need_t
  );
end entity raw_writer;

architecture rtl of raw_writer is

  constant LAST_SLOT : natural := BUILD.held_lines / 2 - 1;
  -- Clocks until the reads for a line have left the ring.
  constant KEEP_WAIT : positive := 12;

  type keeps_t is array (1 to KEEP_WAIT) of place_t;

  -- The line that is written, its place in the ring, and the next column. The number wraps around; only differences
  -- of lines within the ring are ever taken.
  signal line_number : place_t                                                := (others => '0');
  signal slot        : natural range 0 to LAST_SLOT                           := 0;
  signal column      : unsigned(bits_for(BUILD.max_columns - 1) - 1 downto 0) := (others => '0');
  -- The frame that came in last still waits for its reader; its first line; lines complete of it, and of the one
  -- before, which the reader may still have.
  signal waits       : std_logic := '0';
  signal frame_first : place_t   := (others => '0');
  signal done        : place_t   := (others => '0');
  signal done_before : place_t   := (others => '0');
  signal line_ends   : std_logic;
  -- The first line that the reader needs, and the same when its last reads have left the memory: a line is given free
  -- that much later.
  signal keep_at  : keeps_t                          := (others => (others => '0'));
  signal keeps_at : std_logic_vector(1 to KEEP_WAIT) := (others => '0');
  -- The first line that must stay, if any.
  signal first_kept : place_t;
  signal keeps_none : std_logic;
  -- Room for pixels of this line, and of the next.
  signal room_this : std_logic := '0';
  signal room_next : std_logic := '0';

begin

  line_ends        <= token.strobe and token.pixel and token.line_last;
  room             <= room_next when line_ends = '1' else
                      room_this;
  ring.frame_base  <= frame_first;
  ring.frame_waits <= waits;
  -- While a frame waits, the reader has the one before, and that one is complete.
  ring.lines_in <= done_before when waits = '1' else
                   done;

  -- While it has no frame, all lines of the one that waits stay.
  first_kept <= keep_at(KEEP_WAIT) when keeps_at(KEEP_WAIT) = '1' else
                frame_first;
  keeps_none <= not (keeps_at(KEEP_WAIT) or waits);

  follow : process (clk) is

    variable now : place_t;

  begin

    if rising_edge(clk) then
      -- Once a pixel is here its line has room: the sequencer was told before it took it.
      ring_write.enable <= token.strobe and token.pixel;
      write_data        <= token_data;
      ring_write.line   <= line_number;
      ring_write.slot   <= slot;

      -- The first line to stay is given free late, when the reads of the lines before it have left the memory; that
      -- none must stay is known late for the same reason.
      keep_at(1)               <= need.keep;
      keep_at(2 to KEEP_WAIT)  <= keep_at(1 to KEEP_WAIT - 1);
      keeps_at(1)              <= not need.keep_none;
      keeps_at(2 to KEEP_WAIT) <= keeps_at(1 to KEEP_WAIT - 1);

      if need.frame_taken = '1' then
        waits <= '0';
      end if;

      -- `room` is registered, so it is decided here for the line of the next pixel, and for the line after it in case
      -- this pixel is the last one of its line.
      now := line_number;
      if token.strobe = '1' and token.pixel = '1' then
        if token.line_first = '1' then
          ring_write.column <= (others => '0');
          column            <= to_unsigned(1, column'length);
        else
          ring_write.column <= resize(column, 13);
          column            <= column + 1;
        end if;

        if token.line_first = '1' and token.frame_first = '1' then
          waits       <= '1';
          frame_first <= line_number;
          done_before <= done;
          done        <= (others => '0');
        end if;

        if token.line_last = '1' then
          now := line_number + 1;
          if token.line_first = '1' and token.frame_first = '1' then
            done <= to_signed(1, done'length);
          else
            done <= done + 1;
          end if;
          -- Slots hold pairs of lines: the odd one completes a pair.
          if line_number(0) = '1' then
            if slot = LAST_SLOT then
              slot <= 0;
            else
              slot <= slot + 1;
            end if;
          end if;
        end if;
      end if;
      -- The number runs on from frame to frame, so that a line has one name in the ring whatever frame it is of.
      line_number <= now;

      room_this <= '0';
      room_next <= '0';
      if keeps_none = '1' or now - first_kept < BUILD.held_lines then
        room_this <= '1';
      end if;
      if keeps_none = '1' or now + 1 - first_kept < BUILD.held_lines then
        room_next <= '1';
      end if;

      -- A reset makes it a reader that needs no line.
      if reset = '1' then
        keeps_at <= (others => '0');
        waits    <= '0';
      end if;
    end if;

  end process follow;

end architecture rtl;
