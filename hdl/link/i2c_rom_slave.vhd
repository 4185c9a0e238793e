-- SPDX-License-Identifier: Apache-2.0
-- The EDID memory that sources read over the display data channel: an I2C slave at 0x50.
--
-- A write sets the address, and reads continue from it byte by byte; without a write they continue behind the last
-- read, after a reset from 0. The address wraps round at EDID_BYTES, like that of a 24LCS21. Both lines are filtered by
-- FILTER equal samples, and the data line also has a hold time (i2c_lines), because a source may change both at once. A
-- start condition restarts the slave in any state, so an interrupted transfer blocks nothing. A source that goes away
-- while the slave holds the data line low would block it, so the line is released when the clock line has been still
-- for LET_GO clocks.
--
-- Latency: FILTER + HOLD + 4 clocks, HOLD + 4 if FILTER is 1, from a falling edge of the clock line to the data line,
-- which is the master's hold time. Throughput: I2C up to 400 kHz, with clk at 100 MHz.
-- Equation: the n-th byte of a read = EDID((address + n) mod EDID_BYTES).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.edid_pkg.all;
use work.math_pkg.all;

entity i2c_rom_slave is
  generic (
    -- Equal samples that make a level; 20 are 200 ns at 100 MHz.
    FILTER : positive := 20;
    -- Clocks of hold time; UM10204 asks devices for 300 ns. FILTER and HOLD together must be less than the clock line's
    -- shortest high level, 600 ns.
    HOLD : positive := 30;
    -- Clocks without an edge of the clock line after which the data line is released: more than the longest bit.
    LET_GO : positive := 3000000;
    -- Longest line in pixels: longer modes are not offered.
    MAX_COLUMNS : positive := 1280;
    -- Pixel clocks of the build (hdmi_control): modes with other clocks are not offered.
    CLOCK_RANGE : natural range 0 to 4 := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The lines, as they are at the pins.
    scl : in    std_logic;
    sda : in    std_logic;
    -- Pull the data line low (open drain).
    sda_low : out   std_logic;
    -- High for one clock: a byte was read.
    read_byte : out   std_logic
  );
end entity i2c_rom_slave;

architecture rtl of i2c_rom_slave is

  constant DEVICE : std_logic_vector(6 downto 0) := "1010000";
  -- The size is a power of two, so that the address wraps round.
  constant ADDRESS_BITS : positive := bits_for(EDID_BYTES - 1);

  type rom_t is array (0 to EDID_BYTES - 1) of std_logic_vector(7 downto 0);

  -- Among the EDIDs for these pixel clocks, the one with the longest lines that fit; if none fits, the first of them;
  -- if there are none, the first of all.
  function chosen_edid (
    columns : positive;
    clocks  : natural
  ) return rom_t is

    variable first_bit : natural;
    variable found     : boolean;
    variable rom       : rom_t;

  begin

    first_bit := 0;
    found     := false;

    for i in EDID_COLUMNS'range loop

      if EDID_RANGES(i) = clocks and (not found or EDID_COLUMNS(i) <= columns) then
        first_bit := 8 * EDID_BYTES * i;
        found     := true;
      end if;

    end loop;

    for i in rom'range loop

      rom(i) := EDIDS(first_bit + 8 * i to first_bit + 8 * i + 7);

    end loop;

    return rom;

  end function chosen_edid;

  constant EDID : rom_t := chosen_edid(MAX_COLUMNS, CLOCK_RANGE);

  -- idle: not addressed, until the next start; device_byte, address_byte, discard: a byte comes in; acknowledge: the
  -- slave's bit; send: a byte goes out; acknowledged: the master's bit.
  type state_t is (idle, device_byte, address_byte, discard, acknowledge, send, acknowledged);

  -- Levels of the lines, now and a clock before.
  signal scl_now    : std_logic;
  signal sda_now    : std_logic;
  signal scl_before : std_logic := '1';
  signal sda_before : std_logic := '1';
  signal state      : state_t   := idle;
  -- after_ack: the state behind the slave's acknowledge bit.
  signal after_ack : state_t                             := idle;
  signal shift     : std_logic_vector(7 downto 0)        := (others => '0');
  signal bits      : natural range 0 to 8                := 0;
  signal address   : unsigned(ADDRESS_BITS - 1 downto 0) := (others => '0');
  signal rom_byte  : std_logic_vector(7 downto 0)        := (others => '0');
  -- holds: the data line is to be low; pulls: it is, some clocks later; waited: clocks in between; held_long: clocks
  -- since the last edge of the clock line while it is held.
  signal holds     : std_logic                 := '0';
  signal pulls     : std_logic                 := '0';
  signal waited    : natural range 0 to HOLD   := 0;
  signal held_long : natural range 0 to LET_GO := 0;
  -- The master has not acknowledged: it wants no more bytes.
  signal refused : std_logic := '0';

  -- Each high for one clock: edges of the clock line; borders: a start or a stop.
  signal rises   : std_logic;
  signal falls   : std_logic;
  signal borders : std_logic;
  -- receives: the bits belong to a byte that comes in; full: a whole byte has passed; fetches: the next byte of the
  -- memory begins to go out.
  signal receives : std_logic;
  signal full     : std_logic;
  signal fetches  : std_logic;

