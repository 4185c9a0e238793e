-- SPDX-License-Identifier: Apache-2.0
-- Takes words for the load port of a resampler from the serial port, in front of command_line.
--
-- Lines that begin with the letter l are for this entity; all others go on to command_line, whose answers return
-- through here. Blanks are ignored. Each line is answered with one line.
--
--   l KAAAAADDDDDDDDDD   write a word: kind, address, data, 16 hexadecimal digits
--   l ?                  describe the resampler
--
-- The answer is "ok", "error" (another character, more or fewer digits, a second question mark, a kind above 3, or a
-- resampler that has not taken the word before), or DESCRIPTION.
--
-- Latency: up to the end of the line. Throughput: one line at a time; characters that come during an answer are
-- dropped.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity load_port is
  generic (
    -- Answer to "l ?", one line.
    DESCRIPTION : string
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Characters in, always taken.
    in_valid : in    std_logic;
    in_data  : in    std_logic_vector(7 downto 0);
    -- Characters of all other lines, for command_line.
    other_valid : out   std_logic;
    other_data  : out   std_logic_vector(7 downto 0);
    -- Answers of command_line.
    s_axis_tvalid : in    std_logic                    := '0';
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(7 downto 0) := x"00";
    -- All answers.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(7 downto 0);
    -- The word before has not arrived.
    busy : in    std_logic;
    -- The load port of resampler.
    load_write   : out   std_logic;
    load_kind    : out   std_logic_vector(1 downto 0);
    load_address : out   std_logic_vector(19 downto 0);
    load_data    : out   std_logic_vector(39 downto 0)
  );
end entity load_port;

architecture rtl of load_port is

  constant LINE_END : string := CR & LF;
  constant ANSWERS  : string := "ok" & LINE_END & "error" & LINE_END & DESCRIPTION & LINE_END;

  -- First characters of the answers in the ROM, as in command_line; each answer ends with its line feed.
  constant OK_FIRST          : positive := 1;
  constant ERROR_FIRST       : positive := 5;
  constant DESCRIPTION_FIRST : positive := 12;
  constant DIGITS            : positive := 16;

  subtype character_t is std_logic_vector(7 downto 0);

  type codes_t is array (ANSWERS'range) of character_t;

  function code (
    c : character
  ) return std_logic_vector is
  begin

    return std_logic_vector(to_unsigned(character'pos(c), 8));

  end function code;

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

  function between (
    c     : character_t;
    first : character;
    last  : character
  ) return boolean is
  begin

    return unsigned(c) >= unsigned(code(first)) and unsigned(c) <= unsigned(code(last));

  end function between;

  -- begins: the next character begins a line; own: the line is for this entity; its hexadecimal digits so far and their
  -- values; asked: a question mark came; wrong: the line is wrong whatever follows.
  signal begins : std_logic                                 := '1';
  signal own    : std_logic                                 := '0';
  signal count  : natural range 0 to DIGITS                 := 0;
  signal word   : std_logic_vector(4 * DIGITS - 1 downto 0) := (others => '0');
  signal asked  : std_logic                                 := '0';
  signal wrong  : std_logic                                 := '0';
  -- answering: an answer of this entity is under way; other: one of command_line is.
  signal answering : std_logic                         := '0';
  signal other     : std_logic                         := '0';
  signal place     : natural range 1 to ANSWERS'length := 1;
  signal symbol    : character_t;
  signal ends      : std_logic;
  signal blank     : std_logic;

begin

  symbol        <= CODES(place);
  m_axis_tvalid <= answering or s_axis_tvalid;
  m_axis_tdata  <= symbol when answering = '1' else
                   s_axis_tdata;
  s_axis_tready <= m_axis_tready and not answering;
  other_data    <= in_data;
  ends          <= '1' when in_data = code(CR) or in_data = code(LF) else
                   '0';
  blank         <= '1' when in_data = code(' ') else
                   '0';
  -- The letter l at the beginning of a line, and all that follows it, stays here.
  other_valid  <= in_valid and not own and not answering when in_data /= code('l') or begins = '0' else
                  '0';
  load_kind    <= word(61 downto 60);
  load_address <= word(59 downto 40);
  load_data    <= word(39 downto 0);

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      load_write <= '0';

      -- An answer of command_line passes unchanged. Characters that come meanwhile are dropped here as command_line
      -- drops them; otherwise they would begin a line here and not there.
      if answering = '0' and s_axis_tvalid = '1' and m_axis_tready = '1' then
        other <= '1';
        if s_axis_tdata = code(LF) then
          other <= '0';
        end if;
      end if;

      if answering = '1' then
        if m_axis_tready = '1' then
          if symbol = code(LF) then
            answering <= '0';
          else
            place <= place + 1;
          end if;
        end if;
      elsif in_valid = '1' and other = '0' then
        -- Blanks in front of the letter are ignored.
        begins <= ends or (begins and blank);
        if own = '0' then
          if begins = '1' and in_data = code('l') then
            own   <= '1';
            count <= 0;
            asked <= '0';
            wrong <= '0';
          end if;
        elsif ends = '1' then
          own       <= '0';
          answering <= '1';
          place     <= ERROR_FIRST;
          -- A question has no digits; a word has all digits and a valid kind. The word before must have arrived,
          -- because it is held in a register until then.
          if wrong = '0' and asked = '1' and count = 0 then
            place <= DESCRIPTION_FIRST;
          elsif wrong = '0' and asked = '0' and count = DIGITS and word(63 downto 62) = "00" and
                busy = '0' then
            place      <= OK_FIRST;
            load_write <= '1';
          end if;
        elsif in_data = code('?') then
          asked <= '1';
          wrong <= wrong or asked;
        elsif between(in_data, '0', '9') or between(in_data, 'a', 'f') or between(in_data, 'A', 'F') then
          if count = DIGITS then
            wrong <= '1';
          else
            count <= count + 1;
          end if;
          -- The codes of A to F and a to f end with 1 to 6 and have bit 6, which the codes of digits have not: adding 9
          -- serves both cases of letters.
          word <= word(4 * DIGITS - 5 downto 0) & in_data(3 downto 0);
          if in_data(6) = '1' then
            word(3 downto 0) <= std_logic_vector(unsigned(in_data(3 downto 0)) + 9);
          end if;
        elsif blank = '0' then
          -- Any other character makes the line wrong; the answer comes when the line has ended, so that each line has
          -- one answer.
          wrong <= '1';
        end if;
      end if;

      if reset = '1' then
        begins     <= '1';
        own        <= '0';
        answering  <= '0';
        other      <= '0';
        load_write <= '0';
      end if;
    end if;

  end process follow;

end architecture rtl;
