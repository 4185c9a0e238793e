-- SPDX-License-Identifier: Apache-2.0
-- Goes through the lines of the raster, line v of all lenses of a row of lenses after the other, and offers each as
-- soon as the raw lines that it needs are in.
--
-- It holds the registers of the grid. They are written into a memory of two halves; a commit makes the next frame use
-- what was written. At the beginning of a frame its half is copied, in REGISTER_COUNT clocks. What was written outlives
-- a reset.
--
-- Line v of lens row t needs the raw lines from floor(y) + v + reach_up to floor(y) + v + reach_down + 1, mirrored at
-- the borders, y the position of its first lens. From the first that this line or a later one needs on, raw lines are
-- kept. A grid that needs more lines than there are is given up, with a fault; so is the rest of a frame that was cut
-- short.
--
-- Latency: REGISTER_COUNT + 9 clocks from a frame that waits to the offer of its first line; 5 clocks from line to
--   line.
-- Throughput: a line of the raster in 6 clocks or more.
-- Equation: y(t + 1) = y(t) + down(t mod 2), and x the same.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity lens_rows is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- Lines that the ring holds.
    LINES : positive range 4 to 256;
    -- Fraction bits of positions.
    FRACTION_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Writes a register; commit: the registers are complete.
    load_write   : in    std_logic;
    load_address : in    unsigned(3 downto 0);
    load_data    : in    std_logic_vector(31 downto 0);
    load_commit  : in    std_logic;
    -- A frame begins to come in; its size.
    frame_start : in    std_logic;
    columns     : in    std_logic_vector(15 downto 0);
    rows        : in    std_logic_vector(15 downto 0);
    -- From and to raw_writer.
    frame_waits : in    std_logic;
    frame_base  : in    place_t;
    frame_taken : out   std_logic;
    lines_in    : in    place_t;
    keep        : out   place_t;
    keep_none   : out   std_logic;
    -- A line of the raster; it was taken; no line is walked along; all pixels have left.
    raster_line : out   raster_line_t;
    line_valid  : out   std_logic;
    line_taken  : in    std_logic;
    at_rest     : in    std_logic;
    drained     : in    std_logic;
    -- The frame on work: its registers, number of its line 0, its last line and column.
    registers   : out   registers_t;
    base        : out   place_t;
    last_line   : out   place_t;
    last_column : out   place_t;
    -- Size of its raster; between frames that of the last one.
    raster_columns : out   std_logic_vector(15 downto 0);
    raster_rows    : out   std_logic_vector(15 downto 0);
    -- For a clock: the grid needs more lines than there are, or has no lens.
    fault : out   std_logic
  );
end entity lens_rows;

