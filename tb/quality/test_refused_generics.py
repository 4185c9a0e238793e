# SPDX-License-Identifier: Apache-2.0
"""Generics that cannot be built, one by one: an assertion refuses them with their name."""

import random
import re
from fractions import Fraction
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir_tb.faults import plant
from plenofir_tb.refusals import Elaborator, Generics, seeded

CORE = {"MICRO_IMAGE_SIZE": 5, "SHIFTS": "-3", "MAX_COLUMNS": 64}
LANES_CORE = {**CORE, "ENGINE": "moving_sum"}
NORMALISED = {"BORDER_NORMALISED": True}
NO_SETS = ["2, 0", "2 x", "-", "2 -", "3-", "--2", "+2", "1.5", "99999999999", "-4097", "4097", " "]
NO_SETS += ["1 " * 257]

WIDE = {"PIXEL_BITS": 16, "INTERPOLATION_ORDER": 1, "MICRO_IMAGE_SIZE": 14}
ALL_ZERO = {"EXACT": False, "PIXEL_BITS": 1, "MICRO_IMAGE_SIZE": 3}
DEPTH = {"MICRO_IMAGE_SIZE": 5, "SLICES": 3, "MAX_COLUMNS": 64}
PICTURE = CORE | {"SHIFTS": "-3 0", "OUTPUTS": "rad", "COLOURS": "00ff00" * 2}
TWICE = {"SHIFTS": "-3 -3 0 0", "SHARP_TOO": True}
JUDGED = {"DEPTH_INDEX": True}
TEXTS = {
    "SLICES": 2,
    "FONT": "0" * 3040,
    "TEXTS": "a" * 15,
    "TEXT_COLUMNS": 3,
    "LABELS": "b" * 4,
    "LABEL_COLUMNS": 2,
}
PATTERN = {f"{axis}_{part}": 8 for axis in "HV" for part in ("ACTIVE", "FRONT", "SYNC", "BACK")}
LANES = {"PIXELS_PER_CLOCK": 4, "CHANNELS": 1}
# Entities inside the cores, whose generics must be consistent.
INNER: list[tuple[str, Generics, Generics]] = [
    (
        "result_scaler",
        {"EXACT": True, "LANES": 3, "PIXEL_BITS": 8, "DIVISOR": 9},
        {"WEIGHT_COUNT": 2},
    ),
    ("divide_round", {"VALUE_MAX": 255, "DIVISOR": 9, "QUOTIENT_BITS": 5}, {"QUOTIENT_BITS": 4}),
    ("ahead_sum", LANES | {"PIXEL_BITS": 8, "SUM_BITS": 11, "LATENCY": 6}, {"LATENCY": 3}),
    (
        "prefix_sums",
        LANES | {"DIFFERENCE_BITS": 9, "SUM_BITS": 11, "HOLDING": False},
        {"PIXELS_PER_CLOCK": 3},
    ),
    (
        "raw_window",
        {"MAX_COLUMNS": 40, "LINES": 8, "DATA_BITS": 8, "WEIGHT_BITS": 8},
        {"LINES": 7},
    ),
    (
        "control_ports",
        {"MICRO_IMAGE_SIZE": 3, "SHIFTS": "1 2", "CENTRED": True},
        {"FIXED_SLICE": 2},
    ),
]

TWO_BOXES = {"MICRO_IMAGE_SIZE": 4, "SHIFTS": "1 2", "BOX": "3 2", "EXACT": True}

