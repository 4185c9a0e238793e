-- SPDX-License-Identifier: Apache-2.0
-- Side information of the tokens and steps that go through a pass of moving sums.
--
-- Latency: LATENCY clocks; for what belongs to a step DELAY steps more. Throughput: one token each clock.
-- Equation: out_token_tag(t + LATENCY) = token_tag(t); out_step_tag holds the tag of DELAY steps before.

library ieee;
use ieee.std_logic_1164.all;

entity stage_tags is
  generic (
    -- Clocks of the pass.
    LATENCY : positive;
    -- Steps of the pass.
    DELAY : natural;
    -- Width of the side information of a step.
    STEP_TAG_BITS : positive;
    -- Width of the side information of a token.
    TOKEN_TAG_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Marks a token, and with it what belongs to it.
    strobe    : in    std_logic;
    token_tag : in    std_logic_vector(TOKEN_TAG_BITS - 1 downto 0);
    -- Marks the first token of a step, and with it what belongs to the step.
    step     : in    std_logic;
    step_tag : in    std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    -- The same behind the pass; out_step_tag holds until the next step.
    out_strobe    : out   std_logic;
    out_token_tag : out   std_logic_vector(TOKEN_TAG_BITS - 1 downto 0);
    out_step_tag  : out   std_logic_vector(STEP_TAG_BITS - 1 downto 0)
  );
end entity stage_tags;

architecture rtl of stage_tags is

  -- Bit 0 is the one that reset clears.
  signal token_in  : std_logic_vector(TOKEN_TAG_BITS downto 0);
  signal token_out : std_logic_vector(TOKEN_TAG_BITS downto 0);
  signal step_in   : std_logic_vector(STEP_TAG_BITS downto 0);
  signal step_2    : std_logic_vector(STEP_TAG_BITS downto 0);
  signal step_due  : std_logic_vector(STEP_TAG_BITS - 1 downto 0);

begin

  token_in      <= token_tag & strobe;
  out_strobe    <= token_out(0);
  out_token_tag <= token_out(TOKEN_TAG_BITS downto 1);

  tokens : entity work.tag_delay
    generic map (
      WIDTH  => TOKEN_TAG_BITS + 1,
      LENGTH => LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => token_in,
      delayed => token_out
    );

  -- The steps move on behind two registers, as their enable drives many.
  step_in <= step_tag & step;

  ahead_of_steps : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS + 1,
      LENGTH => 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => step_in,
      delayed => step_2
    );

  steps : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => DELAY + 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => step_2(0),
      tag     => step_2(STEP_TAG_BITS downto 1),
      delayed => step_due
    );

  behind_steps : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => LATENCY - 3
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => step_due,
      delayed => out_step_tag
    );

end architecture rtl;
