-- SPDX-License-Identifier: Apache-2.0
-- The line protocol of the serial port: commands in, answers out.
--
-- A command is a letter, for most a number (decimal, 0 to 255), and a line end (CR, LF or both);
-- blanks do not count. Each command is answered by one line.
--
--   s N   show slice N                     p 0|1   pass the input through
--   w N   sweep, N frames a slice; 0: off  t 0|1   test pattern
--   c     clear the error flags            ?       status
--   o N   show output N                    h 0|1|2 text: none, at the top, at the bottom
--
-- The answer is "ok", "error" (unknown letter, number missing, too large, or not wanted), or the
-- status: text with numbers in decimal, negative ones with a minus sign.
--
-- Latency: the length of the line. Throughput: one command at a time; what arrives during an
--   answer is dropped.
-- Equation: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity command_line is
  generic (
    -- The status: each # stands for the next number.
    STATUS : string;
    FIELDS : positive range 1 to 256
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
    -- FIELDS numbers of 16 bits in two's complement for the status line, the first one in the low
    -- bits.
    status_values : in    std_logic_vector(16 * FIELDS - 1 downto 0);
    -- Number of slices, the limit of the command "s".
    slices : in    unsigned(8 downto 0);
    -- Number of outputs and of places of the text, the limits of the commands "o" and "h".
    outputs : in    unsigned(2 downto 0);
    places  : in    unsigned(2 downto 0);
    -- Number of the last command.
    value : out   unsigned(7 downto 0);
    -- The command that came, high for a clock; value goes with it.
    set_slice    : out   std_logic;
    set_sweep    : out   std_logic;
    set_pass     : out   std_logic;
    set_pattern  : out   std_logic;
    set_output   : out   std_logic;
    set_place    : out   std_logic;
    clear_errors : out   std_logic
  );
end entity command_line;

architecture rtl of command_line is

  -- Numbers that the status has a place for.
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

  -- The answers as codes, made at elaboration: what is left is a ROM.

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

  -- read_line: characters come in; act: the line is complete; answer: characters go out; sign,
  -- convert, digits: a number goes out.
  type state_t is (read_line, act, answer, sign, convert, digits);

  signal state   : state_t                           := read_line;
  signal letter  : character_t                       := (others => '0');
  signal number  : unsigned(7 downto 0)              := (others => '0');
  signal given   : std_logic                         := '0';
  signal wrong   : std_logic                         := '0';
  signal place   : natural range 1 to ANSWERS'length := 1;
  signal field   : natural range 0 to FIELDS         := 0;
  signal binary  : unsigned(15 downto 0)             := (others => '0');
  signal decimal : unsigned(19 downto 0)             := (others => '0');
  signal step    : natural range 0 to 16             := 0;
  signal leading : std_logic                         := '0';
  signal offer   : std_logic                         := '0';
  signal symbol  : character_t                       := (others => '0');

