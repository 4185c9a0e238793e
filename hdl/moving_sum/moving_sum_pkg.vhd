-- SPDX-License-Identifier: Apache-2.0
-- Types and constants that the entities of the moving sums share: commands, tables by slice and phase, lines in
-- memory, latencies.
--
-- All functions are evaluated at elaboration only, except table_row, which is a multiplexer.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sum_schedule_pkg.all;

package moving_sum_pkg is

  -- The pixels that change the running sum with a token: enter: one enters; enter_now: it is the pixel that comes
  -- with this token; leave: one leaves.
  type pixel_choice_t is record
    enter     : std_logic;
    enter_now : std_logic;
    leave     : std_logic;
  end record pixel_choice_t;

  constant NO_PIXELS : pixel_choice_t := (others => '0');

  -- The effect of a token on the sums.
  type sum_command_t is record
    -- A line begins, and with it a new first sum.
    fresh : std_logic;
    -- The pixel that comes with the token counts in the first sum (to_first), and in the sum that output 0 shows
    -- (to_held).
    to_first : std_logic;
    to_held  : std_logic;
    -- Output 0 leaves: the first sum replaces the running one.
    take : std_logic;
    -- A new sum begins.
    clear : std_logic;
    -- A group of outputs begins.
    update : std_logic;
    -- The output belongs to the line.
    due : std_logic;
  end record sum_command_t;

  constant NO_COMMAND : sum_command_t := (others => '0');

  -- What moving_sum_control tells the memory of pixels about a step. Names end in the number of clocks behind the
  -- step.
  type ring_control_t is record
    -- step_1: a step begins; phase_1: its phase; first_1: it is a line's first; live_1: it has a pixel of the
    -- line.
    step_1  : std_logic;
    phase_1 : natural range 0 to 127;
    first_1 : std_logic;
    live_1  : std_logic;
    -- take_1: output 0 leaves; slice_1: the output's slice.
    take_1  : std_logic;
    slice_1 : unsigned(7 downto 0);
    -- Phases of the pixels that enter and leave; moves_3: the one that enters does not lie before the line.
    enter_phase_2 : natural range 0 to 127;
    leave_phase_2 : natural range 0 to 127;
    moves_3       : std_logic;
  end record ring_control_t;

  -- Rows of a bank, counted from that of an output, that hold the pixels that the output adds.
  type row_range_t is record
    lowest  : integer;
    highest : integer;
  end record row_range_t;

  -- Sizes of a row stage with several pixels a token, computed once.
  type lanes_build_t is record
    -- Geometry of one slice alone if the slice is always the same.
    geometry : geometry_t;
    -- P, pixels of a token.
    pixels     : positive range 2 to 32;
    channels   : positive;
    pixel_bits : positive;
    -- places: places of a token in the banks; banks: the banks of a micro image.
    places : positive;
    banks  : positive;
    -- row_bits: width of a row's number; most_rows: how many rows of a line are counted.
    row_bits  : positive;
    most_rows : positive;
    rows      : row_range_t;
  end record lanes_build_t;

  -- Where the pixels of a token go in the banks: valid: they go there; their place and their row.
  type lanes_write_t is record
    valid : std_logic;
    place : natural range 0 to 127;
    row   : unsigned(15 downto 0);
  end record lanes_write_t;

  -- The outputs that leave with a token.
  type lanes_read_t is record
    -- active: there are outputs; take: they begin with output 0.
    active : std_logic;
    take   : std_logic;
    -- Slice, place and row of the outputs, and rows since output 0.
    slice : unsigned(7 downto 0);
    place : natural range 0 to 127;
    row   : unsigned(15 downto 0);
    rows  : natural range 0 to 65535;
    -- Place and row behind the last pixel of the outputs' line.
    end_place : natural range 0 to 127;
    end_row   : unsigned(15 downto 0);
  end record lanes_read_t;

  -- Lines that the column memory keeps of a phase; even if they alternate between two banks. any_rows: frames of any
  -- number of lines follow each other, at most one within `reach` lines; else the lines of a frame are a multiple of M.
  function ring_lines (
    geometry : geometry_t;
    any_rows : boolean;
    phase    : natural
  ) return natural;

  -- Lines that the column memory keeps of all phases.
  function kept_lines (
    geometry : geometry_t;
    any_rows : boolean
  ) return natural;

  -- The group of banks that each phase has: another one than the phases that leave as it enters. Groups have one bank,
  -- or two where lines alternate.
  type groups_t is array (natural range 0 to 127) of natural range 0 to 127;

  function bank_groups (
    geometry : geometry_t
  ) return groups_t;

  -- Number of groups.
  function group_count (
    geometry : geometry_t
  ) return positive;

  -- Lines that each bank of a group keeps of all phases before this one (phase = M: of all phases); and lines of the
  -- largest bank.
  function bank_lines (
    geometry    : geometry_t;
    any_rows    : boolean;
    group_index : natural;
    phase       : natural
  ) return natural;

  function most_bank_lines (
    geometry : geometry_t;
    any_rows : boolean
  ) return natural;

  -- Words of a table by phase. All tables have powers of two, so that an index needs no arithmetic.
  function phase_words (
    micro_image_size : positive
  ) return positive;

  -- Words of a table by slice and phase. A table must not end in 32 zero bits, because GHDL 2.0 would synthesise
  -- one whose size is a multiple of 32 bits as all zero. Unused words are therefore not zero.
  function table_words (
    geometry : geometry_t
  ) return positive;

  -- Index into a table by slice and phase. Its parameters are numbers, because a geometry would become a circuit.
  function table_row (
    slices           : positive;
    micro_image_size : positive;
    slice            : unsigned;
    phase            : natural
  ) return natural;

  -- The least number of lines from the beginning of one frame to that of the next, for all passes.
  function least_frame (
    geometry : geometry_t;
    order    : natural;
    any_rows : boolean
  ) return positive;

  -- Latency of a moving sum stage in clocks; depth: 1 for rows, the longest line for columns.
  function sum_stage_latency (
    stored : boolean;
    depth  : positive
  ) return positive;

