-- SPDX-License-Identifier: Apache-2.0
-- Numbers the lines of the raw frames that go into the ring, and says when there is room for another line.
--
-- Lines are numbered without end, even across resets. A line may be overwritten when the reader needs only lines from
-- `keep` on. A new frame waits until the reader has finished the one before and takes it; meanwhile its lines go into
-- the ring as far as there is room.
--
-- Latency: 1 clock. Throughput: one pixel each clock.
-- Equation: room = (number of the next pixel's line) - keep < LINES, with keep the first line of a waiting frame if the
-- reader needs no other line.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;
use work.token_pkg.all;

entity raw_writer is
  generic (
    -- Sizes of the resampler.
    BUILD : resample_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Tokens of the frame sequencer: pixels of whole lines.
    token      : in    token_t;
    token_data : in    std_logic_vector(BUILD.data_bits - 1 downto 0);
    -- The ring has room for the next pixel.
    room : out   std_logic;
    -- Pixels for the ring.
    ring_write : out   ring_write_t;
    write_data : out   std_logic_vector(BUILD.data_bits - 1 downto 0);
    -- The ring's state, and what its reader needs.
    ring : out   ring_state_t;
    need : in    ring_need_t
  );
end entity raw_writer;

architecture rtl of raw_writer is

  constant LAST_SLOT : natural := BUILD.held_lines / 2 - 1;
  -- Clocks until the reads for a line have left the ring.
  constant KEEP_WAIT : positive := 12;

  type keeps_t is array (1 to KEEP_WAIT) of place_t;

  -- The line that is written, its slot in the ring, and the next column. The number wraps round; only differences of
  -- lines within the ring are used.
  signal line_number : place_t                                                := (others => '0');
  signal slot        : natural range 0 to LAST_SLOT                           := 0;
  signal column      : unsigned(bits_for(BUILD.max_columns - 1) - 1 downto 0) := (others => '0');
  -- waits: the newest frame waits for its reader; frame_first: its first line; done: complete lines of it; done_before:
  -- complete lines of the frame before, which the reader may still have.
  signal waits       : std_logic := '0';
  signal frame_first : place_t   := (others => '0');
  signal done        : place_t   := (others => '0');
  signal done_before : place_t   := (others => '0');
  signal line_ends   : std_logic;
  -- The first line that the reader needs, and whether it needs any, delayed until the reads have left the memory: lines
  -- are released that much later.
  signal keep_at  : keeps_t                          := (others => (others => '0'));
  signal keeps_at : std_logic_vector(1 to KEEP_WAIT) := (others => '0');
  -- The first line that must stay; keeps_none: no line must.
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
  -- While a frame waits, the reader has the frame before, which is complete.
  ring.lines_in <= done_before when waits = '1' else
                   done;

  -- While the reader has no frame, all lines of the waiting frame stay.
  first_kept <= keep_at(KEEP_WAIT) when keeps_at(KEEP_WAIT) = '1' else
                frame_first;
  keeps_none <= not (keeps_at(KEEP_WAIT) or waits);

  follow : process (clk) is

    variable now : place_t;

  begin

    if rising_edge(clk) then
      -- A pixel that has come has room: the sequencer was told before it took the pixel.
      ring_write.enable <= token.strobe and token.pixel;
      write_data        <= token_data;
      ring_write.line   <= line_number;
      ring_write.slot   <= slot;

      -- Lines are released late, when the reads of the lines before have left the memory.
      keep_at(1)               <= need.keep;
      keep_at(2 to KEEP_WAIT)  <= keep_at(1 to KEEP_WAIT - 1);
      keeps_at(1)              <= not need.keep_none;
      keeps_at(2 to KEEP_WAIT) <= keeps_at(1 to KEEP_WAIT - 1);

      if need.frame_taken = '1' then
        waits <= '0';
      end if;

      -- `room` is a register, so it is decided here for the next pixel's line, and for the line behind it in case this
      -- pixel is the last of its line.
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
          -- A slot holds a pair of lines, which the odd line completes.
          if line_number(0) = '1' then
            if slot = LAST_SLOT then
              slot <= 0;
            else
              slot <= slot + 1;
            end if;
          end if;
        end if;
      end if;
      -- The number counts on from frame to frame, so each line in the ring has a number of its own.
      line_number <= now;

      room_this <= '0';
      room_next <= '0';
      if keeps_none = '1' or now - first_kept < BUILD.held_lines then
        room_this <= '1';
      end if;
      if keeps_none = '1' or now + 1 - first_kept < BUILD.held_lines then
        room_next <= '1';
      end if;

      -- A reset acts like a reader that needs no line.
      if reset = '1' then
        keeps_at <= (others => '0');
        waits    <= '0';
      end if;
    end if;

  end process follow;

end architecture rtl;
