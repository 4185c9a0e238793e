-- SPDX-License-Identifier: Apache-2.0
-- The column memory of a focal stack: the lines of each phase as a shift register of pixels.
--
-- One word for each column and phase holds the pixels of the phase's last lines. When a line arrives, the word that
-- was read is written back, shifted by one place, with the new pixel in front. All words of a column are read at
-- once, so any number of slices find their pixels, and the column is the only address.
--
-- Latency: 2 clocks. Throughput: one column each clock; one column comes at least 3 clocks apart.
-- Equation: history(phase) = history(phase) moved one place on & pixel.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.focal_stack_pkg.all;

entity line_history is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Longest line in pixels.
    COLUMNS : positive;
    -- Width of a pixel, all channels.
    PIXEL_BITS : positive
  );
  port (
    clk : in    std_logic;
    -- The column to read.
    column : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    -- 2 clocks behind the address: whether a pixel comes in, its line's phase, its column, and the pixel.
    active   : in    std_logic;
    phase    : in    natural range 0 to larger(GEOMETRY.micro_image_size - 1, 1);
    column_2 : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    pixel    : in    std_logic_vector(PIXEL_BITS - 1 downto 0);
    -- 2 clocks behind the address: the pixels of all phases before this one; phase 0, and the newest line of a
    -- phase, in the low bits.
    history : out   std_logic_vector(history_word_bits(GEOMETRY, PIXEL_BITS) - 1 downto 0)
  );
end entity line_history;

architecture rtl of line_history is

  type lines_t is array (natural range 0 to GEOMETRY.micro_image_size) of natural;

  -- Lines of all phases in front of each phase.
  function lines_before return lines_t is

    variable before : lines_t;

  begin

    before(0) := 0;

    for v in 0 to GEOMETRY.micro_image_size - 1 loop

      before(v + 1) := before(v) + history_lines(GEOMETRY, v);

    end loop;

    return before;

  end function lines_before;

  constant BEFORE : lines_t := lines_before;

begin

  history(history'high) <= '0';

  every_phase : for v in 0 to GEOMETRY.micro_image_size - 1 generate

    constant LINES : natural  := BEFORE(v + 1) - BEFORE(v);
    constant FIRST : natural  := BEFORE(v) * PIXEL_BITS;
    constant WIDTH : positive := choose(LINES = 0, 1, LINES * PIXEL_BITS);

  begin

    kept : if LINES > 0 generate

      signal word         : std_logic_vector(WIDTH - 1 downto 0);
      signal moved        : std_logic_vector(WIDTH + PIXEL_BITS - 1 downto 0);
      signal write_enable : std_logic;

    begin

      -- Each column has a shift register of lines: read, shifted by the new pixel, written back two clocks
      -- later. A line moves only its own phase, so each phase's memory is written once in M lines.
      moved        <= word & pixel;
      write_enable <= active when phase = v else
                      '0';

      words : entity work.ram_simple_dual_port
        generic map (
          WIDTH => WIDTH,
          WORDS => COLUMNS
        )
        port map (
          clk           => clk,
          write_enable  => write_enable,
          write_address => column_2,
          write_data    => moved(WIDTH - 1 downto 0),
          read_address  => column,
          read_data     => word
        );

      history(FIRST + WIDTH - 1 downto FIRST) <= word;

    end generate kept;

  end generate every_phase;

end architecture rtl;
