# SPDX-License-Identifier: Apache-2.0
"""Features of a full build that a scene does not need."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import SliceEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import Device
from plenofir.fpga.resources.estimate import VIDEO, Block, estimate
from plenofir.fpga.screen.board_screen import Screen
from plenofir.plan.choice import Candidate
from plenofir.plan.plan import LeftOut
from plenofir.plan.scene_screen import scene_overlay
from plenofir.plan.sensor.resampler import SensorLogic
from plenofir.plan.sensor.scene_sensor import SensorChip
from plenofir.refocus import automatic_units
from plenofir.refocus.arithmetic import ExactArithmetic, StoredProductArithmetic

# Slices of a full build: a = -1 to 1.
_FULL_RANGE = 1
_FULL_CHANNELS = 3
# Defaults of a scene.
_STORED = StoredProductArithmetic(fraction_bits=8, guard_bits=2)
_STORED_NAME = "stored products (exact sums need none)"
_BORDER = "normalised border"
_REASONS = {
    _BORDER: "the scene wants border = 'zero', which is another picture",
    _STORED_NAME: "they round twice, and the scene's sums are exact",
}
_NOT_ASKED = "the scene does not ask for it"


class _Feature(NamedTuple):
    """What a scene leaves out: blocks with it, and those that stand in their place."""

    name: str
    more: tuple[Block, ...]
    less: tuple[Block, ...]


def _compared(feature: _Feature, device: Device) -> LeftOut:
    """Compare a device's resources with and without a feature.

    A feature whose omission costs more than it saves has a reason.
    """
    before = device.amounts(estimate(feature.less, device.family))
    after = device.amounts(estimate(feature.more, device.family))
    saves = {name: n - before[name] for name, n in after.items() if n > before[name]}
    costs = {name: before[name] - n for name, n in after.items() if n < before[name]}
    is_costly = bool(costs) and _largest_share(saves, device) <= _largest_share(costs, device)
    reason = _REASONS.get(feature.name, _NOT_ASKED) if is_costly else ""
    return LeftOut(what=feature.name, saves=saves, costs=costs, reason=reason)


def _largest_share(amounts: Mapping[str, int], device: Device) -> float:
    """Largest share of a resource of the device."""
    total = device.amounts(device.total)
    return max((n / total[name] for name, n in amounts.items() if total[name]), default=0.0)


def automatic_sharpening(core: CoreConfiguration, shifts: tuple[int, ...]) -> tuple[int, ...]:
    """Weight of each slice for `auto`."""
    m, boxes = core.micro_image_size, core.slice_boxes if shifts == core.shifts else ()
    return tuple(
        automatic_units(m, shift, core.order, box)
        for shift, box in zip(shifts, boxes or (m,) * len(shifts), strict=True)
    )


def full_core(core: CoreConfiguration) -> CoreConfiguration:
    """Build for any scene of a camera: every a' from -M to M and the scene's, RGB."""
    m, engine = core.micro_image_size, core.engine
    low = min(-m * _FULL_RANGE, *core.shifts)
    high = max(m * _FULL_RANGE, *core.shifts)
    shifts = tuple(range(low, high + 1))
    return core.model_copy(
        update={
            "shifts": shifts,
            # No smaller box suits all of them.
            "boxes": (),
            "sharpening": automatic_sharpening(core, shifts) if core.sharpens else (),
            "channels": _FULL_CHANNELS,
            "engine": engine.without_shortcuts() if isinstance(engine, SliceEngine) else engine,
        }
    )


def extent(core: CoreConfiguration) -> str:
    """Size of the part of a core that grows with its set of slices."""
    engine = core.engine
    if isinstance(engine, SliceEngine):
        return f"{engine.extent(core)} {engine.UNIT}"
    return f"{engine.lines(core)} lines of pixels"


def _stored(core: CoreConfiguration) -> CoreConfiguration | None:
    """The core with stored products in place of the division, if it can be built."""
    if core.sharpens or core.weighted or core.pixels_per_clock > 1:
        return None
    # The ROM of products is addressed by a pixel and its guard bits, 16 bits at most.
    guard = min(_STORED.guard_bits, 16 - core.pixel_bits)
    arithmetic = _STORED.model_copy(update={"guard_bits": guard})
    return core.model_copy(update={"arithmetic": arithmetic})


def _of_core(core: CoreConfiguration) -> Iterator[tuple[str, CoreConfiguration]]:
    """Features that the scene leaves out: text, and the core with the feature."""
    full, engine = full_core(core), core.slice_engine
    spare = len(full.shifts) - len(core.shifts)
    if spare > 0:
        whole = full.slice_engine
        size = whole.extent(full)
        yield (
            f"{spare} of {len(full.shifts)} slices, {size - engine.extent(core)} of {size} "
            f"{engine.UNIT}",
            core.model_copy(
                update={
                    "shifts": full.shifts,
                    "boxes": full.boxes,
                    "sharpening": full.sharpening,
                    "engine": whole,
                }
            ),
        )
    if core.channels < full.channels:
        yield (
            f"{full.channels - core.channels} of {full.channels} channels",
            core.model_copy(update={"channels": full.channels}),
        )
    for feature, other in engine.savings(core):
        yield feature, core.model_copy(update={"engine": other})
    weights = automatic_sharpening(core, core.shifts)
    sharpenable = core.exact and core.parallel_rows == 1 and not core.boxes_differ
    if sharpenable and any(weights) and not core.sharpens:
        yield (
            f"sharpening, {2 * core.micro_image_size} lines of sums",
            core.model_copy(update={"sharpening": weights}),
        )
    if core.exact and core.parallel_rows == 1 and not core.sharpens and not core.normalises:
        yield _BORDER, core.model_copy(update={"border": "normalise"})
    if core.order == 0:
        yield "linear interpolation", core.model_copy(update={"order": 1})
    if not core.exact:
        yield (
            "wide sums and division (stored products need none)",
            core.model_copy(update={"arithmetic": ExactArithmetic()}),
        )
    elif (stored := _stored(core)) is not None:
        yield _STORED_NAME, stored


def _of_stack(core: CoreConfiguration, screen: Screen) -> Iterator[_Feature]:
    """What all slices in one pass could be more, and are not."""
    screen, full = replace(screen, overlay=None), screen.in_pairs(full_core(core))
    blocks = screen.blocks(core)
    slices = len(screen.shifts(full))
    spare = slices - len(screen.shifts(core))
    if spare > 0:
        wide = core.model_copy(update={"shifts": full.shifts, "boxes": full.boxes})
        lines = core.engine.lines(wide) - core.engine.lines(core)
        feature = f"{spare} of {slices} slices, {lines} of {extent(wide)}"
        yield _Feature(feature, screen.blocks(wide), blocks)
    if core.channels < full.channels:
        feature = f"{full.channels - core.channels} of {full.channels} channels"
        colour = core.model_copy(update={"channels": full.channels})
        yield _Feature(feature, screen.blocks(colour), blocks)
    further, outputs = {"s": ("depth index", "i"), "i": ("picture in focus", "ai")}, screen.outputs
    judges = len(core.shifts) > 1 and core.pixels_per_clock <= core.micro_image_size
    if outputs in further and judges:
        feature, more_outputs = further[outputs]
        judged = replace(screen, outputs=more_outputs)
        yield _Feature(feature, judged.blocks(core), blocks)


def _of_screen(core: CoreConfiguration, screen: Screen) -> Iterator[_Feature]:
    """Outputs of a board that the scene does not use."""
    if screen.needs_stack:
        yield from _of_stack(core, screen)
    elif len(core.shifts) > 1 and core.micro_image_size > 1:
        stack = core.model_copy(
            update={
                "engine": StackEngine(input_lines=core.micro_image_size),
                "arithmetic": ExactArithmetic(),
                "order": 0,
                "sharpening": (),
            }
        )
        feature = "all-in-focus and depth: focal stack, depth index"
        yield _Feature(feature, Screen(outputs="rad").blocks(stack), core.blocks)
    if screen.overlay is None:
        text = scene_overlay(screen.shifts(core), core.micro_image_size)
        yield _Feature("text over the picture", text.blocks, ())


def _features(chosen: Candidate) -> Iterator[_Feature]:
    core, chip = chosen.core, chosen.loaded.sensor
    path, screen = chosen.loaded.scene.build.path, chosen.loaded.shown
    if not screen.needs_stack:
        for name, other in _of_core(core):
            yield _Feature(name, other.blocks, core.blocks)
        if path == "core" and chosen.device.family == "spartan6":
            # The board, a Spartan-6, has a core of three channels.
            yield _Feature("video timing, TMDS ends, the board's control", (VIDEO,), ())
    if path == "video":
        yield from _of_screen(core, screen)
    elif screen.needs_stack:
        yield from _of_stack(core, screen)
    if chip is not None:
        for name, logic in _of_sensor(chip):
            yield _Feature(name, logic.blocks, chip.logic.blocks)


def left_out(chosen: Candidate) -> tuple[LeftOut, ...]:
    """All features that a scene's core, the board around it, and its sensor leave out."""
    return tuple(_compared(feature, chosen.device) for feature in _features(chosen))


def _of_sensor(chip: SensorChip) -> Iterator[tuple[str, SensorLogic]]:
    """Features that a sensor leaves out: text, and the logic with the feature."""
    core, logic = chip.core, chip.logic
    lenses = chip.raster[0] * chip.raster[1] // core.micro_image_size**2
    if not logic.mosaic:
        colour = core.model_copy(update={"channels": _FULL_CHANNELS})
        yield "colour filter mosaic", SensorLogic(colour, mosaic=True)
    if not core.hexagonal and not core.skewed:
        hexagonal = core.model_copy(update={"hexagonal": True})
        yield "hexagonal grid", replace(logic, core=hexagonal)
    for name, feature in (
        ("moves", "table of lenses for distortion"),
        ("gains", "correction of vignetting"),
    ):
        if not getattr(core, name):
            update = {name: True, "lenses": max(core.lenses, lenses)}
            yield feature, replace(logic, core=core.model_copy(update=update))
