-- Switch-controlled semi-systolic FIR filter in transposed form, C-slow.
--
-- The input is broadcast to all taps; a tap adds it to the partial sum of its neighbour where
-- its switch is closed and passes the partial sum on where it is open. Each register of the
-- filter is a memory of DEPTH words, so that one filter serves DEPTH interleaved streams:
-- DEPTH = 1 filters a row, DEPTH = columns of a frame filters every column of a raster scan, its
-- registers then are line buffers in block RAM.
--
-- Latency: 1 clock from data to sum. With DEPTH > 1 the slot is given 2 clocks before the data
--   that belong to it (the block RAM's read latency), and the same slot may come again
--   MIN_LINE_STEPS = 4 clocks later at the earliest (read 2, add 1, write 1).
-- Throughput: one step of one stream each clock.
-- Ports: slot names the stream; step takes data, with the switches `closed`; restart (first step
--   of a line) drops the partial sums of taps 0 to TAPS-1-DELAY; sum is the last tap's.
-- Equation: r(w) <= (r(w-1) unless dropped, r(-1) = 0) + (data where closed(w)); sum = r(TAPS-1).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.refocus_pkg.all;

entity switched_fir is
  generic (
    -- Number of taps.
    TAPS : positive;
    -- Steps from a pixel to the output of the same index.
    DELAY : natural;
    -- Number of interleaved streams.
    DEPTH : positive;
    -- Largest input.
    DATA_MAX : natural;
    -- Largest sum: M times the largest input.
    SUM_MAX : natural
  );
  port (
    clk     : in    std_logic;
    slot    : in    unsigned(bits_for(DEPTH - 1) - 1 downto 0);
    step    : in    std_logic;
    restart : in    std_logic;
    closed  : in    std_logic_vector(0 to TAPS - 1);
    data    : in    std_logic_vector(bits_for(DATA_MAX) - 1 downto 0);
    sum     : out   std_logic_vector(bits_for(SUM_MAX) - 1 downto 0)
  );
end entity switched_fir;

architecture rtl of switched_fir is

  constant SUM_BITS : positive := bits_for(SUM_MAX);

  subtype partial_sum_t is natural range 0 to SUM_MAX;

  -- Partial sums at the outputs of the taps.
  type partial_sums_t is array (0 to TAPS - 1) of partial_sum_t;

  -- One step of one stream: from the partial sums before it to those after it.
  function stepped (
    held          : partial_sums_t;
    pixel         : partial_sum_t;
    switches      : std_logic_vector(0 to TAPS - 1);
    at_first_step : std_logic
  ) return partial_sums_t is

    variable next_sums : partial_sums_t;
    variable carried   : partial_sum_t;

  begin

    for w in 0 to TAPS - 1 loop

      if w = 0 then
        carried := 0;
      elsif at_first_step = '1' and w <= TAPS - 1 - DELAY then
        carried := 0;
      else
        carried := held(w - 1);
      end if;

      if switches(w) = '1' then
        next_sums(w) := carried + pixel;
      else
        next_sums(w) := carried;
      end if;

    end loop;

    return next_sums;

  end function stepped;

  -- The sums that are kept from step to step, in one word: all but the last tap's, which leaves
  -- the filter.
  subtype word_t is std_logic_vector((TAPS - 1) * SUM_BITS - 1 downto 0);

  function packed (
    sums : partial_sums_t
  ) return word_t is

    variable word : word_t;

  begin

    for w in 0 to TAPS - 2 loop

      word((w + 1) * SUM_BITS - 1 downto w * SUM_BITS) := std_logic_vector(to_unsigned(sums(w), SUM_BITS));

    end loop;

    return word;

  end function packed;

  function unpacked (
    word : word_t
  ) return partial_sums_t is

    variable sums : partial_sums_t;

  begin

    for w in 0 to TAPS - 2 loop

      sums(w) := to_integer(unsigned(word((w + 1) * SUM_BITS - 1 downto w * SUM_BITS)));

    end loop;

    sums(TAPS - 1) := 0;

    return sums;

  end function unpacked;

begin

  -- DEPTH = 1, or a single tap, which holds nothing over from step to step.
  registers : if DEPTH = 1 or TAPS = 1 generate

    signal held : partial_sums_t := (others => 0);

  begin

    take_step : process (clk) is
    begin

      if rising_edge(clk) then
        if step = '1' then
          held <= stepped(held, to_integer(unsigned(data)), closed, restart);
        end if;
      end if;

    end process take_step;

    sum <= std_logic_vector(to_unsigned(held(TAPS - 1), SUM_BITS));

  end generate registers;

  line_buffers : if DEPTH > 1 and TAPS > 1 generate

    signal slot_d1      : unsigned(slot'range);
    signal slot_d2      : unsigned(slot'range);
    signal slot_d3      : unsigned(slot'range);
    signal held_word    : word_t;
    signal next_word    : word_t;
    signal write_enable : std_logic := '0';

  begin

    take_step : process (clk) is

      variable next_sums : partial_sums_t;

    begin

      if rising_edge(clk) then
        slot_d1      <= slot;
        slot_d2      <= slot_d1;
        slot_d3      <= slot_d2;
        write_enable <= step;
        if step = '1' then
          next_sums := stepped(unpacked(held_word), to_integer(unsigned(data)), closed, restart);
          next_word <= packed(next_sums);
          sum       <= std_logic_vector(to_unsigned(next_sums(TAPS - 1), SUM_BITS));
        end if;
      end if;

    end process take_step;

    partial_sums : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => word_t'length,
        ADDRESS_BITS => slot'length,
        READ_LATENCY => 2
      )
      port map (
        clk           => clk,
        write_enable  => write_enable,
        write_address => slot_d3,
        write_data    => next_word,
        read_address  => slot,
        read_data     => held_word
      );

  end generate line_buffers;

end architecture rtl;
