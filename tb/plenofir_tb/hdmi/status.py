# SPDX-License-Identifier: Apache-2.0
"""The board's status line: its fields, the VHDL package made of them, and a parser.

``scripts/build_hdl.py`` makes ``hdl/control/status_pkg.vhd`` from this list of fields,
``scripts/build_docs.py`` the table of ``docs/boards/controls.md``.
"""

import re
import textwrap
from dataclasses import dataclass

from plenofir.ground.errors import InputError


@dataclass(frozen=True)
class StatusField:
    """A field of the status line."""

    name: str  # what stands before the equals sign
    meaning: str  # what the documentation says of it
    example: tuple[int, ...]  # its numbers in the documentation's line, as many as the field has


_CHANNELS = "channels 0/1/2"

FIELDS = (
    StatusField("slice", "the slice that is shown", (0,)),
    StatusField("slices", "number of slices", (1,)),
    StatusField("sweep", "frames for each slice of a sweep, 0: none", (0,)),
    StatusField(
        "output",
        "the output that is shown, by its place in the scene's list of outputs, from 0",
        (0,),
    ),
    StatusField("outputs", "number of outputs", (1,)),
    StatusField("text", "text over the picture, 0: none, 1: at the top, 2: at the bottom", (0,)),
    StatusField("pass", "1: the input is passed through", (0,)),
    StatusField("pattern", "1: test pattern instead of J3", (0,)),
    StatusField("clock", "TMDS clock at J3 in units of 100 kHz", (743,)),
    StatusField("present", "1: the TMDS clock is steady and in range", (1,)),
    StatusField("running", "1: both PLLs are locked and the logic runs", (1,)),
    StatusField(
        "restarts",
        "times that a running link was restarted, for a lost clock, a lost lock, or no data",
        (0,),
    ),
    StatusField(
        "lost_locks",
        "times that a PLL did not lock within 50 ms (Atlys: 10 ms) and was started again",
        (0,),
    ),
    StatusField("tracking", "sum of 1, 2, 4: delay lines of channels 0, 1, 2 work", (7,)),
    StatusField(
        "taps",
        f"steps that the delay of {_CHANNELS} has moved from the middle of a bit, to follow it",
        (3, -1, 2),
    ),
    StatusField(
        "hung", f"times that delay lines of {_CHANNELS} did not answer and were reset", (0, 0, 0)
    ),
    StatusField("aligned", "sum of 1, 2, 4: word boundaries found in channels 0, 1, 2", (7,)),
    StatusField(
        "polarity",
        "what `i` has set: 8: swapped wires are found with an HDMI source, 0 to 7: sum of 1, 2, 4 "
        "for channels that are inverted",
        (8,),
    ),
    StatusField(
        "inverted",
        "sum of 1, 2, 4: channels 0, 1, 2 are inverted, as their wires are swapped; 7: the whole "
        "connector is the wrong way round (ULX3S: both rows of the header)",
        (0,),
    ),
    StatusField("word_errors", f"words in {_CHANNELS} that no encoder sends", (0, 0, 0)),
    StatusField("hdmi", "1: the source sends HDMI, 0: DVI", (0,)),
    StatusField("avi", "1: an HDMI source has described its picture (AVI InfoFrame)", (0,)),
    StatusField(
        "colour",
        "colours of the source: 0: RGB, 1: YCbCr 4:2:2, 2: YCbCr 4:4:4, 3: YCbCr 4:2:0; 2 is "
        "converted to RGB, 1 and 3 are not",
        (0,),
    ),
    StatusField(
        "limited",
        "1: the source sends black as 16 and white as 235; converted to full range, except where "
        "colour is 1 or 3",
        (0,),
    ),
    StatusField("vic", "video format of the source (VIC of CEA-861), 0: none", (0,)),
    StatusField(
        "packet_errors",
        "packets of an HDMI source with wrong check bits / InfoFrames with a wrong checksum",
        (0, 0),
    ),
    StatusField("following", "1: timing understood, picture refocused", (1,)),
    StatusField(
        "unsupported",
        "1: timing is stable, but lines are too long or blanking is too short: the input is passed "
        "through",
        (0,),
    ),
    StatusField(
        "varying",
        "1: frames are not all alike (interlaced, variable refresh rate, lines or blanking that "
        "differ): the input is passed through",
        (0,),
    ),
    StatusField("columns", "measured width", (1280,)),
    StatusField("rows", "measured height", (720,)),
    StatusField("rate", "frames in ten seconds: 600 is 60 Hz; 0: no frames", (600,)),
    StatusField("hsync", "1: horizontal sync is positive", (1,)),
    StatusField("vsync", "1: vertical sync is positive", (1,)),
    StatusField(
        "marks",
        "2: the picture arrives as `plenofir board picture` made it, to the bit; 1: its colours "
        "were changed; 0: it has no marks, or was scaled or moved",
        (0,),
    ),
    StatusField(
        "errors",
        "sum of 1: pixel lost at the refocuser's input, 2: pixel missing at its output, 4: a frame "
        "began elsewhere, 8: the refocuser saw a broken frame, 16: a word that no encoder sends",
        (0,),
    ),
    StatusField("edid", "bytes that the source has read from the EDID", (128,)),
    StatusField(
        "monitor",
        "EDID of the monitor at J2: 0: no answer, 1: read, 2: it answers, but header or checksum "
        "is wrong, 3: a line of its data channel stays low",
        (1,),
    ),
    StatusField(
        "monitor_mode",
        "the monitor's preferred columns/rows/rate (in 0.1 Hz; rows and rate of fields if it is "
        "interlaced)",
        (1920, 1080, 600),
    ),
    StatusField("monitor_ok", "1: the EDID of the monitor has the current mode", (1,)),
)
"""The fields in their order."""


