# SPDX-License-Identifier: Apache-2.0
"""The core of a scene: candidates, best first, the first one that fits, and why others do not."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import SLICE_ENGINES, CoreConfiguration
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK, SliceEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import DEVICES, Device, Usage
from plenofir.fpga.families import FAMILIES
from plenofir.fpga.hdmi.modes import find_mode
from plenofir.fpga.names import SliceEngineName
from plenofir.fpga.resources.estimate import VIDEO, Block, Estimate, estimate, is_weighed
from plenofir.ground.errors import InputError
from plenofir.plan.loaded_scene import LoadedScene
from plenofir.plan.plan import EngineOption
from plenofir.plan.scene_box import chosen_boxes
from plenofir.plan.sensor.board_camera import PlannedCamera, lanes_camera, sensor_camera
from plenofir.refocus import interpolation_order, sharpening_units
from plenofir.refocus.arithmetic import ExactArithmetic, StoredProductArithmetic


@dataclass(frozen=True)
class Candidate:
    """A scene's design with a core on a device, and what speaks against it."""

    loaded: LoadedScene
    core: CoreConfiguration
    device: Device

    @cached_property
    def limit(self) -> InputError | None:
        """The limit of core or depth index that is exceeded."""
        try:
            self.core.check_limits()
            if self.loaded.shown.needs_index:
                self.loaded.shown.index(self.core).check_limits()
        except InputError as error:
            return error
        return None

    @cached_property
    def misfit(self) -> str:
        """Why the core cannot follow the scene's video mode; empty if it can."""
        frame = self.loaded.scene.frame
        if self.loaded.scene.build.path != "video" or frame.rate_hz is None:
            return ""
        mode = find_mode(*self.loaded.video_size, frame.rate_hz)
        clocks, lines = self._line_steps, self.core.frame_lines(frame.rows)
        if mode is not None and clocks > mode.h_total:
            return f"lines of {clocks} clocks, the mode has {mode.h_total}"
        if mode is not None and lines > mode.v_total:
            return f"frames of {lines} lines, the mode has {mode.v_total}"
        return ""

    @property
    def refused(self) -> str:
        """Why the core cannot be used at any clock; empty if it can."""
        if self.limit is not None:
            return self.limit.problem
        pixels = self.loaded.scene.build.pixels_per_clock
        if pixels not in ("auto", self.core.pixels_per_clock):
            return f"takes one pixel a clock, not {pixels}"
        return self.misfit

    @cached_property
    def slow(self) -> str:
        """Why the core does not reach the scene's frame rate; empty if it does."""
        scene, pixels = self.loaded.scene, self.core.pixels_per_clock
        frame, lanes = scene.frame, scene.lanes
        needed, asked = self.clock[0], scene.build.clock_mhz
        kept = self.core.kept_mhz(self.device) if asked is None else asked
        if scene.build.path == "video" or needed is None or needed <= kept:
            return ""
        each = "a pixel" if pixels == 1 else f"{pixels} pixels"
        limit = f"cores keep {kept:g} MHz" if kept else "no clock is known for so many"
        if asked is not None:
            limit = f"build.clock_mhz is {asked:g}"
        size = f"{frame.columns} x {frame.rows}"
        load = size if frame.rate_hz is None else f"{size} at {frame.rate_hz:g} Hz"
        if lanes is not None and needed == lanes.pixels_mhz(frame.bits) / pixels:
            load = f"{lanes.number} x {lanes.mbits:g} Mb/s of {frame.bits} bits"
        return (
            f"{load} needs {needed:.4g} MHz at {each} a clock; on the {self.device.title} {limit}"
        )

    @cached_property
    def _line_steps(self) -> int:
        """Clocks from the beginning of a line to that of the next one at the earliest."""
        columns, steps = self.loaded.scene.frame.columns, 0
        if self.loaded.shown.needs_index:
            steps = self.loaded.shown.index(self.core).band_steps(columns)
        return max(self.core.band_steps(columns), steps)

    @cached_property
    def clock(self) -> tuple[float | None, int]:
        """Pixel clock in MHz that the frame rate needs, and clocks for each frame."""
        core, scene, frame = self.core, self.loaded.scene, self.loaded.scene.frame
        # One token per clock on the raster's streams, however many rows the array takes at once.
        lines = core.frame_lines(frame.rows)
        if self.loaded.shown.needs_index:
            lines = max(lines, self.loaded.shown.index(core).frame_lines(frame.rows))
        blank_pixels, blank_lines = frame.blank
        line = max(core.line_tokens(frame.columns + blank_pixels), self._line_steps)
        # Lines that the array still needs at the end of a frame fall into the blanking.
        clocks = line * max(lines, frame.rows + blank_lines)
        if core.parallel_rows > 1:
            clocks = frame.columns * frame.rows
        if (chip := self.loaded.sensor) is not None:
            clocks = max(clocks, chip.columns * chip.rows)
        needed = None if frame.rate_hz is None else clocks * frame.rate_hz / 1e6
        if scene.lanes is not None:
            # The rate within a line, as no buffer holds a whole line.
            needed = max(needed or 0, scene.lanes.pixels_mhz(frame.bits) / core.pixels_per_clock)
        return needed, clocks

    @cached_property
    def camera(self) -> PlannedCamera | None:
        """The camera of a scene whose board has its lanes."""
        loaded, scene = self.loaded, self.loaded.scene
        if scene.build.path != "camera":
            return None
        board, rate, needed = board_of(scene.build.device), scene.frame.rate_hz, self.clock[0]
        assert board is not None
        if scene.lanes is not None:
            assert needed is not None
            registers, where = loaded.registers, f"{loaded.path}: lanes"
            return lanes_camera(scene.lanes, registers, self.core, board, rate, needed, where=where)
        assert scene.sensor is not None
        where = f"{loaded.path}: sensor"
        return sensor_camera(scene.sensor, self.core, board, rate, needed, where=where)

    @property
    def blocks(self) -> Iterator[Block]:
        """Blocks of the core, and of all that is built around it."""
        loaded = self.loaded
        yield from loaded.shown.blocks(self.core)
        if loaded.sensor is not None:
            yield from loaded.sensor.logic.blocks
        if loaded.scene.build.path == "video":
            yield VIDEO
        if self.camera is not None:
            yield self.camera.block_around(self.core)
        if loaded.stored is not None:
            yield from loaded.stored.blocks

    @cached_property
    def usage(self) -> Estimate:
        """Resources of the whole design."""
        return estimate(self.blocks, self.device.family)

    @property
    def scarcest(self) -> tuple[float, str]:
        """The resource of which the design takes the largest share of the device, and the share."""
        totals, needs = self.device.amounts(self.device.total), self.device.amounts(self.usage)
        return max((needed / totals[name], name) for name, needed in needs.items() if totals[name])

    def with_pixels(self) -> "Candidate":
        """The core with the scene's pixels per clock; by default the fewest for its rate, else one.

        The resampler gives one pixel a clock.
        """
        pixels_asked = self.loaded.scene.build.pixels_per_clock
        if self.loaded.sensor is not None:
            pixels_asked = 1
        if "pixels_per_clock" not in type(self.core.engine).model_fields:
            return self
        for pixels in PIXELS_PER_CLOCK if pixels_asked == "auto" else (pixels_asked,):
            engine = self.core.engine.model_copy(update={"pixels_per_clock": pixels})
            other = replace(self, core=self.core.model_copy(update={"engine": engine}))
            if pixels_asked != "auto" or not (other.refused or other.slow):
                return other
        return self


