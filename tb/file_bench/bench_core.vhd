-- SPDX-License-Identifier: Apache-2.0
-- A core of any engine behind one set of ports: what the file benches simulate. Synthesisable.
--
-- "fir" and "moving_sum": a raster refocuser. "stack": a focal stack, and a depth index behind it.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;
use work.sharpness_pkg.all;

entity bench_core is
  generic (
    -- Those of raster_refocuser, focal_stack and depth_index under their names; ENGINE may be "stack" too.
    MICRO_IMAGE_SIZE    : positive := 2;
    SHIFTS              : string   := "0";
    CENTRED             : boolean  := true;
    INTERPOLATION_ORDER : natural  := 0;
    HOLD                : boolean  := false;
    PARALLEL_ROWS       : positive := 1;
    MAX_COLUMNS         : positive := 2048;
    CHANNELS            : positive := 1;
    PIXEL_BITS          : positive := 8;
    EXACT               : boolean  := true;
    FRACTION_BITS       : natural  := 0;
    GUARD_BITS          : natural  := 0;
    BROADCAST_TAPS      : natural  := 0;
    ENGINE              : string   := "fir";
    ANY_ROWS            : boolean  := false;
    SHARPENING          : string   := "";
    BOX                 : string   := "";
    BORDER_NORMALISED   : boolean  := false;
    PIXELS_PER_CLOCK    : positive := 1;
    INPUT_LINES         : positive := 1;
    RADIUS              : natural  := 1;
    CONFIDENCE          : natural  := 0;
    VOTE_RADIUS         : natural  := 0;
    -- A stack has these: SHIFTS, PICTURE and SHARP_TOO of its depth index.
    INDEX_SHIFTS : string  := "";
    PICTURE      : boolean := true;
    SHARP_TOO    : boolean := false
  );
  port (
    clk     : in    std_logic;
    reset   : in    std_logic;
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Frames of each slice of a sweep; 0: all frames are of the first slice.
    sweep_frames : in    std_logic_vector(7 downto 0);
    -- AXI4-Stream video: tuser(0) = start of frame, tlast = end of line, channel 0 in the low bits of tdata.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- The slices of a stack on their way to the depth index, to look at; nothing with other engines.
    slices_tvalid : out   std_logic;
    slices_tready : out   std_logic;
    slices_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * slice_count(SHIFTS) * CHANNELS * PIXEL_BITS - 1 downto 0);
    slices_tuser  : out   std_logic_vector(0 downto 0);
    slices_tlast  : out   std_logic;
    -- tid: slice of the frame. Of a stack, which is all in focus here, the slice of each pixel, and its depth between
    -- slices, fraction in the low bits (0 without).
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_index  : out   std_logic_vector(PIXELS_PER_CLOCK * 8 - 1 downto 0);
    m_axis_depth  : out   std_logic_vector(PIXELS_PER_CLOCK * 16 - 1 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Faults of the stream, see raster_refocuser; never cleared.
    error_flags : out   std_logic_vector(4 downto 0)
  );
end entity bench_core;

architecture rtl of bench_core is

  constant STACK : boolean := same_text(ENGINE, "stack");

