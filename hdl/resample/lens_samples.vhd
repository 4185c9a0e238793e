-- SPDX-License-Identifier: Apache-2.0
-- The light at positions of the raw raster: lenses moved, four pixels interpolated, black level and gain taken.
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
    -- What the resampler is built for.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    MAX_COLUMNS      : positive range 2 to 8192;
    LINES            : positive range 4 to 256;
    LENSES           : positive range 2 to 1048576;
    MOVES            : boolean;
    GAINS            : boolean;
    CHANNELS         : positive range 1 to 3;
    PIXEL_BITS       : positive range 1 to 16;
    WEIGHT_BITS      : positive range 2 to 8;
    GUARD_BITS       : positive range 1 to 3;
    GAIN_BITS        : positive range 4 to 14
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Writes a word of the lens table or of the profile.
    load_lens    : in    std_logic;
    load_profile : in    std_logic;
    load_address : in    lens_t;
    load_data    : in    std_logic_vector(39 downto 0);
    -- From raw_writer.
    write_enable : in    std_logic;
    write_line   : in    place_t;
    write_slot   : in    natural range 0 to LINES / 2 - 1;
    write_column : in    unsigned(bits_for(MAX_COLUMNS - 1) - 1 downto 0);
    write_data   : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    -- The frame that is read: number of its line 0, its last line and column, its black level.
    base        : in    place_t;
    last_line   : in    place_t;
    last_column : in    place_t;
    black       : in    unsigned(PIXEL_BITS + GUARD_BITS - 1 downto 0);
    -- From lens_walk: side information (bit 0 is the one that reset clears), a position of the even grid, its lens and
    -- its pixel of the profile.
    tag        : in    std_logic_vector(2 downto 0);
    position_y : in    signed(15 + WEIGHT_BITS downto 0);
    position_x : in    signed(15 + WEIGHT_BITS downto 0);
    lens       : in    lens_t;
    profile    : in    profile_t;
    -- The side information of a position, and its channels; channel 0 in the low bits.
    value_tag : out   std_logic_vector(2 downto 0);
    values    : out   std_logic_vector(CHANNELS * (PIXEL_BITS + GUARD_BITS + GAIN_INTEGER_BITS) - 1 downto 0)
  );
end entity lens_samples;

architecture rtl of lens_samples is

  constant DATA_BITS    : positive := CHANNELS * PIXEL_BITS;
  constant POSITION     : positive := 16 + WEIGHT_BITS;
  constant SAMPLE_BITS  : positive := PIXEL_BITS + GUARD_BITS;
  constant VALUE_BITS   : positive := SAMPLE_BITS + GAIN_INTEGER_BITS;
  constant GAIN_WIDTH   : positive := GAIN_BITS + GAIN_INTEGER_BITS;
  constant MOVE_LATENCY : positive := 3;
  -- From a position to a value; of the gain from lens_tables to the multiplier.
  constant VALUE_LATENCY : positive := MOVE_LATENCY + WINDOW_LATENCY + SAMPLE_LATENCY + GAIN_LATENCY;
  constant GAIN_WAIT     : positive := MOVE_LATENCY + WINDOW_LATENCY + SAMPLE_LATENCY + 1 - 4;

  -- The position as if lenses were evenly spaced, until the move of its lens has been read.
  signal even_word : std_logic_vector(2 * POSITION - 1 downto 0);
  signal even_late : std_logic_vector(2 * POSITION - 1 downto 0);
  signal move_y    : signed(WEIGHT_BITS + 1 downto 0);
  signal move_x    : signed(WEIGHT_BITS + 1 downto 0);
  signal moved_y   : signed(POSITION - 1 downto 0) := (others => '0');
  signal moved_x   : signed(POSITION - 1 downto 0) := (others => '0');
  -- The four pixels around the moved position, and how far it lies between them.
  signal pixel_00 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal pixel_01 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal pixel_10 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal pixel_11 : std_logic_vector(DATA_BITS - 1 downto 0);
  signal weight_y : unsigned(WEIGHT_BITS - 1 downto 0);
  signal weight_x : unsigned(WEIGHT_BITS - 1 downto 0);
  -- The gain is known with the move, and needed after the interpolation.
  signal gain      : unsigned(GAIN_WIDTH - 1 downto 0);
  signal gain_now  : std_logic_vector(GAIN_WIDTH - 1 downto 0);
  signal gain_late : std_logic_vector(GAIN_WIDTH - 1 downto 0);

