-- SPDX-License-Identifier: Apache-2.0
-- The records that pass between stream shell and engine, and from stage to stage of an engine: tokens in, results out.
-- Pixels are separate signals, as their width depends on generics.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package token_pkg is

  -- What the next frame is, read with its first pixel: its size; its slice as a number in the set, beyond it the last
  -- one; or with sweep all of them in turn, each for sweep_frames frames (0 counts as 1).
  type frame_order_t is record
    columns      : std_logic_vector(15 downto 0);
    rows         : std_logic_vector(15 downto 0);
    slice        : std_logic_vector(7 downto 0);
    sweep        : std_logic;
    sweep_frames : std_logic_vector(7 downto 0);
  end record frame_order_t;

  -- A stream of video without its data: tuser(0) marks the start of a frame, tlast the end of a line.
  type marks_t is record
    tvalid : std_logic;
    tuser  : std_logic_vector(0 downto 0);
    tlast  : std_logic;
  end record marks_t;

  -- Number of a slice in its set, from 0.
  subtype slice_t is unsigned(7 downto 0);

  -- A step of an engine. The other fields are valid only while strobe = '1'.
  type token_t is record
    strobe : std_logic;
    -- A pixel of a band of lines; other tokens push pixels out of the row filters.
    pixel : std_logic;
    -- The ends of a line.
    line_first : std_logic;
    line_last  : std_logic;
    -- The line completes a band; always, without parallel rows.
    band : std_logic;
    -- Lines of a frame's first band.
    frame_first : std_logic;
    -- The line belongs to the image; others push lines out of the column filters.
    image : std_logic;
    -- The slice of the frame.
    slice : slice_t;
  end record token_t;

  constant NO_TOKEN : token_t := ('0', '0', '0', '0', '0', '0', '0', (others => '0'));

  type tokens_t is array (natural range <>) of token_t;

  -- Whether a token holds the first pixel of a line. An empty token may still have the marks of the one before it.
  function begins_line (
    token : token_t
  ) return std_logic;

  -- What an engine has for a pixel of a row.
  type result_t is record
    -- A pixel of an image line.
    valid : std_logic;
    -- The first column of a line that is none.
    skip : std_logic;
    -- The first pixel of a frame.
    start : std_logic;
    -- The last pixel of a line.
    last : std_logic;
    -- The slice of the frame.
    slice : slice_t;
  end record result_t;

  constant NO_RESULT : result_t := ('0', '0', '0', '0', (others => '0'));

  -- The pixels of a token, of so many bits each, with zeros behind the last one of its line; ends: which of them a
  -- line's last token has.
  function in_line (
    data  : std_logic_vector;
    bits  : positive;
    token : token_t;
    ends  : std_logic_vector
  ) return std_logic_vector;

  -- Results of parallel rows.
  type results_t is array (natural range <>) of result_t;

  -- What a token becomes that comes out of an engine with its sums.
  function result_of (
    token : token_t
  ) return result_t;

end package token_pkg;

package body token_pkg is

  function begins_line (
    token : token_t
  ) return std_logic is
  begin

    return token.pixel and token.line_first;

  end function begins_line;

  function result_of (
    token : token_t
  ) return result_t is

    variable result : result_t;

  begin

    result.valid := token.strobe and token.pixel and token.image;
    result.skip  := token.strobe and begins_line(token) and not token.image;
    result.start := token.line_first and token.frame_first;
    result.last  := token.line_last;
    result.slice := token.slice;

    return result;

  end function result_of;

  function in_line (
    data  : std_logic_vector;
    bits  : positive;
    token : token_t;
    ends  : std_logic_vector
  ) return std_logic_vector is

    variable kept : std_logic_vector(data'length - 1 downto 0);

  begin

    kept := data;

    for j in 0 to data'length / bits - 1 loop

      if token.line_last = '1' and ends(j) = '0' then
        kept((j + 1) * bits - 1 downto j * bits) := (others => '0');
      end if;

    end loop;

    return kept;

  end function in_line;

end package body token_pkg;
