-- SPDX-License-Identifier: Apache-2.0
-- The way back from the column modules of fir_array to rows of results.
--
-- Module m gives the sums of its columns, row after row, one token after module m - 1. Multiplexers put the rows
-- together again; each comes one token after the row above it. The side information of columns is delayed along
-- with the rows, and each row keeps the side information of its line through the band.
--
-- Latency: row r comes r tokens later, with DESKEW all rows N - 1 tokens later. Throughput: one word of sums of each
--   row each clock.
-- Equation: row_sums(row r, token t) = module_sums(module c(t - r), token t), c the number of the column mod N.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.token_pkg.all;

entity row_results is
  generic (
    -- N.
    PARALLEL_ROWS : positive;
    -- Bits of a slice that may differ from zero.
    SLICE_BITS : positive;
    -- Width of the sums of a pixel, all channels.
    SUM_BITS : positive;
    -- Whether all rows of a column come out with the same token.
    DESKEW : boolean
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token of module 0.
    strobe : in    std_logic;
    -- It is a pixel, in the first or last column of its band.
    pixel      : in    std_logic;
    band_first : in    std_logic;
    band_last  : in    std_logic;
    -- The line of row t of a band, with the t-th token of the band: it belongs to the image, to the first band of
    -- a frame, and to this slice.
    image       : in    std_logic;
    frame_first : in    std_logic;
    slice       : in    std_logic_vector(SLICE_BITS - 1 downto 0);
    -- The sums of each module, module 0 in the low bits.
    module_sums : in    std_logic_vector(PARALLEL_ROWS * SUM_BITS - 1 downto 0);
    -- The results of each row, and their sums, row 0 in the low bits.
    results  : out   results_t(0 to PARALLEL_ROWS - 1);
    row_sums : out   std_logic_vector(PARALLEL_ROWS * SUM_BITS - 1 downto 0)
  );
end entity row_results;

architecture rtl of row_results is

  -- Side information of a column; bit 0 is the one that reset clears.
  constant PIXEL_BIT   : natural := 0;
  constant FIRST_BIT   : natural := 1;
  constant LAST_BIT    : natural := 2;
  constant COLUMN_BITS : natural := 3;

  -- Side information of a line.
  constant IMAGE_BIT : natural := 0;
  constant FRAME_BIT : natural := 1;
  constant SLICE_LOW : natural := 2;

  subtype line_tag_t is std_logic_vector(SLICE_LOW + SLICE_BITS - 1 downto 0);

  -- A result with its sums: used marks pixels of image lines, and with skip the first column of other lines.
  -- Bit 0 is the one that reset clears.
  constant USED_BIT         : natural := 0;
  constant SKIP_BIT         : natural := 1;
  constant RESULT_LAST_BIT  : natural := 2;
  constant START_BIT        : natural := 3;
  constant RESULT_SLICE_LOW : natural := 4;
  constant DATA_LOW         : natural := RESULT_SLICE_LOW + SLICE_BITS;
  constant RESULT_BITS      : natural := DATA_LOW + SUM_BITS;

  -- Columns come back a token apart from module to module; counted from a band's first one they go to their rows.
  signal starts    : std_logic;
  signal count     : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
  signal summed    : std_logic_vector(PARALLEL_ROWS * SUM_BITS - 1 downto 0);
  signal raw_tags  : std_logic_vector(PARALLEL_ROWS * COLUMN_BITS - 1 downto 0);
  signal skew_tags : std_logic_vector(PARALLEL_ROWS * COLUMN_BITS - 1 downto 0);
  signal line_tag  : line_tag_t;
  -- Results of the rows, a token apart, and all of a column together.
  signal skewed  : std_logic_vector(PARALLEL_ROWS * RESULT_BITS - 1 downto 0);
  signal aligned : std_logic_vector(PARALLEL_ROWS * RESULT_BITS - 1 downto 0);

