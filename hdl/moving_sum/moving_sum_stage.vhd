-- SPDX-License-Identifier: Apache-2.0
-- A pass of the refocusing operator over rows or columns: re-ordering and moving sum.
--
--   data -> stored product -> ring of pixels (rows) or lines (columns) -> adder -> rounding -> out_data
--                                    control (which pixels, when)
--
-- Pixels are kept until they have left the sum, those of each phase (index mod M) only as long as their age
-- requires. At each step one pixel enters the sum and one leaves it, whatever M and the shifts are. For rows a step
-- is a token; for columns (COLUMNS) a step is a line. With DEPTH = 1 a line of columns has one pixel, that of its
-- first token.
--
-- Lines (for columns: frames) must begin at least output_delay + 1 steps apart. A frame takes as many lines as it
-- has, rounded up to a multiple of M; with ANY_ROWS it takes as many as it has, at least least_frame. The sequencer
-- appends flush lines.
--
-- Latency: output_delay steps and sum_stage_latency clocks. Throughput: one token each clock; with DEPTH > 1 one
-- column comes at least PARTIAL_SUM_LOOP clocks apart.
-- Equation: sum += entering pixel - leaving pixel; see sum_schedule_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;

entity moving_sum_stage is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Widths and largest values of the input, the sums and the output.
    SIZES : pass_t;
    -- true: the stage filters columns.
    COLUMNS : boolean := false;
    -- Columns only; true: frames of any number of lines follow each other without a gap.
    ANY_ROWS : boolean := false;
    -- Rows only: the slice, if it is always the same; -1: the slice of the token.
    FIXED_SLICE : integer := -1;
    -- 1 for rows, the longest line for columns.
    DEPTH : positive := 1;
    -- Values of a token that have sums of their own: channels of its pixels.
    LANES : positive := 1;
    -- Width of the tag that goes with a step.
    TAG_BITS : positive := 1
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, its values, and a tag that goes with the step.
    token : in    token_t;
    data  : in    std_logic_vector(LANES * SIZES.data_bits - 1 downto 0);
    tag   : in    std_logic_vector(TAG_BITS - 1 downto 0) := (others => '0');
    -- The token behind the stage (token_path), its values and its tag.
    out_token : out   token_t;
    out_data  : out   std_logic_vector(LANES * SIZES.result_bits - 1 downto 0);
    out_tag   : out   std_logic_vector(TAG_BITS - 1 downto 0)
  );
end entity moving_sum_stage;

