-- SPDX-License-Identifier: Apache-2.0
-- The light at positions on the raw frame: lenses are moved, four pixels interpolated, black level and gain applied.
--
--   position -> + move (lens_tables) -> raw_window -> pixel_sample -> sample_gain -> values
--
-- Latency: 3 + WINDOW_LATENCY + SAMPLE_LATENCY + GAIN_LATENCY clocks. Throughput: one position each clock.
-- Equation: values = sample_gain of pixel_sample at position + move of the lens.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity lens_samples is
  generic (
    -- Sizes of the resampler.
    BUILD : resample_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The load port; only words of the tables are used here.
    load : in    load_t;
    -- Pixels for the ring, from raw_writer.
    ring_write : in    ring_write_t;
    write_data : in    std_logic_vector(BUILD.data_bits - 1 downto 0);
    -- The frame that is read, and its black level.
    frame : in    raw_frame_t;
    black : in    unsigned(BUILD.sample_bits - 1 downto 0);
    -- A pixel of the raster from lens_walk, at its position on the even grid.
    pixel : in    walked_t;
    -- value_valid: there is a value; value_first: a frame's first; value_last: a line's last; its channels, channel 0
    -- in the low bits.
    value_valid : out   std_logic;
    value_first : out   std_logic;
    value_last  : out   std_logic;
    values      : out   std_logic_vector(BUILD.channels * BUILD.value_bits - 1 downto 0)
  );
end entity lens_samples;

architecture rtl of lens_samples is

  constant DATA_BITS   : positive := BUILD.data_bits;
  constant POSITION    : positive := 16 + BUILD.weight_bits;
  constant SAMPLE_BITS : positive := BUILD.sample_bits;
  constant VALUE_BITS  : positive := SAMPLE_BITS + GAIN_INTEGER_BITS;
  constant GAIN_WIDTH  : positive := BUILD.gain_bits + GAIN_INTEGER_BITS;
  -- Table 2, addition 1.
  constant MOVE_LATENCY : positive := 3;
  -- Clocks from a position to its value, and those that a gain waits between lens_tables and the multiplier.
  constant VALUE_LATENCY : positive := MOVE_LATENCY + WINDOW_LATENCY + SAMPLE_LATENCY + GAIN_LATENCY;
  constant GAIN_WAIT     : positive := MOVE_LATENCY + WINDOW_LATENCY + SAMPLE_LATENCY + 1 - 4;

  type positions_t is array (1 to MOVE_LATENCY - 1) of signed(POSITION - 1 downto 0);

  type gains_t is array (1 to GAIN_WAIT) of unsigned(GAIN_WIDTH - 1 downto 0);

  -- The position on the even grid, until the move of its lens has been read.
  signal even_y_at : positions_t                   := (others => (others => '0'));
  signal even_x_at : positions_t                   := (others => (others => '0'));
  signal move_y    : signed(BUILD.weight_bits + 1 downto 0);
  signal move_x    : signed(BUILD.weight_bits + 1 downto 0);
  signal moved_y   : signed(POSITION - 1 downto 0) := (others => '0');
  signal moved_x   : signed(POSITION - 1 downto 0) := (others => '0');
  -- The four pixels around the moved position, and its place between them.
  signal pixel_00 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal pixel_01 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal pixel_10 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal pixel_11 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal weight_y : unsigned(BUILD.weight_bits - 1 downto 0);
  signal weight_x : unsigned(BUILD.weight_bits - 1 downto 0);
  -- The gain comes with the move and is needed behind the interpolation. Its initial value is one, so without gains it
  -- is a constant.
  signal gain    : unsigned(GAIN_WIDTH - 1 downto 0);
  signal gain_at : gains_t := (others => to_unsigned(2 ** BUILD.gain_bits, GAIN_WIDTH));
  -- The marks that go with a value.
  signal valid_at : std_logic_vector(1 to VALUE_LATENCY) := (others => '0');
  signal first_at : std_logic_vector(1 to VALUE_LATENCY) := (others => '0');
  signal last_at  : std_logic_vector(1 to VALUE_LATENCY) := (others => '0');

