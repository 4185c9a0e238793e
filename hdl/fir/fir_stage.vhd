-- SPDX-License-Identifier: Apache-2.0
-- One pass of the refocuser along one dimension: stored products, switch control, the switched FIR filters of all
-- lanes, and the rounding behind them. The side information is delayed as the pixels are.
--
-- Rows (MODULES = 1, DEPTH = 1): every token is a step of all lanes. A lane is a channel of one of the parallel rows.
--
-- Columns (MODULES = N): a token brings the next of N rows to each of N modules. Module m does what module 0 did
-- m tokens earlier. A module takes N steps on a column, one for each row, then turns to its next column, which has
-- a slot of its own. The switches of the N rows are read in the first N tokens of a band. They move from module
-- to module with the columns, and from the last module back to the first. With N = 1 this is a raster scan, and
-- a step is a line.
--
-- Latency: stage_latency clocks (3, stored products 1 more, broadcast latches 1 more), and
--   output_delay steps of the filter. Throughput: one token each clock.
-- Equation: out(step) = S(step - DELAY + output offset) of data (STORED = false) or of
--   round(data * 2**SCALE_BITS / M), then rounded by DROP_BITS (STORED = true).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.fir_pkg.all;

entity fir_stage is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- The set of a' in pixels.
    SHIFTS : string;
    -- Whether the picture stays put from slice to slice.
    CENTRED : boolean;
    -- Whether the first output of a micro image is held for its others, which are equal.
    HOLD : boolean;
    -- Filters that work one token after the other: 1 for rows, the rows of a band for columns.
    MODULES : positive;
    -- Interleaved streams of a filter: 1 for rows, the columns of a module for columns.
    DEPTH : positive;
    -- Filters that work in step, in each module.
    LANES : positive;
    -- Width of a lane of the input.
    DATA_BITS : positive;
    -- Whether the input is multiplied by stored products.
    STORED : boolean;
    -- Stored products: fraction bits of the products above those of the input.
    SCALE_BITS : natural;
    -- Largest input of the filters.
    PRODUCT_MAX : natural;
    -- Stored products: fraction bits to drop from the sums.
    DROP_BITS : natural;
    -- Width of a lane of the output.
    RESULT_BITS : positive;
    -- Taps that one latch of the broadcast net drives; 0: one register drives all.
    BROADCAST_TAPS : natural;
    -- Width of the side information of a step.
    STEP_TAG_BITS : positive;
    -- Width of the side information of a token.
    TOKEN_TAG_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token.
    strobe : in    std_logic;
    -- The token belongs to a band of lines; other tokens only move things on.
    pixel : in    std_logic;
    -- The first token of a band.
    advance : in    std_logic;
    -- A step that begins a line (for columns: a frame), and the slice from there on. Read, as step_tag is, at each of
    -- the first N tokens of a band, row by row.
    first : in    std_logic;
    slice : in    unsigned(bits_for(slice_count(SHIFTS) - 1) - 1 downto 0);
    -- The lanes of all modules: module 0, lane 0 in the low bits.
    data : in    std_logic_vector(MODULES * LANES * DATA_BITS - 1 downto 0);
    -- Side information of a step. Bit 0 marks steps that hold image pixels; other steps add nothing.
    step_tag : in    std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    -- Side information of a token.
    token_tag : in    std_logic_vector(TOKEN_TAG_BITS - 1 downto 0);
    -- The token and its results, in the order of data.
    out_strobe : out   std_logic;
    out_data   : out   std_logic_vector(MODULES * LANES * RESULT_BITS - 1 downto 0);
    -- The step tag of output_delay steps before, row by row as it came in. Reset clears bit 0.
    out_step_tag : out   std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    -- The tag of the token.
    out_token_tag : out   std_logic_vector(TOKEN_TAG_BITS - 1 downto 0)
  );
end entity fir_stage;

