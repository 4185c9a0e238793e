-- SPDX-License-Identifier: Apache-2.0
-- Keeps the last lines of a frame, and gives the pixels that enter a column's moving sum and those that leave it.
--
-- Each phase (line mod M) has a ring of lines, only as long as its ages need. The line that enters and the one that
-- leaves are read at the same time, so they lie in different banks. With a box of M they are neighbours in a ring, and
-- the lines of a ring alternate between two banks. With a smaller box they are of two phases, whose rings lie in groups
-- of banks of their own (bank_groups). Rings lie one behind the other in the banks, without a gap. Frames may have any
-- number of lines: rings continue from frame to frame, and the first outputs of a frame find their lines by the place
-- where the frame began.
--
-- Names of signals end in the number of clocks since the token that begins a line.
--
-- Latency: 8 clocks. Throughput: one token each clock; lines begin at least 4 clocks apart.
-- Equation: entering = the column's pixel `age` lines before, with the age of the phase; leaving = the pixel that
-- entered B lines before, B the box.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;

entity line_ring is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Whether frames of any number of lines follow each other without a gap.
    ANY_ROWS : boolean;
    -- Longest line in pixels.
    COLUMNS : positive;
    -- Bits of a token.
    WIDTH : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Signals from moving_sum_control for each line; a step is a line.
    control : in    ring_control_t;
    -- For each token its column, whether it has a pixel, and the pixel.
    column_4 : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    active_5 : in    std_logic;
    pixel_5  : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The pixels of the token's column that enter and leave the sum.
    entering_8 : out   std_logic_vector(WIDTH - 1 downto 0);
    leaving_8  : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity line_ring;

