-- SPDX-License-Identifier: Apache-2.0
-- Sends serial TMDS bits from a file into a board (board_under_test: board_atlys.vhd or board_ulx3s.vhd) and writes
-- the bits that come out into another.
--
-- With `start` (or at once with AUTO_START, the sweep switch as SWEEP says) input.bin in the working directory is
-- played, and tmds_monitor writes output.bin until it ends; `done` follows. Both files hold the same kind of words, one
-- a pixel clock. Words of the input with bit 31 set are commands: the code in bits 24 to 30, a value in bits 0 to 23:
--
--   1 pixel clock period in fs * 64       2, 3, 4 skew of channel 0, 1, 2 in ps
--   5 jitter of the edges, +- ps          6 clock lane: 1 runs, 0 stands still
--   7 cable: 1 plugged, 0 open            8 skew of the clock lane in ps
--   9 blanking for as many ns             10 faults of the delay lines, see model_faults
--   11 an open clock input that oscillates for as many ns, at ever another rate
--   12 a character to the serial port, BIT_TIME * 10 ns a bit, behind those before it; the words go on meanwhile
--   13 PLLs of the ULX3S lock after so many us

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity hdmi_bench is
  generic (
    AUTO_START          : boolean  := false;
    SWEEP               : boolean  := false;
    SEED                : positive := 1;
    MICRO_IMAGE_SIZE    : positive := 3;
    SHIFTS              : string   := "2";
    MAX_COLUMNS         : positive := 64;
    EXACT               : boolean  := true;
    FRACTION_BITS       : natural  := 0;
    GUARD_BITS          : natural  := 0;
    INTERPOLATION_ORDER : natural  := 0;
    HOLD                : boolean  := false;
    BROADCAST_TAPS      : natural  := 0;
    ENGINE              : string   := "fir";
    BOX                 : string   := "";
    PATTERN_H_ACTIVE    : positive := 64;
    PATTERN_H_FRONT     : positive := 6;
    PATTERN_H_SYNC      : positive := 4;
    PATTERN_H_BACK      : positive := 11;
    PATTERN_V_ACTIVE    : positive := 36;
    PATTERN_V_FRONT     : positive := 1;
    PATTERN_V_SYNC      : positive := 2;
    PATTERN_V_BACK      : positive := 4;
    METER_WINDOW        : positive := 16000;
    LOCK_TIMEOUT        : positive := 20000;
    DATA_PATIENCE       : positive := 625;
    BUTTON_STABLE       : positive := 10;
    BIT_TIME            : positive := 10;
    DDC_QUARTER         : positive := 50;
    DDC_PAUSE           : positive := 100;
    SWITCH_FRAMES       : positive := 1;
    ALIGN_TIMEOUT       : positive := 8192;
    CLOCK_RANGE         : natural  := 2;
    OWN_DIVIDE          : positive := 12;
    SEARCH_TIMEOUT      : positive := 600
  );
  port (
    start          : in    std_logic;
    done           : out   std_logic;
    reset_n        : in    std_logic;
    uart_rx        : in    std_logic;
    uart_tx        : out   std_logic;
    button_up      : in    std_logic;
    button_down    : in    std_logic;
    button_clear   : in    std_logic;
    switch_pattern : in    std_logic;
    switch_pass    : in    std_logic;
    switch_sweep   : in    std_logic;
    led            : out   std_logic_vector(7 downto 0)
  );
end entity hdmi_bench;

architecture test of hdmi_bench is

  type words_t is file of integer;

  -- Control tokens of 00 in all channels.
  constant IDLE : std_logic_vector(31 downto 0) := "00" & "1101010100" & "1101010100" & "1101010100";

  subtype lanes_t is std_logic_vector(2 downto 0);

  subtype random_t is natural range 0 to 65535;

  -- What the board gets: the ports, or with AUTO_START all at rest.

  type to_board_t is record
    reset_n        : std_logic;
    uart_rx        : std_logic;
    button_up      : std_logic;
    button_down    : std_logic;
    button_clear   : std_logic;
    switch_pattern : std_logic;
    switch_pass    : std_logic;
    switch_sweep   : std_logic;
  end record to_board_t;

  signal to_board   : to_board_t;
  signal serial     : std_logic := '1';
  signal clk_100    : std_logic := '0';
  signal running    : boolean   := true;
  signal in_clk_p   : std_logic := '0';
  signal in_clk_n   : std_logic := '1';
  signal in_data_p  : lanes_t   := "000";
  signal in_data_n  : lanes_t   := "111";
  signal plugged    : std_logic := '1';
  signal pin_clk_p  : std_logic;
  signal pin_clk_n  : std_logic;
  signal pin_data_p : lanes_t;
  signal pin_data_n : lanes_t;
  signal out_clk_p  : std_logic;
  signal out_data_p : lanes_t;
  signal fault_seed : natural   := 0;
  signal lock_us    : natural   := 0;
  signal ddc_scl    : std_logic;
  signal ddc_sda    : std_logic;
  signal playing    : boolean   := false;
  signal played     : boolean   := false;
  signal captured   : boolean   := false;

