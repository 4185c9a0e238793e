-- SPDX-License-Identifier: Apache-2.0
-- What buttons, switches and the serial port set: slice, sweep, pass-through, test pattern, output, place of the text.
--
-- Buttons step through the slices, around both ends, and through the outputs. Switches hide the text or put it at the
-- bottom; a command does so too. A switch and a command for the same thing: it is
-- on if either is. A sweep started by the switch shows each slice for SWITCH_FRAMES frames.
--
-- Latency: a few clocks. Throughput: not applicable.
-- Equation: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity board_control is
  generic (
    -- Number of slices of the refocuser.
    SLICES : positive range 1 to 256;
    -- Number of outputs, and whether there is a text over the picture.
    OUTPUTS   : positive range 1 to 3 := 1;
    WITH_TEXT : boolean               := false;
    -- Whether there is a resampler to be loaded, and what it is, see load_port.
    WITH_LOAD   : boolean := false;
    DESCRIPTION : string  := "";
    -- Slice after a reset.
    FIRST_SLICE : natural := 0;
    -- The status line: each # stands for the next number.
    STATUS : string;
    FIELDS : positive range 1 to 256;
    -- Clocks in a bit of the serial port.
    BIT_CLOCKS : positive range 4 to 65535 := 868;
    -- Clocks that a button must be stable.
    STABLE : positive := 1000000;
    -- Frames for each slice of a sweep by the switch: half a second.
    SWITCH_FRAMES : positive range 1 to 255 := 30
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Serial port.
    line_in  : in    std_logic;
    line_out : out   std_logic;
    -- Pins of buttons and switches, active high.
    button_up      : in    std_logic;
    button_down    : in    std_logic;
    switch_pattern : in    std_logic;
    switch_pass    : in    std_logic;
    switch_sweep   : in    std_logic;
    button_output  : in    std_logic;
    switch_hide    : in    std_logic;
    switch_bottom  : in    std_logic;
    -- FIELDS numbers of 16 bits for the status line, the first one in the low bits.
    status_values : in    std_logic_vector(16 * FIELDS - 1 downto 0);
    -- The settings.
    slice        : out   std_logic_vector(7 downto 0);
    sweep        : out   std_logic;
    sweep_frames : out   std_logic_vector(7 downto 0);
    pass_through : out   std_logic;
    pattern      : out   std_logic;
    -- Place of the output, from 0; place of the text: 0 none, 1 at the top, 2 at the bottom.
    picture_place : out   std_logic_vector(1 downto 0);
    text_place    : out   std_logic_vector(1 downto 0);
    -- Clear the error flags, for a clock.
    clear_errors : out   std_logic;
    -- Word for the resampler: kind (2 bits), address (20), data (40); busy: the one before is under way.
    load_busy  : in    std_logic;
    load_write : out   std_logic;
    load_word  : out   std_logic_vector(61 downto 0)
  );
end entity board_control;

architecture rtl of board_control is

  constant REFUSED : boolean := not takes(FIRST_SLICE < SLICES, "board_control: FIRST_SLICE must be below SLICES");

  constant LAST : natural := SLICES - 1;

  signal up            : std_logic;
  signal down          : std_logic;
  signal pattern_level : std_logic;
  signal pass_level    : std_logic;
  signal sweep_level   : std_logic;
  signal output_step   : std_logic;
  signal hide_level    : std_logic;
  signal bottom_level  : std_logic;
  signal set_output    : std_logic;
  signal set_place     : std_logic;
  signal output_now    : unsigned(1 downto 0) := "00";
  signal place_command : unsigned(1 downto 0) := "01";
  signal in_data       : std_logic_vector(7 downto 0);
  signal in_valid      : std_logic;
  signal out_data      : std_logic_vector(7 downto 0);
  signal out_valid     : std_logic;
  signal out_ready     : std_logic;
  signal other_data    : std_logic_vector(7 downto 0);
  signal other_valid   : std_logic;
  signal answer_data   : std_logic_vector(7 downto 0);
  signal answer_valid  : std_logic;
  signal answer_ready  : std_logic;
  signal value         : unsigned(7 downto 0);
  signal set_slice     : std_logic;
  signal set_sweep     : std_logic;
  signal set_pass      : std_logic;
  signal set_pattern   : std_logic;
  signal slice_now     : unsigned(7 downto 0) := to_unsigned(FIRST_SLICE, 8);
  signal sweep_value   : unsigned(7 downto 0) := (others => '0');
  signal pass_command  : std_logic            := '0';
  signal patt_command  : std_logic            := '0';
  signal sweep_now     : std_logic;
  signal frames_now    : unsigned(7 downto 0);
  signal pass_now      : std_logic;
  signal pattern_now   : std_logic;