architecture rtl of line_ring is

  constant M       : positive := GEOMETRY.micro_image_size;
  constant SLICES  : positive := GEOMETRY.slices;
  constant LEAVING : boolean  := pixels_leave(GEOMETRY);
  constant KEPT    : natural  := kept_lines(GEOMETRY, ANY_ROWS);
  -- Banks between which the lines of a ring alternate.
  constant TURNS : positive := choose(alternates(GEOMETRY), 2, 1);
  -- The group of banks of each phase. A single bank does where no pixel leaves: each clock reads one line and writes
  -- one.
  constant GROUP_OF : groups_t := bank_groups(GEOMETRY);

  constant GROUPS : positive := group_count(GEOMETRY);
  constant BANKS  : positive := GROUPS * TURNS;
  -- Lines of the largest bank.
  constant ALL_LINES : natural  := most_bank_lines(GEOMETRY, ANY_ROWS);
  constant WORD_BITS : positive := bits_for(larger(ALL_LINES, 1) * COLUMNS - 1);

  subtype phase_t is natural range 0 to larger(M - 1, 1);

  -- A place in a ring, or the size of a ring. Each phase has a ring of its own, only as long as its pixels stay in
  -- use, which takes fewer lines than one ring for all.
  subtype place_t is natural range 0 to larger(KEPT, 1);

  subtype bank_t is natural range 0 to larger(BANKS - 1, 1);

  subtype address_t is unsigned(WORD_BITS - 1 downto 0);

  -- A power of two, so that slice and phase side by side are an index.
  constant SLICE_STEP : positive := phase_words(M);

  -- A place for each phase.
  type places_t is array (natural range 0 to SLICE_STEP - 1) of place_t;

  -- A place for each slice and phase.
  type skips_t is array (natural range 0 to table_words(GEOMETRY) - 1) of place_t;

  type banks_t is array (5 to 8) of bank_t;

  type addresses_t is array (natural range 0 to BANKS - 1) of address_t;

  type bank_words_t is array (natural range 0 to larger(BANKS - 1, 1)) of std_logic_vector(WIDTH - 1 downto 0);

  -- The ring of a phase: its lines, the lines of a bank in front of it, and its first bank.
  type ring_t is record
    lines : place_t;
    base  : place_t;
    bank  : bank_t;
  end record ring_t;

  type rings_t is array (natural range 0 to SLICE_STEP - 1) of ring_t;

  function all_rings return rings_t is

    variable rings : rings_t;

  begin

    -- Phases of M and above do not occur; 1 keeps the table's words from being all zeros (table_words).
    rings := (others => (lines => 1, base => 1, bank => 0));

    for v in 0 to M - 1 loop

      rings(v).lines := ring_lines(GEOMETRY, ANY_ROWS, v);
      rings(v).base  := 0;
      rings(v).bank  := GROUP_OF(v) * TURNS;

      -- A phase without a ring needs no lines and no base.
      if rings(v).lines > 0 then
        rings(v).base := bank_lines(GEOMETRY, ANY_ROWS, GROUP_OF(v), v);
      end if;

    end loop;

    return rings;

  end function all_rings;

  constant RING_OF : rings_t := all_rings;

  -- For each phase, the lines between the frame's begin and the first line that enters, modulo the ring (1 to its
  -- size, see table_words).
  function skip_table return skips_t is

    variable table : skips_t;
    variable index : integer;
    variable ring  : natural;

  begin

    table := (others => 1);

    for s in 0 to SLICES - 1 loop

      for v in 0 to M - 1 loop

        index := initial_index(GEOMETRY, s, v, false);
        ring  := RING_OF(v).lines;

        if ring > 0 then
          table(s * SLICE_STEP + v) := ring;

          -- The index of that line counted in lines of its phase, as a place in the ring.
          if index >= 0 then
            table(s * SLICE_STEP + v) := index / M mod ring + 1;
          end if;
        end if;

      end loop;

    end loop;

    return table;

  end function skip_table;

  constant SKIP_OF : skips_t := skip_table;

  -- The place that lies so many lines further in a ring.
  function moved (
    place : place_t;
    lines : natural;
    ring  : natural
  ) return place_t is
  begin

    -- One subtraction gives the remainder, because place and lines are each below the ring's size.
    if ring = 0 then
      return 0;
    elsif place + lines >= ring then
      return place + lines - ring;
    end if;

    return place + lines;

  end function moved;

  function place_behind (
    place : place_t;
    ring  : natural
  ) return place_t is
  begin

    if ring = 0 or place + 1 = ring then
      return 0;
    end if;

    return place + 1;

  end function place_behind;

  function place_before (
    place : place_t;
    ring  : natural
  ) return place_t is
  begin

    if place > 0 then
      return place - 1;
    elsif ring /= 0 then
      return ring - 1;
    end if;

    return 0;

  end function place_before;

  type line_addresses_t is array (natural range 0 to 2 ** bits_for(ALL_LINES) - 1) of address_t;

  -- A table takes the place of a multiplier.
  function line_table return line_addresses_t is

    variable table : line_addresses_t;

  begin

    -- Unused words are ones instead of zeros (see table_words).
    table    := (others => (others => '1'));
    table(0) := (others => '0');

    for line in 1 to ALL_LINES - 1 loop

      table(line) := to_unsigned(line * COLUMNS, WORD_BITS);

    end loop;

    return table;

  end function line_table;

  constant ADDRESS_OF : line_addresses_t := line_table;

  -- The bank of a line.
  function bank_of (
    place : place_t;
    phase : phase_t
  ) return bank_t is
  begin

    return RING_OF(phase).bank + place mod TURNS;

  end function bank_of;

  -- Address of a line's first word in its bank.
  function line_address (
    place : place_t;
    phase : phase_t
  ) return address_t is
  begin

    return ADDRESS_OF(RING_OF(phase).base + place / TURNS);

  end function line_address;

  -- For each ring: write_place: place of the next line to write; frame_place: place of the frame's first line;
  -- enter_place: place of the next line that enters.
  signal write_place : places_t := (others => 0);
  signal frame_place : places_t := (others => 0);
  signal enter_place : places_t := (others => 0);

  signal phase_1       : phase_t;
  signal slice_1       : unsigned(bits_for(SLICES - 1) - 1 downto 0);
  signal step_2        : std_logic   := '0';
  signal phase_2       : phase_t     := 0;
  signal live_2        : std_logic   := '0';
  signal take_2        : std_logic   := '0';
  signal in_place_2    : place_t     := 0;
  signal step_3        : std_logic   := '0';
  signal phase_3       : phase_t     := 0;
  signal stored_3      : std_logic   := '0';
  signal take_3        : std_logic   := '0';
  signal enter_phase_3 : phase_t     := 0;
  signal in_place_3    : place_t     := 0;
  signal leave_phase_3 : phase_t     := 0;
  signal enter_place_3 : place_t     := 0;
  signal leave_place_3 : place_t     := 0;
  signal stored_4      : std_logic   := '0';
  signal in_line_4     : address_t   := (others => '0');
  signal enter_line_4  : address_t   := (others => '0');
  signal leave_line_4  : address_t   := (others => '0');
  signal in_bank_4     : bank_t      := 0;
  signal enter_bank_4  : bank_t      := 0;
  signal leave_bank_4  : bank_t      := 0;
  signal stored_5      : std_logic   := '0';
  signal in_bank_5     : bank_t      := 0;
  signal write_address : address_t   := (others => '0');
  signal read_address  : addresses_t := (others => (others => '0'));
  signal enter_bank_at : banks_t     := (others => 0);
  signal leave_bank_at : banks_t     := (others => 0);
  signal bank_words    : bank_words_t;

