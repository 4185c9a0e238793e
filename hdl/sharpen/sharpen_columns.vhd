-- SPDX-License-Identifier: Apache-2.0
-- The taps of sharpening along columns: each sum with those of the lines M above and M below.
--
-- The memory holds, for each column and each line number modulo M, the sums of the last two such lines. A word that
-- is read is written back shifted by one line, so the last 2 M lines are kept and one word has both taps.
--
-- Lines and frames may follow each other without a gap: each line remembers whether the line M above it is in its
-- frame.
--
-- Latency: M lines and SHARPEN_COLUMNS_LATENCY clocks. Throughput: one token each clock; one column comes at least
-- PARTIAL_SUM_LOOP clocks apart.
-- Equation: out(k) = three_taps of sum(k), sum(k - M), sum(k + M), k counting lines.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;
use work.sharpen_pkg.all;

entity sharpen_columns is
  generic (
    -- Sizes and weights of the sharpener.
    BUILD : sharpen_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token and its sums. Its fields of the line are read with the line's first token.
    token : in    token_t;
    sums  : in    std_logic_vector(BUILD.pixels * BUILD.channels * bits_for(BUILD.sum_max) - 1 downto 0);
    -- The token behind the taps. The fields of the line hold until the next line.
    out_token : out   token_t;
    -- out_sharpened: the slice has a weight above 0; then the values behind the taps.
    out_sharpened : out   std_logic;
    out_values    : out   std_logic_vector(BUILD.pixels * BUILD.channels * BUILD.tapped_bits - 1 downto 0)
  );
end entity sharpen_columns;

architecture rtl of sharpen_columns is

  constant M          : positive := BUILD.micro_image_size;
  constant LANES      : positive := BUILD.pixels * BUILD.channels;
  constant SUM_BITS   : positive := bits_for(BUILD.sum_max);
  constant WORDS      : positive := M * BUILD.tokens;
  constant LINE_BITS  : positive := LANES * SUM_BITS;
  constant SLICE_BITS : positive := bits_for(BUILD.slices - 1);

  -- Clocks from a token to the words at its address.
  constant LATENCY : positive := SHARPEN_COLUMNS_LATENCY;
  constant READ    : positive := LATENCY - TAPS_LATENCY;

  subtype address_t is unsigned(bits_for(WORDS - 1) - 1 downto 0);

  subtype line_t is std_logic_vector(LINE_BITS - 1 downto 0);

  type addresses_t is array (1 to READ) of address_t;

  type lines_t is array (1 to READ) of line_t;

  type sharpened_t is array (natural range 0 to 2 ** SLICE_BITS - 1) of std_logic;

  function sharpened_table return sharpened_t is

    variable table : sharpened_t;

  begin

    -- Slices of weight 0 pass unchanged.
    table := (others => '1');

    for i in 0 to BUILD.slices - 1 loop

      if BUILD.weights(i) = 0 then
        table(i) := '0';
      end if;

    end loop;

    return table;

  end function sharpened_table;

  constant SHARPENED : sharpened_t := sharpened_table;

  -- active: the token has a pixel; step: the first pixel of its line.
  signal active : std_logic;
  signal step   : std_logic;
  -- Each line number modulo M has TOKENS words in the memory; next_line is the first of the next line's words.
  signal next_line  : address_t                   := (others => '0');
  signal address_at : addresses_t                 := (others => (others => '0'));
  signal active_at  : std_logic_vector(1 to READ) := (others => '0');
  signal sums_at    : lines_t                     := (others => (others => '0'));

  -- Lines of the frame before the current one, up to M - 1.
  signal lines_before : natural range 0 to larger(M - 1, 1) := 0;
  -- The fields of a line are delayed by lines, up to the line M before, whose results leave now; the last places
  -- are delayed by clocks like the words. Beside them: whether the line above exists (above_at), and whether the
  -- line is sharpened.
  signal line_at      : tokens_t(1 to M + LATENCY)         := (others => NO_TOKEN);
  signal above_at     : std_logic_vector(1 to M + LATENCY) := (others => '0');
  signal sharpened_at : std_logic_vector(1 to M + LATENCY) := (others => '0');
  -- below: the line lies M below another line of its frame.
  signal below       : std_logic;
  signal below_at    : std_logic_vector(1 to READ) := (others => '0');
  signal above_there : std_logic;
  signal below_there : std_logic;

  -- The word read has the sums of the line M above in the low bits and those of the line 2 M above in the high
  -- bits. The word written back has this line's sums in the low bits.
  signal word      : std_logic_vector(2 * LINE_BITS - 1 downto 0);
  signal word_back : std_logic_vector(2 * LINE_BITS - 1 downto 0);
  signal slice_tap : unsigned(SLICE_BITS - 1 downto 0);
  -- The fields of a token; and its strobe, the only one with a reset.
  signal token_at  : tokens_t(0 to LATENCY)         := (others => NO_TOKEN);
  signal strobe_at : std_logic_vector(0 to LATENCY) := (others => '0');

