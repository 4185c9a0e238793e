-- SPDX-License-Identifier: Apache-2.0
-- The line protocol of the serial port: commands in, answers out.
--
-- A command is a letter, for most commands a number (decimal, 0 to 255), and a line end (CR, LF or both); blanks are
-- ignored. Each command is answered by one line.
--
--   s N   show slice N                     p 0|1   pass the input through
--   w N   sweep, N frames a slice; 0: off  t 0|1   test pattern
--   c     clear the error flags            ?       status
--   o N   show output N                    h 0|1|2 text: none, at the top, at the bottom
--   i N   invert channels, sum of 1, 2, 4; 8: find the channels with swapped wires
--
-- With CAMERA the commands are c, ? and
--
--   i     set the sensor up again
--
-- The answer is "ok", "error" (unknown letter; number missing, too large, or not allowed), or the status: text with
-- numbers in decimal, negative ones with a minus sign.
--
-- Latency: up to the end of the line. Throughput: one command at a time; characters that come during an answer are
-- dropped.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;
use work.math_pkg.all;
use work.tmds_pkg.all;

entity command_line is
  generic (
    -- The status: each # stands for the next number.
    STATUS : string;
    FIELDS : positive range 1 to 256;
    -- true: the commands are those of a board with a camera.
    CAMERA : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Characters in, always taken.
    s_axis_tvalid : in    std_logic;
    s_axis_tdata  : in    std_logic_vector(7 downto 0);
    -- Characters out.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(7 downto 0);
    -- FIELDS numbers of 16 bits in two's complement for the status line, the first one in the low bits.
    status_values : in    std_logic_vector(16 * FIELDS - 1 downto 0);
    -- Number of slices, the limit of the command "s".
    slices : in    unsigned(8 downto 0) := (others => '0');
    -- Number of outputs and of places of the text, the limits of the commands "o" and "h".
    outputs : in    unsigned(2 downto 0) := (others => '0');
    places  : in    unsigned(2 downto 0) := (others => '0');
    -- The command that has come.
    command : out   command_t
  );
end entity command_line;