begin

  sda_low <= pulls;

  lines : entity work.i2c_lines
    generic map (
      SPIKE => FILTER,
      HOLD  => HOLD
    )
    port map (
      clk       => clk,
      scl       => scl,
      sda       => sda,
      scl_level => scl_now,
      sda_level => sda_now
    );

  -- The data line changes HOLD clocks behind the fall of the clock line, because the master may see that fall late.
  drive_line : process (clk) is
  begin

    if rising_edge(clk) then
      if holds = pulls then
        waited <= 0;
      elsif waited = HOLD - 1 then
        waited <= 0;
        pulls  <= holds;
      else
        waited <= waited + 1;
      end if;
      if reset = '1' then
        pulls <= '0';
      end if;
    end if;

  end process drive_line;

  -- Levels of the clock before, to find edges.
  remember_levels : process (clk) is
  begin

    if rising_edge(clk) then
      scl_before <= scl_now;
      sda_before <= sda_now;
    end if;

  end process remember_levels;

  -- A register behind the ROM: the byte is needed many clocks after the address.
  look_up : process (clk) is
  begin

    if rising_edge(clk) then
      rom_byte <= EDID(to_integer(address));
    end if;

  end process look_up;

  rises <= scl_now and not scl_before;
  falls <= scl_before and not scl_now;
  -- Only a start or a stop changes the data line while the clock line is high, now and a clock before.
  borders  <= scl_now and scl_before and (sda_now xor sda_before);
  receives <= to_logic(state = device_byte or state = address_byte or state = discard);
  full     <= to_logic(bits = 8);
  -- A byte begins to go out behind the acknowledge bit of the address, and behind each byte that the master
  -- acknowledges.
  fetches <= falls and (to_logic(state = acknowledge and after_ack = send) or
                        (to_logic(state = acknowledged) and not refused));

  -- Bits are read when the clock line rises, and sent when it falls.
  shift_bits : process (clk) is
  begin

    if rising_edge(clk) then
      if rises = '1' and receives = '1' then
        shift <= shift(6 downto 0) & sda_now;
        bits  <= bits + 1;
      elsif falls = '1' and full = '1' and (receives = '1' or state = send) then
        bits <= 0;
      elsif fetches = '1' then
        -- The first bit leaves in this clock (see holds), so seven are left. The ones behind them release the line.
        shift <= rom_byte(6 downto 0) & '1';
        bits  <= 1;
      elsif falls = '1' and state = send then
        shift <= shift(6 downto 0) & '1';
        bits  <= bits + 1;
      elsif borders = '1' then
        -- A start may come in the middle of a byte.
        bits <= 0;
      end if;
      if falls = '1' and state = address_byte and full = '1' then
        -- The address counts on from the last one, like that of an EEPROM: a source may read without writing it.
        address <= unsigned(shift(ADDRESS_BITS - 1 downto 0));
      elsif fetches = '1' then
        address <= address + 1;
      end if;
      if reset = '1' then
        bits    <= 0;
        address <= (others => '0');
      end if;
    end if;

  end process shift_bits;

  -- Open drain: a 0 is pulled (holds), a 1 is released. The lowest bit of the device byte says whether the master
  -- reads. A write sets the address with its first byte. A byte that the master does not acknowledge is the last one.
  serve : process (clk) is
  begin

    if rising_edge(clk) then
      read_byte <= '0';

      if rises = '1' then
        if state = acknowledged then
          refused <= sda_now;
        end if;
      elsif falls = '1' then

        case state is

          when idle =>

            holds <= '0';

          when device_byte =>

            if full = '1' then
              state <= idle;
              if shift(7 downto 1) = DEVICE then
                -- The acknowledge bit is low until the next falling edge of the clock line.
                holds     <= '1';
                state     <= acknowledge;
                after_ack <= address_byte;
                if shift(0) = '1' then
                  after_ack <= send;
                end if;
              end if;
            end if;

          when address_byte =>

            if full = '1' then
              holds     <= '1';
              state     <= acknowledge;
              after_ack <= discard;
            end if;

          when discard =>

            -- The memory is read-only: without an acknowledgement the source stops.
            if full = '1' then
              state <= idle;
            end if;

          when acknowledge =>

            state <= after_ack;
            holds <= fetches and not rom_byte(7);

          when send =>

            holds <= not shift(7);
            if full = '1' then
              holds     <= '0';
              state     <= acknowledged;
              read_byte <= '1';
            end if;

          when acknowledged =>

            holds <= not rom_byte(7);
            state <= send;
            -- The master wants no more bytes: it makes a stop next, for which the line must be released.
            if refused = '1' then
              holds <= '0';
              state <= idle;
            end if;

        end case;

      elsif borders = '1' then
        holds <= '0';
        state <= idle;
        if sda_now = '0' then
          state <= device_byte;
        end if;
      end if;

      -- Every edge of the clock line restarts the count, and only a held line counts.
      held_long <= 0;
      if holds = '1' and rises = '0' and falls = '0' then
        held_long <= held_long + 1;
        if held_long = LET_GO - 1 then
          held_long <= 0;
          holds     <= '0';
          state     <= idle;
        end if;
      end if;

      if reset = '1' then
        state <= idle;
        holds <= '0';
      end if;
    end if;

  end process serve;

end architecture rtl;