def parse_status(line: str) -> dict[str, tuple[int, ...]]:
    """Numbers of each field of the line that the board answers to ``?``, in order.

    InputError if fields are missing, unknown or in another order, or one has other numbers than it
    should.
    """
    words = line.split()
    if len(words) != len(FIELDS):
        raise InputError(f"the board's status has {len(words)} fields; {len(FIELDS)} are known")
    status = {}
    for word, field in zip(words, FIELDS, strict=True):
        pattern = field.name + "=" + "/".join([r"(-?\d+)"] * len(field.example))
        match = re.fullmatch(pattern, word)
        if match is None:
            form = f"{field.name}=" + "/".join("#" * len(field.example))
            raise InputError(f"the board's status has {word!r} in place of {form}")
        status[field.name] = tuple(map(int, match.groups()))
    return status


def example_line() -> str:
    """Make the status line that the documentation shows."""
    return " ".join(f"{f.name}={'/'.join(map(str, f.example))}" for f in FIELDS)


def status_package() -> str:
    """VHDL of ``hdl/control/status_pkg.vhd``: text of the line and record of its numbers."""
    texts = [f"{f.name}={'/'.join('#' * len(f.example))}" for f in FIELDS]
    types = [
        f"std_logic_vector({16 * len(f.example) - 1} downto 0)"
        if len(f.example) > 1
        else "number_t"
        for f in FIELDS
    ]
    comments = [
        textwrap.fill(
            f"{f.meaning[0].upper()}{f.meaning[1:]}.",
            100,
            initial_indent=_COMMENT,
            subsequent_indent=_COMMENT,
        )
        for f in FIELDS
    ]
    return _TEMPLATE.format(
        line=' " &\n                                   "'.join(texts),
        numbers=sum(len(f.example) for f in FIELDS),
        record="\n".join(
            f"{comment}\n    {f.name} : {t};"
            for f, t, comment in zip(FIELDS, types, comments, strict=True)
        ),
        vector=" &\n           ".join(f"status.{f.name}" for f in reversed(FIELDS)),
    )


_COMMENT = "    -- "

_TEMPLATE = """\
-- The status line of the serial port; built by scripts/build_hdl.py from the list of its fields in
-- plenofir_tb.hdmi.status.

library ieee;
use ieee.std_logic_1164.all;

package status_pkg is

  -- The line: each # stands for the next number.
  constant STATUS_LINE : string := "{line}";

  constant STATUS_NUMBERS : positive := {numbers};

  -- Two's complement.
  subtype number_t is std_logic_vector(15 downto 0);

  subtype status_vector_t is std_logic_vector(16 * STATUS_NUMBERS - 1 downto 0);

  -- The numbers; of a field with several the first is in the low bits.

  type status_t is record
{record}
  end record status_t;

  -- All numbers in order, the first one in the low bits.
  function to_vector (
    status : status_t
  ) return std_logic_vector;

end package status_pkg;

package body status_pkg is

  function to_vector (
    status : status_t
  ) return std_logic_vector is
  begin

    return {vector};

  end function to_vector;

end package body status_pkg;
"""
