-- SPDX-License-Identifier: Apache-2.0
-- Control of a board that shows a stored light field: sweeps the focus to and fro until a key stops it.
--
-- Latency: a key takes effect with the next frame.
-- Equation: slice = 0, 1, .. SLICES - 1, SLICES - 2, .. 0, each for FRAMES frames while sweeping, one further with a
-- step.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.picture_pkg.all;

entity demo_control is
  generic (
    -- Number of slices.
    SLICES : positive range 1 to 256;
    -- Frames for each slice.
    FRAMES : positive range 1 to 255;
    -- Clocks for which a key must be steady.
    BUTTON_STABLE : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Vertical sync of the frames, of either polarity.
    v_sync : in    std_logic;
    -- Keys, active high, from any clock: key_stop stops or continues the sweep; key_step stops it and steps.
    key_stop : in    std_logic;
    key_step : in    std_logic;
    -- What is shown; going: the focus sweeps.
    choice : out   picture_choice_t;
    going  : out   std_logic
  );
end entity demo_control;

architecture rtl of demo_control is

  -- Keys as contacts, and those that became pressed.
  signal keys    : std_logic_vector(1 downto 0);
  signal pressed : std_logic_vector(1 downto 0);

  -- going_now: the focus sweeps; upwards: direction of the next step; the slice that is shown; vertical sync a clock
  -- ago.
  signal going_now   : std_logic                                := '1';
  signal upwards     : std_logic                                := '1';
  signal slice       : natural range 0 to larger(SLICES - 1, 1) := 0;
  signal v_sync_seen : std_logic                                := '0';
  -- Edges of vertical sync, two a frame.
  signal edges : natural range 0 to 2 * FRAMES - 1 := 0;

begin

  keys <= key_step & key_stop;

  contacts : entity work.debouncer
    generic map (
      WIDTH  => 2,
      STABLE => BUTTON_STABLE
    )
    port map (
      clk      => clk,
      contacts => keys,
      pressed  => pressed
    );

  go : process (clk) is

    variable step : boolean;

  begin

    if rising_edge(clk) then
      v_sync_seen <= v_sync;
      step        := pressed(1) = '1';

      if pressed(0) = '1' then
        going_now <= not going_now;
      end if;
      if pressed(1) = '1' then
        going_now <= '0';
      end if;

      -- A sweep that continues begins with a whole interval.
      if going_now = '0' then
        edges <= 0;
      elsif v_sync /= v_sync_seen then
        -- Both edges are counted, so the polarity of the sync does not matter; two edges are a frame.
        if edges < 2 * FRAMES - 1 then
          edges <= edges + 1;
        else
          edges <= 0;
          step  := true;
        end if;
      end if;

      -- There and back: the first and the last slice are shown once each turn, so the focus never jumps from one end to
      -- the other.
      if step and SLICES > 1 then
        if upwards = '1' then
          if slice < SLICES - 1 then
            -- At an end the slice steps inwards at once, because the end was shown already.
            slice <= slice + 1;
          else
            slice   <= slice - 1;
            upwards <= '0';
          end if;
        elsif slice > 0 then
          slice <= slice - 1;
        else
          slice   <= slice + 1;
          upwards <= '1';
        end if;
      end if;

      if reset = '1' then
        going_now <= '1';
        upwards   <= '1';
        slice     <= 0;
        edges     <= 0;
      end if;
    end if;

  end process go;

  going <= going_now;
  -- The core's sweep starts again behind the last slice (slice_select). This sweep turns round, so it is made here, and
  -- the core is asked for single slices.
  choice <=
  (
    pass_through => '0',
    slice        => std_logic_vector(to_unsigned(slice, 8)),
    sweep        => '0',
    sweep_frames => x"01",
    shown        => "00"
  );

end architecture rtl;
