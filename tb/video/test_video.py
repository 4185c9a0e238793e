# SPDX-License-Identifier: Apache-2.0
"""Video in, refocused video out."""

from pathlib import Path
from typing import Any

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, SHADES, Screen, screen_package
from plenofir.refocus.sharpness import has_order
from plenofir_tb.drawn import bench_filter
from plenofir_tb.runner import Case, run_cases
from plenofir_tb.video import MODE_720, shrunken

# Of frames of random pixels about half of the micro images have this much texture.
CONFIDENCE = 4000


def video_case(
    m: int,
    shifts: tuple[int, ...],
    mode: VideoMode,
    *,
    thorough: bool = False,
    outputs: str = "r",
    radius: int = 1,
    boxes: tuple[int, ...] = (),
    **options: int | bool,
) -> Case:
    """A case; with boxes each slice comes twice, with M samples and with its box."""
    between = "d" in outputs and len(shifts) > 2 and has_order(shifts)
    count = len(shifts) * (SHADES if between else 1)
    colours = [[(40 * i + 90 * c) % 256 for c in range(3)] for i in range(count)]
    vote_radius = options.pop("VOTE_RADIUS", 0)
    confidence = options.pop("CONFIDENCE", 0)
    shown = Screen(
        outputs=outputs,
        radius=radius,
        confidence=confidence,
        vote_radius=vote_radius,
        colours=tuple((red, green, blue) for red, green, blue in colours),
        between=between,
        sharp_box=min(boxes, default=None),
    )
    layout = CoreConfiguration(micro_image_size=m, shifts=shifts, max_columns=64)
    twice = [shift for shift in shifts for _ in range(2)] if boxes else shifts
    delay_lines = layout.delay + ((radius + vote_radius + 3) * m - 1) * (outputs != "r")
    return Case(
        "video_ports",
        "video.video_bench",
        {
            "MICRO_IMAGE_SIZE": m,
            "SHIFTS": " ".join(map(str, twice)),
            "BOX": " ".join(f"{m} {box}" for box in boxes),
            "MAX_COLUMNS": 64,
            **options,
        },
        {
            "m": m,
            "shifts": shifts,
            "boxes": boxes,
            "outputs": outputs,
            "radius": radius,
            "confidence": confidence,
            "vote_radius": vote_radius,
            "colours": colours,
            "between": between,
            "delay_lines": delay_lines,
            "order": options.get("INTERPOLATION_ORDER", 0),
            "stored": not options.get("EXACT", True),
            "max_columns": options.get("MAX_COLUMNS", 64),
            "mode": mode.model_dump(),
            "thorough": thorough,
        },
        {} if outputs == "r" else {SCREEN_PACKAGE: screen_package(shown)},
    )


def run_thorough(outputs: str, shifts: tuple[int, ...] = (2, 0, -1), **more: Any) -> None:
    """The whole bench, which simulates longer than it compiles."""
    mode = shrunken("mini")
    run_cases([video_case(3, shifts, mode, thorough=True, outputs=outputs, **more)], long=True)


