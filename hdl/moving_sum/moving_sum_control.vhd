-- SPDX-License-Identifier: Apache-2.0
-- Control of a moving sum: which pixels enter and leave it, and where lines begin.
--
-- Two lines (for columns: frames) may be under way: pixels of the newer one arrive while the last outputs of the
-- older one leave. A line begins with its first step and ends with its last step that has a pixel. Pixels in front
-- of it or behind it count as zero; the control recognises them by their ages. While a line arrives, the sum of its
-- output 0 is collected separately (to_first); output 0 takes it over (take), so lines follow each other without a
-- gap. Lines must begin at least output_delay + 1 steps apart.
--
-- Latency: 3 clocks from advance; the outputs hold until the next advance.
-- Throughput: one step each clock.
-- Equation: see sum_schedule_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;

entity moving_sum_control is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- The slice, if it is always the same; -1: the slice of the port.
    FIXED_SLICE : integer := -1
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- advance: a step begins; first: it is a line's first; live: it has a pixel of the line.
    advance : in    std_logic;
    first   : in    std_logic;
    live    : in    std_logic;
    -- Slice of the line, read with its first step.
    slice : in    unsigned(bits_for(GEOMETRY.slices - 1) - 1 downto 0);
    -- Control of the memory of pixels.
    ring : out   ring_control_t;
    -- 3 clocks from advance: the ages of the pixels that enter and leave.
    age_3      : out   natural range 0 to reach(GEOMETRY);
    left_age_3 : out   natural range 0 to reach(GEOMETRY);
    -- 3 clocks from advance: which pixels change the sums, and the effect of the step's tokens on them.
    choice_3  : out   pixel_choice_t;
    command_3 : out   sum_command_t
  );
end entity moving_sum_control;

