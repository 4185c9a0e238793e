-- SPDX-License-Identifier: Apache-2.0
-- The EDID memory that sources read over the display data channel: an I2C slave at 0x50.
--
-- A write sets the address, reads go on from it, one byte after the other. Beyond the EDID_BYTES
-- of the EDID reads give 0xFF. Both lines are taken only after FILTER equal samples; a start condition
-- begins anew from any state, so a transfer that was broken off blocks nothing.
--
-- Latency: FILTER + 3 clocks from a falling edge of the clock line to the data line. Throughput: I2C
--   up to 400 kHz, with clk of 100 MHz.
-- Equation: the n-th byte of a read = EDID(address + n).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.edid_pkg.all;

entity i2c_rom_slave is
  generic (
    -- Equal samples that make a level; 20 are 200 ns of 100 MHz.
    FILTER : positive := 20;
    -- Longest line in pixels: longer modes are not offered.
    MAX_COLUMNS : positive := 1280;
    -- Pixel clocks of the build, see hdmi_control: others are not offered.
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
    -- A byte was read, for a clock.
    read_byte : out   std_logic
  );
end entity i2c_rom_slave;

architecture rtl of i2c_rom_slave is

  constant DEVICE : std_logic_vector(6 downto 0) := "1010000";

  type rom_t is array (0 to EDID_BYTES - 1) of std_logic_vector(7 downto 0);

  -- Of those for the pixel clocks the one with the longest lines that fit; their first one in any case, and the first
  -- of all if there is none.
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

  -- idle: not addressed; device_byte, address_byte, discard: bytes coming in; acknowledge: the
  -- slave's bit; send: a byte going out; acknowledged: the master's bit.
  type state_t is (idle, device_byte, address_byte, discard, acknowledge, send, acknowledged);

  signal lines      : std_logic_vector(1 downto 0);
  signal arrived    : std_logic_vector(1 downto 0);
  signal scl_count  : natural range 0 to FILTER    := 0;
  signal sda_count  : natural range 0 to FILTER    := 0;
  signal scl_now    : std_logic                    := '1';
  signal sda_now    : std_logic                    := '1';
  signal scl_before : std_logic                    := '1';
  signal sda_before : std_logic                    := '1';
  signal state      : state_t                      := idle;
  signal after_ack  : state_t                      := idle;
  signal shift      : std_logic_vector(7 downto 0) := (others => '0');
  signal bits       : natural range 0 to 8         := 0;
  signal address    : unsigned(7 downto 0)         := (others => '0');
  signal rom_byte   : std_logic_vector(7 downto 0) := (others => '0');
  signal refused    : std_logic                    := '0';

begin

  lines <= scl & sda;

  cross : entity work.synchroniser
    generic map (
      WIDTH => 2
    )
    port map (
      clk         => clk,
      level       => lines,
      synchronous => arrived
    );

  filter_lines : process (clk) is
  begin

    if rising_edge(clk) then
      if arrived(1) = scl_now then
        scl_count <= 0;
      elsif scl_count = FILTER - 1 then
        scl_now   <= arrived(1);
        scl_count <= 0;
      else
        scl_count <= scl_count + 1;
      end if;
      if arrived(0) = sda_now then
        sda_count <= 0;
      elsif sda_count = FILTER - 1 then
        sda_now   <= arrived(0);
        sda_count <= 0;
      else
        sda_count <= sda_count + 1;
      end if;
      scl_before <= scl_now;
      sda_before <= sda_now;
    end if;

  end process filter_lines;

  look_up : process (clk) is
  begin

    if rising_edge(clk) then
      rom_byte <= x"FF";
      if address < EDID_BYTES then
        rom_byte <= EDID(to_integer(address));
      end if;
    end if;

  end process look_up;

  serve : process (clk) is
  begin

    if rising_edge(clk) then
      read_byte <= '0';

      if scl_now = '1' and scl_before = '0' then
        -- Rising clock: bits are taken.
        if state = device_byte or state = address_byte or state = discard then
          shift <= shift(6 downto 0) & sda_now;
          bits  <= bits + 1;
        elsif state = acknowledged then
          refused <= sda_now;
        end if;
      elsif scl_now = '0' and scl_before = '1' then
        -- Falling clock: the data line may change.
        case state is

          when idle =>

            sda_low <= '0';

          when device_byte =>

            if bits = 8 then
              bits <= 0;
              if shift(7 downto 1) = DEVICE then
                sda_low <= '1';
                state   <= acknowledge;
                if shift(0) = '1' then
                  after_ack <= send;
                else
                  after_ack <= address_byte;
                end if;
              else
                state <= idle;
              end if;
            end if;

          when address_byte =>

            if bits = 8 then
              bits      <= 0;
              sda_low   <= '1';
              address   <= unsigned(shift);
              state     <= acknowledge;
              after_ack <= discard;
            end if;

          when discard =>

            -- There is nothing to write to.
            if bits = 8 then
              bits  <= 0;
              state <= idle;
            end if;

          when acknowledge =>

            sda_low <= '0';
            state   <= after_ack;
            if after_ack = send then
              sda_low <= not rom_byte(7);
              shift   <= rom_byte(6 downto 0) & '1';
              address <= address + 1;
              bits    <= 1;
            end if;

          when send =>

            if bits = 8 then
              sda_low   <= '0';
              bits      <= 0;
              state     <= acknowledged;
              read_byte <= '1';
            else
              sda_low <= not shift(7);
              shift   <= shift(6 downto 0) & '1';
              bits    <= bits + 1;
            end if;

          when acknowledged =>

            if refused = '1' then
              sda_low <= '0';
              state   <= idle;
            else
              sda_low <= not rom_byte(7);
              shift   <= rom_byte(6 downto 0) & '1';
              address <= address + 1;
              bits    <= 1;
              state   <= send;
            end if;

        end case;

      elsif scl_now = '1' and sda_now /= sda_before then
        -- Start or stop.
        sda_low <= '0';
        bits    <= 0;
        state   <= idle;
        if sda_now = '0' then
          state <= device_byte;
        end if;
      end if;

      if reset = '1' then
        state   <= idle;
        sda_low <= '0';
        bits    <= 0;
      end if;
    end if;

  end process serve;

end architecture rtl;
