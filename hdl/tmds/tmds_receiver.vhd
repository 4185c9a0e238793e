-- SPDX-License-Identifier: Apache-2.0
-- From the deserialised bits of three channels to pixels and syncs.
--
-- Word alignment -> polarity -> deskew -> decoders -> periods. In data islands of an HDMI source the syncs are kept and
-- the AVI InfoFrame is read.
--
-- Latency: about 12 clocks, and the skew that is removed. Throughput: one pixel each clock.
-- Equation: DVI 1.0, sections 3.2 and 3.3; HDMI 1.4, section 5.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity tmds_receiver is
  generic (
    -- Control tokens in a row that confirm a word phase.
    RUN : positive := 8;
    -- Words without such a run after which a channel is lost.
    ALIGN_TIMEOUT : positive := 8192
  );
  port (
    -- Pixel clock.
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The next ten bits of each channel, wherever words begin: channel 0 (blue) in the low bits; bit 0 came first.
    bits : in    std_logic_vector(10 * CHANNELS - 1 downto 0);
    -- Channels to invert, or FIND_POLARITY.
    polarity : in    polarity_t := FIND_POLARITY;
    -- Video; black where not active.
    video : out   video_t;
    -- Each channel is aligned to words.
    aligned : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- Channels that are inverted because their wires are swapped.
    inverted : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- All channels are aligned and deskewed.
    locked : out   std_logic := '0';
    -- Channels whose word cannot occur in this period (control, video, island).
    errors : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- The source sends HDMI, not DVI.
    hdmi : out   std_logic;
    -- What the source says about its picture.
    info : out   picture_info_t;
    -- High for one clock: a packet with wrong check bits; an InfoFrame with a wrong sum.
    packet_error : out   std_logic;
    sum_error    : out   std_logic
  );
end entity tmds_receiver;

architecture rtl of tmds_receiver is

  -- Words of each channel: aligned, with the right polarity, in step with each other; and their readings.
  signal words           : words_t;
  signal right_words     : words_t;
  signal tokens          : std_logic_vector(CHANNELS - 1 downto 0);
  signal channel_aligned : std_logic_vector(CHANNELS - 1 downto 0);
  signal deskewed        : words_t;
  signal deskew_locked   : std_logic;
  signal not_locked      : std_logic;
  signal decoded         : decoded_words_t;
  signal is_hdmi         : std_logic;
  signal not_hdmi        : std_logic;
  signal island          : island_t;

begin

  -- Reported for each channel, because a cable has a fault in one of them.
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
        word    => words(c),
        token   => tokens(c),
        aligned => channel_aligned(c)
      );

    decoder : entity work.tmds_decoder
      port map (
        clk     => clk,
        reset   => reset,
        word    => deskewed(c),
        decoded => decoded(c)
      );

  end generate channel;

  invert : entity work.tmds_polarity
    port map (
      clk        => clk,
      reset      => not_locked,
      polarity   => polarity,
      words      => words,
      out_words  => right_words,
      step_words => deskewed,
      inverted   => inverted
    );

  deskew : entity work.tmds_deskew
    port map (
      clk       => clk,
      reset     => reset,
      words     => right_words,
      tokens    => tokens,
      aligned   => channel_aligned,
      out_words => deskewed,
      locked    => deskew_locked
    );

  -- Without three channels in step, neither polarity nor period is known. A DVI source has no packets, so what an HDMI
  -- source told before is cleared.
  not_locked <= reset or not deskew_locked;
  not_hdmi   <= not is_hdmi;
  hdmi       <= is_hdmi;

  periods : entity work.tmds_periods
    port map (
      clk    => clk,
      reset  => not_locked,
      words  => decoded,
      video  => video,
      errors => errors,
      hdmi   => is_hdmi,
      island => island
    );

  reader : entity work.info_frame_reader
    port map (
      clk          => clk,
      reset        => not_hdmi,
      island       => island,
      info         => info,
      packet_error => packet_error,
      sum_error    => sum_error
    );

  -- A register for the report; the entities behind use not_locked itself.
  report_lock : process (clk) is
  begin

    if rising_edge(clk) then
      locked <= not not_locked;
    end if;

  end process report_lock;

end architecture rtl;
