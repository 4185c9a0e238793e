-- Switch table: a ROM with one row of switch states for each phase of a micro image.
--
-- Latency: 1 clock after enable. Throughput: one row each clock.
-- Ports: enable loads the row of phase; closed(w) = '1' closes the switch of tap w, and holds
--   until the next enable.
-- Equation: closed(w) = 1 for the M neighbouring taps whose delay TAPS-1-w lies in
--   phase*(SHIFT-1) + origin + (0 .. M-1).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.refocus_pkg.all;

entity switch_table is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- a' in pixels.
    SHIFT : integer;
    -- tap_count of the two above.
    TAPS : positive
  );
  port (
    clk    : in    std_logic;
    enable : in    std_logic;
    phase  : in    unsigned(bits_for(MICRO_IMAGE_SIZE - 1) - 1 downto 0);
    closed : out   std_logic_vector(0 to TAPS - 1)
  );
end entity switch_table;

architecture rtl of switch_table is

  -- A power of two rows, so that every address exists.
  type rows_t is array (natural range 0 to 2 ** phase'length - 1) of std_logic_vector(0 to TAPS - 1);

  function all_rows return rows_t is

    variable rows : rows_t;

  begin

    rows := (others => (others => '0'));

    for p in 0 to MICRO_IMAGE_SIZE - 1 loop

      for w in 0 to TAPS - 1 loop

        if is_closed(MICRO_IMAGE_SIZE, SHIFT, p, w) then
          rows(p)(w) := '1';
        end if;

      end loop;

    end loop;

    return rows;

  end function all_rows;

  constant ROWS : rows_t := all_rows;

begin

  look_up : process (clk) is
  begin

    if rising_edge(clk) then
      if enable = '1' then
        closed <= ROWS(to_integer(phase));
      end if;
    end if;

  end process look_up;

end architecture rtl;
