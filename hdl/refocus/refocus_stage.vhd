-- One dimension of the refocuser: stored products, switch control and one switched FIR filter
-- for each channel, with the side information delayed as the pixels are.
--
-- The row stage (DEPTH = 1) takes a step for each token of the raster; the column stage (DEPTH =
-- columns) takes a step for each line, all slots of a line sharing the switch states.
--
-- Latency: STAGE_LATENCY = 3 clocks, and DELAY steps of the filter. Throughput: one token each clock.
-- Ports: strobe marks a token, advance the first token of a step (slot 0), first (with advance)
--   the first step of a line; data holds the channels, channel 0 in the low bits. step_tag is
--   read with advance and comes out DELAY steps later; its bit 0 is cleared by reset. token_tag
--   comes out with the token.
-- Equation: sums(step) = S(step - DELAY + output shift) of data (STORED = false) or of
--   round(data * 2**SCALE_BITS / M) (STORED = true).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.refocus_pkg.all;

entity refocus_stage is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- a' in pixels.
    SHIFT : integer;
    -- As in raster_refocuser.
    CENTRED : boolean;
    -- Interleaved streams: 1 for rows, the longest line for columns.
    DEPTH : positive;
    -- Number of channels.
    CHANNELS : positive;
    -- Width of a channel of the input.
    DATA_BITS : positive;
    -- Whether the input is multiplied by stored products.
    STORED : boolean;
    -- Fraction bits of the products above those of the input.
    SCALE_BITS : natural;
    -- Largest input of the filters.
    PRODUCT_MAX : natural;
    -- Largest sum: M times the largest input.
    SUM_MAX : natural;
    -- Width of the side information of a step.
    STEP_TAG_BITS : positive;
    -- Width of the side information of a token.
    TOKEN_TAG_BITS : positive
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    strobe        : in    std_logic;
    advance       : in    std_logic;
    first         : in    std_logic;
    data          : in    std_logic_vector(CHANNELS * DATA_BITS - 1 downto 0);
    step_tag      : in    std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    token_tag     : in    std_logic_vector(TOKEN_TAG_BITS - 1 downto 0);
    out_strobe    : out   std_logic;
    out_sums      : out   std_logic_vector(CHANNELS * bits_for(SUM_MAX) - 1 downto 0);
    out_step_tag  : out   std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    out_token_tag : out   std_logic_vector(TOKEN_TAG_BITS - 1 downto 0)
  );
end entity refocus_stage;

architecture rtl of refocus_stage is

  constant TAPS         : positive := tap_count(MICRO_IMAGE_SIZE, SHIFT);
  constant DELAY        : natural  := output_delay(MICRO_IMAGE_SIZE, SHIFT, CENTRED);
  constant PRODUCT_BITS : positive := bits_for(PRODUCT_MAX);
  constant SUM_BITS     : positive := bits_for(SUM_MAX);
  constant SLOT_BITS    : positive := bits_for(DEPTH - 1);

  signal slot        : unsigned(SLOT_BITS - 1 downto 0);
  signal slot_d1     : unsigned(SLOT_BITS - 1 downto 0)             := (others => '0');
  signal strobe_d1   : std_logic                                    := '0';
  signal strobe_d2   : std_logic                                    := '0';
  signal strobe_d3   : std_logic                                    := '0';
  signal advance_d1  : std_logic                                    := '0';
  signal advance_d2  : std_logic                                    := '0';
  signal first_d1    : std_logic                                    := '0';
  signal step_tag_d1 : std_logic_vector(STEP_TAG_BITS - 1 downto 0) := (others => '0');
  signal step_tag_d2 : std_logic_vector(STEP_TAG_BITS - 1 downto 0) := (others => '0');
  signal closed      : std_logic_vector(0 to TAPS - 1);
  signal restart     : std_logic;

begin

  slot <= (others => '0') when advance = '1' or DEPTH = 1 else
          slot_d1 + 1;

  delay_tokens : process (clk) is
  begin

    if rising_edge(clk) then
      strobe_d1   <= strobe;
      strobe_d2   <= strobe_d1;
      strobe_d3   <= strobe_d2;
      advance_d1  <= strobe and advance;
      advance_d2  <= advance_d1;
      first_d1    <= first;
      step_tag_d1 <= step_tag;
      step_tag_d2 <= step_tag_d1;
      if strobe = '1' then
        slot_d1 <= slot;
      end if;
      if reset = '1' then
        strobe_d1 <= '0';
        strobe_d2 <= '0';
        strobe_d3 <= '0';
      end if;
    end if;

  end process delay_tokens;

  control : entity work.switch_control
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFT            => SHIFT,
      TAPS             => TAPS,
      DELAY            => DELAY
    )
    port map (
      clk     => clk,
      advance => advance_d1,
      first   => first_d1,
      closed  => closed,
      restart => restart
    );

  channel : for c in 0 to CHANNELS - 1 generate

    signal value      : std_logic_vector(DATA_BITS - 1 downto 0);
    signal product_d1 : std_logic_vector(PRODUCT_BITS - 1 downto 0);
    signal product_d2 : std_logic_vector(PRODUCT_BITS - 1 downto 0) := (others => '0');

  begin

    value <= data((c + 1) * DATA_BITS - 1 downto c * DATA_BITS);

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

    end generate stored_products;

    plain_values : if not STORED generate

      delay_value : process (clk) is
      begin

        if rising_edge(clk) then
          product_d1 <= value;
        end if;

      end process delay_value;

    end generate plain_values;

    delay_product : process (clk) is
    begin

      if rising_edge(clk) then
        product_d2 <= product_d1;
      end if;

    end process delay_product;

    fir : entity work.switched_fir
      generic map (
        TAPS     => TAPS,
        DELAY    => DELAY,
        DEPTH    => DEPTH,
        DATA_MAX => PRODUCT_MAX,
        SUM_MAX  => SUM_MAX
      )
      port map (
        clk     => clk,
        slot    => slot,
        step    => strobe_d2,
        restart => restart,
        closed  => closed,
        data    => product_d2,
        sum     => out_sums((c + 1) * SUM_BITS - 1 downto c * SUM_BITS)
      );

  end generate channel;

  out_strobe <= strobe_d3;

  step_tags : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => DELAY + 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => advance_d2,
      tag     => step_tag_d2,
      delayed => out_step_tag
    );

  token_tags : entity work.tag_delay
    generic map (
      WIDTH  => TOKEN_TAG_BITS,
      LENGTH => STAGE_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => token_tag,
      delayed => out_token_tag
    );

end architecture rtl;
