-- SPDX-License-Identifier: Apache-2.0
-- Moves whole frames from a file through a core of any engine into files.
--
-- Reads input.bin in the working directory and writes output.bin: 32-bit little-endian words, one for each channel of
-- each pixel, raster order; with several pixels a clock, lines end with whatever fills up the last token. A stack
-- gives two files instead: slices.bin, all slices of a pixel one after another, and found.bin, the pixels of a token
-- that are all in focus, then their slices, then their depths. Then clocks.txt: one "name value" pair a line.
--
-- SWEEP_FRAMES > 0 sweeps through the slices, a new one every so many frames; else the first of the set is used.
-- "slice" lines in clocks.txt tell the slice of each frame that came out.
--
-- STALL_PERCENT > 0 stalls both sides at pseudo-random clocks (SEED): in that share of clocks, or a third of it, no new
-- pixel is offered, or none is taken (stall_share in bench_pkg).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

library work;
use work.math_pkg.all;
use work.bench_pkg.all;
use work.number_set_pkg.all;

entity file_bench is
  generic (
    -- Passed on to bench_core.
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
    INDEX_SHIFTS        : string   := "";
    SHARP_TOO           : boolean  := false;
    PICTURE             : boolean  := true;
    -- The frames in the file.
    COLUMNS       : positive := 1;
    ROWS          : positive := 1;
    FRAMES        : positive := 1;
    SWEEP_FRAMES  : natural  := 0;
    STALL_PERCENT : natural  := 0;
    SEED          : positive := 1
  );
end entity file_bench;

architecture test of file_bench is

  constant STACK  : boolean  := same_text(ENGINE, "stack");
  constant SLICES : positive := slice_count(SHIFTS);
  -- Values of a token, and tokens: one pixel or several.
  constant VALUES       : positive := PIXELS_PER_CLOCK * CHANNELS;
  constant LINE_TOKENS  : positive := divide_up(COLUMNS, PIXELS_PER_CLOCK);
  constant FRAME_TOKENS : positive := LINE_TOKENS * ROWS;
  constant TOKENS       : positive := FRAME_TOKENS * FRAMES;
  constant CLOCK_PERIOD : time     := 10 ns;
  -- Clocks after the last pixel in which no other may come.
  constant SILENCE : positive := 64;
  -- Clocks without a pixel on either side after which the core counts as hung; lines wait in a stack.
  constant IDLE_LIMIT : positive := 100000 + choose(STACK, 100 * MICRO_IMAGE_SIZE * MAX_COLUMNS, 0);

  signal clk           : std_logic                                          := '0';
  signal reset         : std_logic                                          := '1';
  signal running       : boolean                                            := true;
  signal columns_port  : std_logic_vector(15 downto 0);
  signal rows_port     : std_logic_vector(15 downto 0);
  signal sweep_port    : std_logic_vector(7 downto 0);
  signal s_axis_tvalid : std_logic                                          := '0';
  signal s_axis_tready : std_logic;
  signal s_axis_tdata  : std_logic_vector(VALUES * PIXEL_BITS - 1 downto 0) := (others => '0');
  signal s_axis_tuser  : std_logic_vector(0 downto 0)                       := "0";
  signal s_axis_tlast  : std_logic                                          := '0';
  signal slices_tvalid : std_logic;
  signal slices_tready : std_logic;
  signal slices_tdata  : std_logic_vector(SLICES * VALUES * PIXEL_BITS - 1 downto 0);
  signal slices_tuser  : std_logic_vector(0 downto 0);
  signal slices_tlast  : std_logic;
  signal m_axis_tvalid : std_logic;
  signal m_axis_tready : std_logic                                          := '0';
  signal m_axis_tdata  : std_logic_vector(VALUES * PIXEL_BITS - 1 downto 0);
  signal m_axis_tuser  : std_logic_vector(0 downto 0);
  signal m_axis_tid    : std_logic_vector(7 downto 0);
  signal m_axis_index  : std_logic_vector(PIXELS_PER_CLOCK * 8 - 1 downto 0);
  signal m_axis_depth  : std_logic_vector(PIXELS_PER_CLOCK * 16 - 1 downto 0);
  signal m_axis_tlast  : std_logic;
  signal error_flags   : std_logic_vector(4 downto 0);

  -- Whether the marks of the number-th token are wrong.

  function misframed (
    number : natural;
    user   : std_logic_vector(0 downto 0);
    last   : std_logic
  ) return boolean is
  begin

    return last /= ends_line(number, LINE_TOKENS) or user /= starts_frame(number, FRAME_TOKENS);

  end function misframed;

  function output_name return string is
  begin

    if STACK then
      return "found.bin";
    end if;

    return "output.bin";

  end function output_name;

