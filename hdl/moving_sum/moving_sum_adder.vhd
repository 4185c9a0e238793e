-- SPDX-License-Identifier: Apache-2.0
-- Adds up the pixels of tokens: running sums, first sums and held results.
--
-- While a line (for columns: a frame) arrives, the running sum still belongs to the line before. The sum of output 0
-- of the new line (first sum) is therefore collected beside it, and replaces it when output 0 leaves. A group of
-- equal outputs shows one held result. Rows keep each of these values in a register, columns in a word for each
-- column.
--
-- Latency: 3 clocks. Throughput: one token each clock; one column comes at least PARTIAL_SUM_LOOP clocks apart.
-- Equation: sum += entering pixel - leaving pixel; see sum_schedule_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.moving_sum_pkg.all;

entity moving_sum_adder is
  generic (
    -- 1 for rows, the longest line for columns.
    COLUMNS : positive;
    -- Values of a token that have sums of their own: channels of its pixels.
    LANES : positive;
    -- Width of a value of the input.
    PIXEL_BITS : positive;
    -- Width of a value of the sums.
    SUM_BITS : positive;
    -- true: pixels leave sums; false: every group begins a new sum.
    WITH_LEAVING : boolean;
    -- true: a group of several outputs shows one held result.
    HOLDING : boolean;
    -- true: a line may begin within a group, so output 0 is another sum than the one that goes on.
    SPLIT : boolean
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Column of the token, 2 clocks ahead of it.
    column : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    -- Marks a token.
    active : in    std_logic;
    -- The token's effect on the sums.
    command : in    sum_command_t;
    -- The pixels that come with the token, and those that enter and leave the running sums (0: none).
    own      : in    std_logic_vector(LANES * PIXEL_BITS - 1 downto 0);
    entering : in    std_logic_vector(LANES * PIXEL_BITS - 1 downto 0);
    leaving  : in    std_logic_vector(LANES * PIXEL_BITS - 1 downto 0);
    -- The results for the token.
    sums : out   std_logic_vector(LANES * SUM_BITS - 1 downto 0)
  );
end entity moving_sum_adder;

