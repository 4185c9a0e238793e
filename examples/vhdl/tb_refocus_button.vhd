-- SPDX-License-Identifier: Apache-2.0
-- Test bench of refocus_button: random frames through every slice, each pixel against the definition.
--
-- Both sides pause. It reports "PASS" and stops its clock, or fails at the first wrong pixel.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.definition_pkg.all;

entity tb_refocus_button is
end entity tb_refocus_button;

architecture bench of tb_refocus_button is

  type shifts_t is array (natural range <>) of integer;

  constant M       : positive := 5;
  constant SHIFTS  : shifts_t := (-5, 0, 5);
  constant COLUMNS : positive := 23;
  constant ROWS    : positive := 15;
  constant FRAMES  : positive := SHIFTS'length + 1;
  constant PIXELS  : positive := COLUMNS * ROWS;

  -- Pseudo-random pixels.
  function random_pixels (
    count : positive
  ) return pixels_t is

    variable found : pixels_t(0 to count - 1);
    variable state : natural := 1;

  begin

    for i in found'range loop

      state    := (state * 1103 + 12345) mod 65536;
      found(i) := state / 256;

    end loop;

    return found;

  end function random_pixels;

  constant SENT : pixels_t(0 to FRAMES * PIXELS - 1) := random_pixels(FRAMES * PIXELS);

  signal clk         : std_logic                    := '0';
  signal reset       : std_logic                    := '1';
  signal done        : boolean                      := false;
  signal button      : std_logic                    := '0';
  signal in_valid    : std_logic                    := '0';
  signal in_ready    : std_logic;
  signal in_data     : std_logic_vector(7 downto 0) := x"00";
  signal in_first    : std_logic_vector(0 downto 0) := "0";
  signal in_last     : std_logic                    := '0';
  signal out_valid   : std_logic;
  signal out_ready   : std_logic                    := '0';
  signal out_data    : std_logic_vector(7 downto 0);
  signal out_first   : std_logic_vector(0 downto 0);
  signal out_slice   : std_logic_vector(7 downto 0);
  signal out_last    : std_logic;
  signal error_flags : std_logic_vector(4 downto 0);

begin

  clk <= not clk after 5 ns when not done else
         '0';

  dut : entity work.refocus_button
    port map (
      clk           => clk,
      reset         => reset,
      columns       => std_logic_vector(to_unsigned(COLUMNS, 16)),
      rows          => std_logic_vector(to_unsigned(ROWS, 16)),
      button        => button,
      s_axis_tvalid => in_valid,
      s_axis_tready => in_ready,
      s_axis_tdata  => in_data,
      s_axis_tuser  => in_first,
      s_axis_tlast  => in_last,
      m_axis_tvalid => out_valid,
      m_axis_tready => out_ready,
      m_axis_tdata  => out_data,
      m_axis_tuser  => out_first,
      m_axis_tid    => out_slice,
      m_axis_tlast  => out_last,
      error_flags   => error_flags
    );

  source : process (clk) is

    variable fed : natural := 0;

  begin

    if rising_edge(clk) then
      reset <= '0';
      if reset = '0' and (in_valid = '0' or in_ready = '1') then
        in_valid <= '0';
        -- A pause before every seventh pixel.
        if fed < FRAMES * PIXELS and (fed mod 7 /= 6 or in_valid = '0') then
          in_valid    <= '1';
          in_data     <= std_logic_vector(to_unsigned(SENT(fed), 8));
          in_first(0) <= bit_of(fed mod PIXELS = 0);
          in_last     <= bit_of(fed mod COLUMNS = COLUMNS - 1);
          fed         := fed + 1;
        end if;
      end if;
      -- Pressed in the middle of each frame: the next one comes with the next slice.
      button <= bit_of(fed mod PIXELS > PIXELS / 2);
    end if;

  end process source;

  sink : process (clk) is

    variable clocks : natural := 0;
    variable found  : natural := 0;
    variable frame  : natural;
    variable row    : natural;
    variable column : natural;
    variable slice  : natural;
    variable want   : natural;

  begin

    if rising_edge(clk) then
      clocks    := clocks + 1;
      out_ready <= bit_of(clocks mod 5 /= 0);
      if out_valid = '1' and out_ready = '1' then
        frame  := found / PIXELS;
        row    := found mod PIXELS / COLUMNS;
        column := found mod COLUMNS;
        slice  := frame mod SHIFTS'length;
        want   := refocused(SENT(frame * PIXELS to (frame + 1) * PIXELS - 1), COLUMNS, M, SHIFTS(slice), row, column);
        assert to_integer(unsigned(out_data)) = want
               and to_integer(unsigned(out_slice)) = slice
               and out_first(0) = bit_of(found mod PIXELS = 0)
               and out_last = bit_of(column = COLUMNS - 1)
               and error_flags = "00000"
          report "FAIL: frame " & integer'image(frame) & ", row " & integer'image(row) & ", column " &
                 integer'image(column)
          severity failure;
        found  := found + 1;
        if found = FRAMES * PIXELS then
          report "PASS: " & integer'image(FRAMES) & " frames of " & integer'image(COLUMNS) & " x " &
                 integer'image(ROWS) & " pixels";
          done <= true;
        end if;
      end if;
      assert clocks < 10 * FRAMES * PIXELS + 10000
        report "FAIL: only " & integer'image(found) & " pixels came out"
        severity failure;
    end if;

  end process sink;

end architecture bench;
