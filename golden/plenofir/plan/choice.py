# SPDX-License-Identifier: Apache-2.0
"""The core of a scene: candidates, best first, the first one that fits, and why others do not."""

from collections.abc import Iterator

from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import SLICE_ENGINES, CoreConfiguration
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK, SliceEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import DEVICES, Device, Usage
from plenofir.fpga.families import FAMILIES
from plenofir.fpga.names import SliceEngineName
from plenofir.fpga.resources.estimate import estimate, is_weighed
from plenofir.ground.errors import InputError
from plenofir.plan.design import design_with
from plenofir.plan.plan import EngineOption
from plenofir.plan.scene import LoadedScene
from plenofir.plan.timing import misfit, too_slow
from plenofir.refocus import interpolation_order, sharpening_units
from plenofir.refocus.arithmetic import ExactArithmetic, StoredProductArithmetic


def _arithmetics(
    loaded: LoadedScene,
) -> Iterator[ExactArithmetic | StoredProductArithmetic]:
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
) -> Iterator[CoreConfiguration]:
    """Suitable cores in order of preference: best arithmetic first, then smallest."""
    scene = loaded.scene
    if loaded.shown.needs_stack:
        core = _stack_core(loaded, shifts)
        yield core if scene.build.path == "video" else _with_pixels(loaded, core, device)
        return
    wanted = scene.build.engine
    order = interpolation_order(scene.build.interpolation)
    m = scene.camera.micro_image_size
    weights = tuple(sharpening_units(scene.build.sharpen, m, shift, order) for shift in shifts)
    for arithmetic in _arithmetics(loaded):
        exact_alone = any(weights) or scene.build.border == "normalise"
        if exact_alone and not isinstance(arithmetic, ExactArithmetic):
            continue
        raster = CoreConfiguration(
            micro_image_size=m,
            shifts=shifts,
            max_columns=scene.frame.columns,
            channels=scene.frame.channels,
            pixel_bits=scene.frame.bits,
            arithmetic=arithmetic,
            order=order,
            sharpening=weights if any(weights) else (),
            border=scene.build.border,
        )
        cores = [
            core
            for kind in SLICE_ENGINES.values()
            for core in _variants(loaded, raster, kind, device)
        ]
        if wanted == "auto":
            weighed = [core for core in cores if is_weighed(core.engine.kind)]
            cores = [core for core in weighed if not misfit(loaded, core)]
        else:
            cores = [core for core in cores if core.engine.kind == wanted]
        if scene.build.pixels_per_clock != "auto":
            cores = [c for c in cores if c.pixels_per_clock == scene.build.pixels_per_clock]
        cores = [core for core in cores if not too_slow(loaded, core, device)] or cores[-1:]
        # The smaller variant of each engine (the simpler one wins a tie), then the better engine.
        usages = {core: _needs(loaded, core, device) for core in cores}
        smallest = sorted(cores, key=lambda core: _size(usages[core]))
        yield from sorted(smallest, key=lambda core: _scarcest(usages[core], device)[0])


def _stack_core(loaded: LoadedScene, shifts: tuple[int, ...]) -> CoreConfiguration:
    """Core with all slices at once; behind one whose video cannot wait, see picture_core.vhd."""
    scene, m = loaded.scene, loaded.scene.camera.micro_image_size
    lines = m if scene.build.path == "video" else 1
    return CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=scene.frame.columns,
        channels=scene.frame.channels,
        pixel_bits=scene.frame.bits,
        engine=StackEngine(input_lines=lines),
        border=scene.build.border,
    )


def _variants(
    loaded: LoadedScene, core: CoreConfiguration, kind: type[SliceEngine], device: Device
) -> list[CoreConfiguration]:
    """A core with each variant of an engine; without blanking, those that need no pause."""
    scene = loaded.scene
    blanking = scene.build.path != "core" or scene.frame.rate_hz is None
    rows = None if blanking else scene.frame.rows
    engines = kind.variants(core, scene.build.parallel_rows, rows)
    cores = (core.model_copy(update={"engine": engine}) for engine in engines)
    return [_with_pixels(loaded, variant, device) for variant in cores]


def _with_pixels(loaded: LoadedScene, core: CoreConfiguration, device: Device) -> CoreConfiguration:
    """A core with the scene's pixels per clock; by default the fewest for its rate, else one."""
    # The resampler gives one pixel a clock.
    pixels_asked = 1 if loaded.sensor is not None else loaded.scene.build.pixels_per_clock
    if "pixels_per_clock" not in type(core.engine).model_fields:
        return core
    for pixels in PIXELS_PER_CLOCK if pixels_asked == "auto" else (pixels_asked,):
        engine = core.engine.model_copy(update={"pixels_per_clock": pixels})
        candidate = core.model_copy(update={"engine": engine})
        if pixels_asked != "auto" or not (
            _refused(loaded, candidate) or too_slow(loaded, candidate, device)
        ):
            return candidate
    return core