begin

  clk          <= not clk after CLOCK_PERIOD / 2 when running else
                  '0';
  reset        <= '0' after 4 * CLOCK_PERIOD;
  columns_port <= std_logic_vector(to_unsigned(COLUMNS, 16));
  rows_port    <= std_logic_vector(to_unsigned(ROWS, 16));
  sweep_port   <= std_logic_vector(to_unsigned(SWEEP_FRAMES, 8));

  design : entity work.bench_core
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
      PIXELS_PER_CLOCK    => PIXELS_PER_CLOCK,
      INPUT_LINES         => INPUT_LINES,
      RADIUS              => RADIUS,
      CONFIDENCE          => CONFIDENCE,
      VOTE_RADIUS         => VOTE_RADIUS,
      INDEX_SHIFTS        => INDEX_SHIFTS,
      SHARP_TOO           => SHARP_TOO,
      PICTURE             => PICTURE
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns_port,
      rows          => rows_port,
      sweep_frames  => sweep_port,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      s_axis_tuser  => s_axis_tuser,
      s_axis_tlast  => s_axis_tlast,
      slices_tvalid => slices_tvalid,
      slices_tready => slices_tready,
      slices_tdata  => slices_tdata,
      slices_tuser  => slices_tuser,
      slices_tlast  => slices_tlast,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tid    => m_axis_tid,
      m_axis_index  => m_axis_index,
      m_axis_depth  => m_axis_depth,
      m_axis_tlast  => m_axis_tlast,
      error_flags   => error_flags
    );

  bench : process (clk) is

    file input_file  : words_t open read_mode is "input.bin";
    file output_file : words_t open write_mode is output_name;
    file slices_file : words_t;
    file clocks_file : text open write_mode is "clocks.txt";

    variable random         : random_t := SEED mod 65536;
    variable stall          : boolean;
    variable offered        : natural  := 0;
    variable accepted       : natural  := 0;
    variable stacked        : natural  := 0;
    variable received       : natural  := 0;
    variable clock          : natural  := 0;
    variable idle           : natural  := 0;
    variable first_in       : natural  := 0;
    variable last_in        : natural  := 0;
    variable first_out      : natural  := 0;
    variable last_out       : natural  := 0;
    variable framing_errors : natural  := 0;
    variable slice          : natural  := 0;
    variable frame_slice    : natural  := 0;

  begin

    -- Everything happens at one edge: what is seen was registered at the edge before, so no delta
    -- matters.
    if rising_edge(clk) and reset = '0' then
      -- Only a stack has this file; opened here, as a declaration would make it for all.
      if STACK and clock = 0 then
        file_open(slices_file, "slices.bin", write_mode);
      end if;
      clock := clock + 1;
      idle  := idle + 1;

      -- A token was taken.
      if s_axis_tvalid = '1' and s_axis_tready = '1' then
        if accepted = 0 then
          first_in := clock;
        end if;
        accepted      := accepted + 1;
        last_in       := clock;
        idle          := 0;
        s_axis_tvalid <= '0';
      end if;

      -- Only one token is on offer: the next is drawn when it was taken.
      draw(random, stall, stall_share(STALL_PERCENT, clock, false));
      if offered = accepted and offered < TOKENS and not stall then
        read_values(input_file, PIXEL_BITS, s_axis_tdata);
        s_axis_tvalid <= '1';
        s_axis_tlast  <= ends_line(offered, LINE_TOKENS);
        s_axis_tuser  <= starts_frame(offered, FRAME_TOKENS);
        offered       := offered + 1;
      end if;

      -- The slices of a pixel came out.
      if slices_tvalid = '1' and slices_tready = '1' then
        write_values(slices_file, PIXEL_BITS, slices_tdata);
        if misframed(stacked, slices_tuser, slices_tlast) then
          framing_errors := framing_errors + 1;
        end if;
        stacked := stacked + 1;
        idle    := 0;
      end if;

      -- A token came out.
      if m_axis_tvalid = '1' and m_axis_tready = '1' then
        if received = 0 then
          first_out := clock;
        end if;
        write_values(output_file, PIXEL_BITS, m_axis_tdata);
        slice := to_integer(unsigned(m_axis_tid));
        if STACK then
          write_values(output_file, 8, m_axis_index);
          write_values(output_file, 16, m_axis_depth);
        elsif received mod FRAME_TOKENS = 0 then
          frame_slice := slice;
          write_count(clocks_file, "slice", slice);
        end if;
        if misframed(received, m_axis_tuser, m_axis_tlast) or (slice /= frame_slice and not STACK) then
          framing_errors := framing_errors + 1;
        end if;
        received := received + 1;
        last_out := clock;
        idle     := 0;
      end if;

      -- Drawn anew for the sink, so that both sides stall apart from each other.
      draw(random, stall, stall_share(STALL_PERCENT, clock, true));
      if stall then
        m_axis_tready <= '0';
      else
        m_axis_tready <= '1';
      end if;

      -- Some clocks of silence behind the last token show that none comes in excess. A core that
      -- hangs ends the run as well, with what it gave until then.
      if (received >= TOKENS and idle >= SILENCE) or idle >= IDLE_LIMIT then
        write_count(clocks_file, "accepted", accepted);
        if STACK then
          write_count(clocks_file, "stacked", stacked);
        end if;
        write_count(clocks_file, "received", received);
        write_count(clocks_file, "clocks", last_out - first_in + 1);
        -- The latency of a stack is that of its parts, and its tests measure those.
        if not STACK then
          write_count(clocks_file, "latency", first_out - first_in);
        end if;
        write_count(clocks_file, "input_clocks", last_in - first_in + 1);
        write_count(clocks_file, "framing_errors", framing_errors);
        write_count(clocks_file, "error_flags", to_integer(unsigned(error_flags)));
        running <= false;
      end if;
    end if;

  end process bench;

end architecture test;
