-- SPDX-License-Identifier: Apache-2.0
-- Test bench of pattern_video: a refocused picture of each slice, each pixel against the definition.
--
-- It reports "PASS" and stops its clock, or fails at the first wrong pixel.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.definition_pkg.all;
use work.video_pkg.all;

entity tb_pattern_video is
end entity tb_pattern_video;

architecture bench of tb_pattern_video is

  type shifts_t is array (natural range <>) of integer;

  constant M       : positive := 3;
  constant SHIFTS  : shifts_t := (0, 4);
  constant COLUMNS : positive := 27;
  constant ROWS    : positive := 15;
  constant PIXELS  : positive := COLUMNS * ROWS;
  -- Pictures that are skipped behind a change: those on their way.
  constant SKIPPED : positive := 2;
  constant TIMING  : timing_t := mode_timing("tb_pattern_video", COLUMNS, 6, 6, 9, ROWS, 3, 2, 6, false, false);

  signal clk       : std_logic                    := '0';
  signal reset     : std_logic                    := '1';
  signal done      : boolean                      := false;
  signal slice     : std_logic_vector(7 downto 0) := x"00";
  signal in_video  : video_t;
  signal out_video : video_t;
  signal following : std_logic;
  signal errors    : std_logic_vector(3 downto 0);

begin

  clk <= not clk after 5 ns when not done else
         '0';

  reset <= '0' after 22 ns;

  dut : entity work.pattern_video
    port map (
      clk       => clk,
      reset     => reset,
      timing    => TIMING,
      slice     => slice,
      in_video  => in_video,
      out_video => out_video,
      following => following,
      errors    => errors
    );

  check : process (clk) is

    -- The picture never changes: it is read once, from the first line on.
    variable red      : pixels_t(0 to PIXELS - 1);
    variable read     : natural   := 0;
    variable clocks   : natural   := 0;
    variable pictures : natural   := 0;
    variable place    : natural   := 0;
    variable sync     : std_logic := '0';
    variable chosen   : natural   := 0;

  begin

    if rising_edge(clk) then
      clocks := clocks + 1;
      if in_video.active = '1' and read < PIXELS then
        red(read) := to_integer(unsigned(in_video.pixel(7 downto 0)));
        read      := read + 1;
      end if;

      if following = '1' then
        assert errors = "0000"
          report "FAIL: errors of the video path"
          severity failure;
        if out_video.active = '1' then
          assert pictures <= SKIPPED
                 or to_integer(unsigned(out_video.pixel(7 downto 0))) =
                    refocused(red, COLUMNS, M, SHIFTS(chosen), place / COLUMNS, place mod COLUMNS)
            report "FAIL: slice " & integer'image(chosen) & ", row " & integer'image(place / COLUMNS) & ", column " &
                   integer'image(place mod COLUMNS)
            severity failure;
          place := place + 1;
        end if;
        -- The sync's begin is the border between two pictures.
        if out_video.v_sync = '0' and sync = '1' then
          if pictures > SKIPPED then
            assert place = PIXELS
              report "FAIL: a picture of " & integer'image(place) & " pixels"
              severity failure;
            report "slice " & integer'image(chosen) & " is right";
            if chosen = SHIFTS'high then
              report "PASS: a picture of " & integer'image(COLUMNS) & " x " & integer'image(ROWS) &
                     " pixels for each slice";
              done <= true;
            end if;
            chosen   := chosen + 1;
            pictures := 0;
            slice    <= std_logic_vector(to_unsigned(chosen, 8));
          end if;
          pictures := pictures + 1;
          place    := 0;
        end if;
      end if;
      sync := out_video.v_sync;
      assert clocks < 200000
        report "FAIL: no refocused pictures"
        severity failure;
    end if;

  end process check;

end architecture bench;