# Entity, accepted generics, changes of them, the generic that the message names.
Case = tuple[str, Generics, Generics, str]
REFUSED: list[Case] = [
    *(("raster_refocuser", CORE, {"SHIFTS": text}, "SHIFTS") for text in NO_SETS),
    *(("focal_stack", CORE, {"SHIFTS": text}, "SHIFTS") for text in NO_SETS[:2]),
    ("parallel_top", CORE, {"SHIFTS": "2 x"}, "SHIFTS"),
    ("self_test", {"SHIFTS": "-3"}, {"SHIFTS": "2 x"}, "SHIFTS"),
    *(
        (entity, CORE, {"MICRO_IMAGE_SIZE": 128, "SHIFTS": "4096"}, "SHIFTS")
        for entity in ("raster_refocuser", "focal_stack")
    ),
    *(
        ("raster_refocuser", {**CORE, "ENGINE": engine}, more, name)
        for engine in ("fir", "moving_sum")
        for more, name in (
            (WIDE, "ORDER"),
            ({"EXACT": False, "GUARD_BITS": 1}, "GUARD_BITS"),
            (ALL_ZERO, "FRACTION_BITS"),
            (
                {"EXACT": False, "GUARD_BITS": 9, "FRACTION_BITS": 9, "PIXEL_BITS": 8},
                "PIXEL_BITS",
            ),
            *(({"SHARPENING": text}, "SHARPENING") for text in ("17", "-1", "4 4", "x")),
            ({"SHARPENING": "4", "EXACT": False, "FRACTION_BITS": 4}, "SHARPENING"),
            ({**NORMALISED, "EXACT": False, "FRACTION_BITS": 4}, "BORDER_NORMALISED"),
            ({**NORMALISED, "SHARPENING": "4"}, "BORDER_NORMALISED"),
            *(({"BOX": text}, "BOX") for text in ("0", "129", "2 2", "x")),
        )
    ),
    *(("focal_stack", CORE, {"BOX": text}, "BOX") for text in ("0", "129", "2 2", "x")),
    # A box within a group of views; boxes that differ with one divisor.
    ("core_verdict", {**CORE, **TWO_BOXES}, {"BOX": "2 3"}, "BOX"),
    ("core_verdict", {**CORE, **TWO_BOXES}, {"EXACT": False, "FRACTION_BITS": 4}, "BOX"),
    ("core_verdict", {**CORE, **TWO_BOXES}, {"SHARPENING": "0 4"}, "BOX"),
    ("raster_refocuser", CORE, {"SHARPENING": "4", "PARALLEL_ROWS": 2}, "SHARPENING"),
    ("raster_refocuser", CORE, {**NORMALISED, "PARALLEL_ROWS": 2}, "BORDER_NORMALISED"),
    ("raster_refocuser", CORE, {"HOLD": True}, "HOLD"),
    ("raster_refocuser", LANES_CORE, {"PIXELS_PER_CLOCK": 3}, "PIXELS_PER_CLOCK"),
    (
        "raster_refocuser",
        LANES_CORE,
        {"PIXELS_PER_CLOCK": 2, "EXACT": False, "FRACTION_BITS": 4},
        "PIXELS_PER_CLOCK",
    ),
    ("raster_refocuser", CORE, {"PIXELS_PER_CLOCK": 2}, "PIXELS_PER_CLOCK"),
    ("raster_refocuser", CORE, {"ENGINE": "x"}, "ENGINE"),
    ("raster_refocuser", CORE, {"ANY_ROWS": True}, "ANY_ROWS"),
    ("raster_refocuser", CORE, {"ENGINE": "moving_sum", "PARALLEL_ROWS": 2}, "PARALLEL_ROWS"),
    ("raster_refocuser", CORE, {"ENGINE": "moving_sum", "MAX_COLUMNS": 1}, "MAX_COLUMNS"),
    *(
        ("core_verdict", {**CORE, "EXACT": True, "PIXEL_BITS": 8}, {name: value}, name)
        for name, value in (("MAX_COLUMNS", 8193), ("PARALLEL_ROWS", 65))
    ),
    ("stack_verdict", {**CORE, "CENTRED": True}, {"MAX_COLUMNS": 8193}, "MAX_COLUMNS"),
    ("focal_stack", CORE, {"PIXELS_PER_CLOCK": 3}, "PIXELS_PER_CLOCK"),
    (
        "focal_stack",
        CORE,
        {"PIXELS_PER_CLOCK": 2, "BORDER_NORMALISED": True},
        "BORDER_NORMALISED",
    ),
    ("depth_index", DEPTH, {"CHANNELS": 2}, "CHANNELS"),
    *(("depth_index", DEPTH, {"PIXELS_PER_CLOCK": p}, "PIXELS_PER_CLOCK") for p in (8, 3)),
    *(
        ("depth_index", DEPTH, {name: True, "PICTURE": False}, name)
        for name in ("CHOSEN_TOO", "SHARP_TOO")
    ),
    *(
        ("stack_axi", CORE | TWICE | JUDGED, more, "SHARP_TOO")
        for more in (
            {"DEPTH_INDEX": False},
            *({"SHIFTS": text} for text in ("-3", "-3 -3 0", "-3 0 -3 0")),
        )
    ),
    ("stack_axi", CORE | TWICE | JUDGED, {"SHIFTS": "2 x"}, "SHIFTS"),
    ("depth_index", DEPTH, {"SLICES": 256, "MAX_COLUMNS": 8192}, "SLICES"),
    ("index_verdict", DEPTH, {"MAX_COLUMNS": 8193}, "MAX_COLUMNS"),
    *(
        ("depth_index", DEPTH, {"SLICES": 3, "SHIFTS": shifts}, "SHIFTS")
        for shifts in ("0 1", "0 2 1", "1 0 x")
    ),
    ("picture_ports", PICTURE, {"OUTPUTS": "rx"}, "OUTPUTS"),
    ("picture_ports", PICTURE, {"OUTPUTS": "rrrrr"}, "OUTPUTS"),
    ("picture_ports", PICTURE, {"COLOURS": "00ff00"}, "COLOURS"),
    ("picture_ports", PICTURE, {"COLOURS": "00FF00" * 2}, "COLOURS"),
    ("picture_ports", PICTURE, {"CHANNELS": 2}, "CHANNELS"),
    ("picture_ports", PICTURE, {"MICRO_IMAGE_SIZE": 1}, "MICRO_IMAGE_SIZE"),
    ("picture_ports", PICTURE, {"SHIFTS": "2 x"}, "SHIFTS"),
    ("picture_ports", PICTURE, {"OUTPUTS": "r", "ENGINE": "x"}, "ENGINE"),
    ("picture_ports", PICTURE, {"SHARP_TOO": True}, "SHARP_TOO"),
    ("picture_ports", PICTURE | TWICE, {"OUTPUTS": "r"}, "SHARP_TOO"),
    ("picture_ports", PICTURE | TWICE, {"SHIFTS": "-3"}, "SHARP_TOO"),
    ("video_ports", CORE, {"SHIFTS": "2, 0"}, "SHIFTS"),
    ("video_ports", CORE, {"ENGINE": "moving_sum", "SHIFTS": "-3000"}, "SHIFTS"),
    (
        "sensor_raster",
        {"MICRO_IMAGE_SIZE": 5, "CHANNELS": 3},
        {"MOSAIC": True, "CHANNELS": 1},
        "MOSAIC",
    ),
    *(
        ("sensor_setup", {"REGISTERS": "010001"}, {"REGISTERS": text}, "REGISTERS")
        for text in ("01000", "01000x", "01000A")
    ),
    *(
        ("csi_receiver", {"LANES": 2, "PIXEL_BITS": 10}, {name: value}, name)
        for name, value in (("LANES", 3), ("PIXEL_BITS", 9), ("PIXELS_PER_CLOCK", 3))
    ),
    ("text_overlay", TEXTS, {"FONT": "0" * 3038}, "FONT"),
    ("text_overlay", TEXTS, {"TEXTS": "a" * 14}, "TEXTS"),
    ("text_overlay", TEXTS, {"LABELS": "bbb"}, "LABELS"),
    ("text_overlay", TEXTS, {"COLOURS": "00ff00"}, "COLOURS"),
    ("command_line", {"STATUS": "a # b #", "FIELDS": 2}, {"FIELDS": 1}, "FIELDS"),
    ("board_control", {"SLICES": 2, "STATUS": "#", "FIELDS": 1}, {"FIRST_SLICE": 2}, "FIRST_SLICE"),
    *((entity, base, more, next(iter(more))) for entity, base, more in INNER),
    ("mode_ports", PATTERN, {"H_BACK": 4095}, "PATTERN_H_ACTIVE"),
    ("mode_ports", PATTERN, {"V_BACK": 4095}, "PATTERN_V_ACTIVE"),
]