architecture rtl of fir_stage is

  constant GEOMETRY : geometry_t := geometry_of("fir_stage", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  constant TAPS         : positive := tap_count(GEOMETRY, HOLD);
  constant DELAY        : natural  := GEOMETRY.output_delay;
  constant PRODUCT_BITS : positive := bits_for(PRODUCT_MAX);
  -- M inputs add to an output, whatever the slice.
  constant SUM_MAX   : positive := MICRO_IMAGE_SIZE * PRODUCT_MAX;
  constant SUM_BITS  : positive := bits_for(SUM_MAX);
  constant SLOT_BITS : positive := bits_for(DEPTH - 1);
  constant LATENCY   : positive := stage_latency(STORED, BROADCAST_TAPS);

  -- What a module does with a token.
  type turn_t is record
    slot   : unsigned(SLOT_BITS - 1 downto 0);
    resume : std_logic;
    active : std_logic;
  end record turn_t;

  type turns_t is array (natural range 0 to MODULES - 1) of turn_t;

  constant NO_TURN : turn_t := (slot => (others => '0'), resume => '0', active => '0');

  -- Switch states of a row of the band, as they move from module to module.
  constant SWITCH_BITS : positive := TAPS + 2;

  subtype switches_t is std_logic_vector(SWITCH_BITS - 1 downto 0);

  type switch_chain_t is array (natural range 0 to MODULES) of switches_t;

  signal burst_step : natural range 0 to larger(MODULES - 1, 1);
  signal opening    : std_logic := '0';
  signal fresh      : std_logic;
  -- A module's turn now; the two clocks behind, in which its filter and the switches take it; the one of the token
  -- before, which the next module has.
  signal turn        : turns_t;
  signal turn_d1     : turns_t   := (others => NO_TURN);
  signal turn_d2     : turns_t   := (others => NO_TURN);
  signal turn_held   : turns_t   := (others => NO_TURN);
  signal strobe_d1   : std_logic := '0';
  signal strobe_d2   : std_logic := '0';
  signal fresh_d1    : std_logic := '0';
  signal fresh_d2    : std_logic := '0';
  signal first_d1    : std_logic := '0';
  signal slice_d1    : unsigned(slice'range);
  signal step_tag_d1 : std_logic_vector(STEP_TAG_BITS - 1 downto 0);
  signal step_tag_d2 : std_logic_vector(STEP_TAG_BITS - 1 downto 0);
  signal step_tag_d3 : std_logic_vector(STEP_TAG_BITS - 1 downto 0);

  -- Switches of the row that comes, and the same as they move on with its pixels.
  signal closed   : std_logic_vector(0 to TAPS - 1);
  signal restart  : std_logic;
  signal update   : std_logic;
  signal switches : switch_chain_t := (others => (others => '0'));

  signal strobe_tag     : std_logic_vector(0 downto 0);
  signal out_strobe_tag : std_logic_vector(0 downto 0);

begin

  -- Module 0's turn: the place in its burst on a column, and the column.
  count_steps : entity work.pixel_counter
    generic map (
      MODULUS => MODULES
    )
    port map (
      clk     => clk,
      strobe  => strobe,
      restart => advance,
      count   => burst_step
    );

  fresh <= strobe and (advance or opening);

  turn(0).slot <= (others => '0') when advance = '1' or DEPTH = 1 else
                  turn_held(0).slot + 1 when burst_step = 0 else
                  turn_held(0).slot;

  turn(0).resume <= '0' when burst_step = 0 else
                    '1';

  turn(0).active <= pixel when burst_step = 0 else
                    turn_held(0).active;

  -- Each of the other modules does the same a token later than the module before it.
  followers : for m in 1 to MODULES - 1 generate
    turn(m) <= turn_held(m - 1);
  end generate followers;

  delay_tokens : process (clk) is
  begin

    if rising_edge(clk) then
      strobe_d1   <= strobe;
      strobe_d2   <= strobe_d1;
      fresh_d1    <= fresh;
      fresh_d2    <= fresh_d1;
      first_d1    <= first;
      slice_d1    <= slice;
      step_tag_d1 <= step_tag;
      step_tag_d2 <= step_tag_d1;
      turn_d1     <= turn;
      turn_d2     <= turn_d1;
      if strobe = '1' then
        turn_held <= turn;
        if burst_step = MODULES - 1 then
          opening <= '0';
        elsif advance = '1' then
          opening <= '1';
        end if;
      end if;
      if reset = '1' then
        strobe_d1 <= '0';
        strobe_d2 <= '0';
        fresh_d1  <= '0';
        fresh_d2  <= '0';
        opening   <= '0';
      end if;
    end if;

  end process delay_tokens;

  control : entity work.switch_control
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      HOLD             => HOLD,
      TAPS             => TAPS,
      DELAY            => DELAY
    )
    port map (
      clk     => clk,
      advance => fresh_d1,
      first   => first_d1,
      live    => step_tag_d1(0),
      slice   => slice_d1,
      closed  => closed,
      restart => restart,
      update  => update
    );

  -- One module: the outputs of the control hold for the whole line.
  one_module : if MODULES = 1 generate
    switches(0) <= closed & restart & update;
  end generate one_module;

  -- Several modules: the switches of the band's rows pass from each module to the next, and from the last to the first.
  many_modules : if MODULES > 1 generate

    signal passed : switch_chain_t := (others => (others => '0'));

  begin

    switches(0) <= closed & restart & update when fresh_d2 = '1' else
                   passed(MODULES);

    pass_on : process (clk) is
    begin

      if rising_edge(clk) then
        if strobe_d2 = '1' then
          passed(1 to MODULES) <= switches(0 to MODULES - 1);
        end if;
      end if;

    end process pass_on;

    follower : for m in 1 to MODULES - 1 generate
      switches(m) <= passed(m);
    end generate follower;

  end generate many_modules;

  module : for m in 0 to MODULES - 1 generate

    signal step : std_logic;

  begin

    step <= strobe_d2 and turn_d2(m).active;

    lane : for i in m * LANES to m * LANES + LANES - 1 generate

      signal value      : std_logic_vector(DATA_BITS - 1 downto 0);
      signal product_d1 : std_logic_vector(PRODUCT_BITS - 1 downto 0);
      signal product_d2 : std_logic_vector(PRODUCT_BITS - 1 downto 0) := (others => '0');
      signal sum        : std_logic_vector(SUM_BITS - 1 downto 0);

    begin

      value <= data((i + 1) * DATA_BITS - 1 downto i * DATA_BITS);

      stored_products : if STORED generate

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
            product => product_d1
          );

        round_sum : entity work.round_saturate
          generic map (
            VALUE_MAX   => SUM_MAX,
            DROP_BITS   => DROP_BITS,
            RESULT_BITS => RESULT_BITS
          )
          port map (
            clk    => clk,
            value  => sum,
            result => out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS)
          );

      end generate stored_products;

      plain_values : if not STORED generate

        delay_value : process (clk) is
        begin

          if rising_edge(clk) then
            product_d1 <= value;
          end if;

        end process delay_value;

        out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS) <= sum;

      end generate plain_values;

      delay_product : process (clk) is
      begin

        if rising_edge(clk) then
          product_d2 <= product_d1;
        end if;

      end process delay_product;

      fir : entity work.switched_fir
        generic map (
          TAPS           => TAPS,
          DELAY          => DELAY,
          DEPTH          => DEPTH,
          HOLD           => HOLD,
          DATA_MAX       => PRODUCT_MAX,
          SUM_MAX        => SUM_MAX,
          BROADCAST_TAPS => BROADCAST_TAPS
        )
        port map (
          clk     => clk,
          slot    => turn(m).slot,
          step    => step,
          resume  => turn_d2(m).resume,
          restart => switches(m)(1),
          update  => switches(m)(0),
          closed  => switches(m)(SWITCH_BITS - 1 downto 2),
          data    => product_d2,
          sum     => sum
        );

    end generate lane;

  end generate module;

  -- Side information.
  step_tags : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => DELAY + 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => fresh_d2,
      tag     => step_tag_d2,
      delayed => step_tag_d3
    );

  later_step_tags : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => LATENCY - 3
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => step_tag_d3,
      delayed => out_step_tag
    );

  strobe_tag(0) <= strobe_d2;

  strobes : entity work.tag_delay
    generic map (
      WIDTH  => 1,
      LENGTH => LATENCY - 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => strobe_tag,
      delayed => out_strobe_tag
    );

  out_strobe <= out_strobe_tag(0);

  token_tags : entity work.tag_delay
    generic map (
      WIDTH  => TOKEN_TAG_BITS,
      LENGTH => LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => token_tag,
      delayed => out_token_tag
    );

end architecture rtl;
