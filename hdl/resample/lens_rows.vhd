-- SPDX-License-Identifier: Apache-2.0
-- Goes through the lines of the raster (for each row of lenses, line v of all its lenses, v after v) and offers each
-- line as soon as the raw lines that it needs have arrived. At the beginning of a frame it copies the registers of the
-- grid.
--
-- Line v of lens row t needs the raw lines from floor(y + v line) + reach_up to floor(y + v line) + reach_down + 1,
-- mirrored at the borders; y is the position of the row's first lens, line the step from line to line: one raw line,
-- or with SKEWED a register. The ring keeps raw lines from the first one that this or a later line needs. A frame is
-- abandoned with a fault if its grid needs more lines than the ring has or has no lens, or if the frame has a single
-- line or column or more than 8192 lines. The rest of a frame that was cut short is abandoned too.
--
-- Latency: REGISTER_COUNT + 9 clocks from a frame that waits to the offer of its first line; 5 clocks from line to
-- line.
-- Throughput: a line of the raster in 6 clocks or more.
-- Equation: y(t + 1) = y(t) + down(t mod 2); x likewise.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity lens_rows is
  generic (
    -- M, pixels of a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive;
    -- true: rows of lenses are interpolated to a rectangular raster.
    HEXAGONAL : boolean := false;
    -- true: registers hold the steps between the lines and between the pixels of a micro image.
    SKEWED : boolean := false;
    -- Lines that the ring holds.
    LINES : positive range 4 to 256;
    -- Fraction bits of positions.
    FRACTION_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The load port; only registers and commits are used here.
    load : in    load_t;
    -- The first pixel of a frame is taken; the frame begins to come in; its size.
    frame_accepted : in    std_logic;
    frame_start    : in    std_logic;
    columns        : in    std_logic_vector(15 downto 0);
    rows           : in    std_logic_vector(15 downto 0);
    -- The ring's state from raw_writer, and what the reader needs of it.
    ring : in    ring_state_t;
    need : out   ring_need_t;
    -- line_valid: a line of the raster is on offer; line_taken: it was taken; at_rest: lens_walk is on no line;
    -- drained: all pixels have left.
    raster_line : out   raster_line_t;
    line_valid  : out   std_logic;
    line_taken  : in    std_logic;
    at_rest     : in    std_logic;
    drained     : in    std_logic;
    -- The frame that is processed, and its registers.
    frame     : out   raw_frame_t;
    registers : out   registers_t;
    -- Size of the frame's raster; between frames that of the last one.
    raster_columns : out   std_logic_vector(15 downto 0);
    raster_rows    : out   std_logic_vector(15 downto 0);
    -- High for one clock: a frame was abandoned for its grid or its size, or a commit came before all registers.
    fault : out   std_logic
  );
end entity lens_rows;

