-- SPDX-License-Identifier: Apache-2.0
-- From the deserialised bits of three channels to pixels and syncs.
--
-- Word alignment -> deskew -> decoders -> periods. Of an HDMI source's data islands the
-- syncs are kept and the AVI InfoFrame is read.
--
-- Latency: about 12 clocks, plus the skew that is taken out. Throughput: one pixel each clock.
-- Equation: DVI 1.0, sections 3.2 and 3.3; HDMI 1.4, section 5.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.tmds_pkg.all;

entity tmds_receiver is
  generic (
    -- Control tokens in a row that make a word phase trustworthy.
    RUN : positive := 8;
    -- Words without such a run after which a channel is lost.
    ALIGN_TIMEOUT : positive := 8192
  );
  port (
    -- Pixel clock.
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The next ten bits of each channel, wherever its words begin: channel 0 (blue) in the low bits, bit 0 came first.
    bits : in    std_logic_vector(10 * CHANNELS - 1 downto 0);
    -- Video: red in the low bits of pixel, black where not active.
    active : out   std_logic;
    h_sync : out   std_logic;
    v_sync : out   std_logic;
    pixel  : out   std_logic_vector(23 downto 0);
    -- Each channel is aligned to words.
    aligned : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- All channels are aligned and deskewed.
    locked : out   std_logic;
    -- Channels whose word is not one that this period (control, video, island) can have.
    errors : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- The source sends HDMI, not DVI.
    hdmi : out   std_logic;
    -- What it tells of its picture, and packets with errors; see info_frame_reader.
    informed     : out   std_logic;
    colour       : out   std_logic_vector(1 downto 0);
    limited      : out   std_logic;
    bt601        : out   std_logic;
    format_code  : out   std_logic_vector(7 downto 0);
    packet_error : out   std_logic;
    sum_error    : out   std_logic
  );
end entity tmds_receiver;

architecture rtl of tmds_receiver is

  signal words           : std_logic_vector(10 * CHANNELS - 1 downto 0);
  signal tokens          : std_logic_vector(CHANNELS - 1 downto 0);
  signal channel_aligned : std_logic_vector(CHANNELS - 1 downto 0);
  signal deskewed        : std_logic_vector(10 * CHANNELS - 1 downto 0);
  signal deskew_locked   : std_logic;
  signal not_locked      : std_logic;
  signal channel_active  : std_logic_vector(CHANNELS - 1 downto 0);
  signal control         : std_logic_vector(2 * CHANNELS - 1 downto 0);
  signal bytes           : std_logic_vector(8 * CHANNELS - 1 downto 0);
  signal channel_errors  : std_logic_vector(CHANNELS - 1 downto 0);
  signal is_nibble       : std_logic_vector(CHANNELS - 1 downto 0);
  signal nibbles         : std_logic_vector(4 * CHANNELS - 1 downto 0);
  signal is_guard        : std_logic_vector(CHANNELS - 1 downto 0);
  signal is_hdmi         : std_logic;
  signal not_hdmi        : std_logic;
  signal island_start    : std_logic;
  signal island_valid    : std_logic;
  signal island_header   : std_logic;
  signal island_even     : std_logic_vector(3 downto 0);
  signal island_odd      : std_logic_vector(3 downto 0);

begin

  aligned <= channel_aligned;

  channel : for c in 0 to CHANNELS - 1 generate

    align : entity work.tmds_word_align
      generic map (
        RUN     => RUN,
        TIMEOUT => ALIGN_TIMEOUT
      )
      port map (
        clk     => clk,
        reset   => reset,
        bits    => bits(10 * c + 9 downto 10 * c),
        word    => words(10 * c + 9 downto 10 * c),
        token   => tokens(c),
        aligned => channel_aligned(c)
      );

    decoder : entity work.tmds_decoder
      port map (
        clk       => clk,
        reset     => reset,
        word      => deskewed(10 * c + 9 downto 10 * c),
        active    => channel_active(c),
        control   => control(2 * c + 1 downto 2 * c),
        data      => bytes(8 * c + 7 downto 8 * c),
        error     => channel_errors(c),
        is_nibble => is_nibble(c),
        nibble    => nibbles(4 * c + 3 downto 4 * c),
        is_guard  => is_guard(c)
      );

  end generate channel;

  deskew : entity work.tmds_deskew
    port map (
      clk       => clk,
      reset     => reset,
      words     => words,
      tokens    => tokens,
      aligned   => channel_aligned,
      out_words => deskewed,
      locked    => deskew_locked
    );

  not_locked <= reset or not deskew_locked;
  not_hdmi   <= not is_hdmi;
  hdmi       <= is_hdmi;

  periods : entity work.tmds_periods
    port map (
      clk            => clk,
      reset          => not_locked,
      word_active    => channel_active,
      word_control   => control,
      word_data      => bytes,
      word_error     => channel_errors,
      word_is_nibble => is_nibble,
      word_nibble    => nibbles,
      word_is_guard  => is_guard,
      active         => active,
      h_sync         => h_sync,
      v_sync         => v_sync,
      pixel          => pixel,
      errors         => errors,
      hdmi           => is_hdmi,
      island_start   => island_start,
      island_valid   => island_valid,
      island_header  => island_header,
      island_even    => island_even,
      island_odd     => island_odd
    );

  reader : entity work.info_frame_reader
    port map (
      clk          => clk,
      reset        => not_hdmi,
      start        => island_start,
      valid        => island_valid,
      header       => island_header,
      even         => island_even,
      odd          => island_odd,
      informed     => informed,
      colour       => colour,
      limited      => limited,
      bt601        => bt601,
      format_code  => format_code,
      packet_error => packet_error,
      sum_error    => sum_error
    );

  report_lock : process (clk) is
  begin

    if rising_edge(clk) then
      locked <= not not_locked;
    end if;

  end process report_lock;

end architecture rtl;
