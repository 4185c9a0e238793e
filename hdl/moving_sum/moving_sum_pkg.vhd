-- SPDX-License-Identifier: Apache-2.0
-- Types and constants that the entities of the moving sums share: commands, tables by slice and phase, lines in memory,
-- clock counts.
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

  -- Which pixels change the running sum with a token: one enters, which is its own, one leaves.
  type pixel_choice_t is record
    enter     : std_logic;
    enter_now : std_logic;
    leave     : std_logic;
  end record pixel_choice_t;

  constant NO_PIXELS : pixel_choice_t := (others => '0');

  -- What a token does to the sums.
  type sum_command_t is record
    -- A line begins: its first sums, too.
    fresh : std_logic;
    -- The own pixel belongs to the first sum, as it goes on and as output 0 shows it.
    to_first : std_logic;
    to_held  : std_logic;
    -- Output 0 is due: the first sum takes the place of the running one.
    take : std_logic;
    -- A new sum begins.
    clear : std_logic;
    -- A group of outputs begins.
    update : std_logic;
    -- The output belongs to the line.
    due : std_logic;
  end record sum_command_t;

  constant NO_COMMAND : sum_command_t := (others => '0');

  -- What the control of a moving sum says of a step to the memory of its pixels; clocks behind the step are part of the
  -- names.
  type ring_control_t is record
    -- A step begins; its phase, whether it is the first of a line and whether it has a pixel of the line.
    step_1  : std_logic;
    phase_1 : natural range 0 to 127;
    first_1 : std_logic;
    live_1  : std_logic;
    -- Whether output 0 is due, and the slice of the output.
    take_1  : std_logic;
    slice_1 : unsigned(7 downto 0);
    -- Phase of the pixel that enters, and whether it does not lie before the line.
    enter_phase_2 : natural range 0 to 127;
    moves_3       : std_logic;
  end record ring_control_t;

  -- What a row stage of several pixels a token is built for, and the sizes that follow from it, computed once.
  type lanes_build_t is record
    -- Of one slice, if it is always the same.
    geometry : geometry_t;
    -- P.
    pixels     : positive range 2 to 32;
    channels   : positive;
    pixel_bits : positive;
    -- Places of tokens in a micro image's banks, and these banks.
    places : positive;
    banks  : positive;
    -- Bits of a row, and how many rows of a line are counted.
    row_bits  : positive;
    most_rows : positive;
  end record lanes_build_t;

  -- Where the pixels of a token go in the banks: whether they do, their place and their row.
  type lanes_write_t is record
    valid : std_logic;
    place : natural range 0 to 127;
    row   : unsigned(15 downto 0);
  end record lanes_write_t;

  -- The outputs that are due with a token.
  type lanes_read_t is record
    -- There are any, and they begin with output 0.
    active : std_logic;
    take   : std_logic;
    -- Their slice, place and row, and rows since output 0.
    slice : unsigned(7 downto 0);
    place : natural range 0 to 127;
    row   : unsigned(15 downto 0);
    rows  : natural range 0 to 65535;
    -- Place and row behind the last pixel of their line that came.
    end_place : natural range 0 to 127;
    end_row   : unsigned(15 downto 0);
  end record lanes_read_t;

  -- Lines of a phase that the column memory keeps; even if pixels leave, for two banks. any_rows: frames of any
  -- number of lines follow each other, once in `reach` lines at most; else those of a multiple of M.
  function ring_lines (
    geometry : geometry_t;
    any_rows : boolean;
    phase    : natural
  ) return natural;

  -- Lines of all phases before a phase that a bank keeps (phase = M: of all).
  function bank_lines (
    geometry : geometry_t;
    any_rows : boolean;
    phase    : natural
  ) return natural;

  -- Words of a table by phase: a power of two, as of all tables here, so that an index needs no arithmetic.
  function phase_words (
    micro_image_size : positive
  ) return positive;

  -- Words of a table by slice and phase. A table must not end in 32 bits of zeros: GHDL 2.0 synthesises one whose
  -- size is a multiple of them as if all of it were zero. So words without a meaning are not zero.
  function table_words (
    geometry : geometry_t
  ) return positive;

  -- Row of a table by slice and phase. It is wired, so it takes numbers: no circuit need be made of a geometry.
  function table_row (
    slices           : positive;
    micro_image_size : positive;
    slice            : unsigned;
    phase            : natural
  ) return natural;

  -- Lines from the beginning of a frame to that of the next one at the earliest, of all passes.
  function least_frame (
    geometry : geometry_t;
    order    : natural;
    any_rows : boolean
  ) return positive;

  -- Clocks from a token at a moving sum stage's input to its output; depth: 1 for rows, the longest line for columns.
  function sum_stage_latency (
    stored : boolean;
    depth  : positive
  ) return positive;

  -- Clocks from a token at the moving sum array's input to its output.
  function sum_array_latency (
    stored : boolean;
    order  : natural
  ) return positive;

end package moving_sum_pkg;

package body moving_sum_pkg is

  function ring_lines (
    geometry : geometry_t;
    any_rows : boolean;
    phase    : natural
  ) return natural is

    variable oldest : natural;
    variable lines  : natural;

  begin

    oldest := oldest_entering(geometry, phase);

    -- Where frames have multiples of M lines, the lines of a phase are M apart across frames, too;
    -- otherwise the first line of a frame may come early, that of phase v by M-1-v lines at most.
    if any_rows and (oldest > 0 or pixels_leave(geometry)) then
      oldest := oldest + geometry.micro_image_size - 1 - phase;
    end if;

    -- One line of the phase comes every M lines; the one that comes may take the place of the one that goes.
    lines := (oldest + geometry.micro_image_size - 1) / geometry.micro_image_size;

    if pixels_leave(geometry) then
      lines := lines + 1;
      -- Even, so that both banks have as many lines: the line that leaves is in the other bank than the one that
      -- enters.
      lines := lines + lines mod 2;
    end if;

    return lines;

  end function ring_lines;

  function bank_lines (
    geometry : geometry_t;
    any_rows : boolean;
    phase    : natural
  ) return natural is

    variable lines : natural;

  begin

    -- The rings lie one behind the other in the banks, so this is also where a ring begins.
    lines := 0;

    for v in 0 to phase - 1 loop

      lines := lines + ring_lines(geometry, any_rows, v);

    end loop;

    -- Each bank has every second line of a phase.
    if pixels_leave(geometry) then
      lines := lines / 2;
    end if;

    return lines;

  end function bank_lines;

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

    -- Indices are converted from vectors here, because GHDL then makes a wire of them and no arithmetic.
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

    -- Three of the control, two for the addresses, two for the words, three for the sums. The memory
    -- of lines (ram_blocks) takes a clock more than that of a line's last pixels.
    return 10 + choose(stored, 1, 0) + choose(depth > 1, 1, 0);

  end function sum_stage_latency;

  function sum_array_latency (
    stored : boolean;
    order  : natural
  ) return positive is
  begin

    -- A stage for rows and one for columns.
    return (order + 1) * (sum_stage_latency(stored, 1) + sum_stage_latency(stored, 2)) +
           choose(stored, 0, DIVIDE_LATENCY);

  end function sum_array_latency;

end package body moving_sum_pkg;
