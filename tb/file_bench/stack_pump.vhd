-- Pumps a frame from a file through the focal stack and the depth index into files.
--
-- Reads input.bin and writes slices.bin (all slices of a pixel one after another) and found.bin (the pixel, then
-- its index) in the working directory: 32-bit little-endian words, one for each channel of each pixel, raster
-- order. Then clocks.txt: one "name value" pair a line.
--
-- STALL_PERCENT, SEED: as in refocus_pump.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

library work;
use work.pump_pkg.all;
use work.refocus_pkg.all;

entity stack_pump is
  generic (
    MICRO_IMAGE_SIZE : positive := 2;
    SHIFTS           : string   := "0";
    CENTRED          : boolean  := true;
    MAX_COLUMNS      : positive := 2048;
    CHANNELS         : positive := 1;
    PIXEL_BITS       : positive := 8;
    INPUT_LINES      : positive := 1;
    RADIUS           : natural  := 1;
    COLUMNS          : positive := 1;
    ROWS             : positive := 1;
    STALL_PERCENT    : natural  := 0;
    SEED             : positive := 1
  );
end entity stack_pump;

architecture test of stack_pump is

  constant PIXELS    : positive := COLUMNS * ROWS;
  constant SLICES    : positive := slice_count(SHIFTS);
  constant DATA_BITS : positive := CHANNELS * PIXEL_BITS;
  -- Clocks without a pixel on either side after which the core counts as hung, beyond the lines that wait in it.
  constant IDLE_LIMIT : positive := 100000 + 100 * MICRO_IMAGE_SIZE * MAX_COLUMNS;

  signal clk           : std_logic                                := '0';
  signal reset         : std_logic                                := '1';
  signal running       : boolean                                  := true;
  signal columns_port  : std_logic_vector(15 downto 0);
  signal rows_port     : std_logic_vector(15 downto 0);
  signal s_axis_tvalid : std_logic                                := '0';
  signal s_axis_tready : std_logic;
  signal s_axis_tdata  : std_logic_vector(DATA_BITS - 1 downto 0) := (others => '0');
  signal s_axis_tuser  : std_logic_vector(0 downto 0)             := "0";
  signal s_axis_tlast  : std_logic                                := '0';
  signal stack_tvalid  : std_logic;
  signal stack_tready  : std_logic;
  signal stack_tdata   : std_logic_vector(SLICES * DATA_BITS - 1 downto 0);
  signal stack_tuser   : std_logic_vector(0 downto 0);
  signal stack_tlast   : std_logic;
  signal m_axis_tvalid : std_logic;
  signal m_axis_tready : std_logic                                := '0';
  signal m_axis_tdata  : std_logic_vector(DATA_BITS + 7 downto 0);
  signal m_axis_tuser  : std_logic_vector(0 downto 0);
  signal m_axis_tlast  : std_logic;
  signal error_flags   : std_logic_vector(4 downto 0);

begin

  clk          <= not clk after CLOCK_PERIOD / 2 when running else
                  '0';
  reset        <= '0' after 4 * CLOCK_PERIOD;
  columns_port <= std_logic_vector(to_unsigned(COLUMNS, 16));
  rows_port    <= std_logic_vector(to_unsigned(ROWS, 16));

  core : entity work.stack_and_index
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      MAX_COLUMNS      => MAX_COLUMNS,
      CHANNELS         => CHANNELS,
      PIXEL_BITS       => PIXEL_BITS,
      INPUT_LINES      => INPUT_LINES,
      RADIUS           => RADIUS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns_port,
      rows          => rows_port,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      s_axis_tuser  => s_axis_tuser,
      s_axis_tlast  => s_axis_tlast,
      stack_tvalid  => stack_tvalid,
      stack_tready  => stack_tready,
      stack_tdata   => stack_tdata,
      stack_tuser   => stack_tuser,
      stack_tlast   => stack_tlast,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tlast  => m_axis_tlast,
      error_flags   => error_flags
    );

  pump : process (clk) is

    file input_file  : words_t open read_mode is "input.bin";
    file slices_file : words_t open write_mode is "slices.bin";
    file found_file  : words_t open write_mode is "found.bin";
    file clocks_file : text open write_mode is "clocks.txt";

    variable word           : integer;
    variable pixel          : std_logic_vector(PIXEL_BITS - 1 downto 0);
    variable random         : random_t := SEED mod 65536;
    variable stall          : boolean;
    variable offered        : natural  := 0;
    variable accepted       : natural  := 0;
    variable stacked        : natural  := 0;
    variable received       : natural  := 0;
    variable clock          : natural  := 0;
    variable idle           : natural  := 0;
    variable first_in       : natural  := 0;
    variable last_out       : natural  := 0;
    variable last_in        : natural  := 0;
    variable framing_errors : natural  := 0;

    procedure check_framing (
      number : natural;
      user   : std_logic;
      last   : std_logic
    ) is
    begin

      if (last = '1') /= (number mod COLUMNS = COLUMNS - 1) or (user = '1') /= (number mod PIXELS = 0) then
        framing_errors := framing_errors + 1;
      end if;

    end procedure check_framing;

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
        if offered = 0 then
          s_axis_tuser <= "1";
        end if;
        offered := offered + 1;
      end if;

      -- The slices of a pixel came out.
      if stack_tvalid = '1' and stack_tready = '1' then

        for c in 0 to SLICES * CHANNELS - 1 loop

          word := to_integer(unsigned(stack_tdata((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)));
          write(slices_file, word);

        end loop;

        check_framing(stacked, stack_tuser(0), stack_tlast);
        stacked := stacked + 1;
        idle    := 0;
      end if;

      -- A pixel of the picture and its index came out.
      if m_axis_tvalid = '1' and m_axis_tready = '1' then

        for c in 0 to CHANNELS - 1 loop

          word := to_integer(unsigned(m_axis_tdata((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)));
          write(found_file, word);

        end loop;

        word     := to_integer(unsigned(m_axis_tdata(DATA_BITS + 7 downto DATA_BITS)));
        write(found_file, word);
        check_framing(received, m_axis_tuser(0), m_axis_tlast);
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
        write_count(clocks_file, "stacked", stacked);
        write_count(clocks_file, "received", received);
        write_count(clocks_file, "clocks", last_out - first_in + 1);
        write_count(clocks_file, "input_clocks", last_in - first_in + 1);
        write_count(clocks_file, "framing_errors", framing_errors);
        write_count(clocks_file, "error_flags", to_integer(unsigned(error_flags)));
        running <= false;
      end if;
    end if;

  end process pump;

end architecture test;