def _scarcest(usage: Usage, device: Device) -> tuple[float, str]:
    """The resource of which a design takes the largest share of the device, and that share."""
    totals = device.amounts(device.total)
    needs = device.amounts(usage)
    return max((needed / totals[name], name) for name, needed in needs.items() if totals[name])


def _check_limits(loaded: LoadedScene, core: CoreConfiguration) -> None:
    """Refuse configurations that cannot be built, the depth index of a stack included."""
    core.check_limits()
    if loaded.shown.needs_index:
        loaded.shown.index(core).check_limits()


def _refused(loaded: LoadedScene, core: CoreConfiguration) -> str:
    """Why a core cannot be used; empty if it can."""
    try:
        _check_limits(loaded, core)
    except InputError as error:
        return error.problem
    pixels_asked = loaded.scene.build.pixels_per_clock
    if pixels_asked not in ("auto", core.pixels_per_clock):
        return f"takes one pixel a clock, not {pixels_asked}"
    return misfit(loaded, core)


def _needs(loaded: LoadedScene, core: CoreConfiguration, device: Device) -> Usage:
    """Resources of a scene's whole design with a core."""
    return estimate(design_with(loaded, core), device.family)


def _size(usage: Usage) -> tuple[int, int]:
    return usage.block_rams, usage.lut + usage.flip_flops


def engine_choice(
    loaded: LoadedScene, core: CoreConfiguration, device: Device
) -> tuple[tuple[EngineOption, ...], str]:
    """All engines with the arithmetic of the chosen core, and the reason of the choice."""
    if loaded.shown.needs_stack:
        refused = "gives one slice at a time; the scene needs all"
        engines = (EngineOption(engine=e, needs=None, refused=refused) for e in SLICE_ENGINES)
        purpose = {"s": "", "i": ", for depth"}.get(
            loaded.shown.outputs, ", for all-in-focus and depth"
        )
        return tuple(engines), f"all slices in one pass{purpose}"
    options, usages = [], dict[SliceEngineName, Usage | None]()
    for name, engine in SLICE_ENGINES.items():
        cores = [core] if core.engine.kind == name else _variants(loaded, core, engine, device)
        usage, refused = None, f"takes one row at once, not {core.parallel_rows}"
        if not is_weighed(name):
            refused = "was never synthesised, so its size is not known"
        elif cores:
            smallest = min(cores, key=lambda other: _size(estimate(other, device.family)))
            refused = _refused(loaded, smallest) or too_slow(loaded, smallest, device)
            usage = None if refused else _needs(loaded, smallest, device)
        usages[name] = usage
        needs = None if usage is None else device.amounts(usage)
        options.append(EngineOption(engine=name, needs=needs, refused=refused))
    other = next(name for name in usages if name != core.engine.kind)
    chosen, rest = _needs(loaded, core, device), usages[other]
    if loaded.scene.build.engine != "auto":
        return tuple(options), "as the scene wants it"
    if rest is None:
        return tuple(options), f"{other}: {next(o.refused for o in options if o.engine == other)}"
    if over := "; ".join(device.overflow(rest)):
        return tuple(options), f"{other} would not fit: {over}"
    (share, scarce), (other_share, other_scarce) = (_scarcest(u, device) for u in (chosen, rest))
    reason = (
        f"{share:.0%} of the device's {scarce}, {other} {other_share:.0%} of its {other_scarce}"
    )
    return tuple(options), reason


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


def choose_core(loaded: LoadedScene, shifts: tuple[int, ...], device: Device) -> CoreConfiguration:
    """Take the first candidate that fits."""
    smallest: Usage | None = None
    refused: InputError | None = None
    slowest: InputError | None = None
    for core in _candidates(loaded, shifts, device):
        try:
            _check_limits(loaded, core)
        except InputError as error:
            refused = error
            continue
        if slow := too_slow(loaded, core, device):
            if slowest is None:
                where = f"{loaded.path}: frame.rate_hz"
                slowest = InputError(f"{slow}; use {_faster(loaded, core)}", where=where)
            continue
        usage = _needs(loaded, core, device)
        if not device.overflow(usage):
            return core
        if smallest is None or _size(usage) < _size(smallest):
            smallest = usage
    if smallest is not None:
        raise _too_small(loaded, device, smallest)
    if slowest is not None:
        raise slowest
    assert refused is not None
    raise InputError(refused.problem, where=str(loaded.path))


def _faster(loaded: LoadedScene, core: CoreConfiguration) -> str:
    """Advice for a frame rate that a device does not reach."""
    camera = loaded.scene.build.path == "camera"
    for device in DEVICES.values():
        if camera and ((board := board_of(device.name)) is None or board.camera is None):
            continue
        other = _with_pixels(loaded, core, device)
        fits = not device.assumed and not device.overflow(_needs(loaded, other, device))
        if fits and not too_slow(loaded, other, device):
            return f"a lower rate, a smaller frame, or build.device = {device.name!r}"
    return "a lower rate or a smaller frame"
