-- SPDX-License-Identifier: Apache-2.0
-- The moving sums of one slice of a focal stack, over columns.
--
-- From the column memory that all slices share, the entity takes the pixel that enters the sum and the one that
-- leaves it. Their places depend on the phase alone.
--
-- Latency: output_delay lines and 7 clocks. Throughput: one token each clock; one column comes at least
-- PARTIAL_SUM_LOOP clocks apart.
-- Equation: sum += entering pixel - leaving pixel; see sum_schedule_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;
use work.focal_stack_pkg.all;

entity column_sum is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- The slice of this entity.
    SLICE : natural;
    -- Longest line in pixels.
    COLUMNS : positive;
    -- Values of a token that have sums of their own: channels of its pixels.
    LANES : positive;
    -- Width of such a value.
    LANE_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- step: a line begins; first: it is a frame's first line; live: it belongs to the frame.
    step  : in    std_logic;
    first : in    std_logic;
    live  : in    std_logic;
    -- 1 clock behind step: phase of the line.
    phase_1 : out   natural range 0 to larger(GEOMETRY.micro_image_size - 1, 1);
    -- For each token: its column; whether it has a pixel; the pixel; the memory's word for its column.
    column_2  : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    active_3  : in    std_logic;
    pixel_3   : in    std_logic_vector(LANES * LANE_BITS - 1 downto 0);
    history_3 : in    std_logic_vector(history_word_bits(GEOMETRY, LANES * LANE_BITS) - 1 downto 0);
    -- The sums of the token's values.
    sum : out   std_logic_vector(LANES * column_sum_bits(GEOMETRY.micro_image_size, LANE_BITS) - 1 downto 0)
  );
end entity column_sum;

architecture rtl of column_sum is

  constant NO_SUCH_SLICE : boolean := not takes(SLICE < GEOMETRY.slices,
                                                "column_sum: SLICE must be one of SHIFTS");

  constant M          : positive := GEOMETRY.micro_image_size;
  constant PIXEL_BITS : positive := LANES * LANE_BITS;

  subtype pixel_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

  subtype phase_t is natural range 0 to larger(M - 1, 1);

  constant NO_SLICE : unsigned(bits_for(GEOMETRY.slices - 1) - 1 downto 0) := (others => '0');

  -- enters_at: place of a phase's entering pixel in the shift register of the phase (-1 for the line that is just
  -- coming in); base: place of that register in the word.
  type history_t is record
    enters_at : integer;
    base      : natural;
  end record history_t;

  type histories_t is array (natural range 0 to M - 1) of history_t;

  function all_histories return histories_t is

    variable histories : histories_t;

  begin

    -- The phase alone decides which pixel enters: a multiplexer with M fixed inputs, no address.
    for v in 0 to M - 1 loop

      histories(v) := (enters_at => history_place(GEOMETRY, SLICE, v), base => history_base(GEOMETRY, v));

    end loop;

    return histories;

  end function all_histories;

  constant HISTORY_OF : histories_t := all_histories;

  -- The phase's pixel that enters, or the one `later` places behind it; zero if the memory does not hold it yet.
  function pixel_at (
    words : std_logic_vector;
    phase : natural;
    later : natural
  ) return pixel_t is

    variable low : natural;

  begin

    if HISTORY_OF(phase).enters_at + later < 0 then
      return (others => '0');
    end if;

    low := (HISTORY_OF(phase).base + HISTORY_OF(phase).enters_at + later) * PIXEL_BITS;

    return words(low + PIXEL_BITS - 1 downto low);

  end function pixel_at;

  -- Names of signals end in the number of clocks behind the token. All slices read the same word of the memory;
  -- entering pixels are chosen from it.
  signal ring          : ring_control_t;
  signal enter_phase_3 : phase_t       := 0;
  signal choice_3      : pixel_choice_t;
  signal command_3     : sum_command_t;
  signal command_4     : sum_command_t := NO_COMMAND;
  signal active_4      : std_logic     := '0';
  signal in_4          : pixel_t       := (others => '0');
  signal entering_4    : pixel_t       := (others => '0');
  signal leaving_4     : pixel_t       := (others => '0');

begin

  phase_1 <= ring.phase_1;

  -- The control is built for one slice alone, so its tables are constants.
  control : entity work.moving_sum_control
    generic map (
      GEOMETRY    => GEOMETRY,
      FIXED_SLICE => SLICE
    )
    port map (
      clk       => clk,
      reset     => reset,
      advance   => step,
      first     => first,
      live      => live,
      slice     => NO_SLICE,
      ring      => ring,
      choice_3  => choice_3,
      command_3 => command_3
    );

  pick : process (clk) is
  begin

    if rising_edge(clk) then
      enter_phase_3 <= ring.enter_phase_2;

      active_4   <= active_3;
      command_4  <= command_3;
      in_4       <= pixel_3;
      entering_4 <= (others => '0');
      leaving_4  <= (others => '0');

      -- The loop compares with each phase: its pixels are at fixed places of the word, so no address is computed.
      for v in 0 to M - 1 loop

        if enter_phase_3 = v then
          if choice_3.enter = '1' then
            entering_4 <= pixel_at(history_3, v, 0);
          end if;
          -- If no pixel ever leaves, the memory does not hold the place.
          if choice_3.leave = '1' and pixels_leave(GEOMETRY) then
            leaving_4 <= pixel_at(history_3, v, 1);
          end if;
        end if;

      end loop;

      -- This assignment comes last and wins: the pixel that has just come is not in the memory yet.
      if choice_3.enter = '1' and choice_3.enter_now = '1' then
        entering_4 <= pixel_3;
      end if;
      if reset = '1' then
        active_4 <= '0';
      end if;
    end if;

  end process pick;

  -- The adder keeps running and first sums of each column; with held outputs their results too.
  adder : entity work.moving_sum_adder
    generic map (
      COLUMNS      => COLUMNS,
      LANES        => LANES,
      PIXEL_BITS   => LANE_BITS,
      SUM_BITS     => column_sum_bits(M, LANE_BITS),
      WITH_LEAVING => pixels_leave(GEOMETRY),
      HOLDING      => group_size(GEOMETRY, SLICE) > 1,
      SPLIT        => not begins_group(GEOMETRY, SLICE, 0)
    )
    port map (
      clk      => clk,
      reset    => reset,
      column   => column_2,
      active   => active_4,
      command  => command_4,
      own      => in_4,
      entering => entering_4,
      leaving  => leaving_4,
      sums     => sum
    );

end architecture rtl;