begin

  active <= token.strobe and token.pixel;
  step   <= active and token.line_first;

  --------------------------------------------------------------------------------------------------
  -- Fields of lines.

  below <= token.image and not token.frame_first when lines_before = M - 1 else
           '0';

  follow_lines : process (clk) is
  begin

    if rising_edge(clk) then
      if step = '1' then
        if token.frame_first = '1' then
          lines_before <= 0;
        elsif lines_before < M - 1 then
          lines_before <= lines_before + 1;
        end if;

        line_at(1)      <= token;
        above_at(1)     <= below;
        sharpened_at(1) <= SHARPENED(to_integer(token.slice(SLICE_BITS - 1 downto 0)));
        below_at(1)     <= below;
      end if;

      for i in 2 to M + LATENCY loop

        -- Up to the line M before, fields move with lines like the memory; behind it they move with clocks
        -- like the taps.
        if step = '1' or i > M + 1 then
          line_at(i)      <= line_at(i - 1);
          above_at(i)     <= above_at(i - 1);
          sharpened_at(i) <= sharpened_at(i - 1);
        end if;

      end loop;

      if reset = '1' then

        for i in 1 to M loop

          line_at(i).image <= '0';

        end loop;

      end if;

      for i in 2 to READ loop

        below_at(i) <= below_at(i - 1);

      end loop;

    end if;

  end process follow_lines;

  above_there <= above_at(M + READ) and sharpened_at(M + READ);
  below_there <= below_at(READ) and sharpened_at(M + READ);
  slice_tap   <= line_at(M + READ + 2).slice(SLICE_BITS - 1 downto 0);

  --------------------------------------------------------------------------------------------------
  -- Memory of lines.

  find_address : process (clk) is
  begin

    if rising_edge(clk) then
      if step = '1' then
        address_at(1) <= next_line;

        -- The M words of a column lie TOKENS apart: adding finds the next line, and a comparison finds the first.
        if next_line = (M - 1) * BUILD.tokens then
          next_line <= (others => '0');
        else
          next_line <= next_line + BUILD.tokens;
        end if;
      elsif active = '1' then
        address_at(1) <= address_at(1) + 1;
      end if;

      -- Address, sums and write enable move together, so that a word goes back to its own place.
      active_at(1) <= active;
      sums_at(1)   <= sums;

      for i in 2 to READ loop

        address_at(i) <= address_at(i - 1);
        active_at(i)  <= active_at(i - 1);
        sums_at(i)    <= sums_at(i - 1);

      end loop;

      -- A reset sets the place to 0: one beyond the memory would never come back into it.
      if reset = '1' then
        next_line <= (others => '0');
      end if;
    end if;

  end process find_address;

  word_back <= word(LINE_BITS - 1 downto 0) & sums_at(READ);

  memory : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => 2 * LINE_BITS,
      WORDS        => WORDS,
      READ_LATENCY => 3,
      DIVIDED      => true
    )
    port map (
      clk           => clk,
      write_enable  => active_at(READ),
      write_address => address_at(READ),
      write_data    => word_back,
      read_address  => address_at(1),
      read_data     => word
    );

  --------------------------------------------------------------------------------------------------
  -- Taps.

  lane : for i in 0 to LANES - 1 generate

    signal own        : signed(SUM_BITS downto 0);
    signal line_above : signed(SUM_BITS downto 0);
    signal line_below : signed(SUM_BITS downto 0);
    signal tapped     : signed(BUILD.tapped_bits - 1 downto 0);

  begin

    own        <= signed('0' & word((i + 1) * SUM_BITS - 1 downto i * SUM_BITS));
    line_above <= signed('0' & word(LINE_BITS + (i + 1) * SUM_BITS - 1 downto LINE_BITS + i * SUM_BITS));
    line_below <= signed('0' & sums_at(READ)((i + 1) * SUM_BITS - 1 downto i * SUM_BITS));

    -- Taps work on signed numbers, so the width is a bit more than that of a sum.
    taps : entity work.three_taps
      generic map (
        VALUE_BITS      => SUM_BITS + 1,
        DIFFERENCE_BITS => SUM_BITS + 1,
        BUILD           => BUILD,
        OFFSET          => BUILD.rounding,
        RESULT_BITS     => BUILD.tapped_bits
      )
      port map (
        clk           => clk,
        value         => own,
        earlier       => line_above,
        later         => line_below,
        earlier_there => above_there,
        later_there   => below_there,
        slice_2       => slice_tap,
        result        => tapped
      );

    out_values((i + 1) * BUILD.tapped_bits - 1 downto i * BUILD.tapped_bits) <= std_logic_vector(tapped);

  end generate lane;

  --------------------------------------------------------------------------------------------------
  -- Fields of tokens.

  token_at(0)  <= token;
  strobe_at(0) <= token.strobe;

  delay_token : process (clk) is
  begin

    if rising_edge(clk) then
      -- A token keeps its place in its line; its fields of the line are replaced below by those of the line M before.
      token_at(1 to LATENCY)  <= token_at(0 to LATENCY - 1);
      strobe_at(1 to LATENCY) <= strobe_at(0 to LATENCY - 1);
      if reset = '1' then
        strobe_at(1 to LATENCY) <= (others => '0');
      end if;
    end if;

  end process delay_token;

  give : process (token_at, strobe_at, line_at) is
  begin

    out_token             <= token_at(LATENCY);
    out_token.strobe      <= strobe_at(LATENCY);
    out_token.image       <= line_at(M + LATENCY).image;
    out_token.frame_first <= line_at(M + LATENCY).frame_first;
    out_token.slice       <= line_at(M + LATENCY).slice;

  end process give;

  out_sharpened <= sharpened_at(M + LATENCY);

end architecture rtl;
