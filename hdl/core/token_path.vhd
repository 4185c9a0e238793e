-- SPDX-License-Identifier: Apache-2.0
-- Delays the tokens of a stage as the stage delays their pixels.
--
-- A stage answers a token LATENCY clocks later with the output that belongs to the token DELAY steps before. So
-- strobe is delayed by clocks alone, and all fields that describe a pixel by DELAY steps more. In a row stage every
-- token is a step. In a column stage a line is a step: the fields of a pixel keep their place in the line, and the
-- fields of the line are delayed by DELAY lines.
--
-- Latency: LATENCY clocks; for fields that go by steps DELAY steps more. Throughput: one token each clock.
-- Equation: out_token(t + LATENCY).strobe = token(t).strobe; the other fields are those of DELAY steps before.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.token_pkg.all;

entity token_path is
  generic (
    -- Clocks of the stage.
    LATENCY : positive range 3 to 1023;
    -- Steps of the stage.
    DELAY : natural;
    -- true: a line is a step, so only the fields of a line are delayed by steps.
    COLUMNS : boolean := false;
    -- Width of the tag that goes with a step.
    TAG_BITS : positive := 1
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- token; and step: whether the token begins a step.
    token : in    token_t;
    step  : in    std_logic;
    -- A tag that goes with the step, read with the step's first token.
    tag : in    std_logic_vector(TAG_BITS - 1 downto 0) := (others => '0');
    -- Token and tag behind the stage; fields that go by steps hold until the next step.
    out_token : out   token_t;
    out_tag   : out   std_logic_vector(TAG_BITS - 1 downto 0)
  );
end entity token_path;

architecture rtl of token_path is

  -- The memory of steps is moved two registers later: its enable drives many flip-flops and so has a clock to reach
  -- them. One step more than DELAY compensates for the register that the memory itself is.
  constant AHEAD  : positive := 2;
  constant STEPS  : positive := AHEAD + DELAY + 1;
  constant BEHIND : natural  := LATENCY - AHEAD - 1;
  constant LAST   : positive := STEPS + BEHIND;

  type tags_t is array (natural range <>) of std_logic_vector(TAG_BITS - 1 downto 0);

  -- These fields are delayed by clocks.
  signal strobe_at     : std_logic_vector(0 to LATENCY) := (others => '0');
  signal pixel_at      : std_logic_vector(0 to LATENCY) := (others => '0');
  signal line_first_at : std_logic_vector(0 to LATENCY) := (others => '0');
  signal line_last_at  : std_logic_vector(0 to LATENCY) := (others => '0');
  signal step_at       : std_logic_vector(0 to AHEAD)   := (others => '0');

  -- These fields are delayed by steps. Whole tokens are kept, because synthesis drops fields that nobody reads.
  signal token_at : tokens_t(1 to LAST) := (others => NO_TOKEN);
  signal tag_at   : tags_t(1 to LAST)   := (others => (others => '0'));

begin

  strobe_at(0)     <= token.strobe;
  pixel_at(0)      <= token.pixel;
  line_first_at(0) <= token.line_first;
  line_last_at(0)  <= token.line_last;
  step_at(0)       <= step;

  move : process (clk) is
  begin

    if rising_edge(clk) then
      strobe_at(1 to LATENCY)     <= strobe_at(0 to LATENCY - 1);
      pixel_at(1 to LATENCY)      <= pixel_at(0 to LATENCY - 1);
      line_first_at(1 to LATENCY) <= line_first_at(0 to LATENCY - 1);
      line_last_at(1 to LATENCY)  <= line_last_at(0 to LATENCY - 1);
      step_at(1 to AHEAD)         <= step_at(0 to AHEAD - 1);

      token_at(1) <= token;
      tag_at(1)   <= tag;

      for i in 2 to LAST loop

        if i <= AHEAD or i > STEPS or step_at(AHEAD) = '1' then
          token_at(i) <= token_at(i - 1);
          tag_at(i)   <= tag_at(i - 1);
        end if;

      end loop;

      -- The reset clears only the field that validates all others, because shift registers in LUTs have no reset.
      if reset = '1' then
        strobe_at(1 to LATENCY) <= (others => '0');
        step_at(1 to AHEAD)     <= (others => '0');

        for i in AHEAD + 1 to LAST loop

          if COLUMNS then
            token_at(i).image <= '0';
          else
            token_at(i).pixel <= '0';
          end if;

        end loop;

      end if;
    end if;

  end process move;

  tokens_are_steps : if not COLUMNS generate

    hold : process (token_at, strobe_at) is
    begin

      out_token        <= token_at(LAST);
      out_token.strobe <= strobe_at(LATENCY);

    end process hold;

  end generate tokens_are_steps;

  lines_are_steps : if COLUMNS generate

    gather : process (token_at, strobe_at, pixel_at, line_first_at, line_last_at) is
    begin

      out_token            <= token_at(LAST);
      out_token.strobe     <= strobe_at(LATENCY);
      out_token.pixel      <= pixel_at(LATENCY);
      out_token.line_first <= line_first_at(LATENCY);
      out_token.line_last  <= line_last_at(LATENCY);

    end process gather;

  end generate lines_are_steps;

  out_tag <= tag_at(LAST);

end architecture rtl;
