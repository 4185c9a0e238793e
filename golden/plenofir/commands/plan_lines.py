# SPDX-License-Identifier: Apache-2.0
"""The plan of a scene as lines of text."""

from collections.abc import Iterable
from fractions import Fraction
from math import inf
from typing import TYPE_CHECKING

from plenofir.commands.console import print_line, print_table
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.plan.placements import BesideFull
    from plenofir.plan.plan import Plan, PlannedSensor


def _millimetres(value: float | None) -> str:
    return "inf" if value is None or value == inf else f"{value:.1f}"


def _amounts(amounts: dict[str, int]) -> str:
    return ", ".join(f"{amount} {name}" for name, amount in amounts.items())


def _takes(plan: "Plan", kind: str) -> str:
    """Amounts of a device that blocks of a kind in a plan's core take."""
    from plenofir.fpga.resources.estimate import estimate

    device = plan.chip
    blocks = (block for block in plan.core.blocks if block.kind == kind)
    amounts = device.amounts(estimate(blocks, device.family))
    return _amounts({name: amount for name, amount in amounts.items() if amount})


def _sharpening(plan: "Plan") -> str:
    """Weights of the slices, and what they take."""
    from plenofir.fpga.core.sharpener import sharpener_bits
    from plenofir.refocus.sharpening import WEIGHT_UNITS

    core = plan.core
    weights = " ".join(str(Fraction(weight, WEIGHT_UNITS)) for weight in core.weights)
    lines = 2 * core.micro_image_size
    kbit = sharpener_bits(core, core.pixels_per_clock) / 1024
    return (
        f"b = {weights}: {lines} lines of sums ({kbit:.0f} Kbit), takes {_takes(plan, 'sharpener')}"
    )


def print_sensor(sensor: "PlannedSensor") -> None:
    """Print what makes the raster of raw frames."""
    core = sensor.core
    mosaic = "" if sensor.mosaic is None else f", mosaic {sensor.mosaic}"
    lenses = "hexagonal rows" if core.hexagonal else "rectangular"
    if core.skewed:
        lenses = "a focused camera"
    source = "calibration built in" if sensor.calibrated else "calibration loaded at run time"
    print_line(
        "sensor",
        f"{sensor.columns} x {sensor.rows}, {core.pixel_bits} bit{mosaic}; {lenses}, {source}",
    )
    print_line("ring", f"{sensor.lines} raw lines ({sensor.ring_bits / 1024:.0f} Kbit)")
    if not sensor.full_rate:
        print_line("note", "the raster has more pixels than the raw frame: the source must wait")
    needs = {name: amount for name, amount in sensor.needs.items() if amount}
    print_line("resampler", f"takes {_amounts(needs)}")


_OUTPUTS = {
    "r": "refocused",
    "a": "all-in-focus",
    "d": "depth",
    "i": "depth index",
    "s": "all slices",
}


def print_screen(plan: "Plan") -> None:
    """Print what comes out besides the refocused slice."""
    screen = plan.screen
    if screen.needs_stack:
        print_line("output", ", ".join(_OUTPUTS[letter] for letter in screen.outputs))
    if screen.needs_index:
        votes = f", votes within {screen.vote_radius}" if screen.vote_radius else ""
        if screen.sharp_box is not None:
            votes += f", a box of {screen.sharp_box} in focus"
        waiting = screen.index(plan.core).memory_bits[0]
        print_line(
            "index",
            f"sharpness within {screen.radius} micro images{votes}; "
            + (f"pixels wait in {waiting / 1024:.0f} Kbit" if waiting else "no pixel waits"),
        )
    if screen.overlay is not None and plan.screen_needs is not None:
        takes = {name: amount for name, amount in plan.screen_needs.items() if amount}
        print_line("text", f"takes {_amounts(takes)}")
        for text in screen.overlay.texts:
            print_line("", text)
    if plan.stored is not None and plan.stored_needs is not None:
        takes = {name: amount for name, amount in plan.stored_needs.items() if amount}
        rows, columns = plan.stored.lenses
        print_line("stored", f"{columns} x {rows} micro images, takes {_amounts(takes)}")


def beside(needed: float, full: float) -> tuple[str, str, str]:
    """An amount, that of the full build, and what leaving out changes."""
    change = f"{round(100 * (needed / full - 1)):+d}%" if full else ""
    # A change that rounds to nothing has no sign.
    return f"{needed:g}", f"{full:g}", "0%" if change == "+0%" else change


def print_placed(placement: "BesideFull") -> None:
    """Print what was recorded of a shipped scene's core and its full build, their clocks too."""
    print_table(
        ("core, placed", "this scene", "full build", "change"),
        [(name, *beside(needed, placement.full[name])) for name, needed in placement.scene.items()],
        left=("core, placed",),
        title=f"recorded, on an {placement.device}",
    )