begin

  tables : entity work.lens_tables
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      LENSES           => LENSES,
      MOVES            => MOVES,
      GAINS            => GAINS,
      WEIGHT_BITS      => WEIGHT_BITS,
      GAIN_BITS        => GAIN_BITS
    )
    port map (
      clk          => clk,
      load_lens    => load_lens,
      load_profile => load_profile,
      load_address => load_address,
      load_data    => load_data,
      lens         => lens,
      profile      => profile,
      move_y       => move_y,
      move_x       => move_x,
      gain         => gain
    );

  even_word <= std_logic_vector(position_y) & std_logic_vector(position_x);

  even_delay : entity work.tag_delay
    generic map (
      WIDTH  => 2 * POSITION,
      LENGTH => MOVE_LATENCY - 1
    )
    port map (
      clk     => clk,
      tag     => even_word,
      delayed => even_late
    );

  -- A move is at most a pixel or so: the sum needs no bit more, as positions reach half a micro image beyond the
  -- sensor at most.
  move : process (clk) is
  begin

    if rising_edge(clk) then
      moved_y <= signed(even_late(2 * POSITION - 1 downto POSITION)) + move_y;
      moved_x <= signed(even_late(POSITION - 1 downto 0)) + move_x;
    end if;

  end process move;

  window : entity work.raw_window
    generic map (
      MAX_COLUMNS => MAX_COLUMNS,
      LINES       => LINES,
      DATA_BITS   => DATA_BITS,
      WEIGHT_BITS => WEIGHT_BITS
    )
    port map (
      clk          => clk,
      write_enable => write_enable,
      write_line   => write_line,
      write_slot   => write_slot,
      write_column => write_column,
      write_data   => write_data,
      base         => base,
      last_line    => last_line,
      last_column  => last_column,
      position_y   => moved_y,
      position_x   => moved_x,
      pixel_00     => pixel_00,
      pixel_01     => pixel_01,
      pixel_10     => pixel_10,
      pixel_11     => pixel_11,
      weight_y     => weight_y,
      weight_x     => weight_x
    );

  gain_now <= std_logic_vector(gain);

  gain_delay : entity work.tag_delay
    generic map (
      WIDTH  => GAIN_WIDTH,
      LENGTH => GAIN_WAIT
    )
    port map (
      clk     => clk,
      tag     => gain_now,
      delayed => gain_late
    );

  channel : for c in 0 to CHANNELS - 1 generate

    signal sample : unsigned(SAMPLE_BITS - 1 downto 0);
    signal value  : unsigned(VALUE_BITS - 1 downto 0);

  begin

    interpolate : entity work.pixel_sample
      generic map (
        PIXEL_BITS  => PIXEL_BITS,
        WEIGHT_BITS => WEIGHT_BITS,
        GUARD_BITS  => GUARD_BITS
      )
      port map (
        clk      => clk,
        pixel_00 => unsigned(pixel_00((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)),
        pixel_01 => unsigned(pixel_01((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)),
        pixel_10 => unsigned(pixel_10((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)),
        pixel_11 => unsigned(pixel_11((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)),
        weight_y => weight_y,
        weight_x => weight_x,
        sample   => sample
      );

    level : entity work.sample_gain
      generic map (
        SAMPLE_BITS => SAMPLE_BITS,
        GAIN_BITS   => GAIN_BITS
      )
      port map (
        clk    => clk,
        sample => sample,
        black  => black,
        gain   => unsigned(gain_late),
        value  => value
      );

    values((c + 1) * VALUE_BITS - 1 downto c * VALUE_BITS) <= std_logic_vector(value);

  end generate channel;

  -- What goes with a value: valid, first of a frame, last of a line. Of these reset clears valid alone.
  tags : entity work.tag_delay
    generic map (
      WIDTH  => 3,
      LENGTH => VALUE_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => tag,
      delayed => value_tag
    );

end architecture rtl;
