-- SPDX-License-Identifier: Apache-2.0
-- Settings from buttons, switches and the serial port: slice, sweep, pass-through, test pattern, output, place of the
-- text, polarity of the input's pairs, clearing of the errors.
--
-- Buttons step through the slices, around both ends, and through the outputs. Switches and commands hide the text or
-- put it at the bottom. If a function has a switch and a command, it is on if either is on. A sweep started by the
-- switch shows each slice for SWITCH_FRAMES frames.
--
-- Latency: a few clocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;
use work.math_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.tmds_pkg.all;

entity board_control is
  generic (
    -- Number of slices of the refocuser.
    SLICES : positive range 1 to 256;
    -- Number of outputs; whether there is a text over the picture.
    OUTPUTS   : positive range 1 to 3 := 1;
    WITH_TEXT : boolean               := false;
    -- Whether there is a resampler to load; the resampler's description (load_port).
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
    -- Frames for each slice of a sweep by the switch; 30 are half a second.
    SWITCH_FRAMES : positive range 1 to 255 := 30
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Serial port.
    line_in  : in    std_logic;
    line_out : out   std_logic;
    -- Buttons and switches at the pins.
    panel : in    panel_t;
    -- FIELDS numbers of 16 bits for the status line, the first one in the low bits.
    status_values : in    std_logic_vector(16 * FIELDS - 1 downto 0);
    -- What is shown; pattern: the test pattern instead of the input; place of the text: 0 none, 1 at the top, 2 at the
    -- bottom.
    choice     : out   picture_choice_t;
    pattern    : out   std_logic;
    text_place : out   std_logic_vector(1 downto 0);
    -- Channels of the input to invert, or FIND_POLARITY.
    polarity : out   polarity_t;
    -- High for one clock: clear the error flags.
    clear_errors : out   std_logic;
    -- Word for the resampler; load_busy: the word before is under way.
    load_busy  : in    std_logic;
    load_write : out   std_logic;
    load_word  : out   load_word_t
  );
end entity board_control;

architecture rtl of board_control is

  constant REFUSED : boolean := not takes(FIRST_SLICE < SLICES, "board_control: FIRST_SLICE must be below SLICES");

  constant LAST : natural := SLICES - 1;

  -- Buttons and switches: contacts at the pins, their levels, and those that became high; the last two as records.
  signal contacts         : std_logic_vector(PANEL_CONTACTS - 1 downto 0);
  signal contact_levels   : std_logic_vector(PANEL_CONTACTS - 1 downto 0);
  signal contacts_pressed : std_logic_vector(PANEL_CONTACTS - 1 downto 0);
  signal level            : panel_t;
  signal pressed          : panel_t;

  -- Characters from the serial port; those of lines that are no words for the resampler; answers to these; all answers.
  signal in_data      : std_logic_vector(7 downto 0);
  signal in_valid     : std_logic;
  signal other_data   : std_logic_vector(7 downto 0);
  signal other_valid  : std_logic;
  signal answer_data  : std_logic_vector(7 downto 0);
  signal answer_valid : std_logic;
  signal answer_ready : std_logic;
  signal out_data     : std_logic_vector(7 downto 0);
  signal out_valid    : std_logic;
  signal out_ready    : std_logic;

  -- Settings made by commands and buttons.
  signal command         : command_t;
  signal slice_now       : unsigned(7 downto 0) := to_unsigned(FIRST_SLICE, 8);
  signal output_now      : unsigned(1 downto 0) := "00";
  signal place_command   : unsigned(1 downto 0) := "01";
  signal sweep_command   : unsigned(7 downto 0) := (others => '0');
  signal pass_command    : std_logic            := '0';
  signal pattern_command : std_logic            := '0';
  signal polarity_now    : polarity_t           := FIND_POLARITY;

begin

  -- One debouncer takes all contacts as a vector.
  contacts <= to_vector(panel);

  debounce : entity work.debouncer
    generic map (
      WIDTH  => PANEL_CONTACTS,
      STABLE => STABLE
    )
    port map (
      clk      => clk,
      contacts => contacts,
      levels   => contact_levels,
      pressed  => contacts_pressed
    );

  level   <= to_panel(contact_levels);
  pressed <= to_panel(contacts_pressed);

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

  -- Without a resampler every character belongs to the command line.
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

    -- load_port stands in front of the command line: it takes the lines that begin with its letter and passes the
    -- others on.
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

  -- A feature that a build lacks counts as having one choice, so command_line refuses all numbers for it except 0.
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
      command       => command
    );

  -- A switch and a command are ored, so that each works without the other.
  choice.slice <= std_logic_vector(slice_now);
  -- A sweep by command brings its own number of frames; a sweep by the switch takes that of the generic.
  choice.sweep        <= level.switch_sweep or to_logic(sweep_command /= 0);
  choice.sweep_frames <= std_logic_vector(sweep_command) when sweep_command /= 0 else
                         std_logic_vector(to_unsigned(SWITCH_FRAMES, 8)) when level.switch_sweep = '1' else
                         (others => '0');
  choice.pass_through <= pass_command or level.switch_pass;
  choice.shown        <= std_logic_vector(output_now);
  pattern             <= pattern_command or level.switch_pattern;
  -- The switches win over the command, so that whoever stands at the board sees their effect.
  text_place   <= "00" when level.switch_hide = '1' or not WITH_TEXT or place_command = 0 else
                  "10" when level.switch_bottom = '1' else
                  std_logic_vector(place_command);
  polarity     <= polarity_now;
  clear_errors <= command.clear_errors or pressed.button_clear;

  set : process (clk) is
  begin

    if rising_edge(clk) then
      -- A command names the slice, a button steps. If both come in one clock, the command wins.
      if command.set_slice = '1' then
        slice_now <= command.value;
      elsif pressed.button_up = '1' then
        slice_now <= slice_now + 1;
        -- Slices step around both ends.
        if slice_now = LAST then
          slice_now <= (others => '0');
        end if;
      elsif pressed.button_down = '1' then
        slice_now <= slice_now - 1;
        if slice_now = 0 then
          slice_now <= to_unsigned(LAST, 8);
        end if;
      end if;
      -- Outputs step likewise, in one direction.
      if command.set_output = '1' then
        output_now <= command.value(1 downto 0);
      elsif pressed.button_output = '1' then
        output_now <= output_now + 1;
        if output_now = OUTPUTS - 1 then
          output_now <= "00";
        end if;
      end if;
      if command.set_place = '1' then
        place_command <= command.value(1 downto 0);
      end if;
      if command.set_sweep = '1' then
        sweep_command <= command.value;
      end if;
      if command.set_pass = '1' then
        pass_command <= command.value(0);
      end if;
      if command.set_pattern = '1' then
        pattern_command <= command.value(0);
      end if;
      if command.set_polarity = '1' then
        polarity_now <= std_logic_vector(command.value(polarity_t'range));
      end if;
      -- After a reset the text is at the top, so that a board which starts says what it shows.
      if reset = '1' then
        output_now      <= "00";
        place_command   <= "01";
        slice_now       <= to_unsigned(FIRST_SLICE, 8);
        sweep_command   <= (others => '0');
        pass_command    <= '0';
        pattern_command <= '0';
        polarity_now    <= FIND_POLARITY;
      end if;
    end if;

  end process set;

end architecture rtl;
