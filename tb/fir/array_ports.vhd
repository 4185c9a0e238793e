-- SPDX-License-Identifier: Apache-2.0
-- fir_array and its division with ports of plain vectors: simulators show no records to a test in Python.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.token_pkg.all;
use work.refocuser_pkg.all;

entity array_ports is
  generic (
    MICRO_IMAGE_SIZE    : positive := 1;
    SHIFTS              : string   := "1";
    CENTRED             : boolean  := true;
    INTERPOLATION_ORDER : natural  := 0;
    HOLD                : boolean  := false;
    PARALLEL_ROWS       : positive := 1;
    MAX_COLUMNS         : positive := 1;
    CHANNELS            : positive := 1;
    PIXEL_BITS          : positive := 8;
    EXACT               : boolean  := true;
    FRACTION_BITS       : natural  := 0;
    GUARD_BITS          : natural  := 0;
    BOX                 : string   := "";
    BROADCAST_TAPS      : natural  := 0
  );
  port (
    clk            : in    std_logic;
    reset          : in    std_logic;
    in_strobe      : in    std_logic;
    in_pixel       : in    std_logic;
    in_band_first  : in    std_logic;
    in_band_last   : in    std_logic;
    in_frame_first : in    std_logic;
    in_slice       : in    std_logic_vector(7 downto 0);
    in_image       : in    std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    in_data        : in    std_logic_vector(PARALLEL_ROWS * CHANNELS * PIXEL_BITS - 1 downto 0);
    out_valid      : out   std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    out_skip       : out   std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    out_start      : out   std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    out_last       : out   std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    out_slice      : out   std_logic_vector(PARALLEL_ROWS * 8 - 1 downto 0);
    out_data       : out   std_logic_vector(PARALLEL_ROWS * CHANNELS * PIXEL_BITS - 1 downto 0)
  );
end entity array_ports;

architecture test of array_ports is

  constant CORE : core_t := core_of
                            (
                              name                => "array_ports",
                              micro_image_size    => MICRO_IMAGE_SIZE,
                              shifts              => SHIFTS,
                              centred             => CENTRED,
                              interpolation_order => INTERPOLATION_ORDER,
                              hold                => HOLD,
                              parallel_rows       => PARALLEL_ROWS,
                              max_columns         => MAX_COLUMNS,
                              channels            => CHANNELS,
                              pixel_bits          => PIXEL_BITS,
                              exact               => EXACT,
                              fraction_bits       => FRACTION_BITS,
                              guard_bits          => GUARD_BITS,
                              broadcast_taps      => BROADCAST_TAPS,
                              box                 => BOX
                            );

  constant NO_WEIGHTS : std_logic_vector(weights_bits(CORE) - 1 downto 0) := (others => '0');

  signal token     : token_t;
  signal sum_token : tokens_t(0 to PARALLEL_ROWS - 1);
  signal sums      : std_logic_vector(PARALLEL_ROWS * row_sums_bits(CORE) - 1 downto 0);
  signal results   : results_t(0 to PARALLEL_ROWS - 1);

begin

  token.strobe      <= in_strobe;
  token.pixel       <= in_pixel;
  token.line_first  <= in_band_first;
  token.line_last   <= in_band_last;
  token.band        <= in_pixel;
  token.frame_first <= in_frame_first;
  token.image       <= in_image(0);
  token.slice       <= unsigned(in_slice);

  dut : entity work.fir_array
    generic map (
      CORE => CORE
    )
    port map (
      clk        => clk,
      reset      => reset,
      token      => token,
      token_rows => in_image,
      token_data => in_data,
      out_token  => sum_token,
      out_sums   => sums
    );

  tail : entity work.sum_tail
    generic map (
      CORE => CORE
    )
    port map (
      clk         => clk,
      reset       => reset,
      tokens      => sum_token,
      sums        => sums,
      line_end    => "1",
      weights     => NO_WEIGHTS,
      results     => results,
      result_data => out_data
    );

  row : for r in 0 to PARALLEL_ROWS - 1 generate
    out_valid(r) <= results(r).valid;
    out_skip(r)  <= results(r).skip;
    out_start(r) <= results(r).start;
    out_last(r)  <= results(r).last;

    out_slice(8 * r + 7 downto 8 * r) <= std_logic_vector(results(r).slice);
  end generate row;

end architecture test;
