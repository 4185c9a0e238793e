# SPDX-License-Identifier: Apache-2.0
"""What is in the block diagrams of the documentation; `draw_diagrams.py` draws them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

Point = tuple[float, float]


@dataclass(frozen=True)
class Box:
    """A block. The first line of its text is bold; a frame has its text at the top."""

    x: int
    y: int
    width: int
    height: int
    colour: str
    lines: tuple[str, ...]


# An arrow: the points on its way, its label, where the label is.
Arrow = tuple[Sequence[Point], str, Point]


@dataclass(frozen=True)
class Diagram:
    """A drawing; `legend` explains colours, from `legend_at` downwards."""

    width: int
    height: int
    boxes: Sequence[Box]
    arrows: Sequence[Arrow]
    legend: dict[str, str] = field(default_factory=dict)
    legend_at: Point = (0, 0)
    notes: Sequence[tuple[Point, str]] = ()


_BOARD: list[Box] = [
    Box(20, 40, 90, 60, "outside", ("J3", "HDMI in")),
    Box(160, 30, 170, 80, "io", ("tmds_input x 3", "IBUFDS, IODELAY2", "ISERDES2 1:5")),
    Box(160, 150, 170, 50, "half", ("phase_detector_control", "samples amid the bits")),
    Box(
        400,
        30,
        190,
        80,
        "pixel",
        ("tmds_receiver", "5:10, word alignment", "deskew, TMDS decoders"),
    ),
    Box(400, 150, 190, 50, "pixel", ("light_field_pattern", "without any source")),
    Box(660, 30, 90, 80, "pixel", ("choice", "source or", "pattern")),
    Box(820, 30, 200, 80, "pixel", ("video_to_stream", "timing measured", "sync delay, no frame")),
    Box(820, 160, 200, 80, "pixel", ("raster_refocuser", "M, a' of the slice", "line buffers")),
    Box(820, 290, 200, 60, "pixel", ("stream_to_video", "syncs made anew")),
    Box(
        560,
        280,
        190,
        80,
        "tx",
        ("tmds_transmitter", "TMDS encoders", "elastic_buffer, 10:5"),
    ),
    Box(320, 280, 170, 80, "io", ("tmds_output x 4", "OSERDES2 5:1", "OBUFDS")),
    Box(160, 290, 90, 60, "outside", ("J2", "HDMI out")),
    Box(20, 420, 130, 60, "outside", ("clock_input", "IBUFDS, BUFIO2")),
    Box(210, 410, 170, 80, "outside", ("pixel_clock_select", "BUFGMUX", "DCM: 25.175 MHz")),
    Box(440, 420, 170, 60, "pixel", ("serial_clocks", "PLL of the receiver")),
    Box(700, 420, 190, 60, "tx", ("serial_clocks", "PLL of the transmitter")),
    Box(
        20,
        540,
        870,
        60,
        "control",
        (
            "clock_meter  link_supervisor  pll_configure x 2  i2c_rom_slave  monitor_edid  "
            "board_control",
            "measures, chooses the PLLs' setting, brings up in order; buttons, switches, UART",
        ),
    ),
]

_BOARD_ARROWS: list[Arrow] = [
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


def _shell(height: int) -> tuple[list[Box], list[Arrow]]:
    """What is the same around every engine: input FIFO and sequencer left, output FIFO right."""
    boxes = [
        Box(20, 50, 130, 50, "half", ("axis_fifo", "of whole lines")),
        Box(190, 50, 130, 50, "control", ("frame_sequencer", "one token a clock")),
        Box(960, 50, 130, 50, "half", ("row_scatter", "output FIFO")),
    ]
    arrows: list[Arrow] = [
        (((85, 15), (85, 50)), "stream in", (125, 30)),
        (((150, 75), (190, 75)), "", (0, 0)),
        (((1025, 50), (1025, 15)), "stream out", (1065, 30)),
        (
            ((1025, 100), (1025, height), (255, height), (255, 100)),
            "credit: room for the tokens under way",
            (640, height - 7),
        ),
    ]
    return boxes, arrows


def _fir() -> Diagram:
    boxes, arrows = _shell(195)
    boxes += [
        Box(350, 25, 575, 150, "frame", ("fir_array",)),
        Box(365, 60, 150, 60, "tx", ("fir_stage", "rows: each register", "is a flip-flop")),
        Box(545, 60, 150, 60, "tx", ("fir_stage", "columns: each register", "is a line memory")),
        Box(
            725,
            60,
            185,
            60,
            "tx",
            ("divide_round", "exact: sum / M\u00b2; stored", "products: round_saturate"),
        ),
    ]
    arrows += [
        (((320, 75), (365, 75)), "", (0, 0)),
        (((515, 90), (545, 90)), "", (0, 0)),
        (((695, 90), (725, 90)), "", (0, 0)),
        (((910, 75), (960, 75)), "", (0, 0)),
    ]
    notes = [
        ((640, 142), "N rows at once: row_gather before, lane_skew and lane_exchange"),
        ((640, 159), "between the stages; N = 1 needs none of them"),
        ((120, 240), "A fir_stage, M = 3, a' = 2:"),
    ]
    # The filter: a bus over the taps; switches from the control; adders and registers in a row.
    boxes += [
        Box(20, 260, 120, 50, "pixel", ("pixel", "x, or x / M")),
        Box(
            20,
            430,
            150,
            60,
            "control",
            ("switch_control", "a row of switch_table", "for the phase of x"),
        ),
        Box(195, 250, 830, 250, "frame", ("switched_fir",)),
        Box(1050, 355, 50, 40, "pixel", ("sum",)),
    ]
    arrows += [(((140, 285), (965, 285)), "", (0, 0))]
    for w in range(5):
        x = 250 + 150 * w
        boxes += [
            Box(x, 360, 40, 30, "tx", ("+",)),
            Box(x - 10, 308, 60, 24, "control", ("switch",)),
        ]
        arrows += [
            (((x + 20, 285), (x + 20, 308)), "", (0, 0)),
            (((x + 20, 332), (x + 20, 360)), "", (0, 0)),
            (((x + 40, 375), (x + 66, 375)), "", (0, 0)),
        ]
        boxes += [Box(x + 66, 355, 60, 40, "half", ("register",))]
        end = 1050 if w == 4 else x + 150
        arrows += [(((x + 126, 375), (end, 375)), "", (0, 0))]
        notes += [((x + 20, 420), f"tap {w}")]
    arrows += [(((170, 460), (215, 460), (215, 320), (240, 320)), "", (0, 0))]
    notes += [
        ((640, 455), "phase 0 closes taps 2 3 4, phase 1 taps 1 2 3, phase 2 taps 0 1 2"),
        (
            (640, 475),
            "A partial sum moves right by a tap a step and takes in pixels whose switch is closed.",
        ),
    ]
    return Diagram(1115, 515, boxes, arrows, notes=notes)


def _moving_sum() -> Diagram:
    boxes, arrows = _shell(195)
    boxes += [
        Box(350, 25, 575, 150, "frame", ("moving_sum_array",)),
        Box(
            365,
            60,
            160,
            60,
            "tx",
            ("moving_sum_stage", "columns first: keeps", "pixels of the input"),
        ),
        Box(555, 60, 150, 60, "tx", ("moving_sum_stage", "rows")),
        Box(735, 60, 175, 60, "tx", ("divide_round", "sum / M\u00b2")),
    ]
    arrows += [
        (((320, 75), (365, 75)), "", (0, 0)),
        (((525, 90), (555, 90)), "", (0, 0)),
        (((705, 90), (735, 90)), "", (0, 0)),
        (((910, 75), (960, 75)), "", (0, 0)),
    ]
    boxes += [
        Box(20, 290, 110, 50, "pixel", ("pixel", "of phase v")),
        Box(195, 250, 830, 290, "frame", ("moving_sum_stage",)),
        Box(225, 280, 200, 50, "half", ("pixel_ring", "rows: the last pixels")),
        Box(
            225,
            335,
            200,
            60,
            "half",
            ("line_ring", "columns: lines of each", "phase, in two banks"),
        ),
        Box(
            225,
            445,
            200,
            60,
            "control",
            ("moving_sum_control", "ages by phase: which pixel", "enters, which leaves"),
        ),
        Box(505, 275, 510, 240, "frame", ("moving_sum_adder",)),
        Box(530, 310, 110, 60, "tx", ("add", "+ entering", "\u2212 leaving")),
        Box(705, 305, 120, 70, "half", ("sum", "rows: one;", "columns: one each")),
        Box(705, 440, 120, 60, "half", ("first sum", "of the next line or", "frame, output 0")),
        Box(885, 305, 115, 70, "half", ("held result", "g = gcd(a', M)", "equal outputs")),
        Box(1050, 320, 50, 40, "pixel", ("sum",)),
    ]
    arrows += [
        (((130, 315), (225, 315)), "", (0, 0)),
        (((425, 325), (530, 325)), "enters", (463, 318)),
        (((425, 355), (530, 355)), "leaves", (463, 348)),
        (((325, 445), (325, 395)), "ages", (345, 423)),
        (((640, 340), (705, 340)), "", (0, 0)),
        (((765, 375), (765, 405), (600, 405), (600, 370)), "running sum", (680, 400)),
        (((825, 340), (885, 340)), "", (0, 0)),
        (((1000, 340), (1050, 340)), "", (0, 0)),
        (((180, 315), (180, 528), (765, 528), (765, 500)), "", (0, 0)),
        (((705, 470), (560, 470), (560, 370)), "when output 0 is due", (630, 487)),
    ]
    notes = [
        ((640, 142), "with stored products rows come first, and each stage begins with"),
        ((640, 159), "stored_product and ends with round_saturate"),
        ((120, 240), "A moving_sum_stage:"),
    ]
    return Diagram(1115, 555, boxes, arrows, notes=notes)


def _lanes() -> Diagram:
    boxes = [
        Box(20, 120, 110, 60, "pixel", ("P pixels", "of a token")),
        Box(170, 25, 500, 190, "frame", ("pixel_banks",)),
        Box(185, 65, 95, 60, "tx", ("rotate_words", "to the banks")),
        Box(
            310,
            60,
            120,
            140,
            "half",
            ("banks", "B: a multiple of M,", "read twice:", "entering,", "leaving"),
        ),
        Box(450, 65, 90, 60, "tx", ("subtract", "in each bank")),
        Box(546, 60, 118, 70, "tx", ("rotate_words", "exchange by slice", "to the outputs")),
        Box(310, 250, 120, 60, "control", ("lane_control", "places, rows, ends")),
        Box(185, 345, 245, 50, "half", ("ahead_sum", "pixels before output 0 of a line")),
        Box(710, 25, 330, 290, "frame", ("prefix_sums",)),
        Box(730, 70, 130, 60, "tx", ("prefix sums", "log\u2082 P levels")),
        Box(890, 70, 135, 60, "tx", ("+ carry", "P sums")),
        Box(890, 180, 135, 50, "half", ("last sum", "of the token before")),
        Box(730, 250, 295, 45, "half", ("held result", "of the last output that begins a group")),
        Box(1070, 245, 70, 55, "pixel", ("P sums",)),
    ]
    arrows: list[Arrow] = [
        (((130, 150), (155, 150), (155, 95), (185, 95)), "", (0, 0)),
        (((280, 95), (310, 95)), "", (0, 0)),
        (((430, 80), (450, 80)), "", (0, 0)),
        (((430, 110), (450, 110)), "", (0, 0)),
        (((540, 95), (546, 95)), "", (0, 0)),
        (((664, 95), (730, 95)), "d", (690, 88)),
        (((860, 95), (890, 95)), "", (0, 0)),
        (((980, 130), (980, 180)), "", (0, 0)),
        (((930, 180), (930, 130)), "", (0, 0)),
        (((900, 130), (900, 155), (870, 155), (870, 250)), "", (0, 0)),
        (((1025, 272), (1070, 272)), "", (0, 0)),
        (((370, 250), (370, 200)), "", (0, 0)),
        (((155, 150), (155, 370), (185, 370)), "", (0, 0)),
        (
            ((430, 370), (1055, 370), (1055, 100), (1025, 100)),
            "instead of the last sum, when output 0 is due",
            (760, 362),
        ),
    ]
    return Diagram(1160, 415, boxes, arrows)


def _stack() -> Diagram:
    boxes, arrows = _shell(440)
    boxes += [
        Box(350, 25, 575, 395, "frame", ("stack_array",)),
        Box(362, 55, 365, 350, "frame", ("stack_columns",)),
        Box(
            375,
            90,
            150,
            290,
            "half",
            (
                "line_history",
                "one for all slices:",
                "for each column and",
                "phase a word with the",
                "last lines, newest first;",
                "a new line moves",
                "them one place on",
            ),
        ),
    ]
    for y, name in ((90, "slice 0"), (195, "slice 1"), (320, "slice n-1")):
        boxes += [
            Box(575, y, 140, 60, "tx", ("column_sum", name, "picks, adds, subtracts")),
            Box(745, y, 80, 60, "tx", ("rows", "moving_sum", "_stage")),
            Box(845, y, 70, 60, "tx", ("divide", "/ M\u00b2")),
        ]
        arrows += [
            (((525, y + 30), (575, y + 30)), "", (0, 0)),
            (((715, y + 30), (745, y + 30)), "", (0, 0)),
            (((825, y + 30), (845, y + 30)), "", (0, 0)),
            (((915, y + 30), (940, y + 30), (940, 75), (960, 75)), "", (0, 0)),
        ]
    arrows += [(((320, 75), (340, 75), (340, 235), (375, 235)), "", (0, 0))]
    notes = [((645, 290), "\u22ee"), ((785, 290), "\u22ee"), ((880, 290), "\u22ee")]
    return Diagram(1115, 455, boxes, arrows, notes=notes)


def _depth() -> Diagram:
    boxes = [
        Box(20, 50, 140, 60, "pixel", ("focal_stack", "all slices of a pixel", "in each word")),
        Box(200, 50, 130, 60, "control", ("frame_sequencer", "one token a clock")),
        Box(370, 20, 560, 350, "frame", ("sharpness_index",)),
        Box(
            400,
            60,
            220,
            60,
            "half",
            ("ring of lines", "pixels of all slices, until", "their index is known"),
        ),
        Box(680, 60, 220, 60, "tx", ("choose", "the pixel of the slice that", "is sharpest here")),
        Box(960, 50, 130, 60, "half", ("row_scatter", "output FIFO")),
        Box(700, 190, 180, 60, "half", ("index", "of each micro image", "of a row")),
        Box(400, 280, 110, 70, "tx", ("lens_sums", "luma of each", "micro image")),
        Box(540, 280, 150, 70, "tx", ("lens_sharpness", "|Laplacian| summed", "over the window")),
        Box(720, 280, 140, 70, "tx", ("largest", "slice after slice, the", "first of equal ones")),
    ]
    arrows: list[Arrow] = [
        (((160, 80), (200, 80)), "", (0, 0)),
        (((330, 80), (400, 80)), "", (0, 0)),
        (((620, 90), (680, 90)), "", (0, 0)),
        (((900, 80), (960, 80)), "", (0, 0)),
        (((1025, 50), (1025, 15)), "pixel, index", (980, 30)),
        (((355, 80), (355, 315), (400, 315)), "", (0, 0)),
        (((510, 315), (540, 315)), "", (0, 0)),
        (((690, 315), (720, 315)), "", (0, 0)),
        (((790, 280), (790, 250)), "", (0, 0)),
        (((790, 190), (790, 120)), "slice", (812, 160)),
        (
            ((1025, 110), (1025, 395), (265, 395), (265, 110)),
            "credit: room for the tokens under way",
            (640, 388),
        ),
    ]
    notes = [
        ((545, 265), "one of each for every slice"),
        ((510, 150), "RADIUS + 2 rows of micro images"),
    ]
    return Diagram(1115, 410, boxes, arrows, notes=notes)


DIAGRAMS = {
    "board": Diagram(
        1160,
        620,
        _BOARD,
        _BOARD_ARROWS,
        {
            "outside": "board",
            "io": "10 f: I/O clocks (BUFPLL of the bank)",
            "half": "2 f: clk_x2, tx_clk_x2",
            "pixel": "f: clk, the pixel clock",
            "tx": "f: tx_clk, the transmitter's",
            "control": "100 MHz: control",
        },
        (920, 420),
    ),
    "fir": _fir(),
    "moving_sum": _moving_sum(),
    "lanes": _lanes(),
    "stack": _stack(),
    "depth": _depth(),
}