begin

  debounce_up : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => button_up,
      level   => open,
      pressed => up
    );

  debounce_down : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => button_down,
      level   => open,
      pressed => down
    );

  debounce_pattern : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => switch_pattern,
      level   => pattern_level,
      pressed => open
    );

  debounce_pass : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => switch_pass,
      level   => pass_level,
      pressed => open
    );

  debounce_sweep : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => switch_sweep,
      level   => sweep_level,
      pressed => open
    );

  debounce_output : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => button_output,
      level   => open,
      pressed => output_step
    );

  debounce_hide : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => switch_hide,
      level   => hide_level,
      pressed => open
    );

  debounce_bottom : entity work.debouncer
    generic map (
      STABLE => STABLE
    )
    port map (
      clk     => clk,
      contact => switch_bottom,
      level   => bottom_level,
      pressed => open
    );

  receiver : entity work.uart_receiver
    generic map (
      BIT_CLOCKS => BIT_CLOCKS
    )
    port map (
      clk   => clk,
      reset => reset,
      line  => line_in,
      data  => in_data,
      valid => in_valid
    );

  transmitter : entity work.uart_transmitter
    generic map (
      BIT_CLOCKS => BIT_CLOCKS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => out_valid,
      s_axis_tready => out_ready,
      s_axis_tdata  => out_data,
      line          => line_out
    );

  no_load : if not WITH_LOAD generate
    other_valid  <= in_valid;
    other_data   <= in_data;
    out_valid    <= answer_valid;
    answer_ready <= out_ready;
    out_data     <= answer_data;
    load_write   <= '0';
    load_word    <= (others => '0');
  end generate no_load;

  load : if WITH_LOAD generate

    words : entity work.load_port
      generic map (
        DESCRIPTION => DESCRIPTION
      )
      port map (
        clk           => clk,
        reset         => reset,
        in_valid      => in_valid,
        in_data       => in_data,
        other_valid   => other_valid,
        other_data    => other_data,
        s_axis_tvalid => answer_valid,
        s_axis_tready => answer_ready,
        s_axis_tdata  => answer_data,
        m_axis_tvalid => out_valid,
        m_axis_tready => out_ready,
        m_axis_tdata  => out_data,
        busy          => load_busy,
        load_write    => load_write,
        load_kind     => load_word(61 downto 60),
        load_address  => load_word(59 downto 40),
        load_data     => load_word(39 downto 0)
      );

  end generate load;

  commands : entity work.command_line
    generic map (
      STATUS => STATUS,
      FIELDS => FIELDS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => other_valid,
      s_axis_tdata  => other_data,
      m_axis_tvalid => answer_valid,
      m_axis_tready => answer_ready,
      m_axis_tdata  => answer_data,
      status_values => status_values,
      slices        => to_unsigned(SLICES, 9),
      outputs       => to_unsigned(OUTPUTS, 3),
      places        => to_unsigned(choose(WITH_TEXT, 3, 1), 3),
      value         => value,
      set_slice     => set_slice,
      set_sweep     => set_sweep,
      set_pass      => set_pass,
      set_pattern   => set_pattern,
      set_output    => set_output,
      set_place     => set_place,
      clear_errors  => clear_errors
    );

  sweep_now   <= '1' when sweep_level = '1' or sweep_value /= 0 else
                 '0';
  frames_now  <= sweep_value when sweep_value /= 0 else
                 to_unsigned(SWITCH_FRAMES, 8) when sweep_level = '1' else
                 (others => '0');
  pass_now    <= pass_command or pass_level;
  pattern_now <= patt_command or pattern_level;

  slice         <= std_logic_vector(slice_now);
  sweep         <= sweep_now;
  sweep_frames  <= std_logic_vector(frames_now);
  pass_through  <= pass_now;
  pattern       <= pattern_now;
  picture_place <= std_logic_vector(output_now);
  text_place    <= "00" when hide_level = '1' or not WITH_TEXT or place_command = 0 else
                   "10" when bottom_level = '1' else
                   std_logic_vector(place_command);

  set : process (clk) is
  begin

    if rising_edge(clk) then
      if set_slice = '1' then
        slice_now <= value;
      elsif up = '1' then
        slice_now <= slice_now + 1;
        if slice_now = LAST then
          slice_now <= (others => '0');
        end if;
      elsif down = '1' then
        slice_now <= slice_now - 1;
        if slice_now = 0 then
          slice_now <= to_unsigned(LAST, 8);
        end if;
      end if;
      if set_output = '1' then
        output_now <= value(1 downto 0);
      elsif output_step = '1' then
        output_now <= output_now + 1;
        if output_now = OUTPUTS - 1 then
          output_now <= "00";
        end if;
      end if;
      if set_place = '1' then
        place_command <= value(1 downto 0);
      end if;
      if set_sweep = '1' then
        sweep_value <= value;
      end if;
      if set_pass = '1' then
        pass_command <= value(0);
      end if;
      if set_pattern = '1' then
        patt_command <= value(0);
      end if;
      if reset = '1' then
        output_now    <= "00";
        place_command <= "01";
        slice_now     <= to_unsigned(FIRST_SLICE, 8);
        sweep_value   <= (others => '0');
        pass_command  <= '0';
        patt_command  <= '0';
      end if;
    end if;

  end process set;

end architecture rtl;
