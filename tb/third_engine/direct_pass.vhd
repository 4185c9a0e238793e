-- SPDX-License-Identifier: Apache-2.0
-- A pass of direct sums over rows or columns: the last pixels are remembered, and each output adds M of them.
--
-- Latency: output_delay steps and DIRECT_LATENCY clocks. Throughput: one token each clock.
-- Equation: out_data(k) = S(k).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;
use work.direct_pkg.all;

entity direct_pass is
  generic (
    -- Geometry of the slices; widths of the input and the sums.
    GEOMETRY : geometry_t;
    SIZES    : pass_t;
    -- true: a line is a step, and each of so many columns has pixels of its own.
    COLUMNS : boolean;
    DEPTH   : positive;
    -- Channels of a pixel.
    CHANNELS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token and its pixel.
    token : in    token_t;
    data  : in    std_logic_vector(CHANNELS * SIZES.data_bits - 1 downto 0);
    -- The token behind the pass, and its sums.
    out_token : out   token_t;
    out_data  : out   std_logic_vector(CHANNELS * SIZES.result_bits - 1 downto 0)
  );
end entity direct_pass;

architecture rtl of direct_pass is

  constant M     : positive := GEOMETRY.micro_image_size;
  constant STEPS : positive := direct_steps(GEOMETRY);
  constant BITS  : positive := CHANNELS * SIZES.data_bits;

  -- What is remembered of a step: whether it has a pixel, of which line (or frame), its phase and slice.
  type step_t is record
    there : std_logic;
    line  : unsigned(3 downto 0);
    phase : natural range 0 to 127;
    slice : natural range 0 to 255;
  end record step_t;

  constant NO_STEP : step_t := ('0', "0000", 0, 0);

  type steps_t is array (natural range 0 to STEPS - 1) of step_t;

  subtype word_t is std_logic_vector(STEPS * BITS - 1 downto 0);

  type words_t is array (natural range 0 to DEPTH - 1) of word_t;

  signal steps_at : steps_t                      := (others => NO_STEP);
  signal words    : words_t                      := (others => (others => '0'));
  signal word     : word_t                       := (others => '0');
  signal sums     : std_logic_vector(CHANNELS * SIZES.result_bits - 1 downto 0);
  signal column   : natural range 0 to DEPTH - 1 := 0;
  signal step     : std_logic;

begin

  step <= token.strobe and begins_line(token) when COLUMNS else
          token.strobe;

  remember : process (clk) is

    variable place : natural range 0 to DEPTH - 1;
    variable known : word_t;
    variable fresh : std_logic;
    variable now   : step_t;

  begin

    if rising_edge(clk) then
      if token.strobe = '1' and (token.pixel = '1' or not COLUMNS) then
        -- The pixels of this column, the newest in the low bits.
        place := 0;

        if COLUMNS and token.line_first = '0' then
          place := column;
        end if;

        known        := words(place)(word_t'high - BITS downto 0) & data;
        words(place) <= known;
        word         <= known;

        if place < DEPTH - 1 then
          column <= place + 1;
        end if;
      end if;

      if step = '1' then
        now       := steps_at(0);
        fresh     := begins_line(token);
        now.there := token.pixel;
        now.slice := to_integer(token.slice);

        if COLUMNS then
          fresh     := token.frame_first and token.image;
          now.there := token.image;
        end if;

        now.phase := (now.phase + 1) mod M;

        if fresh = '1' then
          now.phase := 0;
          now.line  := now.line + 1;
        end if;

        steps_at <= now & steps_at(0 to STEPS - 2);
      end if;
      if reset = '1' then
        steps_at <= (others => NO_STEP);
      end if;
    end if;

  end process remember;

  add : process (clk) is

    variable output : step_t;
    variable age    : natural range 0 to STEPS - 1;
    variable sum    : unsigned(SIZES.result_bits - 1 downto 0);

  begin

    if rising_edge(clk) then
      output := steps_at(GEOMETRY.output_delay);

      for c in 0 to CHANNELS - 1 loop

        sum := (others => '0');

        for p in 0 to M - 1 loop

          age := direct_age(GEOMETRY, output.slice, p, output.phase);

          if steps_at(age).there = '1' and steps_at(age).line = output.line then
            sum := sum + unsigned(word(age * BITS + (c + 1) * SIZES.data_bits - 1 downto
                                       age * BITS + c * SIZES.data_bits));
          end if;

        end loop;

        sums((c + 1) * SIZES.result_bits - 1 downto c * SIZES.result_bits) <= std_logic_vector(sum);

      end loop;

      out_data <= sums;
    end if;

  end process add;

  path : entity work.token_path
    generic map (
      LATENCY => DIRECT_LATENCY,
      DELAY   => GEOMETRY.output_delay,
      COLUMNS => COLUMNS
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      step      => step,
      out_token => out_token,
      out_tag   => open
    );

end architecture rtl;
