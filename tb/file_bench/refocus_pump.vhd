-- Pumps whole frames from a file through the raster refocuser into a file.
--
-- Reads input.bin and writes output.bin in the working directory (32-bit little-endian words, one
-- for each channel of each pixel, raster order), then clocks.txt: one "name value" pair a line.
--
-- SWEEP_FRAMES > 0 sweeps through the slices, a new one every so many frames; else the first of
-- the set is used. "slice" lines in clocks.txt tell the slice of each frame that came out.
--
-- STALL_PERCENT > 0 stalls both sides at pseudo-random clocks (SEED); a new input pixel or
-- output slot is then offered in that share of clocks fewer.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

library work;
use work.pump_pkg.all;

entity refocus_pump is
  generic (
    MICRO_IMAGE_SIZE    : positive := 1;
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
    COLUMNS             : positive := 1;
    ROWS                : positive := 1;
    FRAMES              : positive := 1;
    SWEEP_FRAMES        : natural  := 0;
    STALL_PERCENT       : natural  := 0;
    SEED                : positive := 1
  );
end entity refocus_pump;

architecture test of refocus_pump is

  constant PIXELS : positive := COLUMNS * ROWS * FRAMES;
  -- Clocks without a pixel on either side after which the core counts as hung.
  constant IDLE_LIMIT : positive := 100000;

  signal clk           : std_logic                                            := '0';
  signal reset         : std_logic                                            := '1';
  signal running       : boolean                                              := true;
  signal columns_port  : std_logic_vector(15 downto 0);
  signal rows_port     : std_logic_vector(15 downto 0);
  signal sweep         : std_logic;
  signal sweep_port    : std_logic_vector(7 downto 0);
  signal s_axis_tvalid : std_logic                                            := '0';
  signal s_axis_tready : std_logic;
  signal s_axis_tdata  : std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0) := (others => '0');
  signal s_axis_tuser  : std_logic_vector(0 downto 0)                         := "0";
  signal s_axis_tlast  : std_logic                                            := '0';
  signal m_axis_tvalid : std_logic;
  signal m_axis_tready : std_logic                                            := '0';
  signal m_axis_tdata  : std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
  signal m_axis_tuser  : std_logic_vector(0 downto 0);
  signal m_axis_tid    : std_logic_vector(7 downto 0);
  signal m_axis_tlast  : std_logic;
  signal error_flags   : std_logic_vector(4 downto 0);

begin

  clk          <= not clk after CLOCK_PERIOD / 2 when running else
                  '0';
  reset        <= '0' after 4 * CLOCK_PERIOD;
  columns_port <= std_logic_vector(to_unsigned(COLUMNS, 16));
  rows_port    <= std_logic_vector(to_unsigned(ROWS, 16));

  sweep      <= '1' when SWEEP_FRAMES > 0 else
                '0';
  sweep_port <= std_logic_vector(to_unsigned(SWEEP_FRAMES, 8));

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
      ANY_ROWS            => ANY_ROWS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns_port,
      rows          => rows_port,
      slice         => (others => '0'),
      sweep         => sweep,
      sweep_frames  => sweep_port,
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
      error_flags   => error_flags,
      error_clear   => '0'
    );

  pump : process (clk) is

    file input_file  : words_t open read_mode is "input.bin";
    file output_file : words_t open write_mode is "output.bin";
    file clocks_file : text open write_mode is "clocks.txt";

    variable word           : integer;
    variable pixel          : std_logic_vector(PIXEL_BITS - 1 downto 0);
    variable random         : random_t := SEED mod 65536;
    variable offered        : natural  := 0;
    variable received       : natural  := 0;
    variable clock          : natural  := 0;
    variable idle           : natural  := 0;
    variable first_in       : natural  := 0;
    variable first_out      : natural  := 0;
    variable last_in        : natural  := 0;
    variable last_out       : natural  := 0;
    variable accepted       : natural  := 0;
    variable framing_errors : natural  := 0;
    variable frame_slice    : natural  := 0;

    procedure check_framing (
      column : natural;
      row    : natural
    ) is
    begin

      if (m_axis_tlast = '1') /= (column = COLUMNS - 1) or
         (m_axis_tuser(0) = '1') /= (column = 0 and row = 0) then
        framing_errors := framing_errors + 1;
      end if;

    end procedure check_framing;

    variable stall : boolean;

  begin

    if rising_edge(clk) and reset = '0' then
      clock := clock + 1;
      idle  := idle + 1;

      -- A pixel was taken.
      if s_axis_tvalid = '1' and s_axis_tready = '1' then
        if accepted = 0 then
          first_in := clock;
        end if;
        accepted      := accepted + 1;
        last_in       := clock;
        idle          := 0;
        s_axis_tvalid <= '0';
      end if;

      -- Offer the next one.
      draw(random, STALL_PERCENT, stall);
      if offered = accepted and offered < PIXELS and not stall then

        for c in 0 to CHANNELS - 1 loop

          read(input_file, word);
          pixel := std_logic_vector(to_unsigned(word, PIXEL_BITS));

          s_axis_tdata((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS) <= pixel;

        end loop;

        s_axis_tvalid <= '1';
        s_axis_tlast  <= '0';
        s_axis_tuser  <= "0";
        if offered mod COLUMNS = COLUMNS - 1 then
          s_axis_tlast <= '1';
        end if;
        if offered mod (COLUMNS * ROWS) = 0 then
          s_axis_tuser <= "1";
        end if;
        offered := offered + 1;
      end if;

      -- A pixel came out.
      if m_axis_tvalid = '1' and m_axis_tready = '1' then
        if received = 0 then
          first_out := clock;
        end if;

        for c in 0 to CHANNELS - 1 loop

          word := to_integer(unsigned(m_axis_tdata((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)));
          write(output_file, word);

        end loop;

        check_framing(received mod COLUMNS, (received / COLUMNS) mod ROWS);
        if received mod (COLUMNS * ROWS) = 0 then
          frame_slice := to_integer(unsigned(m_axis_tid));
          write_count(clocks_file, "slice", frame_slice);
        elsif frame_slice /= to_integer(unsigned(m_axis_tid)) then
          framing_errors := framing_errors + 1;
        end if;
        received := received + 1;
        last_out := clock;
        idle     := 0;
      end if;

      draw(random, STALL_PERCENT, stall);
      if stall then
        m_axis_tready <= '0';
      else
        m_axis_tready <= '1';
      end if;

      if (received >= PIXELS and idle >= SILENCE) or idle >= IDLE_LIMIT then
        write_count(clocks_file, "accepted", accepted);
        write_count(clocks_file, "received", received);
        write_count(clocks_file, "clocks", last_out - first_in + 1);
        write_count(clocks_file, "latency", first_out - first_in);
        write_count(clocks_file, "input_clocks", last_in - first_in + 1);
        write_count(clocks_file, "framing_errors", framing_errors);
        write_count(clocks_file, "error_flags", to_integer(unsigned(error_flags)));
        running <= false;
      end if;
    end if;

  end process pump;

end architecture test;
