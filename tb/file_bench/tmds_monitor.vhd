-- SPDX-License-Identifier: Apache-2.0
-- Samples the serial bits of three TMDS channels as a monitor does it, in tenths of their own clock lane, and writes
-- them to output.bin: 32-bit little-endian words, one a period of the clock lane: ten bits of channel 0 in bits 0 to 9,
-- channel 1 in 10 to 19, channel 2 in 20 to 29; what came first is lowest.
--
-- Words begin where the clock lane rises, whatever their true phase is. None is written until four periods were alike.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity tmds_monitor is
  generic (
    -- Period that the clock lane has, within a part in fifty; 0: any.
    NOMINAL_PERIOD : time := 0 fs
  );
  port (
    clk  : in    std_logic;
    data : in    std_logic_vector(2 downto 0);
    -- The file is opened when it begins, and closed when it ends.
    watching : in    boolean;
    -- Whether the file is open; the words in it.
    is_open : out   boolean := false;
    words   : out   natural := 0
  );
end entity tmds_monitor;

architecture test of tmds_monitor is

  type words_t is file of integer;

begin

  take : process is

    file output_file : words_t;

    variable last   : time;
    variable period : time;
    variable cycles : natural;
    variable count  : natural;
    variable bits   : std_logic_vector(31 downto 0);

  begin

    if not watching then
      wait until watching;
    end if;

    is_open <= true;
    file_open(output_file, "output.bin", write_mode);
    cycles  := 0;
    count   := 0;
    last    := now;

    while watching loop

      wait until rising_edge(clk) or not watching;
      exit when not watching;

      if cycles > 0 and abs (now - last - period) > period / 8 then
        -- The clock has just begun, or changed.
        cycles := 0;
      end if;

      period := now - last;
      last   := now;

      -- Four periods alike, so that the middle of the bits is sure.
      if cycles < 4 then
        cycles := cycles + 1;
      else
        assert NOMINAL_PERIOD = 0 fs or abs (period - NOMINAL_PERIOD) < NOMINAL_PERIOD / 50
          report "tmds_monitor: the clock lane's period is " & time'image(period) & ", expected " &
                 time'image(NOMINAL_PERIOD)
          severity failure;
        bits := (others => '0');
        -- Bits in their middle, from the clock lane's rising edge on: wherever words begin, their
        -- place stays the same.
        wait for period / 20;

        for i in 0 to 9 loop

          for c in 0 to 2 loop

            bits(10 * c + i) := data(c);

          end loop;

          if i /= 9 then
            wait for period / 10;
          end if;

        end loop;

        write(output_file, to_integer(signed(bits)));
        count := count + 1;
        words <= count;
      end if;

    end loop;

    file_close(output_file);
    is_open <= false;
    wait for 0 fs;

  end process take;

end architecture test;
