-- The column pass of a focal stack: one memory of pixels, and for each slice its moving sums.
--
-- Lines must begin output_delay + 1 lines before those of the next frame, and a multiple of M lines; the sequencer
-- appends empty ones.
--
-- Latency: output_delay lines and STACK_COLUMN_LATENCY clocks. Throughput: one token each clock; the same
--   column comes again PARTIAL_SUM_LOOP clocks later at the earliest.
-- Ports: strobe marks a token, pixel those with a column, line_first the first of a line, first (with it) those of a
--   frame's first line; data: the lanes. Bit 0 of step_tag marks lines of the frame. Side information: step_tag, taken
--   with a line's first token, comes out output_delay lines later and holds until the next line; token_tag comes out
--   with the token. out_data: the sums, slice 0 in the low bits.
-- Equation: for each slice sum += entering pixel - leaving pixel; see moving_sum_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.focal_stack_pkg.all;

entity stack_columns is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- The slices: a' in pixels.
    SHIFTS : string;
    -- As in raster_refocuser.
    CENTRED : boolean;
    -- Longest line in pixels.
    COLUMNS : positive;
    -- Pixels of a token.
    LANES : positive;
    -- Width of a lane of the input.
    LANE_BITS : positive;
    -- Width of the side information of a line.
    STEP_TAG_BITS : positive;
    -- Width of the side information of a token.
    TOKEN_TAG_BITS : positive
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    strobe        : in    std_logic;
    pixel         : in    std_logic;
    line_first    : in    std_logic;
    first         : in    std_logic;
    data          : in    std_logic_vector(LANES * LANE_BITS - 1 downto 0);
    step_tag      : in    std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    token_tag     : in    std_logic_vector(TOKEN_TAG_BITS - 1 downto 0);
    out_strobe    : out   std_logic;
    out_data      : out   std_logic_vector(stack_sum_bits(MICRO_IMAGE_SIZE, SHIFTS, LANES, LANE_BITS) - 1 downto 0);
    out_step_tag  : out   std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    out_token_tag : out   std_logic_vector(TOKEN_TAG_BITS - 1 downto 0)
  );
end entity stack_columns;

architecture rtl of stack_columns is

  constant M           : positive := MICRO_IMAGE_SIZE;
  constant SLICES      : positive := slice_count(SHIFTS);
  constant DELAY       : natural  := output_delay(M, SHIFTS, CENTRED);
  constant PIXEL_BITS  : positive := LANES * LANE_BITS;
  constant SUMS_BITS   : positive := LANES * column_sum_bits(M, LANE_BITS);
  constant COLUMN_BITS : positive := bits_for(COLUMNS - 1);

  subtype phase_t is natural range 0 to M - 1;

  type phases_t is array (natural range 0 to SLICES - 1) of phase_t;

  type columns_t is array (1 to 3) of unsigned(COLUMN_BITS - 1 downto 0);

  signal active  : std_logic;
  signal step    : std_logic;
  signal phase_1 : phases_t;
  signal phase_2 : phase_t := 0;
  signal phase_3 : phase_t := 0;
  signal pixel_3 : std_logic_vector(PIXEL_BITS - 1 downto 0);
  signal history : std_logic_vector(history_high(M, SHIFTS, CENTRED, PIXEL_BITS) downto 0);

  signal active_at    : std_logic_vector(1 to 3) := (others => '0');
  signal column_at    : columns_t                := (others => (others => '0'));
  signal step_in      : std_logic_vector(0 downto 0);
  signal step_2       : std_logic_vector(0 downto 0);
  signal strobe_in    : std_logic_vector(0 downto 0);
  signal strobe_due   : std_logic_vector(0 downto 0);
  signal step_tag_2   : std_logic_vector(STEP_TAG_BITS - 1 downto 0);
  signal step_tag_due : std_logic_vector(STEP_TAG_BITS - 1 downto 0);

begin

  active <= strobe and pixel;
  step   <= active and line_first;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      if step = '1' then
        column_at(1) <= (others => '0');
      elsif active = '1' then
        column_at(1) <= column_at(1) + 1;
      end if;
      column_at(2 to 3) <= column_at(1 to 2);
      active_at         <= active & active_at(1 to 2);
      phase_2           <= phase_1(0);
      phase_3           <= phase_2;
      if reset = '1' then
        active_at <= (others => '0');
      end if;
    end if;

  end process follow;

  delay_pixel : entity work.tag_delay
    generic map (
      WIDTH  => PIXEL_BITS,
      LENGTH => 3
    )
    port map (
      clk     => clk,
      reset   => '0',
      enable  => '1',
      tag     => data,
      delayed => pixel_3
    );

  memory : entity work.column_history
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      COLUMNS          => COLUMNS,
      PIXEL_BITS       => PIXEL_BITS
    )
    port map (
      clk      => clk,
      column   => column_at(1),
      active   => active_at(3),
      phase    => phase_3,
      column_2 => column_at(3),
      pixel    => pixel_3,
      history  => history
    );

  slice : for s in 0 to SLICES - 1 generate

    sums : entity work.column_sum
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHIFTS           => SHIFTS,
        CENTRED          => CENTRED,
        SLICE            => s,
        COLUMNS          => COLUMNS,
        LANES            => LANES,
        LANE_BITS        => LANE_BITS
      )
      port map (
        clk     => clk,
        reset   => reset,
        step    => step,
        first   => first,
        live    => step_tag(0),
        active  => active,
        phase_1 => phase_1(s),
        column  => column_at(2),
        history => history,
        pixel   => pixel_3,
        sum     => out_data((s + 1) * SUMS_BITS - 1 downto s * SUMS_BITS)
      );

  end generate slice;

  --------------------------------------------------------------------------------------------------
  -- Side information.

  step_in(0) <= step;

  delay_step : entity work.tag_delay
    generic map (
      WIDTH  => 1,
      LENGTH => 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => step_in,
      delayed => step_2
    );

  delay_step_tag : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => step_tag,
      delayed => step_tag_2
    );

  step_tags : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => DELAY + 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => step_2(0),
      tag     => step_tag_2,
      delayed => step_tag_due
    );

  later_step_tags : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => STACK_COLUMN_LATENCY - 3
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => step_tag_due,
      delayed => out_step_tag
    );

  strobe_in(0) <= strobe;

  strobes : entity work.tag_delay
    generic map (
      WIDTH  => 1,
      LENGTH => STACK_COLUMN_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => strobe_in,
      delayed => strobe_due
    );

  out_strobe <= strobe_due(0);

  token_tags : entity work.tag_delay
    generic map (
      WIDTH  => TOKEN_TAG_BITS,
      LENGTH => STACK_COLUMN_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => token_tag,
      delayed => out_token_tag
    );

end architecture rtl;