begin

  clk_100 <= not clk_100 after 5 ns when running else
             '0';

  -- As with JP6 and JP7 on: the board reads its own EDID.
  ddc_scl <= 'H';
  ddc_sda <= 'H';

  to_board.reset_n        <= '1' when AUTO_START else
                             reset_n;
  to_board.uart_rx        <= serial when AUTO_START else
                             uart_rx and serial;
  to_board.button_up      <= '0' when AUTO_START else
                             button_up;
  to_board.button_down    <= '0' when AUTO_START else
                             button_down;
  to_board.button_clear   <= '0' when AUTO_START else
                             button_clear;
  to_board.switch_pattern <= '0' when AUTO_START else
                             switch_pattern;
  to_board.switch_pass    <= '0' when AUTO_START else
                             switch_pass;
  to_board.switch_sweep   <= '1' when AUTO_START and SWEEP else
                             '0' when AUTO_START else
                             switch_sweep;

  done <= '1' when start = '1' and played and not playing and not captured else
          '0';

  -- An open cable: the pull-ups of the sink hold both wires of each pair.
  pin_clk_p  <= in_clk_p when plugged = '1' else
                '1';
  pin_clk_n  <= in_clk_n when plugged = '1' else
                '1';
  pin_data_p <= in_data_p when plugged = '1' else
                "111";
  pin_data_n <= in_data_n when plugged = '1' else
                "111";

  board : entity work.board_under_test
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      MAX_COLUMNS         => MAX_COLUMNS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      BOX                 => BOX,
      PATTERN_H_ACTIVE    => PATTERN_H_ACTIVE,
      PATTERN_H_FRONT     => PATTERN_H_FRONT,
      PATTERN_H_SYNC      => PATTERN_H_SYNC,
      PATTERN_H_BACK      => PATTERN_H_BACK,
      PATTERN_V_ACTIVE    => PATTERN_V_ACTIVE,
      PATTERN_V_FRONT     => PATTERN_V_FRONT,
      PATTERN_V_SYNC      => PATTERN_V_SYNC,
      PATTERN_V_BACK      => PATTERN_V_BACK,
      METER_WINDOW        => METER_WINDOW,
      LOCK_TIMEOUT        => LOCK_TIMEOUT,
      DATA_PATIENCE       => DATA_PATIENCE,
      BUTTON_STABLE       => BUTTON_STABLE,
      BIT_TIME            => BIT_TIME,
      DDC_QUARTER         => DDC_QUARTER,
      DDC_PAUSE           => DDC_PAUSE,
      SWITCH_FRAMES       => SWITCH_FRAMES,
      ALIGN_TIMEOUT       => ALIGN_TIMEOUT,
      CLOCK_RANGE         => CLOCK_RANGE,
      OWN_DIVIDE          => OWN_DIVIDE,
      SEARCH_TIMEOUT      => SEARCH_TIMEOUT
    )
    port map (
      delay_fault_seed => fault_seed,
      slow_lock_us     => lock_us,
      clk_100          => clk_100,
      reset_n          => to_board.reset_n,
      in_clk_p         => pin_clk_p,
      in_clk_n         => pin_clk_n,
      in_data_p        => pin_data_p,
      in_data_n        => pin_data_n,
      scl              => ddc_scl,
      sda              => ddc_sda,
      out_clk_p        => out_clk_p,
      out_data_p       => out_data_p,
      uart_rx          => to_board.uart_rx,
      uart_tx          => uart_tx,
      button_up        => to_board.button_up,
      button_down      => to_board.button_down,
      button_clear     => to_board.button_clear,
      switch_pattern   => to_board.switch_pattern,
      switch_pass      => to_board.switch_pass,
      switch_sweep     => to_board.switch_sweep,
      led              => led
    );

  play : process is

    file input_file : words_t;

    type skews_t is array (0 to 2) of time;

    variable word       : integer;
    variable bits       : std_logic_vector(31 downto 0);
    variable value      : natural;
    variable period     : time     := 40 ns;
    variable skews      : skews_t  := (others => 0 fs);
    variable clock_skew : time     := 0 fs;
    variable jitter     : natural  := 0;
    variable ticking    : boolean  := false;
    variable level      : lanes_t  := "000";
    variable random     : random_t := SEED mod 65536;
    variable displaced  : time;

    -- A displacement of an edge.

    procedure draw is
    begin

      -- A linear congruential generator, as in bench_pkg: the seed alone decides.
      random    := (random * 25173 + 13849) mod 65536;
      displaced := ((random / 16) mod (2 * jitter + 1)) * 1 ps;

    end procedure draw;

    -- One pixel clock: the bits of a word, and the clock lane.

    procedure send is
    begin

      if ticking then
        in_clk_p <= transport '1' after clock_skew, '0' after clock_skew + period / 2;
        in_clk_n <= transport '0' after clock_skew, '1' after clock_skew + period / 2;
      end if;

      for c in 0 to 2 loop

        for i in 0 to 9 loop

          if bits(10 * c + i) /= level(c) then
            level(c)  := bits(10 * c + i);
            draw;
            displaced := displaced + skews(c) + period * i / 10;

            in_data_p(c) <= transport level(c) after displaced;
            in_data_n(c) <= transport not level(c) after displaced;
          end if;

        end loop;

      end loop;

      wait for period;

    end procedure send;

    -- When the serial line is free again.
    variable free       : time := 0 fs;
    variable until_free : time;

    constant BIT_LASTS : time := BIT_TIME * 10 ns;

    variable waited  : time;
    variable started : time;
    variable half    : time;
    variable slow    : natural := 0;

  begin

    -- Blanking while there is nothing else to send: the clock lane runs on.
    bits := IDLE;

    if not AUTO_START then

      while start /= '1' loop

        send;

      end loop;

    end if;

    file_open(input_file, "input.bin", read_mode);
    playing <= true;
    -- The monitor opens its file in this delta, before the first word.
    wait for 0 fs;

    while not endfile(input_file) loop

      read(input_file, word);
      bits := std_logic_vector(to_signed(word, 32));

      if bits(31) = '1' then
        value := to_integer(unsigned(bits(23 downto 0)));

        case to_integer(unsigned(bits(30 downto 24))) is

          when 1 =>

            period := value * 64 fs;

          when 2 | 3 | 4 =>

            skews(to_integer(unsigned(bits(30 downto 24))) - 2) := value * 1 ps;

          when 5 =>

            jitter := value;

          when 6 =>

            ticking := value = 1;

          when 7 =>

            plugged <= bits(0);

          when 8 =>

            clock_skew := value * 1 ps;

          when 9 =>

            bits   := IDLE;
            waited := now;

            while now - waited < value * 1 ns loop

              send;

            end loop;

          when 10 =>

            fault_seed <= value;

          when 13 =>

            lock_us <= value;

          when 11 =>

            bits   := IDLE;
            waited := now;

            while now - waited < value * 1 ns loop

              -- Slow and fast in turn, each for longer than a window of the meter and shorter than
              -- two: no two measurements agree.
              random  := (random * 25173 + 13849) mod 65536;
              slow    := 1 - slow;
              half    := (5 + 8 * slow) * 1 ns + (random mod 4096) * 1 ps;
              started := now;

              while now - started < METER_WINDOW * 14 ns loop

                in_clk_p <= '1', '0' after half;
                in_clk_n <= '0', '1' after half;
                wait for 2 * half;

              end loop;

            end loop;

          when 12 =>

            -- Behind the characters that are still being sent; the words go on meanwhile.
            until_free := 0 fs;

            if free > now then
              until_free := free - now;
            end if;

            serial <= transport '0' after until_free;

            for i in 0 to 7 loop

              serial <= transport bits(i) after until_free + (i + 1) * BIT_LASTS;

            end loop;

            serial <= transport '1' after until_free + 9 * BIT_LASTS;
            free   := now + until_free + 10 * BIT_LASTS;

          when others =>

            report "hdmi_bench: input.bin has a command with another code than 1 to 13"
              severity failure;

        end case;

      else
        send;
      end if;

    end loop;

    file_close(input_file);
    playing <= false;
    played  <= true;
    bits    := IDLE;

    if AUTO_START then
      wait until not captured;
      running <= false;
      wait;
    end if;

    while start = '1' loop

      send;

    end loop;

    played <= false;

  end process play;

  monitor : entity work.tmds_monitor
    port map (
      clk      => out_clk_p,
      data     => out_data_p,
      watching => playing,
      is_open  => captured,
      words    => open
    );

end architecture test;
