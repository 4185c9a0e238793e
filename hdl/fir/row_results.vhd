-- SPDX-License-Identifier: Apache-2.0
-- Puts the sums of fir_array's column modules back into rows of results.
--
-- Module m outputs the sums of its columns, row after row, one token after module m - 1. Multiplexers put the rows
-- together again; each row is one token later than the row above it. The fields of a column are delayed like its
-- rows, and each row keeps the fields of its line for the whole band.
--
-- Latency: r tokens for row r. Throughput: one word of sums of each row each clock.
-- Equation: row_sums(row r, token t) = module_sums(module c(t - r), token t), c the number of the column mod N.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.count_pkg.all;
use work.math_pkg.all;
use work.token_pkg.all;

entity row_results is
  generic (
    -- N, rows of a band.
    PARALLEL_ROWS : positive;
    -- Width of the sums of a pixel, all channels.
    SUM_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token of module 0. In each of the first N tokens of a band the fields image, frame_first and slice are
    -- those of the next row.
    token : in    token_t;
    -- The sums of each module, module 0 in the low bits.
    module_sums : in    std_logic_vector(PARALLEL_ROWS * SUM_BITS - 1 downto 0);
    -- The token of each row with the fields of its line, and its sums, row 0 in the low bits.
    row_token : out   tokens_t(0 to PARALLEL_ROWS - 1);
    row_sums  : out   std_logic_vector(PARALLEL_ROWS * SUM_BITS - 1 downto 0)
  );
end entity row_results;

architecture rtl of row_results is

  -- Bits of the mark that passes from row to row, a token each; bit 0 is the one that reset clears.
  constant PIXEL_BIT   : natural := 0;
  constant FIRST_BIT   : natural := 1;
  constant LAST_BIT    : natural := 2;
  constant COLUMN_BITS : natural := 3;

  -- Columns come back from module to module, a token apart. The count since a band's first column says which row
  -- gets which module's sum.
  signal starts     : std_logic;
  signal count      : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
  signal count_held : natural range 0 to larger(PARALLEL_ROWS - 1, 1) := 0;
  signal raw_tags   : std_logic_vector(PARALLEL_ROWS * COLUMN_BITS - 1 downto 0);
  signal skew_tags  : std_logic_vector(PARALLEL_ROWS * COLUMN_BITS - 1 downto 0);

begin

  starts <= begins_line(token);

  count <= place_in_turn(count_held, starts, PARALLEL_ROWS);

  count_columns : process (clk) is
  begin

    if rising_edge(clk) then
      if token.strobe = '1' then
        count_held <= count;
      end if;
    end if;

  end process count_columns;

  multiplex : entity work.lane_exchange
    generic map (
      LANES => PARALLEL_ROWS,
      WIDTH => SUM_BITS
    )
    port map (
      clk      => clk,
      strobe   => token.strobe,
      count    => count,
      data_in  => module_sums,
      data_out => row_sums
    );

  -- All rows get the same three bits; the skew makes them those of each row's own column.
  every_row_tag : for r in 0 to PARALLEL_ROWS - 1 generate
    raw_tags((r + 1) * COLUMN_BITS - 1 downto r * COLUMN_BITS) <= token.line_last & token.line_first &
                                                                  token.pixel;
  end generate every_row_tag;

  skew_tags_of_rows : entity work.lane_skew
    generic map (
      LANES => PARALLEL_ROWS,
      WIDTH => COLUMN_BITS
    )
    port map (
      clk      => clk,
      reset    => reset,
      enable   => token.strobe,
      data_in  => raw_tags,
      data_out => skew_tags
    );

  row : for r in 0 to PARALLEL_ROWS - 1 generate

    signal column_tag : std_logic_vector(COLUMN_BITS - 1 downto 0);
    signal begins     : std_logic;
    -- The fields of the row's line in this band, from the token that begins the line.
    signal line_held : token_t := NO_TOKEN;
    signal line_now  : token_t;

  begin

    column_tag <= skew_tags((r + 1) * COLUMN_BITS - 1 downto r * COLUMN_BITS);
    begins     <= column_tag(PIXEL_BIT) and column_tag(FIRST_BIT);
    -- A row takes the fields of its line with the token that begins the line, and keeps them for the band.
    line_now <= token when begins = '1' else
                line_held;

    hold_line : process (clk) is
    begin

      if rising_edge(clk) then
        if token.strobe = '1' then
          line_held <= line_now;
        end if;
      end if;

    end process hold_line;

    -- Between tokens the skew registers hold; strobe says when their output counts. A row without an image line reports
    -- this with its first column: row_scatter waits for each row in turn and must not wait for this one.
    row_token(r).strobe      <= token.strobe;
    row_token(r).pixel       <= column_tag(PIXEL_BIT);
    row_token(r).line_first  <= column_tag(FIRST_BIT);
    row_token(r).line_last   <= column_tag(LAST_BIT);
    row_token(r).band        <= token.band;
    row_token(r).frame_first <= line_now.frame_first;
    row_token(r).image       <= line_now.image;
    row_token(r).slice       <= line_now.slice;

  end generate row;

end architecture rtl;