architecture rtl of lens_rows is

  -- idle: no frame. load: copies registers. start: the first row of lenses. borders, reach, check: which lines the next
  -- line of the raster needs. wait_lines: until they are in. offer: until it is taken. finish: until all is out.
  type state_t is (idle, load, start, borders, reach, check, wait_lines, offer, finish);

  signal state : state_t := idle;

  -- The half that frames use, the half of the frame that waits; a commit waits for a frame.
  signal half        : std_logic            := '0';
  signal committed   : std_logic            := '0';
  signal load_count  : unsigned(4 downto 0) := (others => '0');
  signal write_place : unsigned(4 downto 0);
  signal read_place  : unsigned(4 downto 0);
  signal word        : std_logic_vector(31 downto 0);
  signal held        : registers_t          := (others => (others => '0'));

  -- Size of the frame that came in last.
  signal waiting_columns : place_t := (others => '0');
  signal waiting_rows    : place_t := (others => '0');

  signal columns_now : unsigned(15 downto 0) := (others => '0');
  signal rows_now    : unsigned(15 downto 0) := (others => '0');

  signal base_now    : place_t    := (others => '0');
  signal bottom_line : place_t    := (others => '0');
  signal y           : position_t := (others => '0');
  signal x           : position_t := (others => '0');
  signal row_index   : place_t    := (others => '0');
  signal row_odd     : std_logic  := '0';
  signal row_lens    : lens_t     := (others => '0');
  signal first_line  : std_logic  := '0';

  signal line_index   : natural range 0 to larger(MICRO_IMAGE_SIZE - 1, 1) := 0;
  signal line_profile : profile_t                                          := (others => '0');
  -- Lines from a row of lenses to the next one, at least and at most.
  signal gap       : place_t   := (others => '0');
  signal stride    : place_t   := (others => '0');
  signal top       : place_t   := (others => '0');
  signal bottom    : place_t   := (others => '0');
  signal oldest    : place_t   := (others => '0');
  signal last_kept : place_t   := (others => '0');
  signal needed    : place_t   := (others => '0');
  signal kept      : place_t   := (others => '0');
  signal keep_now  : place_t   := (others => '0');
  signal offered   : std_logic := '0';

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

  registers      <= held;
  base           <= base_now;
  last_line      <= bottom_line;
  keep           <= keep_now;
  raster_columns <= std_logic_vector(columns_now);
  raster_rows    <= std_logic_vector(rows_now);
  line_valid     <= offered;
  write_place    <= not half & load_address;
  read_place     <= half & load_count(3 downto 0);

  follow : process (clk) is

    variable first_row  : place_t;
    variable steps      : place_t;
    variable bottom_row : place_t;

  begin

    if rising_edge(clk) then
      frame_taken <= '0';
      fault       <= '0';
      keep_none   <= '0';

      if load_commit = '1' then
        committed <= '1';
      end if;
      if frame_start = '1' then
        waiting_columns <= signed(columns);
        waiting_rows    <= signed(rows);
        if committed = '1' then
          half      <= not half;
          committed <= '0';
        end if;
      end if;

      first_row := whole(std_logic_vector(y));

      case state is

        when idle =>

          load_count <= (others => '0');
          if frame_waits = '1' then
            base_now    <= frame_base;
            keep_now    <= frame_base;
            bottom_line <= waiting_rows - 1;
            last_column <= waiting_columns - 1;
            state       <= load;
          else
            keep_none <= '1';
          end if;

        when load =>

          -- The memory answers a clock later.
          load_count <= load_count + 1;

          for i in 0 to REGISTER_COUNT - 1 loop

            if load_count = i + 1 then
              held(i) <= word;
            end if;

          end loop;

          if load_count = REGISTER_COUNT then
            columns_now <= resize(unsigned(held(REGISTER_OUTPUTS)(15 downto 0)) * MICRO_IMAGE_SIZE, 16);
            rows_now    <= resize(unsigned(held(REGISTER_LENSES)(15 downto 0)) * MICRO_IMAGE_SIZE, 16);
            frame_taken <= '1';
            state       <= start;
          end if;

        when start =>

          y            <= signed(held(REGISTER_ORIGIN_Y));
          x            <= signed(held(REGISTER_ORIGIN_X));
          row_index    <= (others => '0');
          row_odd      <= '0';
          row_lens     <= (others => '0');
          first_line   <= '1';
          line_index   <= 0;
          line_profile <= (others => '0');
          gap          <= smaller(whole(held(REGISTER_DOWN_EVEN_Y)), whole(held(REGISTER_DOWN_ODD_Y)));
          stride       <= larger_place(whole(held(REGISTER_DOWN_EVEN_Y)), whole(held(REGISTER_DOWN_ODD_Y))) + 1;
          state        <= borders;
          if unsigned(held(REGISTER_LENSES)(15 downto 0)) = 0 or unsigned(held(REGISTER_LENSES)(31 downto 16)) = 0 then
            fault <= '1';
            state <= finish;
          end if;

        when borders =>

          top    <= first_row + line_index + signed(held(REGISTER_REACH)(15 downto 0));
          bottom <= first_row + line_index + 1 + signed(held(REGISTER_REACH)(31 downto 16));
          steps  := to_signed(line_index, place_t'length);
          -- The next row of lenses may begin above the last line of this one.
          oldest <= first_row + smaller(steps, gap) + signed(held(REGISTER_REACH)(15 downto 0));
          -- What the last line of this row of lenses, or of the next one, needs, mirrored at the last raw line.
          bottom_row := first_row + MICRO_IMAGE_SIZE + signed(held(REGISTER_REACH)(31 downto 16));
          if row_index + 1 /= signed(held(REGISTER_LENSES)(15 downto 0)) then
            bottom_row := bottom_row + stride;
          end if;
          last_kept <= shift_left(bottom_line, 1) - bottom_row;

          raster_line.y       <= y + shift_left(to_signed(line_index, position_t'length), FRACTION_BITS);
          raster_line.x       <= x;
          raster_line.lens    <= row_lens;
          raster_line.profile <= line_profile;
          raster_line.first   <= first_line;

          state <= reach;

        when reach =>

          if bottom < -top then
            needed <= smaller(-top, bottom_line);
          else
            needed <= smaller(bottom, bottom_line);
          end if;
          kept  <= larger_place(smaller(oldest, last_kept), (others => '0'));
          state <= check;

        when check =>

          state <= wait_lines;
          if needed - kept >= LINES then
            fault <= '1';
            state <= finish;
          end if;

        when wait_lines =>

          if at_rest = '1' then
            keep_now <= base_now + kept;
          end if;
          if lines_in > needed then
            offered <= '1';
            state   <= offer;
          elsif frame_waits = '1' then
            -- The frame was cut short.
            state <= finish;
          end if;

        when offer =>

          if line_taken = '1' then
            keep_now   <= base_now + kept;
            offered    <= '0';
            first_line <= '0';
            state      <= borders;
            if line_index = MICRO_IMAGE_SIZE - 1 then
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
              if row_index + 1 = signed(held(REGISTER_LENSES)(15 downto 0)) then
                state <= finish;
              end if;
            else
              line_index   <= line_index + 1;
              line_profile <= line_profile + MICRO_IMAGE_SIZE;
            end if;
          end if;

        when finish =>

          if at_rest = '1' and drained = '1' then
            state <= idle;
          end if;

      end case;

      if reset = '1' then
        state   <= idle;
        offered <= '0';
        fault   <= '0';
      end if;
    end if;

  end process follow;

  words : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => 32,
      ADDRESS_BITS => 5,
      READ_LATENCY => 1
    )
    port map (
      clk           => clk,
      write_enable  => load_write,
      write_address => write_place,
      write_data    => load_data,
      read_enable   => '1',
      read_address  => read_place,
      read_data     => word
    );

end architecture rtl;
