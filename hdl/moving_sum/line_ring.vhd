-- SPDX-License-Identifier: Apache-2.0
-- The last lines of a frame. Gives the pixels that enter the moving sum of a column, and those that leave it.
--
-- Each phase (line mod M) has a ring of lines, only as long as its ages need. The lines of a ring alternate between two
-- banks, so the line that enters and the one that leaves, which are neighbours in the ring, are read at the same time.
-- The rings lie one behind the other in the banks, without a gap. Frames may have any number of lines: rings continue
-- from frame to frame, and the first outputs of a frame find their lines by the place where the frame began.
--
-- Names of signals end in the number of clocks since the token that begins a line.
--
-- Latency: 8 clocks from a token to the pixels that enter and leave. Throughput: one token each clock, a new line 4
--   clocks after the last one at the earliest.
-- Equation: entering = the pixel of the column as many lines before as its phase's age says, leaving = M lines more.

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
    -- M, the slices, and what follows from them.
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
    -- What the control says of a line, which is a step.
    control : in    ring_control_t;
    -- Of each token: its column, then whether it has a pixel, and the pixel.
    column_4 : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    active_5 : in    std_logic;
    pixel_5  : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The pixels of its column that enter and leave.
    entering_8 : out   std_logic_vector(WIDTH - 1 downto 0);
    leaving_8  : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity line_ring;