architecture rtl of lens_rows is

  -- Registers of a grid, and the fewest lenses of a row.
  constant GRID_REGISTERS : positive := choose(HEXAGONAL or SKEWED, REGISTER_COUNT, REGISTER_BLACK + 1);
  constant LEAST_LENSES   : positive := choose(HEXAGONAL, 2, 1);
  constant MOST_LINES     : positive := 8192;

  -- idle: no frame. fetch: copies registers. start: first row of lenses. borders, reach, check: compute which raw lines
  -- the next line of the raster needs. wait_lines: until these are in. offer: until the line is taken. finish: until
  -- all pixels are out.
  type state_t is (idle, fetch, start, borders, reach, check, wait_lines, offer, finish);

  signal state : state_t := idle;

  signal copy       : std_logic;
  signal copied     : std_logic;
  signal incomplete : std_logic;
  signal held       : registers_t;
  signal given_up   : std_logic := '0';

  -- Size of the frame that came in last.
  signal waiting_columns : place_t := (others => '0');
  signal waiting_rows    : place_t := (others => '0');

  -- The size of the raster at the ports.
  signal columns_now : unsigned(15 downto 0) := (others => '0');
  signal rows_now    : unsigned(15 downto 0) := (others => '0');

  -- The current frame, and whether it can be resampled. A line has at least two columns, because the ring reads
  -- neighbours.
  signal base_now    : place_t   := (others => '0');
  signal bottom_line : place_t   := (others => '0');
  signal last_place  : place_t   := to_signed(1, place_t'length);
  signal size_fits   : std_logic := '0';
  signal possible    : std_logic;

  -- The next line of the raster: position of its row's first lens, of the line in that lens, its row of lenses, its
  -- number in the row, its table addresses.
  signal y            : position_t                                         := (others => '0');
  signal x            : position_t                                         := (others => '0');
  signal line_y       : position_t                                         := (others => '0');
  signal line_x       : position_t                                         := (others => '0');
  signal row_index    : place_t                                            := (others => '0');
  signal row_odd      : std_logic                                          := '0';
  signal row_lens     : lens_t                                             := (others => '0');
  signal first_line   : std_logic                                          := '0';
  signal line_index   : natural range 0 to larger(MICRO_IMAGE_SIZE - 1, 1) := 0;
  signal line_profile : profile_t                                          := (others => '0');
  signal row_ends     : std_logic;
  signal last_row     : std_logic;
  -- The raw line at the next line of the raster.
  signal line_row : place_t;

  -- The least and the largest number of raw lines from one row of lenses to the next. From the first line of a row of
  -- lenses: to the first raw line that the next row needs (next_top), to the last that this row and that the next row
  -- need (row_bottom, next_bottom).
  signal gap         : place_t := (others => '0');
  signal stride      : place_t := (others => '0');
  signal next_top    : place_t := (others => '0');
  signal row_bottom  : place_t := (others => '0');
  signal next_bottom : place_t := (others => '0');

  -- Raw lines that the next line of the raster needs (top, bottom), mirrored at the borders (needed); raw lines to keep
  -- for it and later ones (oldest, last_kept, kept); lines that are kept now.
  signal top       : place_t   := (others => '0');
  signal bottom    : place_t   := (others => '0');
  signal oldest    : place_t   := (others => '0');
  signal last_kept : place_t   := (others => '0');
  signal needed    : place_t   := (others => '0');
  signal kept      : place_t   := (others => '0');
  signal keep_now  : place_t   := (others => '0');
  signal offered   : std_logic := '0';

  -- The integer part of a position: a line of the sensor.
  function whole (
    position : std_logic_vector
  ) return place_t is
  begin

    return resize(shift_right(signed(position), FRACTION_BITS), place_t'length);

  end function whole;

  function smaller (
    a : place_t;
    b : place_t
  ) return place_t is
  begin

    if a < b then
      return a;
    end if;

    return b;

  end function smaller;

  function larger_place (
    a : place_t;
    b : place_t
  ) return place_t is
  begin

    if a < b then
      return b;
    end if;

    return a;

  end function larger_place;

begin

  line_row       <= whole(std_logic_vector(line_y));
  registers      <= held;
  frame          <= (base_now, bottom_line, last_place);
  need.keep      <= keep_now;
  raster_columns <= std_logic_vector(columns_now);
  raster_rows    <= std_logic_vector(rows_now);
  line_valid     <= offered;
  fault          <= given_up or incomplete;

  copy <= '1' when state = fetch else
          '0';
  -- A grid needs at least one row, and in each row as many lenses as the interpolation of rows needs.
  possible <= '1' when size_fits = '1' and unsigned(held(REGISTER_LENSES)(15 downto 0)) /= 0 and
                       unsigned(held(REGISTER_LENSES)(31 downto 16)) >= LEAST_LENSES else
              '0';
  -- row_ends: the last line of the row of lenses; then the grid's last row.
  row_ends <= '1' when line_index = MICRO_IMAGE_SIZE - 1 else
              '0';
  last_row <= '1' when row_index + 1 = signed(held(REGISTER_LENSES)(15 downto 0)) else
              '0';

  calibrations : entity work.lens_registers
    generic map (
      NEEDED => GRID_REGISTERS
    )
    port map (
      clk            => clk,
      load           => load,
      incomplete     => incomplete,
      frame_accepted => frame_accepted,
      frame_start    => frame_start,
      copy           => copy,
      copied         => copied,
      registers      => held
    );

  upright_lines : if not SKEWED generate

    -- The next line of a micro image lies a raw line further down, whatever the grid's rotation: micro images are
    -- sampled along the sensor's axes.
    line_y <= y + shift_left(to_signed(line_index, position_t'length), FRACTION_BITS);
    line_x <= x;

  end generate upright_lines;

  skewed_lines : if SKEWED generate

    -- The lines of a micro image lean over with the columns of lenses.
    lean : process (clk) is
    begin

      if rising_edge(clk) then
        if state = start then
          line_y <= signed(held(REGISTER_ORIGIN_Y));
          line_x <= signed(held(REGISTER_ORIGIN_X));
        elsif state = offer and line_taken = '1' then
          if row_ends = '1' then
            -- Rows of even and of odd number have the same step: the second axis does not alternate.
            line_y <= y + signed(held(REGISTER_DOWN_EVEN_Y));
            line_x <= x + signed(held(REGISTER_DOWN_EVEN_X));
          else
            line_y <= line_y + signed(held(REGISTER_LINE_Y));
            line_x <= line_x + signed(held(REGISTER_LINE_X));
          end if;
        end if;
      end if;

    end process lean;

  end generate skewed_lines;

  -- The size of a frame is known when it begins to arrive, which may be before the last frame is finished.
  take_size : process (clk) is
  begin

    if rising_edge(clk) then
      if frame_start = '1' then
        waiting_columns <= signed(columns);
        waiting_rows    <= signed(rows);
      end if;
      -- The size is taken over with the frame: until then the registers describe the frame that is still processed.
      if state = idle and ring.frame_waits = '1' then
        bottom_line <= waiting_rows - 1;
        last_place  <= larger_place(waiting_columns - 1, to_signed(1, place_t'length));
        size_fits   <= to_logic(waiting_columns > 1 and waiting_rows > 1 and waiting_rows <= MOST_LINES);
      end if;
    end if;

  end process take_size;

  follow_frame : process (clk) is
  begin

    if rising_edge(clk) then
      need.frame_taken <= '0';
      given_up         <= '0';
      need.keep_none   <= '0';

      case state is

        when idle =>

          -- Without a frame the whole ring may be overwritten; a frame that waits is kept from its first line on.
          if ring.frame_waits = '1' then
            base_now <= ring.frame_base;
            keep_now <= ring.frame_base;
            state    <= fetch;
          else
            need.keep_none <= '1';
          end if;

        when fetch =>

          if copied = '1' then
            columns_now      <= resize(unsigned(held(REGISTER_OUTPUTS)(15 downto 0)) * MICRO_IMAGE_SIZE, 16);
            rows_now         <= resize(unsigned(held(REGISTER_LENSES)(15 downto 0)) * MICRO_IMAGE_SIZE, 16);
            need.frame_taken <= '1';
            state            <= start;
          end if;

        when start =>

          -- A frame from which no raster can be made is left out, and the next one is tried.
          state <= borders;
          if possible = '0' then
            given_up <= '1';
            state    <= finish;
          end if;

        when borders =>

          state <= reach;

        when reach =>

          state <= check;

        -- A line of the raster that needs more raw lines at once than the ring holds would wait for ever.
        when check =>

          state <= wait_lines;
          -- kept and needed are the first and the last raw line; the ring holds LINES between them.
          if needed - kept >= LINES then
            given_up <= '1';
            state    <= finish;
          end if;

        -- Lines above `kept` are released only while lens_walk is on no line: a walk that still reads the line before
        -- may need them.
        when wait_lines =>

          if at_rest = '1' then
            keep_now <= base_now + kept;
          end if;
          if ring.lines_in > needed then
            offered <= '1';
            state   <= offer;
          elsif ring.frame_waits = '1' then
            -- The frame was cut short.
            state <= finish;
          end if;

        when offer =>

          if line_taken = '1' then
            keep_now <= base_now + kept;
            offered  <= '0';
            state    <= borders;
            if row_ends = '1' and last_row = '1' then
              state <= finish;
            end if;
          end if;

        -- The next frame overwrites registers and raw lines, so all pixels must have left.
        when finish =>

          if at_rest = '1' and drained = '1' then
            state <= idle;
          end if;

      end case;

      if reset = '1' then
        state    <= idle;
        offered  <= '0';
        given_up <= '0';
      end if;
    end if;

  end process follow_frame;

  -- Steps to the next line when a line is taken.
  step_lines : process (clk) is
  begin

    if rising_edge(clk) then
      -- A frame begins with its grid's first lens.
      if state = start then
        y            <= signed(held(REGISTER_ORIGIN_Y));
        x            <= signed(held(REGISTER_ORIGIN_X));
        row_index    <= (others => '0');
        row_odd      <= '0';
        row_lens     <= (others => '0');
        first_line   <= '1';
        line_index   <= 0;
        line_profile <= (others => '0');
      elsif state = offer and line_taken = '1' then
        first_line <= '0';
        -- The next row of lenses lies a step further on, by one of two alternating steps.
        if row_ends = '1' then
          line_index   <= 0;
          line_profile <= (others => '0');
          row_index    <= row_index + 1;
          row_odd      <= not row_odd;
          row_lens     <= row_lens + resize(unsigned(held(REGISTER_LENSES)(31 downto 16)), lens_t'length);
          if row_odd = '0' then
            y <= y + signed(held(REGISTER_DOWN_EVEN_Y));
            x <= x + signed(held(REGISTER_DOWN_EVEN_X));
          else
            y <= y + signed(held(REGISTER_DOWN_ODD_Y));
            x <= x + signed(held(REGISTER_DOWN_ODD_X));
          end if;
        else
          -- The next line of the same lenses: the profile's address moves on by a line.
          line_index   <= line_index + 1;
          line_profile <= line_profile + MICRO_IMAGE_SIZE;
        end if;
      end if;
    end if;

  end process step_lines;

  -- All registers are there a clock before the state start, so distances that follow from them in two clocks are there
  -- for the first line. Sums that are the same for all lines are made here, in front of the longest additions.
  find_distances : process (clk) is

    variable reach_down : place_t;

  begin

    if rising_edge(clk) then
      -- The pitch of rows varies if rows are staggered: the ring must serve the smaller and the larger one.
      gap    <= smaller(whole(held(REGISTER_DOWN_EVEN_Y)), whole(held(REGISTER_DOWN_ODD_Y)));
      stride <= larger_place(whole(held(REGISTER_DOWN_EVEN_Y)), whole(held(REGISTER_DOWN_ODD_Y))) + 1;

      reach_down := signed(held(REGISTER_REACH)(31 downto 16));
      next_top   <= gap + signed(held(REGISTER_REACH)(15 downto 0));
      -- With SKEWED the lines of a row end where the next row begins; positions and steps were rounded down.
      row_bottom  <= reach_down + MICRO_IMAGE_SIZE;
      next_bottom <= reach_down + MICRO_IMAGE_SIZE + stride;
      if SKEWED then
        row_bottom  <= reach_down + stride + 1;
        next_bottom <= reach_down + stride + stride + 1;
      end if;
    end if;

  end process find_distances;

  -- The line, and 2 clocks later the raw lines that it needs.
  find_needs : process (clk) is

    variable first_row  : place_t;
    variable reach_up   : place_t;
    variable reach_down : place_t;
    variable bottom_row : place_t;

  begin

    if rising_edge(clk) then
      raster_line.y       <= line_y;
      raster_line.x       <= line_x;
      raster_line.lens    <= row_lens;
      raster_line.profile <= line_profile;
      raster_line.first   <= first_line;

      first_row  := whole(std_logic_vector(y));
      reach_up   := signed(held(REGISTER_REACH)(15 downto 0));
      reach_down := signed(held(REGISTER_REACH)(31 downto 16));
      -- Computed in two clocks (borders, reach), for which the state waits: the additions are wide and off the path of
      -- pixels.
      top    <= line_row + reach_up;
      bottom <= line_row + 1 + reach_down;
      -- The next row of lenses may begin above the last line of this one.
      oldest <= smaller(line_row + reach_up, first_row + next_top);
      -- The last raw line that the last line of this row of lenses, or of the next one, needs, mirrored at the last raw
      -- line.
      bottom_row := first_row + next_bottom;
      if last_row = '1' then
        bottom_row := first_row + row_bottom;
      end if;
      last_kept <= shift_left(bottom_line, 1) - bottom_row;

      -- A line above the first raw line is mirrored to one below it; the lower of both is needed.
      if bottom < -top then
        needed <= smaller(-top, bottom_line);
      else
        needed <= smaller(bottom, bottom_line);
      end if;
      kept <= larger_place(smaller(oldest, last_kept), (others => '0'));
    end if;

  end process find_needs;

end architecture rtl;