begin

  raster : if not STACK generate

    signal sweep : std_logic;

  begin

    -- 0 frames a slice are no sweep; the port of the core would count them as 1.
    sweep <= '0' when sweep_frames = "00000000" else
             '1';

    core : entity work.raster_refocuser
      generic map (
        MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
        SHIFTS              => SHIFTS,
        CENTRED             => CENTRED,
        INTERPOLATION_ORDER => INTERPOLATION_ORDER,
        HOLD                => HOLD,
        PARALLEL_ROWS       => PARALLEL_ROWS,
        MAX_COLUMNS         => MAX_COLUMNS,
        CHANNELS            => CHANNELS,
        PIXEL_BITS          => PIXEL_BITS,
        EXACT               => EXACT,
        FRACTION_BITS       => FRACTION_BITS,
        GUARD_BITS          => GUARD_BITS,
        BROADCAST_TAPS      => BROADCAST_TAPS,
        ENGINE              => ENGINE,
        ANY_ROWS            => ANY_ROWS,
        SHARPENING          => SHARPENING,
        BOX                 => BOX,
        BORDER_NORMALISED   => BORDER_NORMALISED,
        PIXELS_PER_CLOCK    => PIXELS_PER_CLOCK
      )
      port map (
        clk           => clk,
        reset         => reset,
        columns       => columns,
        rows          => rows,
        slice         => (others => '0'),
        sweep         => sweep,
        sweep_frames  => sweep_frames,
        s_axis_tvalid => s_axis_tvalid,
        s_axis_tready => s_axis_tready,
        s_axis_tdata  => s_axis_tdata,
        s_axis_tuser  => s_axis_tuser,
        s_axis_tlast  => s_axis_tlast,
        m_axis_tvalid => m_axis_tvalid,
        m_axis_tready => m_axis_tready,
        m_axis_tdata  => m_axis_tdata,
        m_axis_tuser  => m_axis_tuser,
        m_axis_tid    => m_axis_tid,
        m_axis_tlast  => m_axis_tlast,
        error_flags   => error_flags
      );

    -- What only a stack gives stands still, so that the bench has one set of ports for all engines.
    m_axis_index  <= (others => '0');
    m_axis_depth  <= (others => '0');
    slices_tvalid <= '0';
    slices_tready <= '0';
    slices_tdata  <= (others => '0');
    slices_tuser  <= "0";
    slices_tlast  <= '0';

  end generate raster;

  stack_and_index : if STACK generate

    constant DATA_BITS : positive := CHANNELS * PIXEL_BITS;
    constant WORD_BITS : positive := index_word_bits(CHANNELS, PIXEL_BITS, INDEX_SHIFTS, false, PICTURE);
    constant INDEX_LOW : natural := choose(PICTURE, DATA_BITS, 0);

    signal valid        : std_logic;
    signal ready        : std_logic;
    signal data         : std_logic_vector(PIXELS_PER_CLOCK * slice_count(SHIFTS) * DATA_BITS - 1 downto 0);
    signal user         : std_logic_vector(0 downto 0);
    signal last         : std_logic;
    signal found        : std_logic_vector(PIXELS_PER_CLOCK * WORD_BITS - 1 downto 0);
    signal stack_errors : std_logic_vector(4 downto 0);
    signal index_errors : std_logic_vector(4 downto 0);

  begin

    core : entity work.focal_stack
      generic map (
        MICRO_IMAGE_SIZE  => MICRO_IMAGE_SIZE,
        SHIFTS            => SHIFTS,
        CENTRED           => CENTRED,
        MAX_COLUMNS       => MAX_COLUMNS,
        CHANNELS          => CHANNELS,
        PIXEL_BITS        => PIXEL_BITS,
        INPUT_LINES       => INPUT_LINES,
        BOX               => BOX,
        BORDER_NORMALISED => BORDER_NORMALISED,
        PIXELS_PER_CLOCK  => PIXELS_PER_CLOCK
      )
      port map (
        clk           => clk,
        reset         => reset,
        columns       => columns,
        rows          => rows,
        s_axis_tvalid => s_axis_tvalid,
        s_axis_tready => s_axis_tready,
        s_axis_tdata  => s_axis_tdata,
        s_axis_tuser  => s_axis_tuser,
        s_axis_tlast  => s_axis_tlast,
        m_axis_tvalid => valid,
        m_axis_tready => ready,
        m_axis_tdata  => data,
        m_axis_tuser  => user,
        m_axis_tlast  => last,
        error_flags   => stack_errors,
        error_clear   => '0'
      );

    index : entity work.depth_index
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SLICES           => slice_count(SHIFTS) / choose(SHARP_TOO, 2, 1),
        RADIUS           => RADIUS,
        CONFIDENCE       => CONFIDENCE,
        VOTE_RADIUS      => VOTE_RADIUS,
        SHIFTS           => INDEX_SHIFTS,
        PICTURE          => PICTURE,
        SHARP_TOO        => SHARP_TOO,
        MAX_COLUMNS      => MAX_COLUMNS,
        PIXELS_PER_CLOCK => PIXELS_PER_CLOCK,
        CHANNELS         => CHANNELS,
        PIXEL_BITS       => PIXEL_BITS
      )
      port map (
        clk           => clk,
        reset         => reset,
        columns       => columns,
        rows          => rows,
        picture_rows  => rows,
        slice         => x"00",
        sweep         => '0',
        sweep_frames  => x"00",
        s_axis_tvalid => valid,
        s_axis_tready => ready,
        s_axis_tdata  => data,
        s_axis_tuser  => user,
        s_axis_tlast  => last,
        m_axis_tvalid => m_axis_tvalid,
        m_axis_tready => m_axis_tready,
        m_axis_tdata  => found,
        m_axis_tuser  => m_axis_tuser,
        m_axis_tid    => open,
        m_axis_tlast  => m_axis_tlast,
        error_flags   => index_errors,
        error_clear   => '0'
      );

    each_pixel : for j in 0 to PIXELS_PER_CLOCK - 1 generate

      signal word : std_logic_vector(WORD_BITS - 1 downto 0);

    begin

      -- A word has the pixel, its index, and the depth on top.
      word <= found((j + 1) * WORD_BITS - 1 downto j * WORD_BITS);

      m_axis_index((j + 1) * 8 - 1 downto j * 8) <= word(INDEX_LOW + 7 downto INDEX_LOW);

      with_picture : if PICTURE generate
        m_axis_tdata((j + 1) * DATA_BITS - 1 downto j * DATA_BITS) <= word(DATA_BITS - 1 downto 0);
      end generate with_picture;

      no_picture : if not PICTURE generate
        m_axis_tdata((j + 1) * DATA_BITS - 1 downto j * DATA_BITS) <= (others => '0');
      end generate no_picture;

      depth_between : if INDEX_SHIFTS'length > 0 generate
        m_axis_depth((j + 1) * 16 - 1 downto j * 16) <= word(WORD_BITS - 1 downto WORD_BITS - 16);
      end generate depth_between;

      slices_alone : if INDEX_SHIFTS'length = 0 generate
        m_axis_depth((j + 1) * 16 - 1 downto j * 16) <= (others => '0');
      end generate slices_alone;

    end generate each_pixel;

    slices_tvalid <= valid;
    slices_tready <= ready;
    slices_tdata  <= data;
    slices_tuser  <= user;
    slices_tlast  <= last;
    m_axis_tid    <= (others => '0');
    -- Both see the same stream, so either may tell of a fault.
    error_flags <= stack_errors or index_errors;

  end generate stack_and_index;

end architecture rtl;
