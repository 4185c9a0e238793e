-- SPDX-License-Identifier: Apache-2.0
-- Switch control: selects the taps that add the pixels of the current step.
--
-- The control steps through the rows of the switch table, one phase each step. Lines (for a column filter: frames)
-- may follow each other without a gap: the number of a tap tells which output its partial sum belongs to. At the
-- first step of a line, taps above TAPS-1-DELAY hold the tail of the line before. A mask opens their switches and
-- moves up by one tap each step; `restart` tells the filter to drop the sums of the lower taps.
--
-- Latency: 1 clock from advance; the outputs hold until the next advance.
-- Throughput: one step each clock.
-- Equation: closed(w) = live and table(slice, phase)(w) and (w <= position + TAPS-1-DELAY).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.fir_pkg.all;

entity switch_control is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- true: the first output of a micro image is held for its others, which are equal.
    HOLD : boolean
  );
  port (
    clk : in    std_logic;
    -- A step begins.
    advance : in    std_logic;
    -- The first step of a line, which reads slice.
    first : in    std_logic;
    -- The step has a pixel to add.
    live : in    std_logic;
    -- The slice of the line.
    slice : in    unsigned(bits_for(GEOMETRY.slices - 1) - 1 downto 0);
    -- '1' closes the switch of a tap.
    closed : out   std_logic_vector(0 to tap_count(GEOMETRY, HOLD) - 1);
    -- The first step of a line.
    restart : out   std_logic;
    -- HOLD only: the output of the step is new; in other steps it is repeated.
    update : out   std_logic
  );
end entity switch_control;

architecture rtl of switch_control is

  constant TAPS       : positive := tap_count(GEOMETRY, HOLD);
  constant DELAY      : natural  := GEOMETRY.output_delay;
  constant PHASE_BITS : positive := bits_for(GEOMETRY.micro_image_size - 1);

  -- Taps that belong to the current line at its first step.
  function first_mask return std_logic_vector is

    variable mask : std_logic_vector(0 to TAPS - 1);

  begin

    for w in mask'range loop

      if w <= TAPS - 1 - DELAY then
        mask(w) := '1';
      else
        mask(w) := '0';
      end if;

    end loop;

    return mask;

  end function first_mask;

  constant FIRST_STEP : std_logic_vector(0 to TAPS - 1) := first_mask;

  -- The phase of the line's pixel, and its slice. Both change only with a step, so idle clocks and empty tokens
  -- leave them.
  signal phase      : unsigned(PHASE_BITS - 1 downto 0) := (others => '0');
  signal phase_next : unsigned(PHASE_BITS - 1 downto 0);
  signal slice_held : unsigned(slice'range)             := (others => '0');
  signal slice_next : unsigned(slice'range);
  -- Taps whose sums belong to the current line: at its begin those at one end, then one more with each step.
  signal mask      : std_logic_vector(0 to TAPS - 1) := (others => '1');
  signal next_mask : std_logic_vector(0 to TAPS - 1);
  signal live_held : std_logic                       := '0';
  signal switches  : std_logic_vector(0 to TAPS - 1);

begin

  -- M need not be a power of two, so the phase is counted and compared. A line always begins at phase 0.
  phase_next <= (others => '0') when first = '1' or phase = GEOMETRY.micro_image_size - 1 else
                phase + 1;

  -- The slice changes only with a line: the filters hold sums of two lines at once, each with its own switches.
  slice_next <= slice when first = '1' else
                slice_held;

  -- Tap 0 always belongs to the current line.
  next_mask(0) <= '1';

  move_mask : for w in 1 to TAPS - 1 generate
    next_mask(w) <= mask(w - 1);
  end generate move_mask;

  step : process (clk) is
  begin

    if rising_edge(clk) then
      if advance = '1' then
        phase      <= phase_next;
        slice_held <= slice_next;
        restart    <= first;
        live_held  <= live;
        -- The boundary between two lines moves up through the filter, by one tap each step.
        if first = '1' then
          mask <= FIRST_STEP;
        else
          mask <= next_mask;
        end if;
      end if;
    end if;

  end process step;

  rows : entity work.switch_table
    generic map (
      GEOMETRY => GEOMETRY,
      HOLD     => HOLD
    )
    port map (
      clk    => clk,
      enable => advance,
      slice  => slice_next,
      phase  => phase_next,
      closed => switches
    );

  -- A step without a pixel adds nothing but moves the sums on, which lets the last ones out.
  closed <= switches and mask when live_held = '1' else
            (others => '0');

  -- The output of step t is new if t is a multiple of M.
  hold_output : if HOLD generate

    -- Mark of a new output, from the step of its pixel to its own step.
    signal new_at : std_logic_vector(0 to DELAY + 1) := (others => '0');

  begin

    new_at(0) <= '1' when phase_next = 0 else
                 '0';

    delay_update : process (clk) is
    begin

      if rising_edge(clk) then
        -- New outputs come DELAY steps behind their pixels, and so do their marks.
        if advance = '1' then
          new_at(1 to DELAY + 1) <= new_at(0 to DELAY);
        end if;
      end if;

    end process delay_update;

    update <= new_at(DELAY + 1);

  end generate hold_output;

  every_output : if not HOLD generate
    update <= '1';
  end generate every_output;

end architecture rtl;