def _size(usage: Usage) -> tuple[int, int]:
    return usage.block_rams, usage.lut + usage.flip_flops


def _arithmetics(loaded: LoadedScene) -> Iterator[ExactArithmetic | StoredProductArithmetic]:
    """Permitted arithmetics, best first."""
    build = loaded.scene.build
    if build.arithmetic in ("auto", "exact"):
        yield ExactArithmetic()
    if build.arithmetic == "stored":
        yield StoredProductArithmetic(
            fraction_bits=build.fraction_bits, guard_bits=build.guard_bits
        )
    if build.arithmetic == "auto":
        room = 16 - loaded.scene.frame.bits
        for fraction in range(build.fraction_bits, -1, -1):
            guard = min(build.guard_bits, fraction, room)
            yield StoredProductArithmetic(fraction_bits=fraction, guard_bits=guard)


def _candidates(
    loaded: LoadedScene, shifts: tuple[int, ...], device: Device
) -> Iterator[Candidate]:
    """Suitable cores in order of preference: best arithmetic first, then smallest."""
    scene, build = loaded.scene, loaded.scene.build
    m, boxes = scene.camera.micro_image_size, chosen_boxes(loaded, shifts)
    if boxes and loaded.shown.sharp_box is not None:
        raise InputError(
            "sharp_box needs slices of M samples, which are judged; leave build.box, resolution "
            "and noise out",
            where=f"{loaded.path}: {'screen' if scene.stack is None else 'stack'}.sharp_box",
        )
    raster = CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=scene.frame.columns,
        channels=scene.frame.channels,
        pixel_bits=scene.frame.bits,
        boxes=boxes,
        border=build.border,
    )
    if loaded.shown.needs_stack:
        # A core behind video cannot wait, see picture_core.vhd.
        engine = StackEngine(input_lines=m if build.path == "video" else 1)
        core = loaded.shown.in_pairs(raster.model_copy(update={"engine": engine}))
        stack = Candidate(loaded, core, device)
        yield stack if build.path == "video" else stack.with_pixels()
        return
    order = interpolation_order(build.interpolation)
    weights = tuple(
        sharpening_units(build.sharpen, m, shift, order, box=box)
        for shift, box in zip(shifts, raster.slice_boxes, strict=True)
    )
    exact_alone = any(weights) or raster.weighted
    sharpening = weights if any(weights) else ()
    for arithmetic in _arithmetics(loaded):
        if exact_alone and not isinstance(arithmetic, ExactArithmetic):
            continue
        update = {"arithmetic": arithmetic, "order": order, "sharpening": sharpening}
        core = raster.model_copy(update=update)
        tried = [
            c for kind in SLICE_ENGINES.values() for c in _variants(loaded, core, kind, device)
        ]
        if build.engine == "auto":
            tried = [c for c in tried if is_weighed(c.core.engine.kind) and not c.misfit]
        else:
            tried = [c for c in tried if c.core.engine.kind == build.engine]
        if build.pixels_per_clock != "auto":
            tried = [c for c in tried if c.core.pixels_per_clock == build.pixels_per_clock]
        # If all are too slow, one remains, so that its reason is told.
        tried = [c for c in tried if not c.slow] or tried[-1:]
        # The smaller variant of each engine (the simpler one wins a tie), then the better engine.
        smallest = sorted(tried, key=lambda c: _size(c.usage))
        yield from sorted(smallest, key=lambda c: c.scarcest[0])


