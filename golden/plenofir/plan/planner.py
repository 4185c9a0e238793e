# SPDX-License-Identifier: Apache-2.0
"""Plans the core that a scene needs, and lists what it leaves out."""

from collections.abc import Iterator
from math import inf

from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import SLICE_ENGINES, CoreConfiguration
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK, SliceEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.core.weights import is_weighed
from plenofir.fpga.devices import DEVICES, Device, Usage
from plenofir.fpga.families import FAMILIES
from plenofir.fpga.hdmi.modes import VideoMode, find_mode
from plenofir.fpga.names import SliceEngineName
from plenofir.fpga.screen.picture_estimate import overlay_usage, picture_usage, stored_usage
from plenofir.fpga.synthesis.estimate import VIDEO_USAGES, estimate
from plenofir.ground.errors import InputError
from plenofir.plan.chosen_slices import cover_of, notes_on, planned_slice
from plenofir.plan.left_out import extent, full_core, left_out, sensor_left_out
from plenofir.plan.planned import EngineOption, Plan, planned_sensor
from plenofir.plan.scene import LoadedScene
from plenofir.plan.scene_screen import screen_of
from plenofir.plan.scene_stack import stack_of
from plenofir.plan.sensor.board_camera import PlannedCamera, lanes_camera, sensor_camera
from plenofir.plan.sensor.board_sensor import SENSOR_BLANK_LINES, sensor_delay_lines
from plenofir.plan.sensor.camera_estimate import camera_usage
from plenofir.plan.sensor.sensor_estimate import sensor_usage
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
            cores = [core for core in weighed if not _misfit(loaded, core)]
        else:
            cores = [core for core in cores if core.engine.kind == wanted]
        if scene.build.pixels_per_clock != "auto":
            cores = [c for c in cores if c.pixels_per_clock == scene.build.pixels_per_clock]
        cores = [core for core in cores if not _too_slow(loaded, core, device)] or cores[-1:]
        # The smaller variant of each engine (the simpler one wins a tie), then the better engine.
        usages = {core: _needs(core, loaded, device) for core in cores}
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
    wanted = 1 if loaded.sensor is not None else loaded.scene.build.pixels_per_clock
    if "pixels_per_clock" not in type(core.engine).model_fields:
        return core
    for pixels in PIXELS_PER_CLOCK if wanted == "auto" else (wanted,):
        engine = core.engine.model_copy(update={"pixels_per_clock": pixels})
        other = core.model_copy(update={"engine": engine})
        if wanted != "auto" or not (_refused(loaded, other) or _too_slow(loaded, other, device)):
            return other
    return core


def _too_slow(loaded: LoadedScene, core: CoreConfiguration, device: Device) -> str:
    """Why a core on a device does not reach the scene's frame rate; empty if it does."""
    frame, pixels, lanes = loaded.scene.frame, core.pixels_per_clock, loaded.scene.lanes
    needed, kept = _clock(loaded, core, None)[0], core.kept_mhz(device)
    if loaded.scene.build.path == "video" or needed is None or needed <= kept:
        return ""
    each = "a pixel" if pixels == 1 else f"{pixels} pixels"
    known = f"cores keep {kept:g} MHz" if kept else "no clock is known for so many"
    size = f"{frame.columns} x {frame.rows}"
    what = size if frame.rate_hz is None else f"{size} at {frame.rate_hz:g} Hz"
    if lanes is not None and needed == lanes.pixels_mhz(frame.bits) / pixels:
        what = f"{lanes.number} x {lanes.mbits:g} Mb/s of {frame.bits} bits"
    return f"{what} needs {needed:.4g} MHz at {each} a clock; on the {device.name.upper()} {known}"


def _scarcest(usage: Usage, device: Device) -> tuple[float, str]:
    """The resource of which a design takes the largest share of the device, and that share."""
    totals = device.amounts(device.total)
    needs = device.amounts(usage)
    return max((needed / totals[name], name) for name, needed in needs.items() if totals[name])


