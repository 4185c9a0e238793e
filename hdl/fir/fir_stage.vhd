-- SPDX-License-Identifier: Apache-2.0
-- One pass of the refocusing operator along one dimension: stored products, switch control, the switched FIR
-- filters, and rounding. Tokens are delayed as their pixels are.
--
-- Rows (MODULES = 1, DEPTH = 1): every token is a step of all filters, one for each channel of each parallel row.
--
-- Columns (COLUMNS, MODULES = N): a token brings the next of N rows to each of N modules. Module m does what module
-- 0 did m tokens earlier. A module takes N steps on a column, one for each row, then turns to its next column, which
-- has a slot of its own. The switches of the N rows are read in the first N tokens of a band. They move with the
-- columns from module to module, and from the last module back to the first. With N = 1 this is a raster scan, and a
-- step is a line.
--
-- Latency: output_delay steps and stage_latency clocks (3; stored products 1 more, broadcast latches 1 more).
-- Throughput: one token each clock.
-- Equation: out(step) = S(step - DELAY + centre_offset) of data (STORED = false), or of round(data * 2**SCALE_BITS /
-- B), B the box, then rounded by DROP_BITS (STORED = true).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.count_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;
use work.fir_pkg.all;

entity fir_stage is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Widths and largest values of the input, the sums and the output.
    SIZES : pass_t;
    -- true: the first output of a micro image is held for its others, which are equal.
    HOLD : boolean;
    -- true: the stage filters columns, and a line is a step; false: a token is a step.
    COLUMNS : boolean := false;
    -- Modules that work one token after the other: 1 for rows, the rows of a band for columns.
    MODULES : positive := 1;
    -- Interleaved streams of a filter: 1 for rows, the columns of a module for columns.
    DEPTH : positive := 1;
    -- Filters of each module, which work in step.
    LANES : positive;
    -- Taps that each latch of the broadcast net drives; 0: one register drives all taps.
    BROADCAST_TAPS : natural;
    -- Width of the tag that goes with a step.
    TAG_BITS : positive := 1
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token; for columns that of module 0. Its pixel belongs to a band of lines, which begins with the line's first
    -- token. In each of the first N tokens of a band the fields image, frame_first and slice are those of the next row.
    token : in    token_t;
    -- The input of all filters: module 0, filter 0 in the low bits.
    data : in    std_logic_vector(MODULES * LANES * SIZES.data_bits - 1 downto 0);
    -- A tag that goes with the step.
    tag : in    std_logic_vector(TAG_BITS - 1 downto 0) := (others => '0');
    -- The token behind the stage (token_path), its results in the order of data, and its tag.
    out_token : out   token_t;
    out_data  : out   std_logic_vector(MODULES * LANES * SIZES.result_bits - 1 downto 0);
    out_tag   : out   std_logic_vector(TAG_BITS - 1 downto 0)
  );
end entity fir_stage;

architecture rtl of fir_stage is

  constant TAPS         : positive := tap_count(GEOMETRY, HOLD);
  constant DELAY        : natural  := GEOMETRY.output_delay;
  constant RESULT_BITS  : positive := SIZES.result_bits;
  constant PRODUCT_BITS : positive := bits_for(SIZES.product_max);
  -- The largest sum of a slice.
  constant SUM_MAX   : positive := SIZES.sum_max;
  constant SUM_BITS  : positive := bits_for(SUM_MAX);
  constant SLOT_BITS : positive := bits_for(DEPTH - 1);
  constant LATENCY   : positive := stage_latency(SIZES.stored, BROADCAST_TAPS);
  -- With a single slice the slice number has one bit, which is not used.
  constant SLICE_BITS : positive := bits_for(GEOMETRY.slices - 1);

  -- A module's work on a token: the slot of its column, whether it goes on with that column, whether there is a pixel.
  type turn_t is record
    slot   : unsigned(SLOT_BITS - 1 downto 0);
    resume : std_logic;
    active : std_logic;
  end record turn_t;

  type turns_t is array (natural range 0 to MODULES - 1) of turn_t;

  constant NO_TURN : turn_t := (slot => (others => '0'), resume => '0', active => '0');

  -- The switches of a row of the band, as they move from module to module.
  constant SWITCH_BITS : positive := TAPS + 2;

  subtype switches_t is std_logic_vector(SWITCH_BITS - 1 downto 0);

  type switch_chain_t is array (natural range 0 to MODULES) of switches_t;

  -- The token as the filters see it. pixel: it has a pixel; advance: it begins a band; first: it begins a line
  -- (for columns a frame); live: its pixels are image pixels; others add nothing.
  signal pixel   : std_logic;
  signal advance : std_logic;
  signal first   : std_logic;
  signal live    : std_logic;

  signal burst_step : natural range 0 to larger(MODULES - 1, 1);
  signal burst_held : natural range 0 to larger(MODULES - 1, 1) := 0;
  signal opening    : std_logic                                 := '0';
  signal fresh      : std_logic;
  -- turn: each module's work now; _d1, _d2: one and two clocks later, when switches and filter use it; turn_held:
  -- the work of the token before, which the next module takes over.
  signal turn      : turns_t;
  signal turn_d1   : turns_t   := (others => NO_TURN);
  signal turn_d2   : turns_t   := (others => NO_TURN);
  signal turn_held : turns_t   := (others => NO_TURN);
  signal strobe_d1 : std_logic := '0';
  signal strobe_d2 : std_logic := '0';
  signal fresh_d1  : std_logic := '0';
  signal fresh_d2  : std_logic := '0';
  signal first_d1  : std_logic := '0';
  signal live_d1   : std_logic := '0';
  signal slice_d1  : unsigned(SLICE_BITS - 1 downto 0);

  -- The switches of the row that comes in, and those that move on with the pixels.
  signal closed   : std_logic_vector(0 to TAPS - 1);
  signal restart  : std_logic;
  signal update   : std_logic;
  signal switches : switch_chain_t := (others => (others => '0'));

