-- SPDX-License-Identifier: Apache-2.0
-- Makes full-range RGB from limited RGB and from YCbCr 4:4:4; all other video passes unchanged.
--
-- Latency: 3 clocks. Throughput: one pixel each clock.
-- Equation: CEA-861-D, section 5; BT.601, BT.709: e.g. R = 255/219 (Y - 16) + 255/224 * 2 (1 - Kr) (Cr - 128), with
-- coefficients of 12 fraction bits, rounded to the nearest and limited to 0 to 255.
-- Cost: five multipliers.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.colour_pkg.all;
use work.video_pkg.all;

entity full_range_rgb is
  port (
    clk : in    std_logic;
    -- The source's colours: colour: 0 RGB, 2 YCbCr 4:4:4, others pass unchanged; limited: limited range; bt601: BT.601,
    -- else BT.709.
    colour  : in    std_logic_vector(1 downto 0);
    limited : in    std_logic;
    bt601   : in    std_logic;
    -- Video in; a pixel of YCbCr has Cr in the low bits, then Y, then Cb.
    in_video : in    video_t;
    -- Video out, RGB.
    out_video : out   video_t
  );
end entity full_range_rgb;

architecture rtl of full_range_rgb is

  -- Width of products and sums. None reaches 2**22: the largest coefficient is 2.12, so a product stays below 2.3
  -- million, and with luma and the offset a sum stays below 3.5 million; in green the colours are subtracted.
  constant SUM_BITS : positive := 24;

  subtype sum_t is signed(SUM_BITS - 1 downto 0);

  -- A register, because the source's colours change only between pictures.
  signal way : way_t := 0;
  -- Syncs in step with the products and with the sums; then products and sums.
  signal video_1    : video_t := NO_VIDEO;
  signal video_2    : video_t := NO_VIDEO;
  signal luma       : sum_t   := (others => '0');
  signal red        : sum_t   := (others => '0');
  signal green_red  : sum_t   := (others => '0');
  signal green_blue : sum_t   := (others => '0');
  signal blue       : sum_t   := (others => '0');
  signal red_sum    : sum_t   := (others => '0');
  signal green_sum  : sum_t   := (others => '0');
  signal blue_sum   : sum_t   := (others => '0');

  function multiply (
    octet        : std_logic_vector(7 downto 0);
    coefficient : coefficient_t
  ) return signed is
  begin

    return signed('0' & octet) * coefficient;

  end function multiply;

  -- Integer part of a sum, limited to a byte.

  function to_byte (
    sum : signed(SUM_BITS - 1 downto 0)
  ) return std_logic_vector is

    variable whole : signed(SUM_BITS - COLOUR_FRACTION - 1 downto 0);

  begin

    whole := sum(SUM_BITS - 1 downto COLOUR_FRACTION);

    -- Sums leave the range if a source sends values beyond its range, and by rounding.
    if whole < 0 then
      return x"00";
    elsif whole > 255 then
      return x"FF";
    end if;

    return std_logic_vector(whole(7 downto 0));

  end function to_byte;

begin

  convert : process (clk) is

    variable c         : coefficients_t;
    variable also_luma : signed(SUM_BITS - 1 downto 0);

  begin

    -- Clock 1: products. Clock 2: sums, with the half that rounds in the offsets. Clock 3: bytes.
    if rising_edge(clk) then
      -- 0: full-range RGB passes unchanged through the same registers, so that the delay is always the same.
      way <= 0;
      if colour = "00" and limited = '1' then
        way <= 1;
      elsif colour = "10" then
        if bt601 = '0' and limited = '0' then
          way <= 2;
        elsif bt601 = '0' then
          way <= 3;
        elsif limited = '0' then
          way <= 4;
        else
          way <= 5;
        end if;
      end if;

      -- All conversions share five multipliers; each conversion is a row of coefficients.
      c := WAYS(way);

      video_1    <= in_video;
      luma       <= multiply(in_video.pixel(15 downto 8), c.luma);
      red        <= multiply(in_video.pixel(7 downto 0), c.red);
      green_red  <= multiply(in_video.pixel(7 downto 0), c.green_red);
      green_blue <= multiply(in_video.pixel(23 downto 16), c.green_blue);
      blue       <= multiply(in_video.pixel(23 downto 16), c.blue);

      -- In RGB there is no luma that red and blue share.
      also_luma := (others => '0');
      if c.shared_luma = '1' then
        also_luma := luma;
      end if;
      video_2   <= video_1;
      red_sum   <= red + also_luma + c.red_offset;
      green_sum <= luma + green_red + green_blue + c.green_offset;
      blue_sum  <= blue + also_luma + c.blue_offset;

      out_video       <= video_2;
      out_video.pixel <= to_byte(blue_sum) & to_byte(green_sum) & to_byte(red_sum);
    end if;

  end process convert;

end architecture rtl;
