-- SPDX-License-Identifier: Apache-2.0
-- Control of a moving sum with several pixels a token: where pixels go in the banks, and where lines begin.
--
-- Two lines may be under way: pixels of the newer one arrive while the last outputs of the older one leave. A token's
-- place in its line is counted modulo the banks. Rows of the banks are counted from line to line, as each line begins
-- in a new row. Lines must begin at least lane_delay + 1 tokens apart.
--
-- Latency: 1 clock. Throughput: one token each clock.
-- Equation: see sum_lanes_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;

entity lane_control is
  generic (
    -- Sizes of lane_stage.
    BUILD : lanes_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- strobe: there is a token; first: it begins a line; live: it has pixels of the line.
    strobe : in    std_logic;
    first  : in    std_logic;
    live   : in    std_logic;
    -- Slice of the line, read with its first token.
    slice : in    unsigned(bits_for(BUILD.geometry.slices - 1) - 1 downto 0);
    -- 1 clock behind a token: where its pixels go.
    write_1 : out   lanes_write_t;
    -- 1 clock behind a token: fresh_1: the token begins a line; ahead_1: which of its pixels count in the sum
    -- ahead of output 0; held_1: which of them count in the sum that output 0 shows.
    fresh_1 : out   std_logic;
    ahead_1 : out   std_logic_vector(BUILD.pixels - 1 downto 0);
    held_1  : out   std_logic_vector(BUILD.pixels - 1 downto 0);
    -- 1 clock behind a token: the outputs that leave with it.
    read_1 : out   lanes_read_t
  );
end entity lane_control;