architecture rtl of line_ring is

  constant M       : positive := GEOMETRY.micro_image_size;
  constant SLICES  : positive := GEOMETRY.slices;
  constant LEAVING : boolean  := pixels_leave(GEOMETRY);
  -- Where no pixel leaves a sum, one line is read for each one that is written, and one bank does.
  constant BANKS     : positive := choose(LEAVING, 2, 1);
  constant ALL_LINES : natural  := bank_lines(GEOMETRY, ANY_ROWS, M);
  constant WORDS     : positive := larger(ALL_LINES, 1) * COLUMNS;
  constant WORD_BITS : positive := bits_for(WORDS - 1);

  subtype phase_t is natural range 0 to larger(M - 1, 1);

  -- A place in a ring, or the size of a ring.
  -- A phase has a ring of its own, as long as its pixels stay in use: rings of different lengths take fewer lines
  -- than one for all.
  subtype place_t is natural range 0 to larger(BANKS * ALL_LINES, 1);

  subtype address_t is unsigned(WORD_BITS - 1 downto 0);

  -- A power of two, so that slice and phase side by side are an index.
  constant SLICE_STEP : positive := phase_words(M);

  -- By phase.
  type places_t is array (natural range 0 to SLICE_STEP - 1) of place_t;

  -- By slice and phase.
  type skips_t is array (natural range 0 to table_words(GEOMETRY) - 1) of place_t;

  type addresses_t is array (natural range 0 to BANKS - 1) of address_t;

  type bank_words_t is array (natural range 0 to 1) of std_logic_vector(WIDTH - 1 downto 0);

  -- Lines of the rings.
  function ring_table return places_t is

    variable table : places_t;

  begin

    -- Phases beyond M do not come; 1 keeps the table's words from being all zeros (see
    -- table_words).
    table := (others => 1);

    for v in 0 to M - 1 loop

      table(v) := ring_lines(GEOMETRY, ANY_ROWS, v);

    end loop;

    return table;

  end function ring_table;

  constant RING_OF : places_t := ring_table;

  -- Lines of a bank before those of the rings.
  function base_table return places_t is

    variable table  : places_t;
    variable before : natural;

  begin

    table  := (others => 1);
    before := 0;

    for v in 0 to M - 1 loop

      table(v) := 0;

      -- A phase without a ring needs no lines and no base.
      if RING_OF(v) > 0 then
        table(v) := before / BANKS;
        before   := before + RING_OF(v);
      end if;

    end loop;

    return table;

  end function base_table;

  -- Lines of a phase that come before the first one that enters, modulo the ring (1 to its size, see table_words).
  function skip_table return skips_t is

    variable table : skips_t;
    variable index : integer;
    variable ring  : natural;

  begin

    table := (others => 1);

    for s in 0 to SLICES - 1 loop

      for v in 0 to M - 1 loop

        index := initial_index(GEOMETRY, s, v, false);
        ring  := RING_OF(v);

        if ring > 0 then
          table(s * SLICE_STEP + v) := ring;

          -- The line with that index counted in lines of its phase, and the places of the ring it
          -- is behind.
          if index >= 0 then
            table(s * SLICE_STEP + v) := index / M mod ring + 1;
          end if;
        end if;

      end loop;

    end loop;

    return table;

  end function skip_table;

  constant BASE_OF : places_t := base_table;
  constant SKIP_OF : skips_t  := skip_table;

  -- A place further on in a ring.
  function moved (
    place : place_t;
    lines : natural;
    ring  : natural
  ) return place_t is
  begin

    -- A modulo by one subtraction: both are below twice the ring.
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

  -- A table instead of a multiplier.
  function line_table return line_addresses_t is

    variable table : line_addresses_t;

  begin

    -- Ones instead of zeros in words without a meaning, see table_words.
    table    := (others => (others => '1'));
    table(0) := (others => '0');

    for line in 1 to ALL_LINES - 1 loop

      table(line) := to_unsigned(line * COLUMNS, WORD_BITS);

    end loop;

    return table;

  end function line_table;

  constant ADDRESS_OF : line_addresses_t := line_table;

  -- The word that a line of a ring begins with, in its bank.
  function line_address (
    place : place_t;
    phase : phase_t
  ) return address_t is
  begin

    return ADDRESS_OF(BASE_OF(phase) + place / BANKS);

  end function line_address;

  -- Places in the rings: of the next line that comes in, of the first line of the frame that comes in, of the next
  -- line that enters.
  signal write_place : places_t := (others => 0);
  signal frame_place : places_t := (others => 0);
  signal enter_place : places_t := (others => 0);

  signal phase_1       : phase_t;
  signal slice_1       : unsigned(bits_for(SLICES - 1) - 1 downto 0);
  signal step_2        : std_logic            := '0';
  signal phase_2       : phase_t              := 0;
  signal live_2        : std_logic            := '0';
  signal take_2        : std_logic            := '0';
  signal own_place_2   : place_t              := 0;
  signal step_3        : std_logic            := '0';
  signal phase_3       : phase_t              := 0;
  signal stored_3      : std_logic            := '0';
  signal take_3        : std_logic            := '0';
  signal enter_phase_3 : phase_t              := 0;
  signal own_place_3   : place_t              := 0;
  signal enter_place_3 : place_t              := 0;
  signal leave_place_3 : place_t              := 0;
  signal stored_4      : std_logic            := '0';
  signal own_line_4    : address_t            := (others => '0');
  signal enter_line_4  : address_t            := (others => '0');
  signal leave_line_4  : address_t            := (others => '0');
  signal own_bank_4    : natural range 0 to 1 := 0;
  signal enter_bank_4  : natural range 0 to 1 := 0;
  signal stored_5      : std_logic            := '0';
  signal own_bank_5    : natural range 0 to 1 := 0;
  signal write_address : address_t            := (others => '0');
  signal read_address  : addresses_t          := (others => (others => '0'));
  signal enter_bank_5  : natural range 0 to 1 := 0;
  signal enter_bank_6  : natural range 0 to 1 := 0;
  signal enter_bank_7  : natural range 0 to 1 := 0;
  signal enter_bank_8  : natural range 0 to 1 := 0;
  signal bank_words    : bank_words_t;

