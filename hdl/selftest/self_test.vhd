-- SPDX-License-Identifier: Apache-2.0
-- The core tests itself on a board: pseudo-random frames go in, and a signature of the results is compared with that of
-- the golden model.
--
-- One linear feedback shift register makes the pixels, equal in each frame; another compresses the refocused pixels.
-- The test needs only a clock and LEDs, so it runs on any board and any FPGA.
--
-- Latency: a frame and the latency of the core until the first result. Throughput: one pixel each clock.
-- Equation: pixel(n) = low bits of state(n), state(0) = SEED, state(n+1) = 2*state(n) modulo P over GF(2);
--   signature(n+1) = (2*signature(n) modulo P) xor pixel(n), P = x**32 + x**22 + x**2 + x + 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity self_test is
  generic (
    -- M: pixels of a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128 := 5;
    -- The slice's shift in pixels.
    SHIFTS : string := "-3";
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 3;
    -- true: exact sums and one division at the end; false: stored products, which round.
    EXACT : boolean := true;
    -- Stored products only: fraction bits of the products.
    FRACTION_BITS : natural range 0 to 12 := 0;
    -- Stored products only: fraction bits of the image between rows and columns.
    GUARD_BITS : natural range 0 to 12 := 0;
    -- Pixels of a line.
    COLUMNS : positive range 2 to 8192 := 640;
    -- Lines of a frame.
    ROWS : positive range 2 to 65535 := 480;
    -- Upper half of the signature of a refocused frame.
    EXPECTED_HIGH : natural range 0 to 65535 := 0;
    -- Lower half of the signature.
    EXPECTED_LOW : natural range 0 to 65535 := 0;
    -- Frames for each change of blink, as a power of two.
    BLINK_BITS : positive range 1 to 31 := 5
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- High from the first result on.
    tested : out   std_logic;
    -- High while every signature so far was right.
    passed : out   std_logic;
    -- Changes every 2**BLINK_BITS frames.
    blink : out   std_logic
  );
end entity self_test;

architecture rtl of self_test is

  constant PIXEL_BITS : positive := 8;
  constant DATA_BITS  : positive := CHANNELS * PIXEL_BITS;

  -- Both registers have the polynomial P.
  subtype state_t is std_logic_vector(31 downto 0);

  constant SEED       : state_t := x"00000001";
  constant POLYNOMIAL : state_t := x"00400007";
  constant EXPECTED   : state_t := std_logic_vector(to_unsigned(EXPECTED_HIGH, 16)) &
                                   std_logic_vector(to_unsigned(EXPECTED_LOW, 16));

  constant COLUMNS_PORT : std_logic_vector(15 downto 0) := std_logic_vector(to_unsigned(COLUMNS, 16));
  constant ROWS_PORT    : std_logic_vector(15 downto 0) := std_logic_vector(to_unsigned(ROWS, 16));

  -- 2 * state, modulo the polynomial.
  function shifted (
    state : state_t
  ) return state_t is

    variable product : state_t;

  begin

    -- A shift register: the bit that leaves at the top comes back at the places of the polynomial.
    product := state(30 downto 0) & '0';

    if state(31) = '1' then
      product := product xor POLYNOMIAL;
    end if;

    return product;

  end function shifted;

  -- Source of pixels.
  signal state        : state_t                        := SEED;
  signal column       : natural range 0 to COLUMNS - 1 := 0;
  signal row          : natural range 0 to ROWS - 1    := 0;
  signal source_valid : std_logic                      := '0';
  signal source_ready : std_logic;
  signal source_start : std_logic_vector(0 downto 0);
  signal source_last  : std_logic;

  -- Sink of results.
  signal result_valid : std_logic;
  signal result       : std_logic_vector(DATA_BITS - 1 downto 0);
  signal result_last  : std_logic;
  signal error_flags  : std_logic_vector(4 downto 0);
  signal signature    : state_t                       := (others => '0');
  signal lines        : natural range 0 to ROWS       := 0;
  signal is_tested    : std_logic                     := '0';
  signal is_passed    : std_logic                     := '1';
  signal frames       : unsigned(BLINK_BITS downto 0) := (others => '0');

begin

  source_start(0) <= '1' when column = 0 and row = 0 else
                     '0';
  source_last     <= '1' when column = COLUMNS - 1 else
                     '0';

  -- The source never pauses, and restarts its register with each frame, so that all frames are equal.
  make_pixels : process (clk) is
  begin

    if rising_edge(clk) then
      source_valid <= '1';
      if source_valid = '1' and source_ready = '1' then
        state <= shifted(state);
        if column < COLUMNS - 1 then
          column <= column + 1;
        else
          column <= 0;
          if row < ROWS - 1 then
            row <= row + 1;
          else
            row   <= 0;
            state <= SEED;
          end if;
        end if;
      end if;
      if reset = '1' then
        source_valid <= '0';
        column       <= 0;
        row          <= 0;
        state        <= SEED;
      end if;
    end if;

  end process make_pixels;

  core : entity work.raster_refocuser
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      MAX_COLUMNS      => COLUMNS,
      CHANNELS         => CHANNELS,
      PIXEL_BITS       => PIXEL_BITS,
      EXACT            => EXACT,
      FRACTION_BITS    => FRACTION_BITS,
      GUARD_BITS       => GUARD_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => COLUMNS_PORT,
      rows          => ROWS_PORT,
      slice         => x"00",
      s_axis_tvalid => source_valid,
      s_axis_tready => source_ready,
      s_axis_tdata  => state(DATA_BITS - 1 downto 0),
      s_axis_tuser  => source_start,
      s_axis_tlast  => source_last,
      m_axis_tvalid => result_valid,
      m_axis_tready => '1',
      m_axis_tdata  => result,
      m_axis_tlast  => result_last,
      error_flags   => error_flags
    );

  sign_result : process (clk) is

    variable next_signature : state_t;

  begin

    if rising_edge(clk) then
      -- The stream is correct, so any fault that the core reports is an error.
      if error_flags /= "00000" then
        is_passed <= '0';
      end if;
      if lines = ROWS then
        -- This is the clock behind a frame's last pixel: at most the next frame's first pixel has come.
        lines     <= 0;
        frames    <= frames + 1;
        is_tested <= '1';
        if signature /= EXPECTED then
          is_passed <= '0';
        end if;
        signature <= (others => '0');
      end if;
      if result_valid = '1' then
        if lines = ROWS then
          next_signature := (others => '0');
        else
          -- Earlier pixels move on with each new one, so the signature depends on their order.
          next_signature := shifted(signature);
        end if;
        next_signature(DATA_BITS - 1 downto 0) := next_signature(DATA_BITS - 1 downto 0) xor result;
        signature                              <= next_signature;
        if result_last = '1' then
          if lines = ROWS then
            lines <= 1;
          else
            lines <= lines + 1;
          end if;
        end if;
      end if;
      if reset = '1' then
        lines     <= 0;
        signature <= (others => '0');
        is_tested <= '0';
        is_passed <= '1';
        frames    <= (others => '0');
      end if;
    end if;

  end process sign_result;

  tested <= is_tested;
  passed <= is_passed;
  blink  <= frames(BLINK_BITS);

end architecture rtl;
