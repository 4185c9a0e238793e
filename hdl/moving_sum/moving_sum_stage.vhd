-- SPDX-License-Identifier: Apache-2.0
-- A pass of the refocusing operator over rows or columns: re-ordering and moving sum.
--
--   data -> stored product -> ring of pixels (rows) or lines (columns) -> adder -> rounding -> out_data
--                                    control (which pixels, when)
--
-- The pixels themselves are kept until they have left the sum, each phase (index mod M) for only as long
-- as its age says; the sum takes one pixel in and gives one back at each step, whatever M and a' are.
-- DEPTH = 1 filters rows, a token being a step; DEPTH > 1 filters columns, a line being a step.
--
-- Lines (for columns: frames) must begin output_delay + 1 steps apart, frames as many lines as they have, rounded up
-- to a multiple of M; with ANY_ROWS least_frame lines, or as many as they have. The sequencer appends empty ones.
--
-- Latency: output_delay steps and sum_stage_latency clocks. Throughput: one token each clock; with DEPTH > 1
--   the same column comes again PARTIAL_SUM_LOOP clocks later at the earliest.
-- Equation: sum += entering pixel - leaving pixel; see sum_schedule_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;

entity moving_sum_stage is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- The slices: a' of each in pixels, with blanks in between.
    SHIFTS : string;
    -- Whether the picture stays put from slice to slice.
    CENTRED : boolean;
    -- Columns only: whether frames of any number of lines follow each other without a gap.
    ANY_ROWS : boolean := false;
    -- Rows only: the slice, if it is always the same; -1: `slice`.
    FIXED_SLICE : integer := -1;
    -- 1 for rows, the longest line for columns.
    DEPTH : positive;
    -- Pixels of a token.
    LANES : positive;
    -- Width of a lane of the input.
    DATA_BITS : positive;
    -- Whether the input is multiplied by stored products.
    STORED : boolean;
    -- Stored products: fraction bits of the products above those of the input.
    SCALE_BITS : natural;
    -- Largest input of the sums.
    PRODUCT_MAX : natural;
    -- Largest sum: M times the largest input.
    SUM_MAX : positive;
    -- Stored products: fraction bits to drop from the sums.
    DROP_BITS : natural;
    -- Width of a lane of the output.
    RESULT_BITS : positive;
    -- Width of the side information of a step.
    STEP_TAG_BITS : positive;
    -- Width of the side information of a token.
    TOKEN_TAG_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Marks a token, and those that the filter works on.
    strobe : in    std_logic;
    pixel  : in    std_logic;
    -- Marks a token that begins a step, and with it the first step of a line.
    advance : in    std_logic;
    first   : in    std_logic;
    -- Slice of the line, read with its first step.
    slice : in    unsigned(bits_for(slice_count(SHIFTS) - 1) - 1 downto 0);
    -- The lanes.
    data : in    std_logic_vector(LANES * DATA_BITS - 1 downto 0);
    -- Side information of a step, taken with advance; bit 0 marks steps with a pixel of the line (the image).
    step_tag : in    std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    -- Side information of a token.
    token_tag  : in    std_logic_vector(TOKEN_TAG_BITS - 1 downto 0);
    out_strobe : out   std_logic;
    out_data   : out   std_logic_vector(LANES * RESULT_BITS - 1 downto 0);
    -- The tag of output_delay steps before; it holds until the next step.
    out_step_tag  : out   std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    out_token_tag : out   std_logic_vector(TOKEN_TAG_BITS - 1 downto 0)
  );
end entity moving_sum_stage;

