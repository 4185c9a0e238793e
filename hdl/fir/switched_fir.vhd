-- SPDX-License-Identifier: Apache-2.0
-- Switch-controlled semi-systolic FIR filter in transposed form, C-slow.
--
-- The input is broadcast to all taps. A tap whose switch is closed adds it to the partial sum of its neighbour; a
-- tap whose switch is open passes the partial sum on. Each register of the filter is a memory of DEPTH words, so
-- that one filter serves DEPTH interleaved streams. DEPTH = 1 filters a row. DEPTH = columns of a frame filters
-- every column of a raster scan; the registers are then line buffers in block RAM. A filter may take several steps
-- of a stream before it turns to the next stream, as for the columns of fir_array. Only the first of these steps
-- reads the memory.
--
-- With HOLD the output of the last tap is kept until the next update (the write enable of the thesis).
--
-- With BROADCAST_TAPS > 0 latches split the broadcast net: each drives that many taps.
--
-- Latency: 1 clock, 2 with BROADCAST_TAPS > 0. With DEPTH > 1 the slot is given 2 clocks before its data (the block
-- RAM's read latency) and is used again at least PARTIAL_SUM_LOOP = 4 clocks later.
-- Throughput: one step of one stream each clock.
-- Equation: r(w) <= (r(w-1) unless dropped, r(-1) = 0) + (data where closed(w)); sum = r(TAPS-1).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity switched_fir is
  generic (
    -- Number of taps.
    TAPS : positive;
    -- Steps from a pixel to the output of the same index.
    DELAY : natural;
    -- Number of interleaved streams.
    DEPTH : positive;
    -- true: outputs are held between updates.
    HOLD : boolean;
    -- Largest input.
    DATA_MAX : natural;
    -- Largest sum: as many times the largest input as the box has samples.
    SUM_MAX : positive;
    -- Taps that each latch of the input drives; 0: no latches.
    BROADCAST_TAPS : natural
  );
  port (
    clk : in    std_logic;
    -- DEPTH > 1: the stream whose data come 2 clocks later.
    slot : in    unsigned(bits_for(DEPTH - 1) - 1 downto 0);
    -- A step: the filter takes the data.
    step : in    std_logic;
    -- The step continues the stream of the step before.
    resume : in    std_logic;
    -- First step of a line: the partial sums of taps 0 to TAPS-1-DELAY are dropped.
    restart : in    std_logic;
    -- HOLD only: lets a new output through.
    update : in    std_logic;
    -- '1' closes the switch of a tap.
    closed : in    std_logic_vector(0 to TAPS - 1);
    -- The pixel, or its product.
    data : in    std_logic_vector(bits_for(DATA_MAX) - 1 downto 0);
    -- The sum of the last tap.
    sum : out   std_logic_vector(bits_for(SUM_MAX) - 1 downto 0)
  );
end entity switched_fir;

architecture rtl of switched_fir is

  constant DATA_BITS : positive := bits_for(DATA_MAX);
  constant SUM_BITS  : positive := bits_for(SUM_MAX);

  -- Latches of the input, each driving a group of neighbouring taps.
  constant GROUP_TAPS : positive := choose(BROADCAST_TAPS = 0 or BROADCAST_TAPS > TAPS, TAPS, BROADCAST_TAPS);
  constant GROUPS     : positive := divide_up(TAPS, GROUP_TAPS);

  subtype partial_sum_t is natural range 0 to SUM_MAX;

  -- Partial sums at the outputs of the taps.
  type partial_sums_t is array (natural range 0 to TAPS - 1) of partial_sum_t;

  -- The input at each group of taps.
  type broadcast_t is array (natural range 0 to GROUPS - 1) of std_logic_vector(DATA_BITS - 1 downto 0);

  -- One step of one stream: its partial sums after the step, from those before.
  function stepped (
    held          : partial_sums_t;
    pixels        : broadcast_t;
    switches      : std_logic_vector(0 to TAPS - 1);
    at_first_step : std_logic
  ) return partial_sums_t is

    variable next_sums : partial_sums_t;
    variable carried   : partial_sum_t;

  begin

    for w in 0 to TAPS - 1 loop

      if w = 0 then
        carried := 0;
      -- Partial sums in front of these taps belong to the line before: they are dropped.
      elsif at_first_step = '1' and w <= TAPS - 1 - DELAY then
        carried := 0;
      else
        carried := held(w - 1);
      end if;

      if switches(w) = '1' then
        next_sums(w) := carried + to_integer(unsigned(pixels(w / GROUP_TAPS)));
      else
        next_sums(w) := carried;
      end if;

    end loop;

    return next_sums;

  end function stepped;

  -- Sums that a stream keeps between steps: all but the last tap's, which leaves the filter; with HOLD the held
  -- output replaces the last tap's.
  constant KEPT : natural := choose(HOLD, TAPS, TAPS - 1);

  subtype word_t is std_logic_vector(larger(KEPT, 1) * SUM_BITS - 1 downto 0);

  function packed (
    sums : partial_sums_t
  ) return word_t is

    variable word : word_t;

  begin

    for w in 0 to KEPT - 1 loop

      word((w + 1) * SUM_BITS - 1 downto w * SUM_BITS) := std_logic_vector(to_unsigned(sums(w), SUM_BITS));

    end loop;

    return word;

  end function packed;

  function unpacked (
    word : word_t
  ) return partial_sums_t is

    variable sums : partial_sums_t;

  begin

    -- Taps that keep no sum start from zero.
    sums := (others => 0);

    for w in 0 to KEPT - 1 loop

      sums(w) := to_integer(unsigned(word((w + 1) * SUM_BITS - 1 downto w * SUM_BITS)));

    end loop;

    return sums;

  end function unpacked;

  -- The inputs of a step. If there are latches, all inputs pass one, like the data.
  signal slot_now    : unsigned(slot'range);
  signal step_now    : std_logic;
  signal resume_now  : std_logic;
  signal restart_now : std_logic;
  signal update_now  : std_logic;
  signal closed_now  : std_logic_vector(0 to TAPS - 1);
  signal pixels      : broadcast_t;

begin

  direct : if BROADCAST_TAPS = 0 generate
    slot_now    <= slot;
    step_now    <= step;
    resume_now  <= resume;
    restart_now <= restart;
    update_now  <= update;
    closed_now  <= closed;
    pixels(0)   <= data;
  end generate direct;

  latched : if BROADCAST_TAPS > 0 generate

    -- Copies of one register, which synthesis must not merge.
    signal copies : broadcast_t;

    attribute keep                         : string;
    attribute equivalent_register_removal  : string;

    attribute keep of copies                        : signal is "true";
    attribute equivalent_register_removal of copies : signal is "no";

  begin

    latch_input : process (clk) is
    begin

      if rising_edge(clk) then
        slot_now    <= slot;
        step_now    <= step;
        resume_now  <= resume;
        restart_now <= restart;
        update_now  <= update;
        closed_now  <= closed;
        copies      <= (others => data);
      end if;

    end process latch_input;

    pixels <= copies;

  end generate latched;

  -- With DEPTH = 1, or if nothing is kept between steps, sums are registers.
  registers : if DEPTH = 1 or KEPT = 0 generate

    signal held : partial_sums_t := (others => 0);

  begin

    take_step : process (clk) is

      variable next_sums : partial_sums_t;

    begin

      if rising_edge(clk) then
        if step_now = '1' then
          next_sums := stepped(held, pixels, closed_now, restart_now);
          if HOLD and update_now = '0' then
            next_sums(TAPS - 1) := held(TAPS - 1);
          end if;
          held <= next_sums;
        end if;
      end if;

    end process take_step;

    sum <= std_logic_vector(to_unsigned(held(TAPS - 1), SUM_BITS));

  end generate registers;

  line_buffers : if DEPTH > 1 and KEPT > 0 generate

    signal slot_d1      : unsigned(slot'range);
    signal slot_d2      : unsigned(slot'range);
    signal slot_d3      : unsigned(slot'range);
    signal read_word    : word_t;
    signal held_word    : word_t;
    signal next_word    : word_t;
    signal write_enable : std_logic := '0';

  begin

    -- The sums of a stream that continues are still in the register.
    held_word <= next_word when resume_now = '1' else
                 read_word;

    take_step : process (clk) is

      variable held      : partial_sums_t;
      variable next_sums : partial_sums_t;

    begin

      if rising_edge(clk) then
        -- The slot is delayed until its sums are written back where they were read.
        slot_d1      <= slot_now;
        slot_d2      <= slot_d1;
        slot_d3      <= slot_d2;
        write_enable <= step_now;
        if step_now = '1' then
          held      := unpacked(held_word);
          next_sums := stepped(held, pixels, closed_now, restart_now);
          if HOLD and update_now = '0' then
            next_sums(TAPS - 1) := held(TAPS - 1);
          end if;
          next_word <= packed(next_sums);
          sum       <= std_logic_vector(to_unsigned(next_sums(TAPS - 1), SUM_BITS));
        end if;
      end if;

    end process take_step;

    partial_sums : entity work.ram_simple_dual_port
      generic map (
        WIDTH => word_t'length,
        WORDS => 2 ** slot'length
      )
      port map (
        clk           => clk,
        write_enable  => write_enable,
        write_address => slot_d3,
        write_data    => next_word,
        read_address  => slot_now,
        read_data     => read_word
      );

  end generate line_buffers;

end architecture rtl;