def _print_frames(plan: "Plan") -> None:
    """Print what comes in: frames, sensor, camera, video, and the clock."""
    from plenofir.fpga.hdmi.edid import describe_edid

    core = plan.core
    frame = f"{plan.columns} x {plan.rows}, {core.channels} x {core.pixel_bits} bit"
    # Video has one clock; a core alone may run faster.
    least = "" if plan.path == "video" else "at least "
    clock = "still" if plan.clock_mhz is None else f"pixel clock {least}{plan.clock_mhz:g} MHz"
    print_line("scene", f"{plan.scene}: {frame}, M = {core.micro_image_size}, {clock}")
    if plan.sensor is not None:
        print_sensor(plan.sensor)
    if core.pixels_per_clock > 1 and plan.clock_mhz is not None:
        print_line(
            "pixels",
            f"{core.pixels_per_clock} a clock, {plan.columns * plan.rows / plan.frame_clocks:.3g} "
            "with the ends of lines",
        )
    if plan.path == "core":
        trusted = f"keeps {plan.kept_mhz:g} MHz" if plan.kept_mhz else "has no known clock"
        print_line(
            "clock",
            f"built for {plan.built_mhz:g} MHz; the {plan.part} {trusted}"
            + " (assumed: no open tool places it in this grade)" * plan.chip.assumed,
        )
    if plan.blanking is not None:
        board = "in and out on the board, " if plan.path == "video" else ""
        print_line(
            "video",
            f"{board}blanking of {plan.blanking[0]} pixels and {plan.blanking[1]} lines",
        )
    if (camera := plan.camera) is not None:
        slow, fast = camera.clock_mhz, camera.wanted_mhz
        clock = f"{slow:g} MHz" if slow == fast else f"{slow:g} to {fast:g} MHz"
        print_line(
            "camera",
            f"{camera.board.lanes} lanes of {camera.lane_mbits:g} Mb/s, their bytes at "
            f"{camera.byte_mhz:g} MHz; the core's clock is {clock}, {camera.needed_mhz:.4g} needed",
        )
    if plan.edid is not None:
        print_line("edid", f"the scene's own: {describe_edid(bytes.fromhex(plan.edid))}")


def print_plan(plan: "Plan", placement: "BesideFull | None") -> None:
    """Print a plan for a person, and what is recorded of its core."""
    _print_frames(plan)
    core = plan.core
    for part in plan.slices:
        depth = (
            ""
            if part.near_mm is None
            else f", sharp from {_millimetres(part.near_mm)} to {_millimetres(part.far_mm)} mm"
        )
        print_line("slice", f"a = {part.a} (a' = {part.shift}){depth}")
        print_line(
            "",
            f"box of {part.box}: half contrast at {part.half_contrast:.3f} cycles a micro lens, "
            f"noise {part.noise:.3f} of the raw image's",
        )
    for low, high in plan.gaps_mm:
        print_line("not covered", f"{_millimetres(low)} to {_millimetres(high)} mm")
    for note in plan.notes:
        print_line("note", note)
    for name, text in core.engine.describe(core, plan.rows):
        print_line(name, text)
    print_screen(plan)
    if core.sharpens:
        print_line("sharpening", _sharpening(plan))
    if core.normalises:
        takes = _takes(plan, "border")
        print_line("border", f"divided by the views that reach it, takes {takes}")
    print_line("engine", f"{core.engine.kind}: {plan.engine_reason}")
    for option in plan.engines:
        # The reason of the choice has told it already.
        if option.refused and option.refused in plan.engine_reason:
            continue
        numbers = option.refused if option.needs is None else _amounts(option.needs)
        print_line("", f"{option.engine}: {numbers}")
    arithmetic = core.arithmetic.model_dump()
    widths = "".join(f", {name} {value}" for name, value in arithmetic.items() if name != "kind")
    bound = f"error at most {plan.error_bound:.3g} grey levels"
    print_line("arithmetic", f"{core.arithmetic.kind}{widths}; {bound}")
    print_line(
        "latency",
        f"{plan.latency_clocks} clocks ({plan.latency_lines} lines); "
        f"{plan.frame_clocks} clocks for each frame",
    )
    print_table(
        ("estimate", "this scene", "full build", "change", plan.device.upper()),
        [
            (name, *beside(needed, plan.full[name]), str(plan.available[name]))
            for name, needed in plan.needs.items()
        ],
        left=("estimate",),
    )
    print_line("estimate", plan.error_class)
    if plan.video_needs is not None:
        video = {name: amount for name, amount in plan.video_needs.items() if amount}
        print_line("video", f"takes {_amounts(video)} of it")
    print_line("full build", plan.full_build)
    # A full set of slices needs no logic that selects between a few.
    above = {name: n - plan.full[name] for name, n in plan.needs.items() if n > plan.full[name]}
    if above:
        print_line("", f"takes {_amounts(above)} less than this scene")
    if placement is not None:
        print_placed(placement)
    for omission in plan.left_out:
        change = omission.change(plan.available)
        change_text = ": ".join(filter(None, (omission.what, change)))
        print_line("left out", "; ".join(filter(None, (change_text, omission.reason))))


def print_boxes(plans: "Iterable[tuple[int, Plan | InputError]]", chosen: "Plan") -> None:
    """Print what boxes of a scene's slices resolve, what noise they leave, and what they take."""

    def span(values: Iterable[float]) -> str:
        """The least and the largest, or the one that all are."""
        texts = [f"{value:.3f}" for value in sorted(values)]
        return " to ".join(dict.fromkeys((texts[0], texts[-1])))

    rows, refused = [], []
    for box, plan in plans:
        if isinstance(plan, InputError):
            refused.append((box, plan))
            continue
        mark = "*" * (plan.core.slice_boxes == chosen.core.slice_boxes)
        parts = plan.slices
        qualities = span(p.half_contrast for p in parts), span(p.noise for p in parts)
        rows.append((f"{mark}{box}", *qualities, *map(str, plan.needs.values())))
    heads = ("box", "half contrast", "noise", *chosen.needs)
    title = "boxes, or the smallest larger ones that a slice can have; * as planned"
    print_table(heads, rows, title=title, width=100)
    for box, error in refused:
        print_line("not possible", f"a box of {box}: {error.problem}")