@pytest.mark.parametrize(
    ("outputs", "sensor"), [("rm", False), ("m", False), ("rad", True)], ids=str
)
def test_what_a_board_cannot_show(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outputs: str, sensor: bool
) -> None:
    """Constants of `screen_pkg` and `sensor_pkg` must be consistent."""
    sources = plant(
        *(tmp_path / "hdl", hdl.hdl_sources(), "screen_pkg.vhd"),
        *(': string  := "r";', f': string  := "{outputs}";'),
    )
    if sensor:
        sources = plant(
            *(tmp_path / "more", sources, "sensor_pkg.vhd"),
            *("WITH_SENSOR    : boolean  := false", "WITH_SENSOR    : boolean  := true"),
        )
        sources = plant(
            *(tmp_path / "colours", sources, "screen_pkg.vhd"),
            *('COLOURS          : string  := ""', 'COLOURS          : string  := "00ff00"'),
        )
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    folder = tmp_path / "library"
    folder.mkdir()
    bench = Path(__file__).parents[1] / "video" / "video_ports.vhd"
    message = Elaborator("ghdl", folder, bench).refusal("video_ports", CORE)
    assert message.startswith("video_ports: ")
    assert "OUTPUTS" in message
    assert "sensor" in message


@pytest.mark.parametrize("count", [24, pytest.param(len(REFUSED), marks=pytest.mark.slow)])
def test_each_is_named(elaborator: Elaborator, count: int) -> None:
    """Each change alone is refused, with a message that names the generic."""
    taken = seeded().sample(REFUSED, count)
    built = {entity: base for entity, base, _, _ in taken}
    assert elaborator.refusals(list(built.items())) == [""] * len(built)
    messages = elaborator.refusals([(entity, {**base, **more}) for entity, base, more, _ in taken])
    for (entity, _, more, name), message in zip(taken, messages, strict=True):
        assert re.match(r"\w+: ", message), message
        assert name in message, (entity, more, message)
        if name == "SHIFTS" and "MICRO_IMAGE_SIZE" not in message:
            assert f'"{more["SHIFTS"]}"' in message, message


