-- The moving sums of one slice of a focal stack over columns.
--
-- Of the column memory that the slices share it picks the pixel that enters the sum and the one that leaves it; their
-- places depend on the phase alone. For each column it keeps the running sum, the sum of output 0 of the frame
-- that comes in, and where outputs are held the result.
--
-- Latency: 7 clocks from a token to its sum, output_delay lines. Throughput: one token each clock; the same
--   column comes again PARTIAL_SUM_LOOP clocks later at the earliest.
-- Ports: step, first, live: advance, first and live of moving_sum_control; with them active: a token of a
--   column. 2 clocks later column, its number; 3 clocks later history, what the memory holds of it, and pixel, its
--   own pixel. phase_1: phase of the line, 1 clock behind step. sum: the lanes.
-- Equation: sum += entering pixel - leaving pixel; see moving_sum_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;
use work.focal_stack_pkg.all;

entity column_sum is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- The slices: a' in pixels.
    SHIFTS : string;
    -- As in raster_refocuser.
    CENTRED : boolean;
    -- Which of the slices.
    SLICE : natural;
    -- Longest line in pixels.
    COLUMNS : positive;
    -- Pixels of a token.
    LANES : positive;
    -- Width of a lane of a pixel.
    LANE_BITS : positive
  );
  port (
    clk     : in    std_logic;
    reset   : in    std_logic;
    step    : in    std_logic;
    first   : in    std_logic;
    live    : in    std_logic;
    active  : in    std_logic;
    phase_1 : out   natural range 0 to MICRO_IMAGE_SIZE - 1;
    column  : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    history : in    std_logic_vector(history_high(MICRO_IMAGE_SIZE, SHIFTS, CENTRED, LANES * LANE_BITS) downto 0);
    pixel   : in    std_logic_vector(LANES * LANE_BITS - 1 downto 0);
    sum     : out   std_logic_vector(LANES * column_sum_bits(MICRO_IMAGE_SIZE, LANE_BITS) - 1 downto 0)
  );
end entity column_sum;

architecture rtl of column_sum is

  constant M           : positive := MICRO_IMAGE_SIZE;
  constant LEAVING     : boolean  := pixels_leave(M, SHIFTS);
  constant HOLDING     : boolean  := group_size(M, slice_shift(SHIFTS, SLICE)) > 1;
  constant SPLIT       : boolean  := not begins_group(M, SHIFTS, CENTRED, SLICE, 0);
  constant SLICE_BITS  : positive := bits_for(slice_count(SHIFTS) - 1);
  constant PIXEL_BITS  : positive := LANES * LANE_BITS;
  constant SUM_BITS    : positive := column_sum_bits(M, LANE_BITS);
  constant SUMS_BITS   : positive := LANES * SUM_BITS;
  constant COLUMN_BITS : positive := bits_for(COLUMNS - 1);

  subtype pixel_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

  subtype sums_t is std_logic_vector(SUMS_BITS - 1 downto 0);

  subtype phase_t is natural range 0 to M - 1;

  type columns_t is array (2 to 7) of unsigned(COLUMN_BITS - 1 downto 0);

  constant NO_SLICE : unsigned(SLICE_BITS - 1 downto 0) := (others => '0');

  -- The pixel of a phase at a place of its shift register, or none.
  function pixel_at (
    words : std_logic_vector;
    phase : phase_t;
    later : natural
  ) return pixel_t is

    variable place : integer;
    variable low   : natural;

  begin

    place := history_place(M, SHIFTS, CENTRED, SLICE, phase) + later;

    if place < 0 then
      return (others => '0');
    end if;

    low := (history_base(M, SHIFTS, CENTRED, phase) + place) * PIXEL_BITS;

    return words(low + PIXEL_BITS - 1 downto low);

  end function pixel_at;

  function lane_of (
    word  : std_logic_vector;
    index : natural;
    width : positive
  ) return unsigned is
  begin

    return unsigned(word((index + 1) * width - 1 downto index * width));

  end function lane_of;

  -- Of the control, 3 clocks behind the token; the number of clocks in the names of what follows.
  signal fresh         : std_logic;
  signal to_first      : std_logic;
  signal to_held       : std_logic;
  signal enter         : std_logic;
  signal enter_now     : std_logic;
  signal leave         : std_logic;
  signal take          : std_logic;
  signal clear         : std_logic;
  signal update        : std_logic;
  signal due           : std_logic;
  signal enter_phase_2 : phase_t;
  signal enter_phase   : phase_t := 0;

  signal active_at : std_logic_vector(1 to 7) := (others => '0');
  signal column_at : columns_t                := (others => (others => '0'));

  signal fresh_4     : std_logic                := '0';
  signal to_first_4  : std_logic                := '0';
  signal to_held_4   : std_logic                := '0';
  signal take_at     : std_logic_vector(4 to 6) := (others => '0');
  signal clear_at    : std_logic_vector(4 to 5) := (others => '0');
  signal update_at   : std_logic_vector(4 to 6) := (others => '0');
  signal due_at      : std_logic_vector(4 to 6) := (others => '0');
  signal own_4       : pixel_t                  := (others => '0');
  signal entering_4  : pixel_t                  := (others => '0');
  signal leaving_4   : pixel_t                  := (others => '0');
  signal changes_5   : sums_t                   := (others => '0');
  signal first_5     : sums_t                   := (others => '0');
  signal held_5      : sums_t                   := (others => '0');
  signal held_6      : sums_t                   := (others => '0');
  signal sums_6      : sums_t                   := (others => '0');
  signal results_7   : sums_t                   := (others => '0');
  signal old_first   : sums_t;
  signal old_held    : sums_t                   := (others => '0');
  signal old_sums    : sums_t;
  signal old_results : sums_t                   := (others => '0');

