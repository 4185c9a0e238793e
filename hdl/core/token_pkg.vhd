-- SPDX-License-Identifier: Apache-2.0
-- What passes between the stream shell and an engine: tokens in, results out. Pixels travel beside them.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package token_pkg is

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

  -- Results of parallel rows.
  type results_t is array (natural range <>) of result_t;

end package token_pkg;