def bits(largest: int) -> int:
    return max(largest.bit_length(), 1)


def width_cases(rng: random.Random, count: int) -> list[tuple[str, str]]:
    """Calls of the packages' functions, and their values in integers of any size."""
    cases = []
    for _ in range(count):
        m, wide = rng.choice([1, 2, 91, 127, 128, rng.randint(1, 128)]), rng.randint(1, 16)
        for channels, weight in ((1, 1), (3, 4)):
            lens = bits(weight * (2**wide - 1) * m * m)
            cases.append((f"lens_bits({m}, {channels}, {wide})", str(lens)))
            radius = rng.randint(0, 8)
            # A Laplacian, |4 a - b - c - d - e|, has two bits more; then sums of 2 r + 1 follow.
            row = lens + 2 + bits(2 * radius)
            name = f"sharpness_bits({m}, {channels}, {wide}, {radius})"
            cases.append((name, str(row + bits(2 * radius))))
        passes, stage = rng.randint(1, 4), rng.randint(0, 8)
        exact = f"(true, {m}, {wide}, 0, 0, {passes})"
        fits = 2**wide * m ** (2 * passes) < 2**31
        cases.append((f"sums_fit({exact})", str(fits).lower()))
        if fits:
            stage = min(stage, 2 * passes)
            largest = (2**wide - 1) * m**stage
            cases.append((f"product_max({exact}, {stage})", str(largest)))
            cases.append((f"value_bits({exact}, {stage})", str(bits(largest))))
            cases.append((f"final_divisor({exact})", str(m ** (2 * passes))))
            total = (2**wide - 1) * m ** (2 * passes)
            units = rng.randint(1, 16)
            share = Fraction(units, 64)
            fraction = max(share.denominator.bit_length() - 1, 2)
            # After the taps of columns the sum is signed, within -2 b to 1 + 4 b times.
            span = int(total * (1 + 4 * share) * 2**fraction)
            name = f"tapped_bits({total}, (0 => {units}, others => 0)) > {span.bit_length()}"
            cases.append((name, "true"))
        guard = rng.randint(0, min(12, 16 - wide))
        scale = rng.randint(guard, 12)
        stored = f"(false, {m}, {wide}, {scale}, {guard}, {passes})"
        if 2 * (2**wide - 1) * 2**scale < m:
            # All products are 0.
            continue
        number = rng.randint(0, 2 * passes - 1)
        value = 2 ** (wide + (guard if number else 0)) - 1
        product = Fraction(value * 2 ** (scale - (guard if number else 0)), m)
        rounded = int(product + Fraction(1, 2))
        cases.append((f"product_max({stored}, {number})", str(rounded)))
    return cases


