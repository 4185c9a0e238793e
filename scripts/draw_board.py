"""Draw the block diagram of the board, docs/images/board.svg.

Usage: python scripts/draw_board.py [--check]

With --check nothing is written; exit code 1 if the drawing is missing or stale.
"""

import sys
from dataclasses import dataclass
from html import escape

from plenofir import project

DRAWING = project.root() / "docs" / "images" / "board.svg"
WIDTH, HEIGHT = 1160, 620

# Clock domain to its name and colour.
DOMAINS = {
    "pin": ("board", "#eeeeee"),
    "io": ("10 f: I/O clocks (BUFPLL of the bank)", "#f9d5d3"),
    "half": ("2 f: clk_x2, tx_clk_x2", "#fde7c4"),
    "pixel": ("f: clk, the pixel clock", "#d6ead0"),
    "tx": ("f: tx_clk, the transmitter's", "#d3e5f5"),
    "control": ("100 MHz: control", "#e5daf0"),
}


@dataclass(frozen=True)
class Box:
    """A block: where it is, its domain, what is in it. The first line is bold."""

    x: int
    y: int
    width: int
    height: int
    domain: str
    lines: tuple[str, ...]


BOXES = {
    "j3": Box(20, 40, 90, 60, "pin", ("J3", "HDMI in")),
    "input": Box(160, 30, 170, 80, "io", ("tmds_input x 3", "IBUFDS, IODELAY2", "ISERDES2 1:5")),
    "phase": Box(160, 150, 170, 50, "half", ("phase_detector_control", "samples amid the bits")),
    "receiver": Box(
        400,
        30,
        190,
        80,
        "pixel",
        ("tmds_receiver", "5:10, word alignment", "deskew, TMDS decoders"),
    ),
    "pattern": Box(400, 150, 190, 50, "pixel", ("light_field_pattern", "without any source")),
    "choice": Box(660, 30, 90, 80, "pixel", ("choice", "source or", "pattern")),
    "to_stream": Box(
        820, 30, 200, 80, "pixel", ("video_to_stream", "timing measured", "sync delay, no frame")
    ),
    "core": Box(
        820, 160, 200, 80, "pixel", ("raster_refocuser", "M, a' of the slice", "line buffers")
    ),
    "to_video": Box(820, 290, 200, 60, "pixel", ("stream_to_video", "syncs made anew")),
    "transmitter": Box(
        560,
        280,
        190,
        80,
        "tx",
        ("tmds_transmitter", "TMDS encoders", "elastic_buffer, 10:5"),
    ),
    "output": Box(320, 280, 170, 80, "io", ("tmds_output x 4", "OSERDES2 5:1", "OBUFDS")),
    "j2": Box(160, 290, 90, 60, "pin", ("J2", "HDMI out")),
    "clock_input": Box(20, 420, 130, 60, "pin", ("clock_input", "IBUFDS, BUFIO2")),
    "select": Box(210, 410, 170, 80, "pin", ("pixel_clock_select", "BUFGMUX", "DCM: 25.175 MHz")),
    "rx_pll": Box(440, 420, 170, 60, "pixel", ("serial_clocks", "PLL of the receiver")),
    "tx_pll": Box(700, 420, 190, 60, "tx", ("serial_clocks", "PLL of the transmitter")),
    "control": Box(
        20,
        540,
        870,
        60,
        "control",
        (
            "clock_meter  link_supervisor  pll_configure x 2  i2c_rom_slave (EDID)  board_control",
            "measures, chooses the PLLs' setting, brings up in order; buttons, switches, UART",
        ),
    ),
}

# From, to, points on the way (empty: straight), label, where the label is.
ARROWS = [
    (((110, 70), (160, 70)), "3", (135, 63)),
    (((330, 70), (400, 70)), "3 x 5", (365, 63)),
    (((590, 70), (660, 70)), "24 + 3", (625, 63)),
    (((750, 70), (820, 70)), "24 + 3", (785, 63)),
    (((245, 110), (245, 150)), "", (0, 0)),
    (((590, 175), (705, 175), (705, 110)), "24 + 3", (650, 168)),
    (((920, 110), (920, 160)), "AXI4-Stream, 24", (990, 138)),
    (((920, 240), (920, 290)), "AXI4-Stream, 24", (990, 268)),
    (((820, 320), (750, 320)), "24 + 3", (785, 313)),
    (((560, 320), (490, 320)), "4 x 5", (525, 313)),
    (((320, 320), (250, 320)), "4", (285, 313)),
    (((65, 100), (65, 420)), "clock lane", (100, 250)),
    (((150, 450), (210, 450)), "f", (180, 443)),
    (((380, 450), (440, 450)), "f", (410, 443)),
    (((610, 450), (700, 450)), "clk", (655, 443)),
    (((525, 420), (525, 385)), "clk, clk_x2, io_clk (bank 1)", (525, 378)),
    (((795, 420), (795, 385)), "tx_clk, tx_clk_x2, tx_io_clk (bank 0)", (840, 378)),
    (((85, 480), (85, 540)), "measured", (120, 514)),
    (((295, 540), (295, 490)), "choice", (320, 519)),
    (((525, 540), (525, 480)), "setting, reset", (570, 514)),
    (((795, 540), (795, 480)), "setting, reset", (840, 514)),
]


def _text(x: float, y: float, text: str, *, anchor: str = "middle", bold: bool = False) -> str:
    weight = ' font-weight="bold"' if bold else ""
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}"{weight}>{escape(text)}</text>'


def drawing() -> str:
    """Make the drawing.

    Returns
    -------
    str
        SVG.
    """
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="sans-serif" font-size="12">',
        '<marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0,0 L8,4 L0,8 z"/></marker>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
    ]
    for box in BOXES.values():
        parts.append(
            f'<rect x="{box.x}" y="{box.y}" width="{box.width}" height="{box.height}" rx="4" '
            f'fill="{DOMAINS[box.domain][1]}" stroke="#444444"/>'
        )
        top = box.y + box.height / 2 - 8 * (len(box.lines) - 1) + 4
        for i, line in enumerate(box.lines):
            parts.append(_text(box.x + box.width / 2, top + 16 * i, line, bold=i == 0))
    for points, label, place in ARROWS:
        path = " ".join(f"{x},{y}" for x, y in points)
        parts.append(
            f'<polyline points="{path}" fill="none" stroke="black" marker-end="url(#head)"/>'
        )
        if label:
            parts.append(_text(*place, label))
    for i, (name, colour) in enumerate(DOMAINS.values()):
        y = 420 + 30 * i
        parts.append(
            f'<rect x="920" y="{y}" width="20" height="18" fill="{colour}" stroke="#444444"/>'
        )
        parts.append(_text(948, y + 13, name, anchor="start"))
    return "\n".join([*parts, "</svg>", ""])


def main() -> int:
    """Write or check the drawing."""
    text = drawing()
    if "--check" in sys.argv[1:]:
        if DRAWING.exists() and DRAWING.read_text() == text:
            return 0
        print(f"{DRAWING.relative_to(project.root())} is stale; run make docs", file=sys.stderr)
        return 1
    DRAWING.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