end package moving_sum_pkg;

package body moving_sum_pkg is

  function ring_lines (
    geometry : geometry_t;
    any_rows : boolean;
    phase    : natural
  ) return natural is

    variable age   : natural;
    variable lines : natural;

  begin

    age := oldest(geometry, phase);

    -- If frames have multiples of M lines, the lines of a phase are M apart across frames too. Otherwise a frame
    -- may begin early: the first line of phase v comes up to M-1-v lines early.
    if any_rows and age > 0 then
      age := age + geometry.micro_image_size - 1 - phase;
    end if;

    -- A line of the phase comes every M lines and may replace the one that goes out of use.
    lines := divide_up(age, geometry.micro_image_size);

    if alternates(geometry) then
      -- An even number lets both banks have as many lines: the leaving line is never in the entering line's
      -- bank.
      lines := lines + lines mod 2;
    end if;

    return lines;

  end function ring_lines;

  function kept_lines (
    geometry : geometry_t;
    any_rows : boolean
  ) return natural is

    variable lines : natural;

  begin

    lines := 0;

    for v in 0 to geometry.micro_image_size - 1 loop

      lines := lines + ring_lines(geometry, any_rows, v);

    end loop;

    return lines;

  end function kept_lines;

  function bank_groups (
    geometry : geometry_t
  ) return groups_t is

    constant M : positive := geometry.micro_image_size;

    type phases_t is array (natural range 0 to M - 1) of boolean;

    type meetings_t is array (natural range 0 to M - 1) of phases_t;

    variable meets  : meetings_t;
    variable groups : groups_t;
    variable enters : natural;
    variable leaves : natural;
    variable taken  : phases_t;

  begin

    meets  := (others => (others => false));
    groups := (others => 0);

    -- Phases meet if pixels of one enter with those of the other leaving.
    for s in 0 to geometry.slices - 1 loop

      for k in 0 to M - 1 loop

        enters := entering_phase(geometry, s, k);
        leaves := leaving_phase(geometry, s, k);

        meets(enters)(leaves) := pixels_leave(geometry);
        meets(leaves)(enters) := pixels_leave(geometry);

      end loop;

    end loop;

    for v in 0 to M - 1 loop

      taken := (others => false);

      for u in 0 to M - 1 loop

        if u < v and meets(u)(v) then
          taken(groups(u)) := true;
        end if;

      end loop;

      -- The first group that no phase before has that meets this one. Downwards, the last one found is the first.
      for candidate in M - 1 downto 0 loop

        if not taken(candidate) then
          groups(v) := candidate;
        end if;

      end loop;

    end loop;

    return groups;

  end function bank_groups;

  function group_count (
    geometry : geometry_t
  ) return positive is

    constant GROUP_OF : groups_t := bank_groups(geometry);

    variable groups : positive;

  begin

    groups := 1;

    for v in groups_t'range loop

      groups := larger(groups, GROUP_OF(v) + 1);

    end loop;

    return groups;

  end function group_count;

  function bank_lines (
    geometry    : geometry_t;
    any_rows    : boolean;
    group_index : natural;
    phase       : natural
  ) return natural is

    constant GROUP_OF : groups_t := bank_groups(geometry);

    variable lines : natural;

  begin

    -- The rings lie one behind the other in the banks, so the lines in front of a ring are also where it begins.
    lines := 0;

    for v in 0 to phase - 1 loop

      if GROUP_OF(v) = group_index then
        lines := lines + ring_lines(geometry, any_rows, v);
      end if;

    end loop;

    -- Where lines alternate, each of two banks has every second line of a phase.
    return lines / choose(alternates(geometry), 2, 1);

  end function bank_lines;

  function most_bank_lines (
    geometry : geometry_t;
    any_rows : boolean
  ) return natural is

    variable lines : natural;

  begin

    lines := 0;

    for g in 0 to geometry.micro_image_size - 1 loop

      lines := larger(lines, bank_lines(geometry, any_rows, g, geometry.micro_image_size));

    end loop;

    return lines;

  end function most_bank_lines;

  function phase_words (
    micro_image_size : positive
  ) return positive is
  begin

    -- A power of two: slice and phase side by side are the index, without a multiplication by M.
    return 2 ** bits_for(micro_image_size - 1);

  end function phase_words;

  function table_words (
    geometry : geometry_t
  ) return positive is
  begin

    if geometry.slices = 1 then
      return phase_words(geometry.micro_image_size);
    end if;

    return phase_words(geometry.micro_image_size) * 2 ** bits_for(geometry.slices - 1);

  end function table_words;

  function table_row (
    slices           : positive;
    micro_image_size : positive;
    slice            : unsigned;
    phase            : natural
  ) return natural is

    variable row : unsigned(slice'length + bits_for(micro_image_size - 1) - 1 downto 0);

  begin

    if slices = 1 then
      return phase;
    end if;

    -- Indices are converted from vectors here, which GHDL turns into wires instead of arithmetic.
    row := slice & to_unsigned(phase, bits_for(micro_image_size - 1));

    return to_integer(row);

  end function table_row;

  function least_frame (
    geometry : geometry_t;
    order    : natural;
    any_rows : boolean
  ) return positive is

    variable lines : positive;

  begin

    lines := total_delay(geometry, order) + 1;

    -- No pass reaches further than the first.
    if any_rows then
      -- Two frames in `reach` lines would need a third line of some phases.
      return larger(lines, reach(geometry));
    end if;

    return lines;

  end function least_frame;

  function sum_stage_latency (
    stored : boolean;
    depth  : positive
  ) return positive is
  begin

    -- Control 3, addresses 2, words 2, sums 3. The memory of lines takes a clock more than that of
    -- a row's pixels.
    return 10 + choose(stored, 1, 0) + choose(depth > 1, 1, 0);

  end function sum_stage_latency;

end package body moving_sum_pkg;