architecture rtl of moving_sum_adder is

  -- All sums of a token in one word, as they come from one memory.
  constant SUMS_BITS : positive := LANES * SUM_BITS;

  subtype sums_t is std_logic_vector(SUMS_BITS - 1 downto 0);

  type commands_t is array (2 to 4) of sum_command_t;

  type columns_t is array (0 to 5) of unsigned(column'range);

  -- The values that a column keeps, by number of clocks from `column` to their word. All are read and written at
  -- fixed distances from the token, so one column counter serves them.
  constant FIRST_KEPT   : natural := 0;
  constant HELD_KEPT    : natural := 1;
  constant RUNNING_KEPT : natural := 2;
  constant RESULTS_KEPT : natural := 3;

  type kept_t is array (FIRST_KEPT to RESULTS_KEPT) of sums_t;

  type clocks_t is array (FIRST_KEPT to RESULTS_KEPT) of natural range 3 to 5;

  constant WRITTEN_AT : clocks_t := (3, 3, 4, 5);

  function lane_of (
    word  : std_logic_vector;
    index : natural;
    width : positive
  ) return unsigned is
  begin

    return unsigned(word((index + 1) * width - 1 downto index * width));

  end function lane_of;

  -- Indices count clocks behind `column`.
  signal active_at  : std_logic_vector(2 to 5) := (others => '0');
  signal command_at : commands_t               := (others => NO_COMMAND);
  signal column_at  : columns_t                := (others => (others => '0'));

  -- changes of the running sums; first sums as they are collected and as output 0 shows them (held); running sums;
  -- results. Behind them their values for the column's token before.
  signal changes     : sums_t := (others => '0');
  signal first_sums  : sums_t := (others => '0');
  signal held_sums   : sums_t := (others => '0');
  signal held_before : sums_t := (others => '0');
  signal running     : sums_t := (others => '0');
  signal results     : sums_t := (others => '0');
  -- The four values of the column's token before: for columns from memories, for rows from the registers.
  signal word        : kept_t;
  signal old_word    : kept_t := (others => (others => '0'));
  signal old_first   : sums_t;
  signal old_held    : sums_t;
  signal old_running : sums_t;
  signal old_results : sums_t;

begin

  column_at(0)  <= column;
  active_at(2)  <= active;
  command_at(2) <= command;

  delay : process (clk) is
  begin

    if rising_edge(clk) then
      column_at(1 to 5)  <= column_at(0 to 4);
      active_at(3 to 5)  <= active_at(2 to 4);
      command_at(3 to 4) <= command_at(2 to 3);
      if reset = '1' then
        active_at(3 to 5) <= (others => '0');
      end if;
    end if;

  end process delay;

  add : process (clk) is

    variable own_pixel : unsigned(PIXEL_BITS - 1 downto 0);
    variable sum       : unsigned(SUM_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then

      for i in 0 to LANES - 1 loop

        -- Clock 2: the change of the running sums, and the first sums.
        sum := resize(lane_of(entering, i, PIXEL_BITS), SUM_BITS);
        -- A change may be negative. It is added modulo 2**SUM_BITS, like the running sum, which ends up
        -- within 0 to SUM_MAX again.
        sum := sum - lane_of(leaving, i, PIXEL_BITS);

        changes((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);

        own_pixel := lane_of(own, i, PIXEL_BITS);
        -- Sums change only with their tokens; otherwise they keep the value from the memory.
        if active_at(2) = '1' then
          -- The first token of a line starts from zero, because the memory still holds the line before.
          sum := (others => '0');
          if command_at(2).fresh = '0' then
            sum := lane_of(old_first, i, SUM_BITS);
          end if;
          if command_at(2).to_first = '1' then
            sum := sum + own_pixel;
          end if;
          first_sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);

          -- Without split groups no held first sums are needed, and no adder.
          sum := (others => '0');
          if SPLIT then
            if command_at(2).fresh = '0' then
              sum := lane_of(old_held, i, SUM_BITS);
            end if;
            if command_at(2).to_held = '1' then
              sum := sum + own_pixel;
            end if;
          end if;
          held_sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);
        end if;

        -- Clock 3: the running sums.
        if active_at(3) = '1' then
          sum := (others => '0');
          -- With output 0 the first sum takes over; all of its pixels are in it.
          if command_at(3).take = '1' then
            sum := lane_of(first_sums, i, SUM_BITS);
          else
            -- If no pixel leaves, a sum starts from zero with each group.
            if WITH_LEAVING or command_at(3).clear = '0' then
              sum := lane_of(old_running, i, SUM_BITS);
            end if;
            sum := sum + lane_of(changes, i, SUM_BITS);
          end if;
          running((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);
        end if;

      end loop;

      -- Clock 4: the results, one for a group. The held first sum waits a clock for them.
      held_before <= held_sums;
      if active_at(4) = '1' then
        if command_at(4).due = '0' then
          -- The token shows no output of a line, so this value does not matter.
          results <= (others => '0');
        elsif command_at(4).update = '1' or not HOLDING then
          results <= running;
        -- The group began before the line, so its result is the sum at the group's first output, which was
        -- collected separately.
        elsif SPLIT and command_at(4).take = '1' then
          results <= held_before;
        else
          results <= old_results;
        end if;
      end if;
    end if;

  end process add;

  sums <= results;

  --------------------------------------------------------------------------------------------------
  -- The values that the column's next token finds.

  word <= (first_sums, held_sums, running, results);

  old_first   <= old_word(FIRST_KEPT);
  old_held    <= old_word(HELD_KEPT);
  old_running <= old_word(RUNNING_KEPT);
  old_results <= old_word(RESULTS_KEPT);

  -- With one column these are the registers themselves.
  one_column : if COLUMNS = 1 generate
    old_word <= word;
  end generate one_column;

  several_columns : if COLUMNS > 1 generate

    each_kept : for i in FIRST_KEPT to RESULTS_KEPT generate

      -- Without held outputs nothing reads results again; without split groups nothing reads held sums.
      in_use : if (i /= HELD_KEPT or SPLIT) and (i /= RESULTS_KEPT or HOLDING) generate

        -- Each memory is written when its value is ready, and read two clocks ahead of the token that changes it.
        memory : entity work.ram_simple_dual_port
          generic map (
            WIDTH        => SUMS_BITS,
            WORDS        => COLUMNS,
            READ_LATENCY => 2,
            DIVIDED      => true
          )
          port map (
            clk           => clk,
            write_enable  => active_at(WRITTEN_AT(i)),
            write_address => column_at(WRITTEN_AT(i)),
            write_data    => word(i),
            read_address  => column_at(WRITTEN_AT(i) - 3),
            read_data     => old_word(i)
          );

      end generate in_use;

    end generate each_kept;

  end generate several_columns;

end architecture rtl;