def test_refocus_video(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Path(__file__).with_name("video_bench.py")
    monkeypatch.setenv("COCOTB_TEST_FILTER", bench_filter(1, bench))
    run_thorough("r")


@pytest.mark.drawn(1, "stacks behind video")
@pytest.mark.parametrize(
    "more", [{}, {"shifts": (2, -1), "boxes": (2, 1), "CONFIDENCE": CONFIDENCE}]
)
def test_all_in_focus_and_depth(monkeypatch: pytest.MonkeyPatch, more: dict[str, Any]) -> None:
    monkeypatch.setenv("COCOTB_TEST_FILTER", "slices_change")
    run_thorough("rad", **more)


@pytest.mark.slow
@pytest.mark.parametrize("more", [{}, {"boxes": (2, 3, 1), "CONFIDENCE": CONFIDENCE}])
def test_more_of_all_in_focus_and_depth(more: dict[str, Any]) -> None:
    run_thorough("rad", **more)


@pytest.mark.slow
def test_blanking_of_stacks() -> None:
    cases = []
    for m, shifts, outputs, radius, changes in [
        # Lines of a frame, blanking included, that are M - 1, M - 2, 0 above a multiple of M.
        (5, (-1, 2), "dr", 0, {"v_active": 24, "v_front": 1, "v_sync": 1, "v_back": 3}),
        (4, (1, 0, 3), "ad", 1, {"v_active": 30, "v_back": 1, "h_back": 60}),
        (3, (-2, 1), "d", 2, {"v_active": 22, "v_front": 1, "v_sync": 1, "v_back": 21}),
    ]:
        mode = shrunken("stack", **{"v_active": 22, **changes})
        cases.append(video_case(m, shifts, mode, outputs=outputs, radius=radius))
    # Lines longer than the index holds: with four slices 32 pixels are under way in it, and 64
    # words are too few after a stall.
    mode = shrunken("wide", h_active=80, v_active=16, v_back=5, h_back=30)
    votes = {"VOTE_RADIUS": 1, "CONFIDENCE": 5400, "MAX_COLUMNS": 80}
    run_cases([*cases, video_case(2, (-1, 0, 1, 2), mode, outputs="rad", **votes)])


def test_blanking_and_other_latencies() -> None:
    cases = [
        video_case(m, (shift,), MODE_720.model_copy(update=changes))
        for m, shift, changes in [
            # Flush lines in the vertical blanking, as many as fit, one more, and many more.
            (5, -1, {"v_back": 6}),
            (3, -2, {"v_front": 1, "v_sync": 1, "v_back": 2, "h_positive": False}),
            (5, -2, {"v_back": 3, "h_back": 30}),
            (5, -3, {"v_back": 2, "h_back": 40}),
            (1, 0, {"v_positive": False}),
        ]
    ]
    stored = {"EXACT": False, "FRACTION_BITS": 4, "GUARD_BITS": 2, "BROADCAST_TAPS": 2}
    for options in ({"INTERPOLATION_ORDER": 1}, stored):
        cases.append(video_case(3, (-1, 2), MODE_720, **options))
    run_cases(cases, long=True)


def unit(entity: str, generics: dict, *, bench: str = "unit", **case: object) -> Case:
    return Case(entity, f"video.{bench}_bench", generics, {"entity": entity, **case})


# Limits of video_to_stream: the bench has modes that just meet them.
LIMITS = {"MAX_COLUMNS": 12, "DELAY_LINES": 6, "DELAY_PIXELS": 14, "BLANK_LINES": 4}


def test_units() -> None:
    mode = shrunken("any", h_sync=5, v_sync=3, v_positive=False)
    given = mode.model_dump()
    parts = {key.upper(): part for key, part in given.items() if key[:2] in ("h_", "v_")}
    pattern = {
        **{"micro_image_size": 3, "left_shift": 2, "middle_shift": 0, "right_shift": -4},
        **{"middle_begin": 19, "right_begin": 40},
    }
    run_cases(
        [
            unit("video_timing_meter", {}, bench="input"),
            unit("raster_generator", {}),
            unit("camera_timing", {"LATE_LINES": 3}, late=3),
            unit(
                "mode_ports",
                {key.upper(): part for key, part in parts.items()},
                mode=mode.model_dump(),
            ),
            Case("full_range_rgb", "video.colour_bench"),
            unit("video_to_stream", LIMITS, bench="input"),
            Case(
                "video_to_stream",
                "video.input_bench",
                {**LIMITS, "ROW_MODULUS": 5},
                {"entity": "more_rows", "modulus": 5},
            ),
            unit("stream_to_video", {"DELAY_PIXELS": 3}, lines=1, pixels=3),
            Case(
                "stream_to_video",
                "video.unit_bench",
                {"DELAY_PIXELS": 3, "WINDOW": True},
                {"entity": "window", "lines": 1, "pixels": 3},
            ),
            unit("picture_marks", {"LINES": 3}, lines=3),
            unit(
                "light_field_pattern",
                {name.upper(): value for name, value in pattern.items()},
                **pattern,
                mode={"h_active": 61, "v_active": 41},
            ),
        ]
    )