architecture rtl of command_line is

  -- Number of places for numbers in the status.
  function places_in (
    text : string
  ) return natural is

    variable places : natural;

  begin

    places := 0;

    for i in text'range loop

      if text(i) = '#' then
        places := places + 1;
      end if;

    end loop;

    return places;

  end function places_in;

  constant REFUSED : boolean := not takes(places_in(STATUS) = FIELDS,
                                          "command_line: STATUS must have FIELDS times a #");

  -- The answers lie one behind the other in one ROM. Each ends with its line feed. STATUS is last, because only its
  -- length varies.
  constant LINE_END : string := CR & LF;
  constant ANSWERS  : string := "ok" & LINE_END & "error" & LINE_END & STATUS & LINE_END;

  constant OK_FIRST     : positive := 1;
  constant ERROR_FIRST  : positive := 5;
  constant STATUS_FIRST : positive := 12;

  subtype character_t is std_logic_vector(7 downto 0);

  function code (
    c : character
  ) return std_logic_vector is
  begin

    return std_logic_vector(to_unsigned(character'pos(c), 8));

  end function code;

  -- The answers as codes, computed at elaboration: a ROM.

  type codes_t is array (ANSWERS'range) of character_t;

  function codes_of (
    text : string
  ) return codes_t is

    variable codes : codes_t;

  begin

    for i in text'range loop

      codes(i) := code(text(i));

    end loop;

    return codes;

  end function codes_of;

  constant CODES : codes_t := codes_of(ANSWERS);

  -- read_line: characters come in; act: the line is complete; answer: characters go out; sign, convert, digits: a
  -- number goes out.
  type state_t is (read_line, act, answer, sign, convert, digits);

  -- Steps of a conversion: one for each bit in, and one for each digit out. Five digits hold 16 bits.
  constant LAST_BIT   : natural := 16;
  constant LAST_DIGIT : natural := 4;

  subtype decimal_t is unsigned(4 * (LAST_DIGIT + 1) - 1 downto 0);

  signal state : state_t := read_line;

  -- The line so far. letter: 0 means none yet, all ones a letter that no command has.
  signal letter : character_t          := (others => '0');
  signal number : unsigned(7 downto 0) := (others => '0');
  signal given  : std_logic            := '0';
  signal wrong  : std_logic            := '0';

  -- A valid line has come: at all; with a number; without one.
  signal right    : std_logic;
  signal numbered : std_logic;
  signal bare     : std_logic;
  -- High for the command that it is; is_known: any of them.
  signal to_slice   : std_logic;
  signal to_sweep   : std_logic;
  signal to_pass    : std_logic;
  signal to_pattern : std_logic;
  signal to_output  : std_logic;
  -- The comparisons of numbers are part of the command, so a number out of range makes the command unknown, and the
  -- answer an error.
  signal to_place    : std_logic;
  signal to_polarity : std_logic;
  signal to_clear    : std_logic;
  signal to_status   : std_logic;
  signal to_set_up   : std_logic;
  signal is_known    : std_logic;

  -- The next character of an answer; is_end: it is the last one.
  signal place    : natural range 1 to ANSWERS'length := 1;
  signal next_one : character_t;
  signal is_end   : std_logic;

  -- The next number of the status, its binary value (not negative once the sign is out), and its digits.
  signal field   : natural range 0 to FIELDS   := 0;
  signal binary  : unsigned(15 downto 0)       := (others => '0');
  signal decimal : decimal_t                   := (others => '0');
  signal step    : natural range 0 to LAST_BIT := 0;
  signal leading : std_logic                   := '0';

  -- A character waits to be taken.
  signal offer  : std_logic   := '0';
  signal symbol : character_t := (others => '0');

  -- Double dabble for all digits at once: a digit of 5 or more gets 3 added, so that doubling carries into the next
  -- digit.

  function doubled (
    value : decimal_t;
    carry : std_logic
  ) return decimal_t is

    variable digit  : unsigned(3 downto 0);
    variable result : decimal_t;

  begin

    for i in 0 to LAST_DIGIT loop

      digit := value(4 * i + 3 downto 4 * i);

      if digit >= 5 then
        digit := digit + 3;
      end if;

      result(4 * i + 3 downto 4 * i) := digit;

    end loop;

    return result(result'high - 1 downto 0) & carry;

  end function doubled;

begin

  m_axis_tvalid <= offer;
  m_axis_tdata  <= symbol;
  command.value <= number;

  -- All of these are valid in the single clock of state act.
  right    <= to_logic(state = act) and not wrong;
  numbered <= right and given;
  bare     <= right and not given;

  to_slice    <= numbered and to_logic(letter = code('s') and number < slices);
  to_sweep    <= numbered and to_logic(letter = code('w') and not CAMERA);
  to_pass     <= numbered and to_logic(letter = code('p') and number < 2 and not CAMERA);
  to_pattern  <= numbered and to_logic(letter = code('t') and number < 2 and not CAMERA);
  to_output   <= numbered and to_logic(letter = code('o') and number < outputs);
  to_place    <= numbered and to_logic(letter = code('h') and number < places);
  to_clear    <= bare and to_logic(letter = code('c'));
  to_polarity <= numbered and to_logic(letter = code('i') and number <= unsigned(FIND_POLARITY) and not CAMERA);
  to_set_up   <= bare and to_logic(letter = code('i') and CAMERA);
  to_status   <= bare and to_logic(letter = code('?'));
  is_known    <= to_slice or to_sweep or to_pass or to_pattern or to_output or to_place or to_clear or
                 to_polarity or to_set_up;

  next_one <= CODES(place);
  is_end   <= to_logic(state = answer and next_one = code(LF)) and not offer;

  take_line : process (clk) is

    variable wide : unsigned(11 downto 0);

  begin

    if rising_edge(clk) then
      if state = read_line and s_axis_tvalid = '1' then
        -- Line ends are handled by process reply; here they must not count as letters.
        if s_axis_tdata = code(CR) or s_axis_tdata = code(LF) or s_axis_tdata = code(' ') then
          null;
        elsif unsigned(s_axis_tdata) >= unsigned(code('0')) and unsigned(s_axis_tdata) <= unsigned(code('9')) then
          -- Ten times the number so far, plus the digit.
          wide := resize(number, 12);
          wide := shift_left(wide, 3) + shift_left(wide, 1) + unsigned(s_axis_tdata(3 downto 0));
          -- A number without a letter, or one beyond 255, makes the line wrong: the letter becomes one that no command
          -- has.
          if letter = x"00" or wide > 255 then
            letter <= x"FF";
            wrong  <= '1';
          end if;
          number <= wide(7 downto 0);
          given  <= '1';
        elsif letter = x"00" then
          -- Everything else is a letter, which is checked when the line is complete. The first letter is kept; a second
          -- one makes the line wrong.
          letter <= s_axis_tdata;
        else
          wrong <= '1';
        end if;
      end if;

      -- The next line begins when the answer is over.
      if reset = '1' or is_end = '1' then
        letter <= x"00";
        number <= (others => '0');
        given  <= '0';
        wrong  <= '0';
      end if;
    end if;

  end process take_line;

  obey : process (clk) is
  begin

    if rising_edge(clk) then
      command.set_slice    <= to_slice;
      command.set_sweep    <= to_sweep;
      command.set_pass     <= to_pass;
      command.set_pattern  <= to_pattern;
      command.set_output   <= to_output;
      command.set_place    <= to_place;
      command.set_polarity <= to_polarity;
      command.clear_errors <= to_clear;
      command.set_up       <= to_set_up;
      if reset = '1' then
        -- A command in this clock would come with the number 0 that the reset has set. For sweep, pass, pattern and
        -- output that is their value after a reset; slice, place, polarity and errors would be changed.
        command.set_slice    <= '0';
        command.set_place    <= '0';
        command.set_polarity <= '0';
        command.clear_errors <= '0';
        command.set_up       <= '0';
      end if;
    end if;

  end process obey;

  reply : process (clk) is
  begin

    if rising_edge(clk) then
      if offer = '1' and m_axis_tready = '1' then
        offer <= '0';
      end if;

      case state is

        when read_line =>

          -- An empty line is no command, because CR and LF may both end a line.
          if s_axis_tvalid = '1' and letter /= x"00" and (s_axis_tdata = code(CR) or s_axis_tdata = code(LF)) then
            state <= act;
          end if;

        when act =>

          -- The answer is an error unless the command is known, so every line gets an answer.
          state <= answer;
          place <= ERROR_FIRST;
          if is_known = '1' then
            place <= OK_FIRST;
          elsif to_status = '1' then
            place <= STATUS_FIRST;
            field <= 0;
          end if;

        when answer =>

          if offer = '0' then
            if next_one = code('#') then
              state <= sign;
            else
              symbol <= next_one;
              offer  <= '1';
              if next_one = code(LF) then
                state <= read_line;
              else
                place <= place + 1;
              end if;
            end if;
          end if;

        when sign =>

          state <= convert;
          if binary(15) = '1' then
            symbol <= code('-');
            offer  <= '1';
          end if;

        when convert =>

          if step = LAST_BIT then
            state <= digits;
          end if;

        when digits =>

          -- The sign, or the digit before, may still wait to be taken.
          if offer = '0' then
            if step > LAST_DIGIT then
              state <= answer;
              -- Behind the number the text goes on with the character behind its #.
              place <= place + 1;
              if field /= FIELDS then
                field <= field + 1;
              end if;
            elsif leading = '0' or decimal(19 downto 16) /= 0 or step = LAST_DIGIT then
              -- The code of a digit is 0x30 plus its value. Leading zeros are left out except the last digit, because 0
              -- is a number.
              symbol <= x"3" & std_logic_vector(decimal(19 downto 16));
              offer  <= '1';
            end if;
          end if;

      end case;

      if reset = '1' then
        state <= read_line;
        offer <= '0';
      end if;
    end if;

  end process reply;

  -- A number becomes decimal digits, its highest bit first; the digits then leave, the highest first. One bit each
  -- clock takes 16 clocks, which is short against a character on the line, and needs no divider.
  convert_number : process (clk) is
  begin

    if rising_edge(clk) then
      if state = answer and offer = '0' and next_one = code('#') then
        binary  <= unsigned(status_values(15 downto 0));
        decimal <= (others => '0');
        step    <= 0;

        -- A multiplexer by comparison: the index behind the last number selects nothing.
        for i in 1 to FIELDS - 1 loop

          if field = i then
            binary <= unsigned(status_values(16 * i + 15 downto 16 * i));
          end if;

        end loop;

      elsif state = sign and binary(15) = '1' then
        -- The sign is offered in this clock (process reply). -32768 is its own complement, and right as an unsigned
        -- number.
        binary <= 0 - binary;
      elsif state = convert and step = LAST_BIT then
        step    <= 0;
        leading <= '1';
      elsif state = convert then
        step    <= step + 1;
        decimal <= doubled(decimal, binary(15));
        binary  <= shift_left(binary, 1);
      elsif state = digits and offer = '0' and step <= LAST_DIGIT then
        step    <= step + 1;
        decimal <= shift_left(decimal, 4);
        if decimal(19 downto 16) /= 0 or step = LAST_DIGIT then
          leading <= '0';
        end if;
      end if;
    end if;

  end process convert_number;

end architecture rtl;
