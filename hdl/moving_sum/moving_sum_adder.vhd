-- SPDX-License-Identifier: Apache-2.0
-- Adds up the pixels of tokens: running sums, first sums and held results.
--
-- While a line (for columns: a frame) arrives, the running sum still belongs to the line before. So the sum of output 0
-- of the new line is collected beside it, and replaces it when output 0 is due. The result of a group of equal outputs
-- is held. Rows keep each of these in a register, columns in a word for each column.
--
-- Latency: 3 clocks. Throughput: one token each clock; the same column comes again PARTIAL_SUM_LOOP clocks later at
--   the earliest.
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
    -- Pixels of a token.
    LANES : positive;
    -- Width of a lane of the input.
    PIXEL_BITS : positive;
    -- Width of a lane of the sums.
    SUM_BITS : positive;
    -- Whether pixels leave a sum; if not, every group begins a new one.
    WITH_LEAVING : boolean;
    -- Whether outputs are held.
    HOLDING : boolean;
    -- Whether a line begins within a group, so that output 0 is not the sum that goes on.
    SPLIT : boolean
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Column of the token, 2 clocks ahead of it.
    column : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    -- Marks a token.
    active : in    std_logic;
    -- What it does to the sums.
    command : in    sum_command_t;
    -- Its own pixels, and those that enter and leave the running sums (0: none).
    own      : in    std_logic_vector(LANES * PIXEL_BITS - 1 downto 0);
    entering : in    std_logic_vector(LANES * PIXEL_BITS - 1 downto 0);
    leaving  : in    std_logic_vector(LANES * PIXEL_BITS - 1 downto 0);
    -- Results of the lanes.
    sums : out   std_logic_vector(LANES * SUM_BITS - 1 downto 0)
  );
end entity moving_sum_adder;

architecture rtl of moving_sum_adder is

  -- All lanes in one word, as they come from one memory.
  constant SUMS_BITS : positive := LANES * SUM_BITS;

  subtype sums_t is std_logic_vector(SUMS_BITS - 1 downto 0);

  type commands_t is array (2 to 4) of sum_command_t;

  type columns_t is array (0 to 5) of unsigned(column'range);

  -- What a column keeps, and how many clocks behind `column` each of it is there. All are read and written at fixed
  -- distances from the token, so one column counter serves them.
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

  -- Clocks behind `column`.
  signal active_at  : std_logic_vector(2 to 5) := (others => '0');
  signal command_at : commands_t               := (others => NO_COMMAND);
  signal column_at  : columns_t                := (others => (others => '0'));

  -- First sums as they are collected and as output 0 shows them, running sums, results; and the values of all of them
  -- for the token before.
  signal changes     : sums_t := (others => '0');
  signal first_sums  : sums_t := (others => '0');
  signal held_sums   : sums_t := (others => '0');
  signal held_before : sums_t := (others => '0');
  signal running     : sums_t := (others => '0');
  signal results     : sums_t := (others => '0');
  -- Columns keep all four for each column of the line, in memories; they come back in time for the next line's token.
  -- For rows these are the registers of the token before.
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

        -- 2: by how much the running sums change, and the first sums.
        sum := resize(lane_of(entering, i, PIXEL_BITS), SUM_BITS);
        -- A change may be negative. It is added modulo 2 ** SUM_BITS, and so is the running sum, which ends up within 0
        -- to SUM_MAX again.
        sum := sum - lane_of(leaving, i, PIXEL_BITS);

        changes((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);

        own_pixel := lane_of(own, i, PIXEL_BITS);
        -- Sums wait for their tokens: in between they keep the value from the memory.
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

          -- Without split groups there are none, and no adder.
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

        -- 3: the running sums.
        if active_at(3) = '1' then
          sum := (others => '0');
          -- Output 0: the separately collected sum takes over, with all of its pixels already in it.
          if command_at(3).take = '1' then
            sum := lane_of(first_sums, i, SUM_BITS);
          else
            -- Where no pixel ever leaves, a sum begins anew with each group instead.
            if WITH_LEAVING or command_at(3).clear = '0' then
              sum := lane_of(old_running, i, SUM_BITS);
            end if;
            sum := sum + lane_of(changes, i, SUM_BITS);
          end if;
          running((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);
        end if;

      end loop;

      -- 4: results, the same for a group.
      -- A clock later than it was made, as the results are.
      held_before <= held_sums;
      if active_at(4) = '1' then
        if command_at(4).due = '0' then
          -- Not an output of a line, so its value does not matter.
          results <= (others => '0');
        elsif command_at(4).update = '1' or not HOLDING then
          results <= running;
        -- The group began before the line, so its output is the sum of the group's first place, which is collected
        -- separately.
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
  -- Their values for the token before.

  word <= (first_sums, held_sums, running, results);

  old_first   <= old_word(FIRST_KEPT);
  old_held    <= old_word(HELD_KEPT);
  old_running <= old_word(RUNNING_KEPT);
  old_results <= old_word(RESULTS_KEPT);

  -- With one column the registers of the token before are these values.
  one_column : if COLUMNS = 1 generate
    old_word <= word;
  end generate one_column;

  several_columns : if COLUMNS > 1 generate

    each_kept : for i in FIRST_KEPT to RESULTS_KEPT generate

      -- Without held outputs nothing reads results again, and without split groups no held sums.
      in_use : if (i /= HELD_KEPT or SPLIT) and (i /= RESULTS_KEPT or HOLDING) generate

        -- Written when its word is there, and read two clocks ahead of the token that changes it.
        memory : entity work.ram_blocks
          generic map (
            WIDTH        => SUMS_BITS,
            WORDS        => COLUMNS,
            READ_LATENCY => 2
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