begin

  -- The tables are read with the position, so the move comes as soon as possible.
  tables : entity work.lens_tables
    generic map (
      BUILD => BUILD
    )
    port map (
      clk     => clk,
      load    => load,
      lens    => pixel.lens,
      profile => pixel.profile,
      move_y  => move_y,
      move_x  => move_x,
      gain    => gain
    );

  -- A move is about a pixel at most. The sum needs no further bit, because positions reach at most half a micro image
  -- beyond the sensor.
  move : process (clk) is
  begin

    if rising_edge(clk) then
      -- The position waits for the move of its lens, which comes out of a table.
      even_y_at(1)                     <= pixel.y(POSITION - 1 downto 0);
      even_x_at(1)                     <= pixel.x(POSITION - 1 downto 0);
      even_y_at(2 to MOVE_LATENCY - 1) <= even_y_at(1 to MOVE_LATENCY - 2);
      even_x_at(2 to MOVE_LATENCY - 1) <= even_x_at(1 to MOVE_LATENCY - 2);

      moved_y <= even_y_at(MOVE_LATENCY - 1) + move_y;
      moved_x <= even_x_at(MOVE_LATENCY - 1) + move_x;
    end if;

  end process move;

  -- raw_window reads four neighbouring pixels at once, from four memories by parity of line and column.
  window : entity work.raw_window
    generic map (
      MAX_COLUMNS => BUILD.max_columns,
      LINES       => BUILD.held_lines,
      DATA_BITS   => DATA_BITS,
      WEIGHT_BITS => BUILD.weight_bits
    )
    port map (
      clk        => clk,
      ring_write => ring_write,
      write_data => write_data,
      frame      => frame,
      position_y => moved_y,
      position_x => moved_x,
      pixel_00   => pixel_00,
      pixel_01   => pixel_01,
      pixel_10   => pixel_10,
      pixel_11   => pixel_11,
      weight_y   => weight_y,
      weight_x   => weight_x
    );

  channel : for c in 0 to BUILD.channels - 1 generate

    signal sample : unsigned(SAMPLE_BITS - 1 downto 0);
    signal value  : unsigned(VALUE_BITS - 1 downto 0);

  begin

    -- Each channel has its own interpolation; weights and gain are the same for all.
    interpolate : entity work.pixel_sample
      generic map (
        BUILD => BUILD
      )
      port map (
        clk      => clk,
        pixel_00 => unsigned(pixel_00((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits)),
        pixel_01 => unsigned(pixel_01((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits)),
        pixel_10 => unsigned(pixel_10((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits)),
        pixel_11 => unsigned(pixel_11((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits)),
        weight_y => weight_y,
        weight_x => weight_x,
        sample   => sample
      );

    level : entity work.sample_gain
      generic map (
        BUILD => BUILD
      )
      port map (
        clk    => clk,
        sample => sample,
        black  => black,
        gain   => gain_at(GAIN_WAIT),
        value  => value
      );

    values((c + 1) * VALUE_BITS - 1 downto c * VALUE_BITS) <= std_logic_vector(value);

  end generate channel;

  delay : process (clk) is
  begin

    if rising_edge(clk) then
      -- The gain was read with the move and is needed behind the interpolation.
      gain_at(1)                   <= gain;
      gain_at(2 to GAIN_WAIT)      <= gain_at(1 to GAIN_WAIT - 1);
      valid_at(1)                  <= pixel.valid;
      valid_at(2 to VALUE_LATENCY) <= valid_at(1 to VALUE_LATENCY - 1);
      first_at(1)                  <= pixel.first;
      first_at(2 to VALUE_LATENCY) <= first_at(1 to VALUE_LATENCY - 1);
      last_at(1)                   <= pixel.last;
      last_at(2 to VALUE_LATENCY)  <= last_at(1 to VALUE_LATENCY - 1);
      -- Only valid needs a reset; the other marks fit shift registers in LUTs, which have none.
      if reset = '1' then
        valid_at <= (others => '0');
      end if;
    end if;

  end process delay;

  value_valid <= valid_at(VALUE_LATENCY);
  value_first <= first_at(VALUE_LATENCY);
  value_last  <= last_at(VALUE_LATENCY);

end architecture rtl;