begin

  phase_1 <= control.phase_1;
  slice_1 <= control.slice_1(slice_1'range);

  -- A ring's places are read and moved once a line, so clocks are counted from the token that begins the line.
  find_lines : process (clk) is

    variable next_in    : place_t;
    variable next_enter : place_t;
    variable left_phase : phase_t;

  begin

    if rising_edge(clk) then
      -- Clock 1: the place of the line that comes in. frame_place keeps where each ring stood when the frame
      -- began: output 0 comes later and counts from there.
      if control.step_1 = '1' and control.first_1 = '1' then
        frame_place <= write_place;
      end if;
      step_2     <= control.step_1;
      phase_2    <= phase_1;
      in_place_2 <= write_place(phase_1);
      live_2     <= control.live_1;
      take_2     <= control.take_1;

      -- Clock 2: the line that enters and its neighbour in the ring; with output 0 the first lines that enter.
      next_in := place_behind(in_place_2, RING_OF(phase_2).lines);
      -- With one group only boxes of M have pixels that leave, of the phase that enters.
      left_phase := control.enter_phase_2;
      if GROUPS > 1 then
        left_phase := control.leave_phase_2;
      end if;
      step_3   <= step_2;
      stored_3 <= '0';
      -- Phases whose lines always enter at once are not stored.
      if RING_OF(phase_2).lines > 0 then
        stored_3 <= live_2;
      end if;
      if step_2 = '1' then
        phase_3       <= phase_2;
        in_place_3    <= in_place_2;
        enter_phase_3 <= control.enter_phase_2;
        enter_place_3 <= enter_place(control.enter_phase_2);
        -- The line that leaves is the last one of its phase that has entered: it stands in front of the next one.
        leave_phase_3 <= left_phase;
        leave_place_3 <= place_before(enter_place(left_phase), RING_OF(left_phase).lines);
        take_3        <= take_2;

        -- The loop avoids an element of variable index, for which GHDL 2.0 synthesises no register.
        for v in 0 to M - 1 loop

          -- Flush lines take no place, or they would overwrite lines that are still read.
          if v = phase_2 and live_2 = '1' then
            write_place(v) <= next_in;
          end if;
          -- With output 0, each ring's first line that enters is found from where the frame began.
          if take_2 = '1' then
            enter_place(v) <= moved(frame_place(v), SKIP_OF(table_row(SLICES, M, slice_1, v)), RING_OF(v).lines);
          end if;

        end loop;

      end if;

      -- Clock 3: the phase's next line will enter.
      next_enter := place_behind(enter_place_3, RING_OF(enter_phase_3).lines);
      -- The place moves only if a line has entered, because lines before the frame have no place; with output
      -- 0 it has just been set.
      if step_3 = '1' and control.moves_3 = '1' and take_3 = '0' then

        for v in 0 to M - 1 loop

          if v = enter_phase_3 then
            enter_place(v) <= next_enter;
          end if;

        end loop;

      end if;

      -- Clock 3: addresses of lines.
      in_line_4    <= line_address(in_place_3, phase_3);
      enter_line_4 <= line_address(enter_place_3, enter_phase_3);
      leave_line_4 <= line_address(leave_place_3, leave_phase_3);
      -- The entering and the leaving line lie in different banks and are read in one clock.
      in_bank_4    <= bank_of(in_place_3, phase_3);
      enter_bank_4 <= bank_of(enter_place_3, enter_phase_3);
      leave_bank_4 <= bank_of(leave_place_3, leave_phase_3);
      stored_4     <= stored_3;

      if reset = '1' then
        step_2      <= '0';
        step_3      <= '0';
        write_place <= (others => 0);
        frame_place <= (others => 0);
        enter_place <= (others => 0);
      end if;
    end if;

  end process find_lines;

  find_pixels : process (clk) is
  begin

    if rising_edge(clk) then
      -- Clock 4: addresses of pixels.
      in_bank_5 <= in_bank_4;
      stored_5  <= stored_4;
      -- Line and column are added in a clock of their own, in front of the memories' address registers.
      write_address <= in_line_4 + column_4;

      for b in 0 to BANKS - 1 loop

        -- A bank that is read for neither may be too short for their addresses.
        if enter_bank_4 = b then
          read_address(b) <= enter_line_4 + column_4;
        elsif GROUPS = 1 or leave_bank_4 = b then
          read_address(b) <= leave_line_4 + column_4;
        else
          read_address(b) <= (others => '0');
        end if;

      end loop;

      -- The numbers of the banks wait until the words come.
      enter_bank_at <= enter_bank_4 & enter_bank_at(5 to 7);
      leave_bank_at <= leave_bank_4 & leave_bank_at(5 to 7);
    end if;

  end process find_pixels;

  -- If every line enters at once there is no ring and no memory.
  bank : for b in 0 to choose(ALL_LINES = 0, 0, BANKS) - 1 generate

    constant LINES : positive := larger(bank_lines(GEOMETRY, ANY_ROWS, b / TURNS, M), 1);
    constant WORDS : positive := LINES * COLUMNS;

    signal write_enable : std_logic;

  begin

    -- A word goes to the bank that its ring has reached.
    write_enable <= active_5 and stored_5 when in_bank_5 = b else
                    '0';

    memory : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => WIDTH,
        WORDS        => WORDS,
        READ_LATENCY => 3,
        DIVIDED      => true
      )
      port map (
        clk           => clk,
        write_enable  => write_enable,
        write_address => write_address(bits_for(WORDS - 1) - 1 downto 0),
        write_data    => pixel_5,
        read_address  => read_address(b)(bits_for(WORDS - 1) - 1 downto 0),
        read_data     => bank_words(b)
      );

  end generate bank;

  one_bank : if not LEAVING generate
    entering_8 <= bank_words(0);
    leaving_8  <= (others => '0');
  end generate one_bank;

  -- With two banks the leaving pixel is in the bank that the entering one is not in.
  several_banks : if LEAVING generate
    entering_8 <= bank_words(enter_bank_at(8));
    leaving_8  <= bank_words(1 - enter_bank_at(8)) when BANKS = 2 else
                  bank_words(leave_bank_at(8));
  end generate several_banks;

end architecture rtl;
