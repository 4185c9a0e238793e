-- SPDX-License-Identifier: Apache-2.0
-- From pixels and syncs to the bits of three channels and the clock lane: encoders, then an elastic buffer into the
-- serialisers' clock.
--
-- Latency: about 15 clocks. Throughput: one pixel each clock.
-- Equation: DVI 1.0, sections 3.2 and 3.3; the clock lane is high for the first five bits of a word.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity tmds_transmitter is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video, in clk.
    video : in    video_t;
    -- Clock of the transmitter, with the frequency of clk and any phase to it.
    tx_clk : in    std_logic;
    -- Reset in tx_clk.
    tx_reset : in    std_logic;
    -- Words of channels 0 to 2 and, in the high bits, of the clock lane, in tx_clk; bit 0 is sent first.
    tx_words : out   std_logic_vector(10 * CHANNELS + 9 downto 0)
  );
end entity tmds_transmitter;

architecture rtl of tmds_transmitter is

  constant CLOCK_WORD : tmds_word_t := "0000011111";
  constant SYNCS      : natural     := 0;

  type bytes_t is array (0 to CHANNELS - 1) of std_logic_vector(7 downto 0);

  type controls_t is array (0 to CHANNELS - 1) of std_logic_vector(1 downto 0);

  signal bytes    : bytes_t;
  signal controls : controls_t;
  signal words    : std_logic_vector(10 * CHANNELS - 1 downto 0);

begin

  -- Bytes of the channels: blue, green, red.
  bytes(0) <= video.pixel(23 downto 16);
  bytes(1) <= video.pixel(15 downto 8);
  bytes(2) <= video.pixel(7 downto 0);

  channel : for c in 0 to CHANNELS - 1 generate

    -- DVI sends the syncs with blue; the control bits of the other channels are 0.
    controls(c) <= video.v_sync & video.h_sync when c = SYNCS else
                   "00";

    encoder : entity work.tmds_encoder
      port map (
        clk     => clk,
        reset   => reset,
        active  => video.active,
        control => controls(c),
        data    => bytes(c),
        word    => words(10 * c + 9 downto 10 * c)
      );

  end generate channel;

  crossing : entity work.elastic_buffer
    generic map (
      WIDTH => 10 * CHANNELS
    )
    port map (
      write_clk   => clk,
      write_reset => reset,
      write_word  => words,
      read_clk    => tx_clk,
      read_reset  => tx_reset,
      read_word   => tx_words(10 * CHANNELS - 1 downto 0)
    );

  -- The clock lane's word is constant, so it needs no crossing.
  tx_words(10 * CHANNELS + 9 downto 10 * CHANNELS) <= CLOCK_WORD;

end architecture rtl;
