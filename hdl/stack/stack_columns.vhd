-- SPDX-License-Identifier: Apache-2.0
-- The column pass of a focal stack: one memory of pixels, and for each slice its moving sums.
--
-- Frames must begin at least output_delay + 1 lines apart, and a multiple of M lines; the sequencer appends flush
-- lines.
--
-- Latency: output_delay lines and STACK_COLUMN_LATENCY clocks. Throughput: one token each clock; one column comes at
-- least PARTIAL_SUM_LOOP clocks apart.
-- Equation: for each slice sum += entering pixel - leaving pixel; see sum_schedule_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;
use work.focal_stack_pkg.all;

entity stack_columns is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Longest line in pixels.
    COLUMNS : positive;
    -- Values of a token that have sums of their own: channels of its pixels.
    LANES : positive;
    -- Width of such a value.
    LANE_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token and its values.
    token : in    token_t;
    data  : in    std_logic_vector(LANES * LANE_BITS - 1 downto 0);
    -- The token behind the pass (token_path), and the sums, slice 0 in the low bits.
    out_token : out   token_t;
    out_data  : out   std_logic_vector(stack_sum_bits(GEOMETRY, LANES, LANE_BITS) - 1 downto 0)
  );
end entity stack_columns;

architecture rtl of stack_columns is

  constant M            : positive := GEOMETRY.micro_image_size;
  constant SLICES       : positive := GEOMETRY.slices;
  constant PIXEL_BITS   : positive := LANES * LANE_BITS;
  constant SUMS_BITS    : positive := LANES * column_sum_bits(M, LANE_BITS);
  constant COLUMN_BITS  : positive := bits_for(COLUMNS - 1);
  constant HISTORY_BITS : positive := history_word_bits(GEOMETRY, PIXEL_BITS);

  subtype phase_t is natural range 0 to larger(M - 1, 1);

  type phases_t is array (natural range 0 to SLICES - 1) of phase_t;

  type columns_t is array (1 to 3) of unsigned(COLUMN_BITS - 1 downto 0);

  type pixels_t is array (1 to 3) of std_logic_vector(PIXEL_BITS - 1 downto 0);

  -- active: the token has a pixel; step: the first pixel of its line.
  signal active : std_logic;
  signal step   : std_logic;
  -- The phase of the line. All slices have the same.
  signal phase_1 : phases_t;
  signal phase_2 : phase_t := 0;
  signal phase_3 : phase_t := 0;
  -- The pixels that come in, and the memory's word of the same column with the lines before, for all slices.
  signal pixel_at  : pixels_t := (others => (others => '0'));
  signal history_3 : std_logic_vector(HISTORY_BITS - 1 downto 0);

  signal active_at : std_logic_vector(1 to 3) := (others => '0');
  signal column_at : columns_t                := (others => (others => '0'));

begin

  active <= token.strobe and token.pixel;
  step   <= active and token.line_first;

  count_columns : process (clk) is
  begin

    if rising_edge(clk) then
      -- The column is counted here, because tokens carry none; empty tokens between pixels must not move it.
      if step = '1' then
        column_at(1) <= (others => '0');
      elsif active = '1' then
        column_at(1) <= column_at(1) + 1;
      end if;
      column_at(2 to 3) <= column_at(1 to 2);
      active_at         <= active & active_at(1 to 2);
      pixel_at(1)       <= data;
      pixel_at(2 to 3)  <= pixel_at(1 to 2);
      -- The phase counts lines modulo M, so all slices have the same: slice 0 provides it.
      phase_2 <= phase_1(0);
      phase_3 <= phase_2;
      if reset = '1' then
        active_at <= (others => '0');
      end if;
    end if;

  end process count_columns;

  -- One memory serves all slices, which differ only in the pixels that they take from its word.
  memory : entity work.line_history
    generic map (
      GEOMETRY   => GEOMETRY,
      COLUMNS    => COLUMNS,
      PIXEL_BITS => PIXEL_BITS
    )
    port map (
      clk      => clk,
      column   => column_at(1),
      active   => active_at(3),
      phase    => phase_3,
      column_2 => column_at(3),
      pixel    => pixel_at(3),
      history  => history_3
    );

  -- The large memory of pixels is shared. Each slice adds only an adder and a word for each column.
  slice : for s in 0 to SLICES - 1 generate

    sums : entity work.column_sum
      generic map (
        GEOMETRY  => GEOMETRY,
        SLICE     => s,
        COLUMNS   => COLUMNS,
        LANES     => LANES,
        LANE_BITS => LANE_BITS
      )
      port map (
        clk       => clk,
        reset     => reset,
        step      => step,
        first     => token.frame_first,
        live      => token.image,
        phase_1   => phase_1(s),
        column_2  => column_at(2),
        active_3  => active_at(3),
        pixel_3   => pixel_at(3),
        history_3 => history_3,
        sum       => out_data((s + 1) * SUMS_BITS - 1 downto s * SUMS_BITS)
      );

  end generate slice;

  -- All slices have the same delay, so one path of tokens serves all.
  path : entity work.token_path
    generic map (
      LATENCY => STACK_COLUMN_LATENCY,
      DELAY   => GEOMETRY.output_delay,
      COLUMNS => true
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      step      => step,
      out_token => out_token
    );

  -- Simulation stops if a frame comes too early: frames share the phases of the memory's lines, and a frame's
  -- first outputs follow the last outputs of the frame before. Marks without an image are left in the path of
  -- tokens by a reset and do not count.
  watch_frames : process (clk) is

    variable lines : integer := -1;

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      if reset = '1' then
        lines := -1;
      elsif step = '1' then
        assert not (token.frame_first = '1' and token.image = '1' and lines >= 0 and
                    (lines <= GEOMETRY.output_delay or lines mod M /= 0))
          report "stack_columns: frames begin too few lines apart, or no multiple of M lines"
          severity failure;
        if token.frame_first = '1' and token.image = '1' then
          lines := 1;
        elsif lines >= 0 then
          lines := lines + 1;
        end if;
      end if;
    end if;

  -- synthesis translate_on

  end process watch_frames;

end architecture rtl;