def text_cases(rng: random.Random, count: int) -> list[tuple[str, str]]:
    """Strings that are sets of integers, or nearly."""
    texts = [*NO_SETS[:-1], "-0", "007", "4096 -4096", "  1  -2 ", "1-2"]
    for _ in range(count):
        parts = [str(rng.randint(-5000, 5000)) for _ in range(rng.randint(0, 4))]
        text = " ".join(parts)
        if rng.random() < 0.6:
            place = rng.randint(0, len(text))
            text = text[:place] + rng.choice(" -+,0x9.") + text[place:]
        texts.append(text)
    cases = []
    for text in texts:
        numbers = text.split()
        is_set = all(
            re.fullmatch("-?[0-9]+", number) and abs(int(number)) <= 4096 for number in numbers
        )
        quoted = f"{chr(34)}{text}{chr(34)}"
        cases.append((f"is_set({quoted}, -4096, 4096)", str(is_set).lower()))
        if is_set and numbers:
            index = rng.randrange(len(numbers))
            cases.append((f"slice_shift({quoted}, {index})", str(int(numbers[index]))))
        cases.append((f"slice_count({quoted})", str(len(numbers))))
    return cases


def test_widths_and_texts(elaborator: Elaborator, tmp_path: Path) -> None:
    """The packages' functions of generics have the values of integers of any size."""
    rng = seeded()
    cases = [*width_cases(rng, 60), *text_cases(rng, 150)]
    used = ("number_set", "refocus", "arithmetic", "core", "sharpen", "sharpness")
    kinds = ["boolean" if value in ("true", "false") else "integer" for _, value in cases]
    lines = [
        *("library work;", *(f"use work.{name}_pkg.all;" for name in used)),
        *("entity computed is", "end entity;", "architecture bench of computed is", "begin"),
        *("process is", "begin"),
        *(
            f'report "<{number}=" & {kind}\'image({expression}) & ">";'
            for number, ((expression, _), kind) in enumerate(zip(cases, kinds, strict=True))
        ),
        *("wait;", "end process;", "end architecture;"),
    ]
    bench = tmp_path / "computed.vhd"
    bench.write_text("\n".join(lines))
    elaborator.analyse(bench)
    found = dict(re.findall(r"<(\d+)=([\w-]+)>", elaborator.printed("computed")))
    assert len(found) == len(cases)
    wrong = [
        f"{expression}: {found[str(number)]}, expected {value}"
        for number, (expression, value) in enumerate(cases)
        if found[str(number)] != value
    ]
    assert not wrong, "\n".join(wrong)
