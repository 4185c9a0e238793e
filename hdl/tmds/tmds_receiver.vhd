-- From the deserialised bits of three channels to pixels and syncs.
--
-- Gearbox -> word alignment -> deskew -> decoders. Data enable is what two of the three channels
-- say, so that one wrong token does not tear a line.
--
-- Latency: about 12 clocks, plus the skew that is taken out. Throughput: one pixel each clock.
-- Equation: DVI 1.0, sections 3.2 and 3.3.

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
    -- Pixel clock, and twice that from the same PLL.
    clk    : in    std_logic;
    clk_x2 : in    std_logic;
    reset  : in    std_logic;
    -- Five bits of each channel, in clk_x2: channel 0 (blue) in the low bits, bit 0 came first.
    halves : in    std_logic_vector(5 * CHANNELS - 1 downto 0);
    -- Video, in clk: red in the low bits of pixel, black where not active.
    active : out   std_logic;
    h_sync : out   std_logic;
    v_sync : out   std_logic;
    pixel  : out   std_logic_vector(23 downto 0);
    -- Each channel is aligned to words.
    aligned : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- All channels are aligned and deskewed.
    locked : out   std_logic;
    -- The pixel holds a word that no encoder sends, or the channels disagree on data enable.
    error : out   std_logic
  );
end entity tmds_receiver;

architecture rtl of tmds_receiver is

  signal bits            : std_logic_vector(10 * CHANNELS - 1 downto 0);
  signal words           : std_logic_vector(10 * CHANNELS - 1 downto 0);
  signal tokens          : std_logic_vector(CHANNELS - 1 downto 0);
  signal channel_aligned : std_logic_vector(CHANNELS - 1 downto 0);
  signal deskewed        : std_logic_vector(10 * CHANNELS - 1 downto 0);
  signal deskew_locked   : std_logic;
  signal channel_active  : std_logic_vector(CHANNELS - 1 downto 0);
  signal control         : std_logic_vector(2 * CHANNELS - 1 downto 0);
  signal bytes           : std_logic_vector(8 * CHANNELS - 1 downto 0);
  signal errors          : std_logic_vector(CHANNELS - 1 downto 0);

begin

  aligned <= channel_aligned;

  channel : for c in 0 to CHANNELS - 1 generate

    gearbox : entity work.gearbox_5_to_10
      port map (
        clk    => clk,
        clk_x2 => clk_x2,
        half   => halves(5 * c + 4 downto 5 * c),
        bits   => bits(10 * c + 9 downto 10 * c)
      );

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
        clk     => clk,
        reset   => reset,
        word    => deskewed(10 * c + 9 downto 10 * c),
        active  => channel_active(c),
        control => control(2 * c + 1 downto 2 * c),
        data    => bytes(8 * c + 7 downto 8 * c),
        error   => errors(c)
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

  combine : process (clk) is
  begin

    if rising_edge(clk) then
      active <= (channel_active(0) and channel_active(1)) or (channel_active(1) and channel_active(2)) or
                (channel_active(2) and channel_active(0));
      h_sync <= control(0);
      v_sync <= control(1);
      pixel  <= bytes(7 downto 0) & bytes(15 downto 8) & bytes(23 downto 16);
      error  <= '0';
      if errors /= "000" or (channel_active /= "000" and channel_active /= "111") then
        error <= '1';
      end if;
      locked <= deskew_locked;
      if reset = '1' or deskew_locked = '0' then
        active <= '0';
        error  <= '0';
        locked <= '0';
      end if;
    end if;

  end process combine;

end architecture rtl;