begin

  starts   <= pixel and band_first;
  line_tag <= slice & frame_first & image;

  count_columns : entity work.pixel_counter
    generic map (
      MODULUS => PARALLEL_ROWS
    )
    port map (
      clk     => clk,
      strobe  => strobe,
      restart => starts,
      count   => count
    );

  multiplex : entity work.lane_exchange
    generic map (
      LANES => PARALLEL_ROWS,
      WIDTH => SUM_BITS
    )
    port map (
      clk      => clk,
      strobe   => strobe,
      count    => count,
      data_in  => module_sums,
      data_out => summed
    );

  every_row_tag : for r in 0 to PARALLEL_ROWS - 1 generate
    raw_tags((r + 1) * COLUMN_BITS - 1 downto r * COLUMN_BITS) <= band_last & band_first & pixel;
  end generate every_row_tag;

  skew_tags_of_rows : entity work.lane_skew
    generic map (
      LANES    => PARALLEL_ROWS,
      WIDTH    => COLUMN_BITS,
      REVERSED => false
    )
    port map (
      clk      => clk,
      reset    => reset,
      enable   => strobe,
      data_in  => raw_tags,
      data_out => skew_tags
    );

  row_result : for r in 0 to PARALLEL_ROWS - 1 generate

    signal column_tag : std_logic_vector(COLUMN_BITS - 1 downto 0);
    signal begins     : std_logic;
    signal line_held  : line_tag_t := (others => '0');
    signal line_now   : line_tag_t;
    signal result     : std_logic_vector(RESULT_BITS - 1 downto 0);

  begin

    column_tag <= skew_tags((r + 1) * COLUMN_BITS - 1 downto r * COLUMN_BITS);
    begins     <= column_tag(PIXEL_BIT) and column_tag(FIRST_BIT);
    line_now   <= line_tag when begins = '1' else
                  line_held;

    hold_line : process (clk) is
    begin

      if rising_edge(clk) then
        if strobe = '1' then
          line_held <= line_now;
        end if;
      end if;

    end process hold_line;

    result(USED_BIT)        <= column_tag(PIXEL_BIT) and (line_now(IMAGE_BIT) or column_tag(FIRST_BIT));
    result(SKIP_BIT)        <= not line_now(IMAGE_BIT);
    result(RESULT_LAST_BIT) <= column_tag(LAST_BIT);
    result(START_BIT)       <= begins and line_now(FRAME_BIT);

    result(DATA_LOW - 1 downto RESULT_SLICE_LOW) <= line_now(line_tag_t'high downto SLICE_LOW);
    result(RESULT_BITS - 1 downto DATA_LOW)      <= summed((r + 1) * SUM_BITS - 1 downto r * SUM_BITS);

    skewed((r + 1) * RESULT_BITS - 1 downto r * RESULT_BITS) <= result;

  end generate row_result;

  skewed_results : if not DESKEW generate
    aligned <= skewed;
  end generate skewed_results;

  deskewed_results : if DESKEW generate

    deskew_rows : entity work.lane_skew
      generic map (
        LANES    => PARALLEL_ROWS,
        WIDTH    => RESULT_BITS,
        REVERSED => true
      )
      port map (
        clk      => clk,
        reset    => reset,
        enable   => strobe,
        data_in  => skewed,
        data_out => aligned
      );

  end generate deskewed_results;

  row_out : for r in 0 to PARALLEL_ROWS - 1 generate

    signal result : std_logic_vector(RESULT_BITS - 1 downto 0);
    signal used   : std_logic;

  begin

    result <= aligned((r + 1) * RESULT_BITS - 1 downto r * RESULT_BITS);
    used   <= result(USED_BIT) and strobe;

    results(r).valid <= used and not result(SKIP_BIT);
    results(r).skip  <= used and result(SKIP_BIT);
    results(r).last  <= result(RESULT_LAST_BIT);
    results(r).start <= result(START_BIT);
    results(r).slice <= resize(unsigned(result(DATA_LOW - 1 downto RESULT_SLICE_LOW)), slice_t'length);

    row_sums((r + 1) * SUM_BITS - 1 downto r * SUM_BITS) <= result(RESULT_BITS - 1 downto DATA_LOW);

  end generate row_out;

end architecture rtl;
