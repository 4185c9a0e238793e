-- Switch control: which taps add the pixels of the current step.
--
-- Steps through the rows of the switch table, one phase each step, and keeps neighbouring
-- lines (for a column filter: frames) apart without a gap between them. The position of a tap
-- tells the output that its partial sum belongs to: at the first step, taps above
-- TAPS-1-DELAY hold the tail of the line before. A mask opens their switches and moves up by
-- one tap each step, while `restart` tells the filter to drop what the lower taps hold.
--
-- Latency: 1 clock after advance; the outputs hold until the next advance.
-- Throughput: one step each clock.
-- Ports: advance begins a step, first marks the first step of a line; closed are the switches,
--   restart marks the first step.
-- Equation: closed(w) = table(phase)(w) and (w <= position + TAPS-1-DELAY).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.refocus_pkg.all;

entity switch_control is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- a' in pixels.
    SHIFT : integer;
    -- tap_count of the two above.
    TAPS : positive;
    -- output_delay: steps from a pixel to the output of the same index.
    DELAY : natural
  );
  port (
    clk     : in    std_logic;
    advance : in    std_logic;
    first   : in    std_logic;
    closed  : out   std_logic_vector(0 to TAPS - 1);
    restart : out   std_logic
  );
end entity switch_control;

architecture rtl of switch_control is

  constant PHASE_BITS : positive := bits_for(MICRO_IMAGE_SIZE - 1);

  -- The taps of the current line at its first step.
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

  signal phase      : unsigned(PHASE_BITS - 1 downto 0) := (others => '0');
  signal phase_next : unsigned(PHASE_BITS - 1 downto 0);
  signal mask       : std_logic_vector(0 to TAPS - 1)   := (others => '1');
  signal switches   : std_logic_vector(0 to TAPS - 1);

begin

  phase_next <= (others => '0') when first = '1' or phase = MICRO_IMAGE_SIZE - 1 else
                phase + 1;

  step : process (clk) is
  begin

    if rising_edge(clk) then
      if advance = '1' then
        phase   <= phase_next;
        restart <= first;
        if first = '1' then
          mask <= FIRST_STEP;
        else

          for w in 1 to TAPS - 1 loop

            mask(w) <= mask(w - 1);

          end loop;

        end if;
      end if;
    end if;

  end process step;

  rows : entity work.switch_table
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFT            => SHIFT,
      TAPS             => TAPS
    )
    port map (
      clk    => clk,
      enable => advance,
      phase  => phase_next,
      closed => switches
    );

  closed <= switches and mask;

end architecture rtl;
