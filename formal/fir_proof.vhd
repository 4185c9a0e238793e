-- SPDX-License-Identifier: Apache-2.0
-- fir_stage for a proof: exact sums of rows, by generics that a command can give.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;

entity fir_proof is
  generic (
    MICRO_IMAGE_SIZE : positive;
    SHIFTS           : string;
    HOLD             : boolean;
    DATA_BITS        : positive;
    RESULT_BITS      : positive
  );
  port (
    clk       : in    std_logic;
    reset     : in    std_logic;
    token     : in    token_t;
    data      : in    std_logic_vector(DATA_BITS - 1 downto 0);
    tag       : in    std_logic_vector(0 downto 0);
    out_token : out   token_t;
    out_data  : out   std_logic_vector(RESULT_BITS - 1 downto 0);
    out_tag   : out   std_logic_vector(0 downto 0)
  );
end entity fir_proof;

architecture proof of fir_proof is

begin

  stage : entity work.fir_stage
    generic map (
      GEOMETRY       => geometry_of("fir_proof", MICRO_IMAGE_SIZE, SHIFTS, true),
      SIZES          => exact_pass(2 ** DATA_BITS - 1, MICRO_IMAGE_SIZE),
      HOLD           => HOLD,
      LANES          => 1,
      BROADCAST_TAPS => 0
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      data      => data,
      tag       => tag,
      out_token => out_token,
      out_data  => out_data,
      out_tag   => out_tag
    );

end architecture proof;
