-- SPDX-License-Identifier: Apache-2.0
-- Sizes of the text overlay. All functions are evaluated at elaboration only.

library work;
use work.math_pkg.all;

package overlay_pkg is

  -- Pixels of a glyph, lines of the ruler below the texts, and pixels from the picture's edges.
  constant GLYPH_COLUMNS : positive := 8;
  constant GLYPH_ROWS    : positive := 16;
  constant RULER_ROWS    : positive := 8;
  constant MARGIN        : positive := 8;

  -- Lines of the overlay: the text, the labels, the ruler.
  constant OVERLAY_ROWS : positive := 2 * GLYPH_ROWS + RULER_ROWS;

  -- Clocks from a pixel in to the same pixel out.
  constant OVERLAY_LATENCY : positive := 5;

  -- Characters behind the text: "  errors " and two digits.
  constant ERROR_LETTERS : positive                   := 9;
  constant ERROR_TEXT    : string(1 to ERROR_LETTERS) := "  errors ";
  constant ERROR_COLUMNS : positive                   := ERROR_LETTERS + 2;

  -- The codes of the glyphs: those of ASCII from the blank on.
  constant FIRST_GLYPH : natural  := 32;
  constant GLYPHS      : positive := 95;

  -- Characters of the widest line, limited to those that fit into the longest picture (4095 columns).
  function overlay_columns (
    slices        : positive;
    text_columns  : positive;
    label_columns : positive
  ) return positive;

end package overlay_pkg;

package body overlay_pkg is

  function overlay_columns (
    slices        : positive;
    text_columns  : positive;
    label_columns : positive
  ) return positive is

    -- Characters of the longest line, rounded up: what lies beyond is never inside a picture.
    constant MOST : positive := (4095 - MARGIN) / GLYPH_COLUMNS + 1;

  begin

    -- The ruler of many slices is cut off by the picture's edge, so its counters need not reach further.
    if slices * label_columns > MOST then
      return MOST;
    end if;

    return larger(text_columns + ERROR_COLUMNS, slices * label_columns);

  end function overlay_columns;

end package body overlay_pkg;
