-- SPDX-License-Identifier: Apache-2.0
-- A camera's lanes as they are on the wires: packets of a file as bursts between low power and high speed.
--
-- The file has words of 32 bits: the number of bytes of a packet and its bytes; 0 and a number of bits to wait; or -1
-- and the number of bits since the start at which the next packet begins.
-- A wire has four levels: '1' and '0' in low power, 'H' and 'L' in high speed. Times are the shortest that D-PHY
-- allows, rounded up to bits; the clock lane's edges are in the middle of the bits.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity dphy_camera is
  generic (
    LANES : positive range 1 to 4;
    -- A bit's time.
    BIT_PS : positive;
    -- Whether the clock lane goes on between bursts.
    CONTINUOUS : boolean := false;
    -- Bits by which each lane is later than the one before.
    SKEW : natural := 0
  );
  port (
    start  : in    boolean;
    clk_p  : out   std_logic                    := '1';
    clk_n  : out   std_logic                    := '1';
    data_p : out   std_logic_vector(3 downto 0) := "1111";
    data_n : out   std_logic_vector(3 downto 0) := "1111";
    sent   : out   boolean                      := false
  );
end entity dphy_camera;

architecture test of dphy_camera is

  type words_t is file of integer;

  -- What a lane's two lines show: LP-11, LP-01, LP-00, and a zero and a one in high speed.
  type levels_t is (stop, request, bridge, zero, one);

  type lanes_t is array (0 to 3) of levels_t;

  subtype byte_t is std_logic_vector(7 downto 0);

  type bytes_t is array (natural range <>) of byte_t;

  constant HALF : time := BIT_PS * 1 ps / 2;

  -- Bits in a time of the standard: nanoseconds and bits.

  function bits_of (
    nanoseconds : natural;
    bits        : natural
  ) return positive is
  begin

    -- Rounded up, and a bit more: a time that the standard has as a minimum.
    return (1000 * nanoseconds + BIT_PS - 1) / BIT_PS + bits + 1;

  end function bits_of;

  function positive_of (
    level : levels_t
  ) return std_logic is
  begin

    case level is

      when stop =>

        return '1';

      when request | bridge =>

        return '0';

      when zero =>

        return 'L';

      when one =>

        return 'H';

    end case;

  end function positive_of;

  function negative_of (
    level : levels_t
  ) return std_logic is
  begin

    case level is

      when stop | request =>

        return '1';

      when bridge =>

        return '0';

      when zero =>

        return 'H';

      when one =>

        return 'L';

    end case;

  end function negative_of;

begin

  send : process is

    file input_file : words_t open read_mode is "input.bin";

    variable now_lanes : lanes_t  := (others => stop);
    variable now_clock : levels_t := stop;
    variable running   : boolean  := false;
    variable length    : integer;
    variable word      : integer;
    variable passed    : natural  := 0;
    variable packet    : bytes_t(0 to 65600);
    variable last      : lanes_t;

    -- So many bits at the present levels.

    procedure pass (
      bits : natural
    ) is
    begin

      for n in 1 to bits loop

        for i in 0 to LANES - 1 loop

          -- A later lane has all of its levels later, those of low power too.
          data_p(i) <= transport positive_of(now_lanes(i)) after i * SKEW * 2 * HALF;
          data_n(i) <= transport negative_of(now_lanes(i)) after i * SKEW * 2 * HALF;

        end loop;

        clk_p <= positive_of(now_clock);
        clk_n <= negative_of(now_clock);
        -- The data change with the clock lane's level; its edge comes in the middle of the bit.
        wait for HALF;

        if running then
          if now_clock = one then
            now_clock := zero;
          else
            now_clock := one;
          end if;
          clk_p <= positive_of(now_clock);
          clk_n <= negative_of(now_clock);
        end if;

        wait for HALF;
        passed := passed + 1;

      end loop;

    end procedure pass;

    procedure start_clock is
    begin

      -- Out of LP-11 by LP-01 and LP-00; then a zero for so long that the receiver has settled, and
      -- whole periods before any data.
      now_clock := request;
      pass(bits_of(50, 0));
      now_clock := bridge;
      pass(bits_of(38, 0));
      now_clock := zero;
      pass(bits_of(262, 0));
      running   := true;
      pass(8);

    end procedure start_clock;

    procedure stop_clock is
    begin

      -- The clock goes on behind the last data lane, so that the receiver gets its trail.
      pass(bits_of(60, 52));
      running   := false;
      now_clock := zero;
      pass(bits_of(60, 0));
      now_clock := stop;
      pass(bits_of(100, 0));

    end procedure stop_clock;

    procedure send_bits (
      constant bytes : in bytes_t
    ) is
    begin

      -- The lowest bit of a byte goes first, on all lanes at once.
      for b in 0 to 7 loop

        for i in 0 to LANES - 1 loop

          now_lanes(i) := zero;

          if bytes(i)(b) = '1' then
            now_lanes(i) := one;
          end if;

        end loop;

        pass(1);

      end loop;

    end procedure send_bits;

    procedure send_packet is

      variable bytes : bytes_t(0 to 3);
      variable place : natural := 0;

    begin

      now_lanes := (others => request);
      pass(bits_of(50, 0));
      now_lanes := (others => bridge);
      pass(bits_of(40, 4));
      now_lanes := (others => zero);
      pass(bits_of(105, 6));
      -- The sync sequence, on each lane.
      send_bits((x"B8", x"B8", x"B8", x"B8"));

      while place < length loop

        for i in 0 to LANES - 1 loop

          if place + i < length then
            bytes(i) := packet(place + i);
          else
            -- A lane that has no more bytes has its trail already.
            bytes(i) := (others => to_x01(not positive_of(last(i))));
          end if;

        end loop;

        send_bits(bytes);

        for i in 0 to LANES - 1 loop

          if place + i < length then
            last(i) := now_lanes(i);
          end if;

        end loop;

        place := place + LANES;

      end loop;

      -- The trail: the last bit's opposite, until the lane rests.
      for i in 0 to LANES - 1 loop

        if last(i) = one then
          now_lanes(i) := zero;
        else
          now_lanes(i) := one;
        end if;

      end loop;

      pass(bits_of(60, 8));
      now_lanes := (others => stop);

      if CONTINUOUS then
        pass(bits_of(100, 0));
      else
        stop_clock;
      end if;

    end procedure send_packet;

  begin

    wait until start;
    pass(bits_of(200, 0));

    if CONTINUOUS then
      start_clock;
    end if;

    while not endfile(input_file) loop

      read(input_file, length);

      if length = 0 then
        read(input_file, word);
        pass(word);
      elsif length < 0 then
        read(input_file, word);
        -- Packets at fixed times, so that a test knows when a line begins: what is late must not
        -- pass as if it were in time.
        assert word >= passed
          report "dphy_camera: a packet of input.bin has not ended when the next one is to begin: give that a later bit"
          severity failure;
        pass(word - passed);
      else

        for n in 0 to length - 1 loop

          read(input_file, word);
          packet(n) := std_logic_vector(to_unsigned(word, 8));

        end loop;

        -- Without a continuous clock each burst starts the clock lane and stops it.
        if not CONTINUOUS then
          start_clock;
        end if;
        send_packet;
      end if;

    end loop;

    sent <= true;
    wait;

  end process send;

end architecture test;
