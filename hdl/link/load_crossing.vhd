-- SPDX-License-Identifier: Apache-2.0
-- Brings words for the load port of a resampler into the pixel clock: after each reset the built-in calibration
-- (sensor_pkg) if there is one, then the words of load_port. Without a pixel clock they wait.
--
-- Latency: that of bus_crossing. Throughput: a word in two round trips.
-- Equation: load_word = CALIBRATION(0), CALIBRATION(1), ..., then port_word.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.resample_pkg.all;
use work.sensor_pkg.all;

entity load_crossing is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Words from load_port. port_busy: the word before has not arrived.
    port_write : in    std_logic;
    port_word  : in    load_word_t;
    port_busy  : out   std_logic;
    -- Toggle of the last word that has arrived, brought back from the pixel clock.
    seen : in    std_logic;
    -- In the pixel clock: the word; each change of the toggle is one word.
    pixel_clk   : in    std_logic;
    load_word   : out   load_word_t;
    load_toggle : out   std_logic
  );
end entity load_crossing;

architecture rtl of load_crossing is

begin

  no_sensor : if not WITH_SENSOR generate
    port_busy   <= '0';
    load_word   <= (others => '0');
    load_toggle <= '0';
  end generate no_sensor;

  sensor : if WITH_SENSOR generate

    -- Words of the calibration that were sent; the word under way and its toggle; busy: it has not arrived; all_done:
    -- the calibration is sent.
    constant WORDS : natural := CALIBRATION'length;

    signal number    : natural range 0 to WORDS      := 0;
    signal word      : load_word_t := (others => '0');
    signal toggle    : std_logic                     := '0';
    signal busy      : std_logic;
    signal all_done  : std_logic;
    signal to_pixels : std_logic_vector(62 downto 0);
    signal arrived   : std_logic_vector(62 downto 0);

  begin

    -- A word is under way until its toggle has come back; if it were replaced before, it would be lost. Without a pixel
    -- clock the toggle does not come back, and the words wait.
    busy     <= toggle xor seen;
    all_done <= '1' when number = WORDS or not CALIBRATED else
                '0';
    -- Words of the port wait for the calibration, which they may be meant to correct.
    port_busy <= busy or not all_done;
    -- Word and toggle cross on one bus: when the toggle has changed, the word is complete.
    to_pixels <= toggle & word;

    send : process (clk) is
    begin

      -- synthesis translate_off
      assert not (rising_edge(clk) and port_write = '1' and (busy = '1' or all_done = '0'))
        report "load_crossing: a word came while port_busy, and one is lost"
        severity failure;
      -- synthesis translate_on

      if rising_edge(clk) then
        if all_done = '0' then
          if busy = '0' then
            word   <= CALIBRATION(number)(61 downto 0);
            toggle <= not toggle;
            number <= number + 1;
          end if;
        elsif port_write = '1' then
          word   <= port_word;
          toggle <= not toggle;
        end if;
        -- The toggle keeps its level, because a change would be a word. A word on its way arrives, and the calibration
        -- restarts behind it.
        if reset = '1' then
          number <= 0;
        end if;
      end if;

    end process send;

    crossing : entity work.bus_crossing
      generic map (
        WIDTH => 63
      )
      port map (
        source_clk      => clk,
        source          => to_pixels,
        destination_clk => pixel_clk,
        destination     => arrived
      );

    load_word   <= arrived(61 downto 0);
    load_toggle <= arrived(62);

  end generate sensor;

end architecture rtl;