architecture rtl of moving_sum_control is

  constant NO_SUCH_SLICE : boolean := not takes(FIXED_SLICE < GEOMETRY.slices,
                                                "moving_sum_control: FIXED_SLICE must be one of SHIFTS");

  constant REACHED : positive := reach(GEOMETRY);
  constant M       : positive := GEOMETRY.micro_image_size;
  constant SLICES  : positive := GEOMETRY.slices;
  -- With boxes of M alone the pixel that leaves is of the phase that enters, M steps older: it is compared with counts
  -- M steps back, and the table needs no second age.
  constant BACK : natural := choose(boxes_of_m(GEOMETRY), M, 0);
  -- Steps from a pixel to the output of the same index.
  constant DELAY : natural := GEOMETRY.output_delay;

  -- A step's index modulo M.
  subtype phase_t is natural range 0 to larger(M - 1, 1);

  -- Steps since a line began; the count stops at REACHED + 1, because no age is larger.
  subtype count_t is natural range 0 to REACHED + 1;

  -- The table of steps has a word for each slice and phase.
  constant SLICE_STEP : positive := phase_words(M);
  constant WORDS      : positive := table_words(GEOMETRY);

  -- What an output of a slice and a phase shows, and what a pixel of that slice and phase does.
  type step_t is record
    -- The output begins a group of equal ones: 1 means no, 2 means yes, because words must not be zero (table_words).
    begins : natural range 1 to 2;
    -- Phases and ages of the pixels that enter and leave with the output.
    phase      : phase_t;
    age        : count_t;
    left_phase : phase_t;
    left_age   : count_t;
    -- Index of the pixel in the sum that goes on from output 0, and in the one that output 0 shows; REACHED + 1 if the
    -- pixel is not in them.
    initial : count_t;
    held    : count_t;
    -- The output begins to gather the next group: it is the one behind a group's first. 1 means no, 2 means yes.
    clears : natural range 1 to 2;
  end record step_t;

  type steps_t is array (natural range 0 to WORDS - 1) of step_t;

  function all_steps return steps_t is

    variable steps : steps_t;
    variable now   : step_t;

  begin

    -- REACHED + 1 equals no count that is compared.
    now   := (phase | left_phase => M - 1, begins | clears => 1, others => REACHED + 1);
    steps := (others => now);

    for s in 0 to SLICES - 1 loop

      for k in 0 to M - 1 loop

        now.begins  := choose(begins_group(GEOMETRY, s, k), 2, 1);
        now.clears  := choose(begins_group(GEOMETRY, s, (k + M - 1) mod M), 2, 1);
        now.phase   := entering_phase(GEOMETRY, s, k);
        now.age     := entering_age(GEOMETRY, s, now.phase);
        now.initial := REACHED + 1;
        now.held    := REACHED + 1;

        now.left_phase := leaving_phase(GEOMETRY, s, k);
        now.left_age   := leaving_age(GEOMETRY, s, now.left_phase);

        if is_initial(GEOMETRY, s, k, false) then
          now.initial := initial_index(GEOMETRY, s, k, false);
        end if;

        if is_initial(GEOMETRY, s, k, true) then
          now.held := initial_index(GEOMETRY, s, k, true);
        end if;

        steps(s * SLICE_STEP + k) := now;

      end loop;

    end loop;

    return steps;

  end function all_steps;

  constant STEP_OF : steps_t := all_steps;

  function next_phase (
    now : phase_t
  ) return phase_t is
  begin

    if now = M - 1 then
      return 0;
    end if;

    return now + 1;

  end function next_phase;

  function next_count (
    now : count_t
  ) return count_t is
  begin

    if now = REACHED + 1 then
      return now;
    end if;

    return now + 1;

  end function next_count;

  -- tag: `first` of the step that arrives (bit 0) and its slice. out_tag: the tag of DELAY steps before, which is
  -- that of the step whose output leaves.
  signal tag     : std_logic_vector(slice'length downto 0);
  signal out_tag : std_logic_vector(slice'length downto 0);
  signal tags    : std_logic_vector(delay_bits(slice'length + 1, DELAY) - 1 downto 0) := (others => '0');

  -- 1 clock from advance: in_ belongs to the pixel that arrives, out_ to the output that leaves.
  signal step_now : std_logic             := '0';
  signal in_phase : phase_t               := 0;
  signal in_slice : unsigned(slice'range) := (others => '0');
  signal in_count : count_t               := REACHED + 1;
  signal in_first : std_logic             := '0';
  signal in_live  : std_logic             := '0';
  -- Steps since the last one with a pixel.
  signal in_ended  : count_t               := REACHED + 1;
  signal out_phase : phase_t               := 0;
  signal out_slice : unsigned(slice'range) := (others => '0');
  signal out_count : count_t               := 0;
  signal out_first : std_logic             := '0';
  signal out_ended : count_t               := REACHED + 1;
  -- The line whose outputs leave is the line whose pixels arrive.
  signal same : std_logic := '0';

  -- 2 clocks from advance.
  signal initial_2      : std_logic := '0';
  signal initial_held_2 : std_logic := '0';
  signal in_first_2     : std_logic := '0';
  signal out_count_2    : count_t   := 0;
  signal out_ended_2    : count_t   := 0;
  signal out_first_2    : std_logic := '0';
  signal age_2          : count_t   := 0;
  -- The age of the pixel that leaves, and the counts that it is compared with, less BACK.
  signal left_age_2   : count_t                            := 0;
  signal left_count_2 : integer range -BACK to REACHED + 1 := -BACK;
  signal left_ended_2 : integer range -BACK to REACHED + 1 := -BACK;
  signal update_2     : std_logic                          := '0';
  signal clear_2      : std_logic                          := '0';

begin

  -- The mark of a line's begin and its slice wait as one word for DELAY steps; they come out with the line's output 0.
  tag <= std_logic_vector(slice) & (first and advance);

  out_tag <= delayed(tags, tag, DELAY);

  ring.step_1  <= step_now;
  ring.phase_1 <= in_phase;
  ring.first_1 <= in_first;
  ring.live_1  <= in_live;
  ring.take_1  <= out_first;
  ring.slice_1 <= resize(out_slice, slice_t'length);

  count_steps : process (clk) is

    variable out_now   : std_logic;
    variable now_ended : count_t;

  begin

    if rising_edge(clk) then
      step_now <= advance;
      tags     <= moved_on(tags, tag, advance, reset);
      if advance = '1' then
        out_now   := out_tag(0);
        now_ended := 0;
        -- Steps since the last pixel of the line: pixels behind it do not exist and count as zero.
        if live = '0' then
          now_ended := next_count(in_ended);
        end if;
        in_live   <= live;
        in_ended  <= now_ended;
        in_first  <= first;
        out_first <= out_now;
        if first = '1' then
          in_phase <= 0;
          in_count <= 0;
          in_slice <= slice;
        else
          in_phase <= next_phase(in_phase);
          in_count <= next_count(in_count);
        end if;
        -- The output's line begins DELAY steps behind its first pixel; count and phase of the output start there.
        if out_now = '1' then
          out_phase <= 0;
          out_count <= DELAY;
          -- The slice of a line holds for its outputs, even if a newer line has another one.
          out_slice <= unsigned(out_tag(out_tag'high downto 1));
        else
          out_phase <= next_phase(out_phase);
          out_count <= next_count(out_count);
        end if;
        -- Pixels and outputs belong to one line from its output 0 on until a newer line begins.
        if out_now = '1' then
          same <= '1';
        elsif first = '1' then
          same <= '0';
        end if;
        -- The end of the outputs' line: that of the pixels while both belong to one line, afterwards counted on alone.
        if out_now = '1' or (same = '1' and first = '0') then
          out_ended <= now_ended;
        else
          out_ended <= next_count(out_ended);
        end if;
      end if;
      -- After reset no stored pixel counts.
      if reset = '1' then
        step_now  <= '0';
        same      <= '0';
        in_count  <= REACHED + 1;
        in_ended  <= REACHED + 1;
        out_count <= 0;
        out_ended <= REACHED + 1;
      end if;
    end if;

  end process count_steps;

  look_up : process (clk) is

    variable in_step  : step_t;
    variable out_step : step_t;

  begin

    if rising_edge(clk) then
      -- The table is read twice: for the pixel that arrives, and for the output that leaves, which may belong to the
      -- line before. Each word is read whole and its flags are compared in front of a register, so that tools keep the
      -- table in logic: block RAM would give a word too late for the choice of places behind it.
      in_step  := STEP_OF(table_row(SLICES, M, in_slice, in_phase));
      out_step := STEP_OF(table_row(SLICES, M, out_slice, out_phase));
      -- An entity for one slice of a stack reads that slice's rows only, so tools drop the others.
      if FIXED_SLICE >= 0 then
        in_step  := STEP_OF(FIXED_SLICE * SLICE_STEP + in_phase);
        out_step := STEP_OF(FIXED_SLICE * SLICE_STEP + out_phase);
      end if;

      initial_2          <= in_live and to_logic(in_count = in_step.initial and in_count <= REACHED);
      initial_held_2     <= in_live and to_logic(in_count = in_step.held and in_count <= REACHED);
      in_first_2         <= in_first;
      out_count_2        <= out_count;
      out_ended_2        <= out_ended;
      out_first_2        <= out_first;
      ring.enter_phase_2 <= out_step.phase;
      ring.leave_phase_2 <= out_step.left_phase;
      age_2              <= out_step.age;
      left_count_2       <= out_count - BACK;
      left_ended_2       <= out_ended - BACK;
      if BACK > 0 then
        left_age_2 <= out_step.age;
      else
        left_age_2 <= out_step.left_age;
      end if;
      update_2 <= to_logic(out_step.begins = 2);
      clear_2  <= to_logic(out_step.clears = 2);
    end if;

  end process look_up;

  compare_ages : process (clk) is
  begin

    if rising_edge(clk) then
      -- Pixels enter from the line's first one on. They go on behind its end, where they count as zero, so
      -- that places in memory always move alike.
      ring.moves_3 <= to_logic(age_2 <= out_count_2);
      age_3        <= age_2;
      left_age_3   <= left_age_2 + BACK;

      -- A pixel's index is the count less its age. The pixel counts if that is not before the line's begin
      -- (count) and not behind its end (ended).
      choice_3 <=
      (
        enter     => to_logic(age_2 <= out_count_2 and age_2 >= out_ended_2),
        enter_now => to_logic(age_2 = 0),
        leave     => to_logic(left_age_2 <= left_count_2 and left_age_2 >= left_ended_2)
      );

      -- An output leaves while its index belongs to the line: up to DELAY steps behind the last pixel.
      command_3 <=
      (
        fresh    => in_first_2,
        to_first => initial_2,
        to_held  => initial_held_2,
        take     => out_first_2,
        clear    => clear_2,
        update   => update_2,
        due      => to_logic(out_ended_2 <= DELAY)
      );
    end if;

  end process compare_ages;

  -- Simulation stops if a line begins before output 0 of the line before has left: it would take that line's place
  -- in the delay. Marks of lines without pixels are left in the path of tokens by a reset and do not count.
  watch_lines : process (clk) is

    variable steps : natural := DELAY + 1;

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      if reset = '1' then
        steps := DELAY + 1;
      elsif advance = '1' then
        assert not (first = '1' and live = '1' and steps <= DELAY)
          report "moving_sum_control: a line began less than output_delay + 1 steps behind the one before"
          severity failure;
        if first = '1' and live = '1' then
          steps := 1;
        elsif steps <= DELAY then
          steps := steps + 1;
        end if;
      end if;
    end if;

  -- synthesis translate_on

  end process watch_lines;

end architecture rtl;