begin

  row_tokens : if not COLUMNS generate
    pixel   <= '1';
    advance <= '1';
    first   <= token.line_first;
    live    <= token.pixel;
  end generate row_tokens;

  column_tokens : if COLUMNS generate
    pixel   <= token.pixel;
    advance <= begins_line(token);
    first   <= token.frame_first;
    live    <= token.image;
  end generate column_tokens;

  -- Module 0's work: its row within the column, and the column. A module takes the N rows of a column in N tokens.
  -- With N = 1 the count is always 0, and synthesis removes all that depends on it.
  burst_step <= place_in_turn(burst_held, advance, MODULES);

  fresh <= token.strobe and (advance or opening);

  -- The column's slot in the memory of partial sums: the next slot with each column.
  turn(0).slot <= (others => '0') when advance = '1' or DEPTH = 1 else
                  turn_held(0).slot + 1 when burst_step = 0 else
                  turn_held(0).slot;

  turn(0).resume <= '0' when burst_step = 0 else
                    '1';

  turn(0).active <= pixel when burst_step = 0 else
                    turn_held(0).active;

  -- Module m takes over the work of module m - 1 a token later: the column to the right, which has the same slot
  -- number in a memory of its own.
  followers : for m in 1 to MODULES - 1 generate
    turn(m) <= turn_held(m - 1);
  end generate followers;

  delay_tokens : process (clk) is
  begin

    if rising_edge(clk) then
      strobe_d1 <= token.strobe;
      strobe_d2 <= strobe_d1;
      fresh_d1  <= fresh;
      fresh_d2  <= fresh_d1;
      first_d1  <= first;
      live_d1   <= live;
      slice_d1  <= token.slice(SLICE_BITS - 1 downto 0);
      -- Two clocks for the switches: one to read their table, one for the fan-out to all taps.
      turn_d1 <= turn;
      turn_d2 <= turn_d1;
      if GEOMETRY.slices = 1 then
        slice_d1 <= (others => '0');
      end if;
      if token.strobe = '1' then
        turn_held  <= turn;
        burst_held <= burst_step;
        -- The N-th token of a band closes it, before a band of N tokens may open the next.
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
      GEOMETRY => GEOMETRY,
      HOLD     => HOLD
    )
    port map (
      clk     => clk,
      advance => fresh_d1,
      first   => first_d1,
      live    => live_d1,
      slice   => slice_d1,
      closed  => closed,
      restart => restart,
      update  => update
    );

  -- One module: the control's outputs hold for the whole line.
  one_module : if MODULES = 1 generate
    switches(0) <= closed & restart & update;
  end generate one_module;

  -- Several modules: switches of the band's rows pass from module to module, and from the last to the first.
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

  each_module : for m in 0 to MODULES - 1 generate

    signal step : std_logic;

  begin

    -- A token without a pixel of a band leaves the partial sums in memory unchanged.
    step <= strobe_d2 and turn_d2(m).active;

    lane : for i in m * LANES to m * LANES + LANES - 1 generate

      signal value      : std_logic_vector(SIZES.data_bits - 1 downto 0);
      signal product_d1 : std_logic_vector(PRODUCT_BITS - 1 downto 0);
      signal product_d2 : std_logic_vector(PRODUCT_BITS - 1 downto 0) := (others => '0');
      signal sum        : std_logic_vector(SUM_BITS - 1 downto 0);

    begin

      value <= data((i + 1) * SIZES.data_bits - 1 downto i * SIZES.data_bits);

      stored_products : if SIZES.stored generate

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
            product => product_d1
          );

        round_sum : process (clk) is
        begin

          if rising_edge(clk) then
            out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS) <= rounded(sum, SIZES.drop_bits, RESULT_BITS);
          end if;

        end process round_sum;

      end generate stored_products;

      plain_values : if not SIZES.stored generate

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
          -- The register in front of the broadcast net, through which one product reaches all taps.
          product_d2 <= product_d1;
        end if;

      end process delay_product;

      -- The slot comes two clocks early, because the line buffer needs two clocks to read.
      fir : entity work.switched_fir
        generic map (
          TAPS           => TAPS,
          DELAY          => DELAY,
          DEPTH          => DEPTH,
          HOLD           => HOLD,
          DATA_MAX       => SIZES.product_max,
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

  end generate each_module;

  path : entity work.token_path
    generic map (
      LATENCY  => LATENCY,
      DELAY    => DELAY,
      COLUMNS  => COLUMNS,
      TAG_BITS => TAG_BITS
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      step      => fresh,
      tag       => tag,
      out_token => out_token,
      out_tag   => out_tag
    );

end architecture rtl;