architecture rtl of moving_sum_stage is

  constant GEOMETRY : geometry_t := geometry_of("moving_sum_stage", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  constant M            : positive := MICRO_IMAGE_SIZE;
  constant REACHED      : positive := reach(GEOMETRY);
  constant PRODUCT_BITS : positive := bits_for(PRODUCT_MAX);
  constant SUM_BITS     : positive := bits_for(SUM_MAX);
  constant PIXEL_BITS   : positive := LANES * PRODUCT_BITS;

  -- Clocks from a token to the addresses of the memory, and to its words.
  constant ADDRESSED : positive := 5;
  constant READ      : positive := ADDRESSED + choose(DEPTH > 1, 3, 2);

  subtype pixels_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

  type choices_t is array (3 to READ) of pixel_choice_t;

  type commands_t is array (3 to READ) of sum_command_t;

  type columns_t is array (3 to READ) of unsigned(bits_for(DEPTH - 1) - 1 downto 0);

  -- Of the control; clocks behind a token are part of the names.
  signal step          : std_logic;
  signal step_1        : std_logic;
  signal phase_1       : natural range 0 to larger(M - 1, 1);
  signal first_1       : std_logic;
  signal live_1        : std_logic;
  signal take_1        : std_logic;
  signal slice_1       : unsigned(slice'range);
  signal enter_phase_2 : natural range 0 to larger(M - 1, 1);
  signal moves_3       : std_logic;
  signal age_3         : natural range 0 to REACHED;

  -- A token from 3 clocks behind it on: whether the filter works on it, what it does, its column.
  signal token_tag_0 : std_logic_vector(1 downto 0);
  signal token_tag_3 : std_logic_vector(1 downto 0);
  signal active_at   : std_logic_vector(3 to READ) := (others => '0');
  signal choice_at   : choices_t                   := (others => NO_PIXELS);
  signal command_at  : commands_t                  := (others => NO_COMMAND);
  signal column_at   : columns_t                   := (others => (others => '0'));

  -- Its pixels, with the addresses and with the words of the memory; those that enter and leave.
  signal pixels_5   : pixels_t;
  signal own        : pixels_t;
  signal read_enter : pixels_t;
  signal read_leave : pixels_t;
  signal entering   : pixels_t;
  signal leaving    : pixels_t;
  signal sums       : std_logic_vector(LANES * SUM_BITS - 1 downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Scaling, and the delay until the control knows.

  lane : for i in 0 to LANES - 1 generate

    signal value : std_logic_vector(DATA_BITS - 1 downto 0);

  begin

    value <= data((i + 1) * DATA_BITS - 1 downto i * DATA_BITS);

    stored_products : if STORED generate

      signal product : std_logic_vector(PRODUCT_BITS - 1 downto 0);

    begin

      product_rom : entity work.stored_product
        generic map (
          VALUE_BITS   => DATA_BITS,
          PRODUCT_BITS => PRODUCT_BITS,
          SCALE_BITS   => SCALE_BITS,
          DIVISOR      => MICRO_IMAGE_SIZE
        )
        port map (
          clk     => clk,
          value   => value,
          product => product
        );

      delay_product : entity work.tag_delay
        generic map (
          WIDTH  => PRODUCT_BITS,
          LENGTH => ADDRESSED - 1
        )
        port map (
          clk     => clk,
          tag     => product,
          delayed => pixels_5((i + 1) * PRODUCT_BITS - 1 downto i * PRODUCT_BITS)
        );

      round_sum : entity work.round_saturate
        generic map (
          VALUE_MAX   => SUM_MAX,
          DROP_BITS   => DROP_BITS,
          RESULT_BITS => RESULT_BITS
        )
        port map (
          clk    => clk,
          value  => sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS),
          result => out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS)
        );

    end generate stored_products;

    plain_values : if not STORED generate

      delay_value : entity work.tag_delay
        generic map (
          WIDTH  => DATA_BITS,
          LENGTH => ADDRESSED
        )
        port map (
          clk     => clk,
          tag     => value,
          delayed => pixels_5((i + 1) * PRODUCT_BITS - 1 downto i * PRODUCT_BITS)
        );

      out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS) <= sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS);

    end generate plain_values;

  end generate lane;

  --------------------------------------------------------------------------------------------------
  -- What a token does.

  step <= strobe and advance;

  control : entity work.moving_sum_control
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      REACHED          => REACHED,
      FIXED_SLICE      => FIXED_SLICE
    )
    port map (
      clk           => clk,
      reset         => reset,
      advance       => step,
      first         => first,
      live          => step_tag(0),
      slice         => slice,
      step_1        => step_1,
      phase_1       => phase_1,
      first_1       => first_1,
      live_1        => live_1,
      take_1        => take_1,
      slice_1       => slice_1,
      enter_phase_2 => enter_phase_2,
      moves_3       => moves_3,
      age_3         => age_3,
      choice_3      => choice_at(3),
      command_3     => command_at(3)
    );

  -- Bit 0 is the one that reset clears.
  token_tag_0 <= step & (strobe and pixel);

  delay_token : entity work.tag_delay
    generic map (
      WIDTH  => 2,
      LENGTH => 3
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => token_tag_0,
      delayed => token_tag_3
    );

  active_at(3) <= token_tag_3(0);
  column_at(3) <= (others => '0') when token_tag_3(1) = '1' else
                  column_at(4) + 1 when active_at(3) = '1' else
                  column_at(4);

  delay : process (clk) is
  begin

    if rising_edge(clk) then
      active_at(4 to READ)  <= active_at(3 to READ - 1);
      choice_at(4 to READ)  <= choice_at(3 to READ - 1);
      command_at(4 to READ) <= command_at(3 to READ - 1);
      column_at(4 to READ)  <= column_at(3 to READ - 1);
      if reset = '1' then
        active_at(4 to READ) <= (others => '0');
      end if;
    end if;

  end process delay;

  --------------------------------------------------------------------------------------------------
  -- The pixels in use, and which of them change the sums.

  rows : if DEPTH = 1 generate

    ring : entity work.pixel_ring
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        REACHED          => REACHED,
        WITH_LEAVING     => pixels_leave(GEOMETRY),
        WIDTH            => PIXEL_BITS
      )
      port map (
        clk      => clk,
        age      => age_3,
        active   => active_at(ADDRESSED),
        pixel    => pixels_5,
        entering => read_enter,
        leaving  => read_leave
      );

  end generate rows;

  columns : if DEPTH > 1 generate

    ring : entity work.line_ring
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHIFTS           => SHIFTS,
        CENTRED          => CENTRED,
        ANY_ROWS         => ANY_ROWS,
        COLUMNS          => DEPTH,
        WIDTH            => PIXEL_BITS
      )
      port map (
        clk           => clk,
        reset         => reset,
        step_1        => step_1,
        phase_1       => phase_1,
        first_1       => first_1,
        live_1        => live_1,
        take_1        => take_1,
        slice_1       => slice_1,
        enter_phase_2 => enter_phase_2,
        moves_3       => moves_3,
        column_4      => column_at(4),
        active_5      => active_at(ADDRESSED),
        pixel_5       => pixels_5,
        entering_8    => read_enter,
        leaving_8     => read_leave
      );

  end generate columns;

  delay_own : entity work.tag_delay
    generic map (
      WIDTH  => PIXEL_BITS,
      LENGTH => READ - ADDRESSED
    )
    port map (
      clk     => clk,
      tag     => pixels_5,
      delayed => own
    );

  entering <= (others => '0') when choice_at(READ).enter = '0' else
              own when choice_at(READ).enter_now = '1' else
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
      own      => own,
      entering => entering,
      leaving  => leaving,
      sums     => sums
    );

  tags : entity work.stage_tags
    generic map (
      LATENCY        => sum_stage_latency(STORED, DEPTH),
      DELAY          => GEOMETRY.output_delay,
      STEP_TAG_BITS  => STEP_TAG_BITS,
      TOKEN_TAG_BITS => TOKEN_TAG_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      strobe        => strobe,
      token_tag     => token_tag,
      step          => step,
      step_tag      => step_tag,
      out_strobe    => out_strobe,
      out_token_tag => out_token_tag,
      out_step_tag  => out_step_tag
    );

end architecture rtl;