architecture rtl of moving_sum_stage is

  constant M            : positive := GEOMETRY.micro_image_size;
  constant REACHED      : positive := reach(GEOMETRY);
  constant PRODUCT_BITS : positive := bits_for(SIZES.product_max);
  constant RESULT_BITS  : positive := SIZES.result_bits;
  constant SUM_BITS     : positive := bits_for(SIZES.sum_max);
  constant PIXEL_BITS   : positive := LANES * PRODUCT_BITS;
  constant SLICE_BITS   : positive := bits_for(GEOMETRY.slices - 1);

  -- Clocks from a token to the addresses of the memory, and to its words. Ages come from a table and are compared
  -- a clock later; pixels wait as long in front of the memory.
  constant ADDRESSED : positive := 5;
  constant READ      : positive := ADDRESSED + choose(DEPTH > 1, 3, 2);

  subtype pixels_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

  type pixels_list_t is array (natural range <>) of pixels_t;

  type products_t is array (natural range <>) of std_logic_vector(PRODUCT_BITS - 1 downto 0);

  type choices_t is array (3 to READ) of pixel_choice_t;

  type commands_t is array (3 to READ) of sum_command_t;

  type columns_t is array (3 to READ) of unsigned(bits_for(DEPTH - 1) - 1 downto 0);

  -- The token as the filter sees it. pixel: it has a pixel of a line; step: it begins a step; first: it begins a
  -- line (for columns a frame); live: the step belongs to the line.
  signal pixel : std_logic;
  signal step  : std_logic;
  signal first : std_logic;
  signal live  : std_logic;
  signal slice : unsigned(SLICE_BITS - 1 downto 0);

  -- Outputs of moving_sum_control.
  signal ring       : ring_control_t;
  signal age_3      : natural range 0 to REACHED;
  signal left_age_3 : natural range 0 to REACHED;

  -- step_at: the token begins a step; active_at: the filter works on it; from 3 clocks on its effect on the sums,
  -- and its column.
  signal step_at    : std_logic_vector(0 to 3)    := (others => '0');
  signal active_at  : std_logic_vector(0 to READ) := (others => '0');
  signal choice_at  : choices_t                   := (others => NO_PIXELS);
  signal command_at : commands_t                  := (others => NO_COMMAND);
  signal column_at  : columns_t                   := (others => (others => '0'));

  -- Pixels of the token, from the memory's addresses to its words; pixels that enter and leave.
  signal pixels_at  : pixels_list_t(ADDRESSED to READ) := (others => (others => '0'));
  signal read_enter : pixels_t;
  signal read_leave : pixels_t;
  signal entering   : pixels_t;
  signal leaving    : pixels_t;
  signal sums       : std_logic_vector(LANES * SUM_BITS - 1 downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Scales pixels, and delays them until the control has decided.

  lane : for i in 0 to LANES - 1 generate

    signal value : std_logic_vector(SIZES.data_bits - 1 downto 0);

  begin

    value <= data((i + 1) * SIZES.data_bits - 1 downto i * SIZES.data_bits);

    stored_products : if SIZES.stored generate

      signal product_at : products_t(1 to ADDRESSED) := (others => (others => '0'));
      signal sum        : std_logic_vector(SUM_BITS - 1 downto 0);

    begin

      product_rom : entity work.stored_product
        generic map (
          VALUE_BITS   => SIZES.data_bits,
          PRODUCT_BITS => PRODUCT_BITS,
          SCALE_BITS   => SIZES.scale_bits,
          DIVISOR      => SIZES.box
        )
        port map (
          clk     => clk,
          value   => value,
          product => product_at(1)
        );

      -- One clock less than for plain values, because the table of products takes one.
      delay_product : process (clk) is
      begin

        if rising_edge(clk) then
          product_at(2 to ADDRESSED) <= product_at(1 to ADDRESSED - 1);
        end if;

      end process delay_product;

      pixels_at(ADDRESSED)((i + 1) * PRODUCT_BITS - 1 downto i * PRODUCT_BITS) <= product_at(ADDRESSED);

      sum <= sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS);

      round_sum : process (clk) is
      begin

        if rising_edge(clk) then
          out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS) <= rounded(sum, SIZES.drop_bits, RESULT_BITS);
        end if;

      end process round_sum;

    end generate stored_products;

    plain_values : if not SIZES.stored generate

      signal value_at : products_t(1 to ADDRESSED) := (others => (others => '0'));

    begin

      -- Pixels wait in front of the memory for the addresses of the pixels that leave, so that the memory is
      -- written and read at one place of the pipeline.
      delay_value : process (clk) is
      begin

        if rising_edge(clk) then
          value_at(1)              <= value;
          value_at(2 to ADDRESSED) <= value_at(1 to ADDRESSED - 1);
        end if;

      end process delay_value;

      pixels_at(ADDRESSED)((i + 1) * PRODUCT_BITS - 1 downto i * PRODUCT_BITS) <= value_at(ADDRESSED);

      out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS) <= sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS);

    end generate plain_values;

  end generate lane;

  --------------------------------------------------------------------------------------------------
  -- The control's signals for tokens.

  row_tokens : if not COLUMNS generate
    -- For rows every token is a step. For columns a line is a step and begins with its first token, and a frame
    -- takes the place of a line.
    pixel <= '1';
    step  <= token.strobe;
    first <= begins_line(token);
    live  <= token.pixel;
  end generate row_tokens;

  column_tokens : if COLUMNS generate
    pixel <= token.pixel when DEPTH > 1 else
             begins_line(token);
    step  <= token.strobe and begins_line(token);
    first <= token.frame_first;
    live  <= token.image;
  end generate column_tokens;

  slice <= (others => '0') when GEOMETRY.slices = 1 else
           token.slice(SLICE_BITS - 1 downto 0);

  -- The control looks at a step three clocks ahead of its pixels: ages come from a table and are compared behind a
  -- register.
  control : entity work.moving_sum_control
    generic map (
      GEOMETRY    => GEOMETRY,
      FIXED_SLICE => FIXED_SLICE
    )
    port map (
      clk        => clk,
      reset      => reset,
      advance    => step,
      first      => first,
      live       => live,
      slice      => slice,
      ring       => ring,
      age_3      => age_3,
      left_age_3 => left_age_3,
      choice_3   => choice_at(3),
      command_3  => command_at(3)
    );

  step_at(0)   <= step;
  active_at(0) <= token.strobe and pixel;
  -- The column is counted three clocks behind the token, where the memory of the sums is addressed.
  column_at(3) <= (others => '0') when step_at(3) = '1' else
                  column_at(4) + 1 when active_at(3) = '1' else
                  column_at(4);

  delay : process (clk) is
  begin

    if rising_edge(clk) then
      step_at(1 to 3)      <= step_at(0 to 2);
      active_at(1 to READ) <= active_at(0 to READ - 1);
      -- A step's choice holds for all its tokens, so these registers copy the control's outputs when each token passes.
      choice_at(4 to READ)  <= choice_at(3 to READ - 1);
      command_at(4 to READ) <= command_at(3 to READ - 1);
      column_at(4 to READ)  <= column_at(3 to READ - 1);

      pixels_at(ADDRESSED + 1 to READ) <= pixels_at(ADDRESSED to READ - 1);

      if reset = '1' then
        active_at(1 to READ) <= (others => '0');
      end if;
    end if;

  end process delay;

  --------------------------------------------------------------------------------------------------
  -- The memory of the pixels in use, and the choice of those that change the sums.

  -- A row has few pixels in use, which fit distributed RAM or a shift register.
  one_column : if DEPTH = 1 generate

    pixels : entity work.pixel_ring
      generic map (
        GEOMETRY => GEOMETRY,
        WIDTH    => PIXEL_BITS
      )
      port map (
        clk      => clk,
        age      => age_3,
        left_age => left_age_3,
        active   => active_at(ADDRESSED),
        pixel    => pixels_at(ADDRESSED),
        entering => read_enter,
        leaving  => read_leave
      );

  end generate one_column;

  -- Lines of pixels go to block RAM, one word for each column.
  many_columns : if DEPTH > 1 generate

    lines : entity work.line_ring
      generic map (
        GEOMETRY => GEOMETRY,
        ANY_ROWS => ANY_ROWS,
        COLUMNS  => DEPTH,
        WIDTH    => PIXEL_BITS
      )
      port map (
        clk        => clk,
        reset      => reset,
        control    => ring,
        column_4   => column_at(4),
        active_5   => active_at(ADDRESSED),
        pixel_5    => pixels_at(ADDRESSED),
        entering_8 => read_enter,
        leaving_8  => read_leave
      );

  end generate many_columns;

  -- A pixel that enters with its own token is not in the memory yet and goes past it. Pixels that do not enter or
  -- leave are set to zero in front of the adder's register.
  entering <= (others => '0') when choice_at(READ).enter = '0' else
              pixels_at(READ) when choice_at(READ).enter_now = '1' else
              read_enter;
  leaving  <= read_leave when choice_at(READ).leave = '1' else
              (others => '0');

  adder : entity work.moving_sum_adder
    generic map (
      COLUMNS      => DEPTH,
      LANES        => LANES,
      PIXEL_BITS   => PRODUCT_BITS,
      SUM_BITS     => SUM_BITS,
      WITH_LEAVING => pixels_leave(GEOMETRY),
      HOLDING      => holds_outputs(GEOMETRY),
      SPLIT        => begins_within_group(GEOMETRY)
    )
    port map (
      clk      => clk,
      reset    => reset,
      column   => column_at(READ - 2),
      active   => active_at(READ),
      command  => command_at(READ),
      own      => pixels_at(READ),
      entering => entering,
      leaving  => leaving,
      sums     => sums
    );

  path : entity work.token_path
    generic map (
      LATENCY  => sum_stage_latency(SIZES.stored, DEPTH),
      DELAY    => GEOMETRY.output_delay,
      COLUMNS  => COLUMNS,
      TAG_BITS => TAG_BITS
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      step      => step,
      tag       => tag,
      out_token => out_token,
      out_tag   => out_tag
    );

end architecture rtl;