def _misfit(loaded: LoadedScene, core: CoreConfiguration) -> str:
    """Why a core cannot follow the scene's video mode; empty if it can."""
    frame = loaded.scene.frame
    if loaded.scene.build.path != "video" or frame.rate_hz is None:
        return ""
    mode = find_mode(*loaded.video_size, frame.rate_hz)
    clocks, lines = core.band_steps(frame.columns), core.frame_lines(frame.rows)
    if loaded.shown.needs_index:
        clocks = max(clocks, loaded.shown.index(core).band_steps(frame.columns))
    if mode is not None and clocks > mode.h_total:
        return f"lines of {clocks} clocks, the mode has {mode.h_total}"
    if mode is not None and lines > mode.v_total:
        return f"frames of {lines} lines, the mode has {mode.v_total}"
    return ""


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
    wanted = loaded.scene.build.pixels_per_clock
    if wanted not in ("auto", core.pixels_per_clock):
        return f"takes one pixel a clock, not {wanted}"
    return _misfit(loaded, core)


def _engine_choice(
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
        variants = [core] if core.engine.kind == name else _variants(loaded, core, engine, device)
        usage, refused = None, f"takes one row at once, not {core.parallel_rows}"
        if not is_weighed(name):
            refused = "was never synthesised, so its size is not known"
        elif variants:
            found = min(variants, key=lambda other: _size(estimate(other, device.family)))
            refused = _refused(loaded, found) or _too_slow(loaded, found, device)
            usage = None if refused else _needs(found, loaded, device)
        usages[name] = usage
        needs = None if usage is None else device.amounts(usage)
        options.append(EngineOption(engine=name, needs=needs, refused=refused))
    other = next(name for name in usages if name != core.engine.kind)
    chosen, rest = _needs(core, loaded, device), usages[other]
    if loaded.scene.build.engine != "auto":
        return tuple(options), "as the scene wants it"
    if rest is None:
        return tuple(options), f"{other}: {next(o.refused for o in options if o.engine == other)}"
    if over := "; ".join(device.overflow(rest)):
        return tuple(options), f"{other} would not fit: {over}"
    (share, scarcest), (more, scarce) = _scarcest(chosen, device), _scarcest(rest, device)
    return (
        tuple(options),
        f"{share:.0%} of the device's {scarcest}, {other} {more:.0%} of its {scarce}",
    )


def _size(usage: Usage) -> tuple[int, int]:
    return usage.block_rams, usage.lut + usage.flip_flops


_LESS_STACK = {
    "slices": "columns or channels",
    "depth": "columns or votes, stack.output = 'slices'",
    "all-in-focus": "columns or votes, stack.output = 'depth'",
}
"""What makes a focal stack smaller, besides fewer slices, by its output."""


def _refusal(loaded: LoadedScene, device: Device, usage: Usage) -> InputError:
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


def _needs(core: CoreConfiguration, loaded: LoadedScene, device: Device) -> Usage:
    """Resources of a core, with the video path around it if there is one."""
    shown = loaded.shown
    if shown.needs_stack:
        usage = picture_usage(core, shown, device.family)
    else:
        usage = estimate(core, device.family)
    if (chip := loaded.sensor) is not None:
        usage += sensor_usage(chip.core, mosaic=chip.mosaic is not None, family=device.family)
    if loaded.scene.build.path == "video":
        usage += VIDEO_USAGES[device.family] + overlay_usage(shown.overlay, device.family)
    if (camera := _camera(loaded, core)) is not None:
        usage += camera_usage(camera, core, device.family)
    return usage + stored_usage(loaded.stored, device.family)


def _choose(loaded: LoadedScene, shifts: tuple[int, ...], device: Device) -> CoreConfiguration:
    """Take the first candidate that fits."""
    smallest: Usage | None = None
    refused: InputError | None = None
    too_slow: InputError | None = None
    for core in _candidates(loaded, shifts, device):
        try:
            _check_limits(loaded, core)
        except InputError as error:
            refused = error
            continue
        if slow := _too_slow(loaded, core, device):
            if too_slow is None:
                where = f"{loaded.path}: frame.rate_hz"
                too_slow = InputError(f"{slow}; use {_faster(loaded, core)}", where=where)
            continue
        usage = _needs(core, loaded, device)
        if not device.overflow(usage):
            return core
        if smallest is None or _size(usage) < _size(smallest):
            smallest = usage
    if smallest is not None:
        raise _refusal(loaded, device, smallest)
    if too_slow is not None:
        raise too_slow
    assert refused is not None
    raise InputError(refused.problem, where=str(loaded.path))


def _faster(loaded: LoadedScene, core: CoreConfiguration) -> str:
    """Advice for a frame rate that a device does not reach."""
    camera = loaded.scene.build.path == "camera"
    for device in DEVICES.values():
        if camera and ((board := board_of(device.name)) is None or board.camera is None):
            continue
        other = _with_pixels(loaded, core, device)
        fits = not device.assumed and not device.overflow(_needs(other, loaded, device))
        if fits and not _too_slow(loaded, other, device):
            return f"a lower rate, a smaller frame, or build.device = {device.name!r}"
    return "a lower rate or a smaller frame"


def _mode(loaded: LoadedScene, core: CoreConfiguration) -> VideoMode | None:
    """Video mode of a scene with video in and out, which the core can follow."""
    frame = loaded.scene.frame
    if loaded.scene.build.path != "video":
        return None
    assert frame.rate_hz is not None
    columns, rows = loaded.video_size
    mode = find_mode(columns, rows, frame.rate_hz)
    board = board_of(loaded.scene.build.device)
    assert board is not None
    if mode not in board.modes:
        known = ", ".join(
            f"{m.h_active} x {m.v_active} at {round(m.frame_rate)} Hz" for m in board.modes
        )
        raise InputError(
            f"{columns} x {rows} at {frame.rate_hz:g} Hz is not a mode of the "
            f"{board.title}; use one of {known}",
            where=f"{loaded.path}: frame" if loaded.sensor is None else f"{loaded.path}: sensor",
        )
    # As video_to_stream decides it.
    delay, lines = loaded.shown.delay_pixels(core), loaded.shown.delay_lines(core)
    blank_lines = core.engine.blank_lines(core)
    if (chip := loaded.sensor) is not None:
        blank_lines = max(blank_lines, SENSOR_BLANK_LINES)
        mosaic = chip.mosaic is not None
        # The smallest raster is empty.
        lines += sensor_delay_lines(core.micro_image_size, mosaic=mosaic) + (rows + 1) // 2
    if delay >= mode.h_total or lines >= mode.v_total or blank_lines > mode.v_total - rows:
        raise InputError(
            f"a delay of {lines} lines and {delay} pixels exceeds the mode's "
            f"{mode.v_total} lines of {mode.h_total} pixels, or its blanking; use focus "
            "settings a closer to 1/M, or a larger mode",
            where=f"{loaded.path}: depth",
        )
    return mode


def _clock(
    loaded: LoadedScene, core: CoreConfiguration, mode: VideoMode | None
) -> tuple[float | None, int]:
    """Pixel clock in MHz and clocks for each frame."""
    frame = loaded.scene.frame
    rate = frame.rate_hz
    if mode is not None:
        return mode.pixel_clock / 1000, mode.h_total * mode.v_total
    # One token per clock on the raster's streams, however many rows the array takes at once.
    tokens = core.line_tokens(frame.columns)
    steps, lines = core.band_steps(frame.columns), core.frame_lines(frame.rows)
    if loaded.shown.needs_index:
        index = loaded.shown.index(core)
        steps = max(steps, index.band_steps(frame.columns))
        lines = max(lines, index.frame_lines(frame.rows))
    clocks = max(tokens, steps) * lines
    if core.parallel_rows > 1:
        clocks = frame.columns * frame.rows
    if loaded.sensor is not None:
        clocks = max(clocks, loaded.sensor.columns * loaded.sensor.rows)
    needed = None if rate is None else clocks * rate / 1e6
    if (lanes := loaded.scene.lanes) is not None:
        # The rate within a line, as no buffer holds a whole line.
        needed = max(needed or 0, lanes.pixels_mhz(frame.bits) / core.pixels_per_clock)
    return needed, clocks


def _camera(loaded: LoadedScene, core: CoreConfiguration) -> PlannedCamera | None:
    """The camera of a scene whose board has its lanes."""
    scene = loaded.scene
    if scene.build.path != "camera":
        return None
    board, rate = board_of(scene.build.device), scene.frame.rate_hz
    needed, _ = _clock(loaded, core, None)
    assert board is not None
    if scene.lanes is not None:
        assert needed is not None
        where = f"{loaded.path}: lanes"
        return lanes_camera(scene.lanes, loaded.registers, core, board, rate, needed, where=where)
    assert scene.sensor is not None
    return sensor_camera(scene.sensor, core, board, rate, needed, where=f"{loaded.path}: sensor")


def make_plan(loaded: LoadedScene) -> Plan:
    """Plan the smallest hardware for a scene.

    InputError if no slice covers anything, the core's limits are exceeded, or the device is too
    small.
    """
    scene = loaded.scene
    m = scene.camera.micro_image_size
    model = loaded.model()
    gaps: tuple[tuple[float, float], ...] = ()
    if loaded.shifts is None:
        assert model is not None
        cover = cover_of(loaded, model)
        shifts = tuple(int(part.a * m) for part in cover.slices)
        gaps = cover.gaps
    else:
        shifts = loaded.shifts
    device = DEVICES[scene.build.device]
    size = scene.frame.rows, scene.frame.columns
    if scene.stack is not None:
        pixel = scene.frame.channels, scene.frame.bits
        shown = stack_of(scene.stack, shifts, m, pixel, where=str(loaded.path))
    else:
        shown = screen_of(scene.screen, shifts, m, model, size, where=str(loaded.path))
    loaded = loaded.model_copy(update={"shown": shown})
    core = _choose(loaded, shifts, device)
    mode = _mode(loaded, core)
    clock_mhz, frame_clocks = _clock(loaded, core, mode)
    columns, rows = scene.frame.columns, scene.frame.rows
    video_columns, video_rows = loaded.video_size
    lag = 0
    if mode is not None and (chip := loaded.sensor) is not None:
        lag = sensor_delay_lines(m, mosaic=chip.mosaic is not None)
        lag += (video_rows - rows + 1) // 2
    full = full_core(core)
    engines, reason = _engine_choice(loaded, core, device)
    camera = _camera(loaded, core)
    if camera is not None:
        camera.check_clock(where=str(loaded.path))
    return Plan(
        scene=scene.name,
        path=scene.build.path,
        device=device.name,
        clock_mhz=clock_mhz,
        blanking=(
            None if mode is None else (mode.h_total - video_columns, mode.v_total - video_rows)
        ),
        frame_clocks=frame_clocks,
        latency_clocks=(
            shown.core_latency_clocks(core, columns, rows)
            if mode is None
            else shown.latency_clocks(core, mode.h_total) + lag * mode.h_total
        ),
        latency_lines=(shown.core_delay_lines if mode is None else shown.delay_lines)(core) + lag,
        slices=tuple(planned_slice(shift, m, model) for shift in shifts),
        gaps_mm=tuple((low, None if high == inf else high) for low, high in gaps),
        core=core,
        columns=columns,
        rows=rows,
        taps=core.taps,
        line_buffers=core.engine.lines(core),
        line_buffer_bits=core.line_buffer_bits,
        engines=engines,
        engine_reason=reason,
        error_bound=float(core.error_bound),
        needs=device.amounts(_needs(core, loaded, device)),
        video_needs=(None if mode is None else device.amounts(VIDEO_USAGES[device.family])),
        full=device.amounts(_needs(full, loaded, device)),
        full_build=f"{len(full.shifts)} slices, {full.channels} channels, {extent(full)}",
        available=device.amounts(device.total),
        left_out=(
            *left_out(core, scene.build.path, device, shown),
            *sensor_left_out(loaded.sensor, device),
        ),
        screen=shown,
        screen_needs=(
            None
            if shown.overlay is None
            else device.amounts(overlay_usage(shown.overlay, device.family))
        ),
        stored=loaded.stored,
        stored_needs=(
            None
            if loaded.stored is None
            else device.amounts(stored_usage(loaded.stored, device.family))
        ),
        sensor=None if loaded.sensor is None else planned_sensor(loaded.sensor, device),
        camera=camera,
        edid=None if loaded.edid is None else loaded.edid.hex(),
        notes=notes_on(model),
    )