begin

  phase_1 <= control.phase_1;
  slice_1 <= control.slice_1(slice_1'range);

  -- The places of a ring are read and moved on once a line, so all its clocks are those of the
  -- token that begins it.
  find_lines : process (clk) is

    variable next_own   : place_t;
    variable next_enter : place_t;

  begin

    if rising_edge(clk) then
      -- 1: the place of the own line.
      -- Where each ring stood when the frame began: output 0 comes later, and counts from there.
      if control.step_1 = '1' and control.first_1 = '1' then
        frame_place <= write_place;
      end if;
      step_2      <= control.step_1;
      phase_2     <= phase_1;
      own_place_2 <= write_place(phase_1);
      live_2      <= control.live_1;
      take_2      <= control.take_1;

      -- 2: the line that enters, and the one before it in its ring; with output 0 the places of what enters.
      next_own := place_behind(own_place_2, RING_OF(phase_2));
      step_3   <= step_2;
      stored_3 <= '0';
      -- Phases that only ever enter with their own line are not stored at all.
      if RING_OF(phase_2) > 0 then
        stored_3 <= live_2;
      end if;
      if step_2 = '1' then
        phase_3       <= phase_2;
        own_place_3   <= own_place_2;
        enter_phase_3 <= control.enter_phase_2;
        enter_place_3 <= enter_place(control.enter_phase_2);
        -- M steps before, the line of the same phase entered: in its ring the neighbour of the one that enters now.
        leave_place_3 <= place_before(enter_place(control.enter_phase_2), RING_OF(control.enter_phase_2));
        take_3        <= take_2;

        -- No element of varying index: GHDL 2.0 synthesises no register for it.
        for v in 0 to M - 1 loop

          -- Lines that belong to no frame take no place, or flush lines would push those out that are still read.
          if v = phase_2 and live_2 = '1' then
            write_place(v) <= next_own;
          end if;
          -- With output 0 the first line that enters is found from where its frame began in each
          -- ring.
          if take_2 = '1' then
            enter_place(v) <= moved(frame_place(v), SKIP_OF(table_row(SLICES, M, slice_1, v)), RING_OF(v));
          end if;

        end loop;

      end if;

      -- 3: the next line of that phase will enter.
      next_enter := place_behind(enter_place_3, RING_OF(enter_phase_3));
      -- Only if a line has entered: one that would lie before its frame has no place. With output 0
      -- the places have just been set.
      if step_3 = '1' and control.moves_3 = '1' and take_3 = '0' then

        for v in 0 to M - 1 loop

          if v = enter_phase_3 then
            enter_place(v) <= next_enter;
          end if;

        end loop;

      end if;

      -- 3: addresses of lines.
      own_line_4   <= line_address(own_place_3, phase_3);
      enter_line_4 <= line_address(enter_place_3, enter_phase_3);
      leave_line_4 <= line_address(leave_place_3, enter_phase_3);
      -- By turns: what enters and what leaves are neighbours in a ring, and so lie in different banks and are read in
      -- one clock.
      own_bank_4   <= own_place_3 mod BANKS;
      enter_bank_4 <= enter_place_3 mod BANKS;
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
      -- 4: addresses of pixels.
      own_bank_5 <= own_bank_4;
      stored_5   <= stored_4;
      -- Line and column added in a clock of their own, in front of the memories' address registers.
      write_address <= own_line_4 + column_4;

      for b in 0 to BANKS - 1 loop

        if enter_bank_4 = b then
          read_address(b) <= enter_line_4 + column_4;
        else
          read_address(b) <= leave_line_4 + column_4;
        end if;

      end loop;

      -- The bank that holds the entering pixel is known when the words come.
      enter_bank_5 <= enter_bank_4;
      enter_bank_6 <= enter_bank_5;
      enter_bank_7 <= enter_bank_6;
      enter_bank_8 <= enter_bank_7;
    end if;

  end process find_pixels;

  -- Where every pixel enters with its own line there is no ring, and no memory.
  bank : for b in 0 to choose(ALL_LINES = 0, 0, BANKS) - 1 generate

    signal write_enable : std_logic;

  begin

    -- The word goes to the bank whose turn it is in its ring.
    write_enable <= active_5 and stored_5 when own_bank_5 = b else
                    '0';

    lines : entity work.ram_blocks
      generic map (
        WIDTH => WIDTH,
        WORDS => WORDS
      )
      port map (
        clk           => clk,
        write_enable  => write_enable,
        write_address => write_address,
        write_data    => pixel_5,
        read_address  => read_address(b),
        read_data     => bank_words(b)
      );

  end generate bank;

  one_bank : if not LEAVING generate
    entering_8 <= bank_words(0);
    leaving_8  <= (others => '0');
  end generate one_bank;

  -- What enters is in one bank, so what leaves is in the other.
  two_banks : if LEAVING generate
    entering_8 <= bank_words(enter_bank_8);
    leaving_8  <= bank_words(1 - enter_bank_8);
  end generate two_banks;

end architecture rtl;