begin

  control : entity work.moving_sum_control
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      FIXED_SLICE      => SLICE
    )
    port map (
      clk           => clk,
      reset         => reset,
      advance       => step,
      first         => first,
      live          => live,
      slice         => NO_SLICE,
      step_1        => open,
      phase_1       => phase_1,
      first_1       => open,
      live_1        => open,
      take_1        => open,
      slice_1       => open,
      step_2        => open,
      enter_phase_2 => enter_phase_2,
      moves_3       => open,
      fresh         => fresh,
      to_first      => to_first,
      to_held       => to_held,
      enter_age     => open,
      enter         => enter,
      enter_now     => enter_now,
      leave         => leave,
      take          => take,
      clear         => clear,
      update        => update,
      due           => due
    );

  column_at(2) <= column;

  add : process (clk) is

    variable total : unsigned(SUM_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then
      enter_phase <= enter_phase_2;

      -- 3: the pixels that enter and leave.
      own_4      <= pixel;
      entering_4 <= (others => '0');
      leaving_4  <= (others => '0');

      for v in 0 to M - 1 loop

        if enter_phase = v then
          if enter = '1' then
            entering_4 <= pixel_at(history, v, 0);
          end if;
          if LEAVING and leave = '1' then
            leaving_4 <= pixel_at(history, v, 1);
          end if;
        end if;

      end loop;

      if enter = '1' and enter_now = '1' then
        entering_4 <= pixel;
      end if;

      fresh_4    <= fresh;
      to_first_4 <= to_first;
      to_held_4  <= to_held;

      -- 4: by how much the sums change; the sums of output 0 of the frame that comes in.
      for i in 0 to LANES - 1 loop

        total                                                 := resize(lane_of(entering_4, i, LANE_BITS), SUM_BITS) -
                                                                 resize(lane_of(leaving_4, i, LANE_BITS), SUM_BITS);
        changes_5((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(total);

        total := (others => '0');
        if fresh_4 = '0' then
          total := lane_of(old_first, i, SUM_BITS);
        end if;
        if to_first_4 = '1' then
          total := total + lane_of(own_4, i, LANE_BITS);
        end if;
        first_5((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(total);

        total := (others => '0');
        if fresh_4 = '0' then
          total := lane_of(old_held, i, SUM_BITS);
        end if;
        if to_held_4 = '1' then
          total := total + lane_of(own_4, i, LANE_BITS);
        end if;
        held_5((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(total);

        -- 5: the sums.
        total := (others => '0');
        if take_at(5) = '1' then
          total := lane_of(first_5, i, SUM_BITS);
        else
          if LEAVING or clear_at(5) = '0' then
            total := lane_of(old_sums, i, SUM_BITS);
          end if;
          total := total + lane_of(changes_5, i, SUM_BITS);
        end if;
        sums_6((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(total);

      end loop;

      held_6 <= held_5;

      -- 6: results, the same for a group.
      if due_at(6) = '0' then
        -- No output of a frame: whatever the sums hold.
        results_7 <= (others => '0');
      elsif update_at(6) = '1' or not HOLDING then
        results_7 <= sums_6;
      elsif SPLIT and take_at(6) = '1' then
        results_7 <= held_6;
      else
        results_7 <= old_results;
      end if;

      take_at           <= take & take_at(4 to 5);
      clear_at          <= clear & clear_at(4);
      update_at         <= update & update_at(4 to 5);
      due_at            <= due & due_at(4 to 5);
      active_at         <= active & active_at(1 to 6);
      column_at(3 to 7) <= column_at(2 to 6);
      if reset = '1' then
        active_at <= (others => '0');
      end if;
    end if;

  end process add;

  sum <= results_7;

  --------------------------------------------------------------------------------------------------
  -- A word for each column.

  first_sums : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => SUMS_BITS,
      ADDRESS_BITS => COLUMN_BITS,
      WORDS        => COLUMNS,
      READ_LATENCY => 2
    )
    port map (
      clk           => clk,
      write_enable  => active_at(5),
      write_address => column_at(5),
      write_data    => first_5,
      read_enable   => '1',
      read_address  => column_at(2),
      read_data     => old_first
    );

  sums : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => SUMS_BITS,
      ADDRESS_BITS => COLUMN_BITS,
      WORDS        => COLUMNS,
      READ_LATENCY => 2
    )
    port map (
      clk           => clk,
      write_enable  => active_at(6),
      write_address => column_at(6),
      write_data    => sums_6,
      read_enable   => '1',
      read_address  => column_at(3),
      read_data     => old_sums
    );

  held_results : if HOLDING generate

    results : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => SUMS_BITS,
        ADDRESS_BITS => COLUMN_BITS,
        WORDS        => COLUMNS,
        READ_LATENCY => 2
      )
      port map (
        clk           => clk,
        write_enable  => active_at(7),
        write_address => column_at(7),
        write_data    => results_7,
        read_enable   => '1',
        read_address  => column_at(4),
        read_data     => old_results
      );

  end generate held_results;

  held_first_sums : if SPLIT generate

    held_sums : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => SUMS_BITS,
        ADDRESS_BITS => COLUMN_BITS,
        WORDS        => COLUMNS,
        READ_LATENCY => 2
      )
      port map (
        clk           => clk,
        write_enable  => active_at(5),
        write_address => column_at(5),
        write_data    => held_5,
        read_enable   => '1',
        read_address  => column_at(2),
        read_data     => old_held
      );

  end generate held_first_sums;

end architecture rtl;