def _variants(
    loaded: LoadedScene, core: CoreConfiguration, kind: type[SliceEngine], device: Device
) -> list[Candidate]:
    """A core with each variant of an engine; without blanking, those that need no pause."""
    scene = loaded.scene
    frame = scene.frame
    blanking = scene.build.path != "core" or frame.rate_hz is None or frame.blank[1] > 0
    rows = None if blanking else scene.frame.rows
    engines = kind.variants(core, scene.build.parallel_rows, rows)
    cores = (core.model_copy(update={"engine": engine}) for engine in engines)
    return [Candidate(loaded, core, device).with_pixels() for core in cores]


def choose_core(loaded: LoadedScene, shifts: tuple[int, ...], device: Device) -> Candidate:
    """Take the first candidate that fits; InputError with the reason if there is none."""
    slow, large, limits = [], [], []
    for candidate in _candidates(loaded, shifts, device):
        if candidate.limit is not None:
            limits.append(candidate.limit)
        elif candidate.slow:
            slow.append(candidate)
        elif device.overflow(candidate.usage):
            large.append(candidate)
        else:
            return candidate
    # The obstacle that comes last is told, because that core was nearest to being built.
    if large:
        raise _too_small(loaded, device, min((c.usage for c in large), key=_size))
    if slow:
        where = f"{loaded.path}: frame.rate_hz"
        raise InputError(f"{slow[0].slow}; use {_faster(slow[0])}", where=where)
    raise InputError(limits[-1].problem, where=str(loaded.path))


