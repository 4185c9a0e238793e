-- SPDX-License-Identifier: Apache-2.0
-- lane_stage for a proof: pixels of a bit each, by generics that a command can give.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;

entity lane_proof is
  generic (
    MICRO_IMAGE_SIZE : positive;
    SHIFTS           : string;
    PIXELS_PER_CLOCK : positive range 2 to 32;
    SUM_BITS         : positive
  );
  port (
    clk       : in    std_logic;
    reset     : in    std_logic;
    token     : in    token_t;
    data      : in    std_logic_vector(PIXELS_PER_CLOCK - 1 downto 0);
    tag       : in    std_logic_vector(0 downto 0);
    out_token : out   token_t;
    out_data  : out   std_logic_vector(PIXELS_PER_CLOCK * SUM_BITS - 1 downto 0);
    out_tag   : out   std_logic_vector(0 downto 0)
  );
end entity lane_proof;

architecture proof of lane_proof is

begin

  stage : entity work.lane_stage
    generic map (
      GEOMETRY         => geometry_of("lane_proof", MICRO_IMAGE_SIZE, SHIFTS, true),
      PIXELS_PER_CLOCK => PIXELS_PER_CLOCK,
      CHANNELS         => 1,
      DATA_BITS        => 1,
      SUM_BITS         => SUM_BITS
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