begin

  m_axis_tvalid <= offer;
  m_axis_tdata  <= symbol;
  value         <= number;

  follow : process (clk) is

    variable digit : unsigned(3 downto 0);
    variable wide  : unsigned(11 downto 0);

  begin

    if rising_edge(clk) then
      set_slice    <= '0';
      set_sweep    <= '0';
      set_pass     <= '0';
      set_pattern  <= '0';
      set_output   <= '0';
      set_place    <= '0';
      clear_errors <= '0';
      if offer = '1' and m_axis_tready = '1' then
        offer <= '0';
      end if;

      case state is

        when read_line =>

          if s_axis_tvalid = '1' then
            if s_axis_tdata = code(CR) or s_axis_tdata = code(LF) then
              if letter /= x"00" then
                state <= act;
              end if;
            elsif s_axis_tdata = code(' ') then
              null;
            elsif unsigned(s_axis_tdata) >= unsigned(code('0')) and unsigned(s_axis_tdata) <= unsigned(code('9')) then
              -- Ten times what was there, and the digit.
              wide := resize(number, 12);
              wide := shift_left(wide, 3) + shift_left(wide, 1) + unsigned(s_axis_tdata(3 downto 0));
              if letter = x"00" or wide > 255 then
                letter <= x"FF";
                wrong  <= '1';
              end if;
              number <= wide(7 downto 0);
              given  <= '1';
            elsif letter = x"00" then
              letter <= s_axis_tdata;
            else
              wrong <= '1';
            end if;
          end if;

        when act =>

          state <= answer;
          place <= OK_FIRST;
          if wrong = '1' then
            place <= ERROR_FIRST;
          elsif letter = code('s') and given = '1' and number < slices then
            set_slice <= '1';
          elsif letter = code('w') and given = '1' then
            set_sweep <= '1';
          elsif letter = code('p') and given = '1' and number < 2 then
            set_pass <= '1';
          elsif letter = code('t') and given = '1' and number < 2 then
            set_pattern <= '1';
          elsif letter = code('o') and given = '1' and number < outputs then
            set_output <= '1';
          elsif letter = code('h') and given = '1' and number < places then
            set_place <= '1';
          elsif letter = code('c') and given = '0' then
            clear_errors <= '1';
          elsif letter = code('?') and given = '0' then
            place <= STATUS_FIRST;
            field <= 0;
          else
            place <= ERROR_FIRST;
          end if;

        when answer =>

          if offer = '0' then
            if CODES(place) = code('#') then
              binary  <= unsigned(status_values(15 downto 0));
              decimal <= (others => '0');
              step    <= 0;
              state   <= sign;

              for i in 1 to FIELDS - 1 loop

                if field = i then
                  binary <= unsigned(status_values(16 * i + 15 downto 16 * i));
                end if;

              end loop;

            else
              symbol <= CODES(place);
              offer  <= '1';
              if CODES(place) = code(LF) then
                state  <= read_line;
                letter <= x"00";
                number <= (others => '0');
                given  <= '0';
                wrong  <= '0';
              else
                place <= place + 1;
              end if;
            end if;
          end if;

        when sign =>

          state <= convert;
          if binary(15) = '1' then
            binary <= 0 - binary;
            symbol <= code('-');
            offer  <= '1';
          end if;

        when convert =>

          -- Double dabble: a digit of 5 or more gets 3 before the next doubling.
          if step = 16 then
            state   <= digits;
            step    <= 0;
            leading <= '1';
          else
            step <= step + 1;

            for i in 0 to 4 loop

              digit := decimal(4 * i + 3 downto 4 * i);
              if digit >= 5 then
                digit := digit + 3;
              end if;
              -- Shifted left by one, with the carry of the digit below.
              decimal(4 * i + 3 downto 4 * i + 1) <= digit(2 downto 0);
              if i < 4 then
                decimal(4 * i + 4) <= digit(3);
              end if;

            end loop;

            decimal(0) <= binary(15);
            binary     <= shift_left(binary, 1);
          end if;

        when digits =>

          if offer = '0' then
            if step = 5 then
              state <= answer;
              place <= place + 1;
              if field /= FIELDS then
                field <= field + 1;
              end if;
            else
              step    <= step + 1;
              decimal <= shift_left(decimal, 4);
              if leading = '0' or decimal(19 downto 16) /= 0 or step = 4 then
                symbol  <= x"3" & std_logic_vector(decimal(19 downto 16));
                offer   <= '1';
                leading <= '0';
              end if;
            end if;
          end if;

      end case;

      if reset = '1' then
        state  <= read_line;
        letter <= x"00";
        number <= (others => '0');
        given  <= '0';
        wrong  <= '0';
        offer  <= '0';
        -- The others would set 0, as the reset does.
        set_slice    <= '0';
        set_place    <= '0';
        clear_errors <= '0';
      end if;
    end if;

  end process follow;

end architecture rtl;