def _faster(slow: Candidate) -> str:
    """Advice for a frame rate that a device does not reach."""
    camera = slow.loaded.scene.build.path == "camera"
    for device in DEVICES.values():
        if camera and ((board := board_of(device.name)) is None or board.camera is None):
            continue
        # A clock that no tool has shown is no advice.
        other = replace(slow, device=device).with_pixels()
        if not (device.assumed or device.overflow(other.usage) or other.slow):
            return f"a lower rate, a smaller frame, or build.device = {device.name!r}"
    return "a lower rate or a smaller frame"


_LESS_STACK = {
    "slices": "columns or channels",
    "depth": "columns or votes, stack.output = 'slices'",
    "all-in-focus": "columns or votes, stack.output = 'depth'",
}
"""What makes a focal stack smaller, besides fewer slices, by its output."""


def _too_small(loaded: LoadedScene, device: Device, usage: Usage) -> InputError:
    family = [other for other in DEVICES.values() if other.family == device.family]
    larger = [other.name for other in family if not other.overflow(usage) and other != device]
    kind = FAMILIES[device.family].title
    others = "channels or columns, another arithmetic"
    if loaded.shown.needs_stack:
        stack = loaded.scene.stack
        others = 'columns or votes, screen.output = ["refocused"]'
        if stack is not None:
            others = _LESS_STACK[stack.output]
    fits = f", or build.device = {larger[0]!r}" if larger else f"; no {kind} is large enough"
    return InputError(
        f"the {device.name.upper()} is too small: it needs "
        f"{'; '.join(device.overflow(usage))}; use fewer slices, {others}{fits}",
        where=str(loaded.path),
    )


_STACK_PURPOSES = {"s": "", "i": ", for depth"}
"""What all slices in one pass are for, by a screen's outputs; others: all-in-focus and depth."""


def engine_choice(chosen: Candidate) -> tuple[tuple[EngineOption, ...], str]:
    """All engines with the arithmetic of the chosen core, and the reason of the choice."""
    loaded, core, device = chosen.loaded, chosen.core, chosen.device
    if loaded.shown.needs_stack:
        refused = "gives one slice at a time; the scene needs all"
        engines = (EngineOption(engine=e, needs=None, refused=refused) for e in SLICE_ENGINES)
        purpose = _STACK_PURPOSES.get(loaded.shown.outputs, ", for all-in-focus and depth")
        return tuple(engines), f"all slices in one pass{purpose}"
    best, refusals = dict[SliceEngineName, Candidate](), dict[SliceEngineName, str]()
    for name, engine in SLICE_ENGINES.items():
        tried = [chosen] if core.engine.kind == name else _variants(loaded, core, engine, device)
        if not is_weighed(name):
            refusals[name] = "was never synthesised, so its size is not known"
        elif not tried:
            refusals[name] = f"takes one row at once, not {core.parallel_rows}"
        else:
            best[name] = min(tried, key=lambda c: _size(estimate(c.core.blocks, device.family)))
            refusals[name] = best[name].refused or best[name].slow
    options = tuple(
        EngineOption(
            engine=name,
            needs=None if refused else device.amounts(best[name].usage),
            refused=refused,
        )
        for name, refused in refusals.items()
    )
    other = next(name for name in refusals if name != core.engine.kind)
    if loaded.scene.build.engine != "auto":
        return options, "as the scene wants it"
    if refusals[other]:
        return options, f"{other}: {refusals[other]}"
    if over := "; ".join(device.overflow(best[other].usage)):
        return options, f"{other} would not fit: {over}"
    (share, scarce), (other_share, other_scarce) = chosen.scarcest, best[other].scarcest
    return options, (
        f"{share:.0%} of the device's {scarce}, {other} {other_share:.0%} of its {other_scarce}"
    )
