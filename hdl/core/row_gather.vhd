-- SPDX-License-Identifier: Apache-2.0
-- Gathers the lines of a raster into bands of parallel rows: row buffers in front of the engine.
--
-- All lines of a band except its last are stored while the engine gets empty tokens. The line that completes the
-- band then gives the engine one pixel of each row at once. Rows that the last band of a frame lacks, and rows of
-- flush lines, are zeros and marked as no image lines.
--
-- Latency: 2 clocks (PARALLEL_ROWS = 1: 0 clocks). Throughput: one token each clock.
-- Equation: row r of the band at column k = pixel k of the r-th line since the last band.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.token_pkg.all;

entity row_gather is
  generic (
    -- Rows of a band.
    PARALLEL_ROWS : positive;
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Width of a pixel.
    DATA_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Tokens and their pixels, as frame_sequencer gives them.
    token      : in    token_t;
    token_row  : in    natural range 0 to larger(PARALLEL_ROWS - 1, 1);
    token_data : in    std_logic_vector(DATA_BITS - 1 downto 0);
    -- Tokens of bands, the rows that are image lines, and their pixels, row 0 in the low bits.
    array_token : out   token_t;
    array_image : out   std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    array_data  : out   std_logic_vector(PARALLEL_ROWS * DATA_BITS - 1 downto 0)
  );
end entity row_gather;

architecture rtl of row_gather is

begin

  raster : if PARALLEL_ROWS = 1 generate
    array_token    <= token;
    array_image(0) <= token.image;
    array_data     <= token_data;
  end generate raster;

  bands : if PARALLEL_ROWS > 1 generate

    constant ADDRESS_BITS : positive := bits_for(MAX_COLUMNS - 1);

    signal column    : unsigned(ADDRESS_BITS - 1 downto 0);
    signal column_d1 : unsigned(ADDRESS_BITS - 1 downto 0)    := (others => '0');
    signal token_d1  : token_t;
    signal image_d2  : std_logic;
    signal row_d1    : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
    signal row_d2    : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
    signal data_d1   : std_logic_vector(DATA_BITS - 1 downto 0);
    signal data_d2   : std_logic_vector(DATA_BITS - 1 downto 0);

  begin

    -- The column is counted here because tokens carry none. Flush lines and filled-up lines have as many columns
    -- as others.
    column <= (others => '0') when token.line_first = '1' else
              column_d1 + 1;

    follow : process (clk) is
    begin

      -- synthesis translate_off
      assert not (rising_edge(clk) and reset = '0' and token.strobe = '1' and token.pixel = '1' and
                  token.line_first = '0' and column_d1 = MAX_COLUMNS - 1)
        report "row_gather: a line is longer than MAX_COLUMNS"
        severity failure;
      -- synthesis translate_on

      if rising_edge(clk) then
        -- Empty tokens between lines must not advance the column, or the next line would be stored at wrong columns.
        if token.strobe = '1' and token.pixel = '1' then
          column_d1 <= column;
        end if;
        token_d1        <= token;
        token_d1.strobe <= token.strobe and not reset;
        row_d1          <= token_row;
        data_d1         <= token_data;

        -- Tokens are delayed by two clocks like the words of the row buffers.
        array_token        <= token_d1;
        array_token.strobe <= token_d1.strobe and not reset;
        -- While a band is gathered, the engine gets empty tokens for these pixels: they move its filters on
        -- and add nothing.
        array_token.pixel      <= token_d1.pixel and token_d1.band;
        array_token.line_first <= token_d1.line_first and token_d1.band;
        array_token.line_last  <= token_d1.line_last and token_d1.band;
        image_d2               <= token_d1.image;
        row_d2                 <= row_d1;
        data_d2                <= data_d1;
      end if;

    end process follow;

    row : for r in 0 to PARALLEL_ROWS - 1 generate

      signal stored : std_logic_vector(DATA_BITS - 1 downto 0);

    begin

      -- Stored rows are image lines; the token says whether the last row is; rows behind it are missing.
      array_image(r) <= '1' when r < row_d2 or (r = row_d2 and image_d2 = '1') else
                        '0';

      array_data((r + 1) * DATA_BITS - 1 downto r * DATA_BITS) <= stored when r < row_d2 else
                                                                  data_d2 when r = row_d2 else
                                                                  (others => '0');

      row_buffer : if r < PARALLEL_ROWS - 1 generate

        signal write_enable : std_logic;

      begin

        -- The band's last line goes to the engine as it comes and is not stored.
        write_enable <= token.strobe and token.pixel and not token.band when token_row = r else
                        '0';

        pixels : entity work.ram_simple_dual_port
          generic map (
            WIDTH => DATA_BITS,
            WORDS => 2 ** ADDRESS_BITS
          )
          port map (
            clk           => clk,
            write_enable  => write_enable,
            write_address => column,
            write_data    => token_data,
            read_address  => column,
            read_data     => stored
          );

      end generate row_buffer;

      live_row : if r = PARALLEL_ROWS - 1 generate
        stored <= (others => '0');
      end generate live_row;

    end generate row;

  end generate bands;

end architecture rtl;
