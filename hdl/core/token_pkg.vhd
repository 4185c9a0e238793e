-- SPDX-License-Identifier: Apache-2.0
-- The records that pass between stream shell and engine, and from stage to stage of an engine: tokens in, results out.
-- Pixels are separate signals, as their width depends on generics.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package token_pkg is

  -- The size and the slice of the next frame, read with its first pixel. The slice is a number in the set; numbers
  -- beyond the set mean its last slice. With sweep all slices come in turn, each for sweep_frames frames (0 counts
  -- as 1).
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

  -- A step of an engine. All fields except strobe are valid only while strobe = '1'.
  type token_t is record
    strobe : std_logic;
    -- The token has a pixel of a band; a token without one pushes pixels out of the row filters.
    pixel : std_logic;
    -- The first and the last pixel of a line.
    line_first : std_logic;
    line_last  : std_logic;
    -- The line completes a band. Without parallel rows every line does.
    band : std_logic;
    -- The line belongs to a frame's first band.
    frame_first : std_logic;
    -- The line belongs to the image; other lines push lines out of the column filters.
    image : std_logic;
    -- The slice of the frame.
    slice : slice_t;
  end record token_t;

  constant NO_TOKEN : token_t := ('0', '0', '0', '0', '0', '0', '0', (others => '0'));

  type tokens_t is array (natural range <>) of token_t;

  -- Whether a token holds the first pixel of a line. An empty token may still have the marks of the token before
  -- it.
  function begins_line (
    token : token_t
  ) return std_logic;

  -- The result of an engine for a pixel of a row.
  type result_t is record
    -- The row has a pixel of an image line.
    valid : std_logic;
    -- The row has no image line, and this is its first column.
    skip : std_logic;
    -- The first pixel of a frame.
    start : std_logic;
    -- The last pixel of a line.
    last : std_logic;
    -- The slice of the frame.
    slice : slice_t;
  end record result_t;

  constant NO_RESULT : result_t := ('0', '0', '0', '0', (others => '0'));

  -- The pixels of a token, each of so many bits, with zeros behind the last pixel of the line. ends: which pixels
  -- a line's last token has.
  function in_line (
    data  : std_logic_vector;
    bits  : positive;
    token : token_t;
    ends  : std_logic_vector
  ) return std_logic_vector;

  -- The results of parallel rows.
  type results_t is array (natural range <>) of result_t;

  -- The result that belongs to a token at the output of an engine.
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