architecture rtl of lane_control is

  -- With a fixed slice the geometry is that slice alone.
  constant GEOMETRY : geometry_t := BUILD.geometry;

  constant M      : positive := BUILD.geometry.micro_image_size;
  constant P      : positive := BUILD.pixels;
  constant SLICES : positive := GEOMETRY.slices;
  constant DELAY  : natural  := lane_delay(GEOMETRY, P);
  constant PLACES : positive := token_places(M, P);
  -- Steps of a place within a token, if there are P banks or more.
  constant TOKEN_STEPS : positive := P / bank_step(M, P);

  subtype place_t is natural range 0 to larger(PLACES - 1, 1);

  subtype row_t is unsigned(BUILD.row_bits - 1 downto 0);

  -- A place, and the row that it lies in.

  type position_t is record
    place : place_t;
    row   : row_t;
  end record position_t;

  -- Tokens since a line began, counted up to DELAY: all pixels of the first outputs have come by then.
  constant COUNT_WORDS : positive := 2 ** bits_for(DELAY);

  subtype count_t is natural range 0 to larger(DELAY, 1);

  -- Which pixels of a token count, between two ones that keep words from being zero (moving_sum_pkg.table_words).

  type masks_t is array (natural range 0 to SLICES * COUNT_WORDS - 1) of std_logic_vector(P + 1 downto 0);

  function mask_table (
    held : boolean
  ) return masks_t is

    variable table : masks_t;

  begin

    for s in 0 to SLICES - 1 loop

      for n in 0 to COUNT_WORDS - 1 loop

        table(s * COUNT_WORDS + n)        := (others => '0');
        table(s * COUNT_WORDS + n)(0)     := '1';
        table(s * COUNT_WORDS + n)(P + 1) := '1';

      end loop;

      -- Only the pixels of the first DELAY tokens can come before output 0.
      for i in 0 to DELAY * P - 1 loop

        if is_ahead(GEOMETRY, s, i, held) then
          table(s * COUNT_WORDS + i / P)(i mod P + 1) := '1';
        end if;

      end loop;

    end loop;

    return table;

  end function mask_table;

  constant AHEAD : masks_t := mask_table(false);
  constant HELD  : masks_t := mask_table(true);

  function mask_of (
    table  : masks_t;
    number : unsigned;
    count  : count_t
  ) return std_logic_vector is

    variable word : std_logic_vector(P + 1 downto 0);

  begin

    -- With one slice the table has the words of that slice only, so the slice's number is no part of the index.
    if SLICES = 1 then
      word := table(count);
    else
      word := table(to_integer(number) * COUNT_WORDS + count);
    end if;

    return word(P downto 1);

  end function mask_of;

  function token_behind (
    position : position_t
  ) return position_t is

    variable behind : position_t;

  begin

    -- The remainder modulo PLACES takes one comparison, because a token moves less than once round.
    behind := position;

    if position.place + TOKEN_STEPS >= PLACES then
      behind.place := position.place + TOKEN_STEPS - PLACES;
      behind.row   := position.row + 1;
    else
      behind.place := position.place + TOKEN_STEPS;
    end if;

    return behind;

  end function token_behind;

  -- tag: mark of a line's first token (bit 0) and its slice. out_tag: the tag of DELAY tokens before, which is
  -- that of the token whose outputs leave.
  signal tag     : std_logic_vector(slice'length downto 0);
  signal out_tag : std_logic_vector(slice'length downto 0);
  signal tags    : std_logic_vector(delay_bits(slice'length + 1, DELAY) - 1 downto 0) := (others => '0');

  -- The token that came in, 1 clock behind it.
  signal in_first    : std_logic             := '0';
  signal in_live     : std_logic             := '0';
  signal in_slice    : unsigned(slice'range) := (others => '0');
  signal in_count    : count_t               := 0;
  signal in_position : position_t            := (place => 0, row => (others => '0'));
  -- The outputs that leave: whether they begin a line, their slice, their place and row, and rows since output 0.
  signal step_now     : std_logic                          := '0';
  signal out_first    : std_logic                          := '0';
  signal out_slice    : unsigned(slice'range)              := (others => '0');
  signal out_position : position_t                         := (place => 0, row => (others => '0'));
  signal out_rows     : natural range 0 to BUILD.most_rows := 0;
  -- following: place of the line's next token; last_end: place behind the last pixel of the outputs' line;
  -- line_row: row of the line's first token; ended: where the line before ended.
  signal following : position_t := (place => 0, row => (others => '0'));
  signal last_end  : position_t;
  signal line_row  : row_t      := (others => '0');
  signal ended     : position_t := (place => 0, row => (others => '0'));
  -- The line whose outputs leave is the line whose pixels come in.
  signal same : std_logic := '0';

begin

  tag <= std_logic_vector(slice) & (first and strobe);

  -- Outputs come DELAY tokens behind their pixels, so a delay line gives the begin of their line: no second counter.
  out_tag <= delayed(tags, tag, DELAY);

  write_1.valid <= step_now and in_live;
  write_1.place <= in_position.place;
  write_1.row   <= resize(in_position.row, 16);
  fresh_1       <= in_first;
  ahead_1       <= mask_of(AHEAD, in_slice, in_count);
  held_1        <= mask_of(HELD, in_slice, in_count);
  read_1.active <= step_now;
  read_1.take   <= out_first;
  read_1.slice  <= resize(out_slice, 8);
  read_1.place  <= out_position.place;
  read_1.row    <= resize(out_position.row, 16);
  read_1.rows   <= out_rows;
  -- The end of the outputs' line: the place of its next token while the line still comes in, else where it ended.
  last_end <= following when same = '1' else
              ended;

  read_1.end_place <= last_end.place;
  read_1.end_row   <= resize(last_end.row, 16);

  count_tokens : process (clk) is

    variable now      : position_t;
    variable then_out : position_t;

  begin

    if rising_edge(clk) then
      step_now <= strobe;
      tags     <= moved_on(tags, tag, strobe, reset);
      if strobe = '1' then
        in_first <= first;
        in_live  <= live;
        now      := following;
        -- A line begins at bank 0 of a new row, so a pixel's bank follows from its column alone.
        if first = '1' then
          now.place := 0;
          now.row   := following.row + 1;
          line_row  <= now.row;
          -- The line before has got its last pixel.
          ended    <= following;
          in_slice <= slice;
          in_count <= 0;
        elsif in_count < DELAY then
          -- The count stops where the masks end.
          in_count <= in_count + 1;
        end if;
        in_position <= now;
        -- Empty tokens behind a line move its outputs on but take no place, because nothing would read it.
        if live = '1' then
          following <= token_behind(now);
        else
          following <= now;
        end if;

        out_first <= out_tag(0);
        then_out  := token_behind(out_position);
        if out_tag(0) = '1' then
          out_slice          <= unsigned(out_tag(out_tag'high downto 1));
          out_position.place <= 0;
          out_position.row   <= line_row;
          -- Without delay, the outputs of the line that begins leave at once.
          if first = '1' then
            out_position.row <= now.row;
          end if;
          out_rows <= 0;
          same     <= '1';
        else
          out_position <= then_out;
          -- The count stops where the tables end; rows beyond all need the same.
          if then_out.row /= out_position.row and out_rows < BUILD.most_rows then
            out_rows <= out_rows + 1;
          end if;
          -- A newer line comes in while outputs of this one still leave.
          if first = '1' then
            same <= '0';
          end if;
        end if;
      end if;
      if reset = '1' then
        step_now <= '0';
        same     <= '0';
      end if;
    end if;

  end process count_tokens;

  -- Simulation stops if a line begins while outputs of two others still leave: there is no register for where it ends.
  watch_lines : process (clk) is

    variable tokens : natural := DELAY + 1;

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      if reset = '1' then
        tokens := DELAY + 1;
      elsif strobe = '1' then
        assert not (first = '1' and tokens <= DELAY)
          report "lane_control: a line began less than lane_delay + 1 tokens behind the one before"
          severity failure;
        if first = '1' then
          tokens := 1;
        elsif tokens <= DELAY then
          tokens := tokens + 1;
        end if;
      end if;
    end if;

  -- synthesis translate_on

  end process watch_lines;

end architecture rtl;
