-- SPDX-License-Identifier: Apache-2.0
-- Checks by a marked first line whether a source's picture arrives unchanged, and shows the result in the picture.
--
-- A marked line has another colour at each place (MARK_STEPS, MARK_BEGINS). If it is equal to the last bit, the picture
-- was neither scaled nor moved, and no colour was changed. If it is nearly equal (all channels within NEAR) in most
-- places, colours were changed (range, gamma, colour management). Otherwise there are no marks, or a scaler has
-- destroyed them.
--
-- In the output a bar covers the first LINES lines, where refocused marks would appear: green for equal, red for nearly
-- equal. Without marks the lines stay unchanged.
--
-- Latency: 1 clock from shown_video to out_video; the marks are judged at the end of the first line. Throughput: one
-- pixel each clock.
-- Equation: channel c of place x = MARK_BEGINS(c) + x * MARK_STEPS(c) modulo 256.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.marks_pkg.all;
use work.math_pkg.all;
use work.video_pkg.all;

entity picture_marks is
  generic (
    -- Lines of the bar.
    LINES : positive range 1 to 128 := 5
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Incoming video, full-range RGB.
    in_video : in    video_t;
    -- Outgoing video, without and with the bar.
    shown_video : in    video_t;
    out_video   : out   video_t;
    -- Result for the last first line: 0 no marks, 1 marks with other colours, 2 marks unchanged.
    marks : out   std_logic_vector(1 downto 0)
  );
end entity picture_marks;

architecture rtl of picture_marks is

  subtype balance_t is integer range -2048 to 2047;

  -- About the incoming line: first: it is the frame's first; wanted: the expected colour; balance: places that are
  -- near, less those that are not; and whether one was not equal.
  signal first     : std_logic                    := '1';
  signal active    : std_logic                    := '0';
  signal v_sync    : std_logic                    := '0';
  signal wanted    : mark_colour_t                := MARK_BEGINS;
  signal judged    : std_logic                    := '0';
  signal near_now  : std_logic                    := '0';
  signal equal_now : std_logic                    := '0';
  signal balance   : balance_t                    := 0;
  signal all_equal : std_logic                    := '1';
  signal line_ends : std_logic                    := '0';
  signal marks_now : std_logic_vector(1 downto 0) := "00";
  -- About the outgoing picture: lines that are left of the bar; activity and sync of the clock before.
  signal left        : natural range 0 to LINES := 0;
  signal last_active : std_logic                := '0';
  signal last_sync   : std_logic                := '0';

begin

  marks <= marks_now;

  watch : process (clk) is

    variable close : boolean;
    variable equal : boolean;
    variable value : unsigned(7 downto 0);

  begin

    if rising_edge(clk) then
      active <= in_video.active;
      v_sync <= in_video.v_sync;

      -- Whether the pixel is near, and equal, in all three channels. One bit more keeps the sums from wrapping round.
      close := true;
      equal := true;

      for c in 0 to 2 loop

        value := unsigned(in_video.pixel(8 * c + 7 downto 8 * c));
        if value /= wanted(c) then
          equal := false;
        end if;
        if ('0' & value) > ('0' & wanted(c)) + NEAR or ('0' & wanted(c)) > ('0' & value) + NEAR then
          close := false;
        end if;

      end loop;

      -- Judged a clock later; the end of the line is delayed as much.
      judged    <= in_video.active and first;
      near_now  <= to_logic(close);
      equal_now <= to_logic(equal);
      line_ends <= active and not in_video.active and first;

      -- The next place's colour is a sum modulo 256, so the place needs no multiplication.
      if in_video.active = '1' then

        for c in 0 to 2 loop

          wanted(c) <= wanted(c) + MARK_STEPS(c);

        end loop;

      else
        wanted <= MARK_BEGINS;
      end if;

      if judged = '1' then
        -- A majority decides: a scaler that leaves a few places near must not pass for changed colours.
        if near_now = '1' and balance /= balance_t'high then
          balance <= balance + 1;
        elsif near_now = '0' and balance /= balance_t'low then
          balance <= balance - 1;
        end if;
        if equal_now = '0' then
          all_equal <= '0';
        end if;
      end if;

      -- The line's last place has been judged in the clock before.
      if line_ends = '1' then
        first     <= '0';
        balance   <= 0;
        all_equal <= '1';
        marks_now <= "00";
        if all_equal = '1' then
          marks_now <= "10";
        elsif balance > 0 then
          marks_now <= "01";
        end if;
      end if;
      -- Both edges of vertical sync lie between two frames.
      if in_video.v_sync /= v_sync then
        first <= '1';
      end if;

      if reset = '1' then
        first     <= '1';
        balance   <= 0;
        all_equal <= '1';
        marks_now <= "00";
      end if;
    end if;

  end process watch;

  draw : process (clk) is
  begin

    if rising_edge(clk) then
      out_video   <= shown_video;
      last_active <= shown_video.active;
      last_sync   <= shown_video.v_sync;
      if shown_video.v_sync /= last_sync then
        left <= LINES;
      elsif last_active = '1' and shown_video.active = '0' and left /= 0 then
        -- The bar counts outgoing lines, which are later than the incoming ones.
        left <= left - 1;
      end if;
      -- The bar covers refocused marks; in the blanking its colour has no effect.
      if left /= 0 and marks_now = "10" then
        out_video.pixel <= EQUAL_BAR;
      elsif left /= 0 and marks_now = "01" then
        out_video.pixel <= CHANGED_BAR;
      end if;
      if reset = '1' then
        left <= 0;
      end if;
    end if;

  end process draw;

end architecture rtl;
