# SPDX-License-Identifier: Apache-2.0
"""Plans the hardware that a scene needs, and lists what it leaves out."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from math import gcd, inf

from plenofir.camera.rays import RayModel, covering_slices, diffraction_note
from plenofir.camera.rays.cover import Slice, depth_of_field, gaps_between, without_idle_slices
from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdmi.modes import VideoMode, find_mode
from plenofir.fpga.resources.estimate import VIDEO, Block, estimate
from plenofir.fpga.screen.board_screen import Screen
from plenofir.ground.errors import InputError
from plenofir.plan.choice import Candidate, choose_core, engine_choice
from plenofir.plan.loaded_scene import LoadedScene
from plenofir.plan.omissions import extent, full_core, left_out
from plenofir.plan.plan import Plan, PlannedSlice, planned_sensor
from plenofir.plan.scene_box import quality, with_wishes
from plenofir.plan.scene_screen import screen_of
from plenofir.plan.scene_stack import stack_of
from plenofir.plan.sensor.board_sensor import SENSOR_BLANK_LINES, sensor_delay_lines
from plenofir.refocus.operator import least_box
from plenofir.refocus.shifts import shift_to_text

STILL_CLOCK_MHZ = 74.25
"""Clock for stills, that of 720p at 60 frames a second."""


def _shifts_of(loaded: LoadedScene, model: RayModel | None) -> tuple[int, ...]:
    """The a' in pixels of a scene's slices; InputError if there are none."""
    if loaded.shifts is not None:
        return loaded.shifts
    depth, camera = loaded.scene.depth, loaded.scene.camera
    assert model is not None
    assert depth.near_mm is not None
    assert depth.far_mm is not None
    cover = covering_slices(model, depth.near_mm, depth.far_mm)
    if not cover.slices:
        raise InputError(
            f"no slice of {camera.model} is in focus between {depth.near_mm:g} and "
            f"{depth.far_mm:g} mm; give distances in front of the lens, or another focus_mm",
            where=f"{loaded.path}: depth",
        )
    cover = without_idle_slices(cover, depth.near_mm, depth.far_mm)
    return tuple(int(part.a * camera.micro_image_size) for part in cover.slices)


def _gaps_of(
    loaded: LoadedScene, slices: Iterable[PlannedSlice]
) -> tuple[tuple[float, float], ...]:
    """The depths of a scene's range that none of its slices covers."""
    depth = loaded.scene.depth
    if depth.near_mm is None or depth.far_mm is None:
        return ()
    fields = [
        Slice(Fraction(part.a), part.near_mm, inf if part.far_mm is None else part.far_mm)
        for part in slices
        if part.near_mm is not None
    ]
    return gaps_between(fields, depth.near_mm, depth.far_mm)


def planned_slices(
    core: CoreConfiguration, model: RayModel | None, screen: Screen
) -> tuple[PlannedSlice, ...]:
    """A core's slices: depth of field, resolution and noise of each with its box.

    Those that come twice, with two boxes, are listed once, with the box of M.
    """
    m, parts = core.micro_image_size, zip(core.shifts, core.slice_boxes, core.weights, strict=True)
    step = len(core.shifts) // len(screen.shifts(core))
    return tuple(
        _planned_slice(m, shift, box, core.order, units, model)
        for shift, box, units in islice(parts, None, None, step)
    )


def _planned_slice(
    m: int, shift: int, box: int, order: int, units: int, model: RayModel | None
) -> PlannedSlice:
    a = Fraction(shift, m)
    field = None if model is None else depth_of_field(replace(model, box=box), a)
    return PlannedSlice(
        a=shift_to_text(shift, m),
        shift=shift,
        near_mm=None if field is None else field.near_mm,
        far_mm=None if field is None or field.far_mm == inf else field.far_mm,
        box=box,
        **quality(m, shift, box, order, units, model)._asdict(),
    )


def _notes_on(model: RayModel | None) -> tuple[str, ...]:
    """Notes on the effects of the camera's optics on the slices."""
    if model is None:
        return ()
    notes = diffraction_note(model.camera), model.vignetting_note(model.micro_image_size // 2)
    return tuple(note for note in notes if note)


def _mode_of(loaded: LoadedScene, core: CoreConfiguration) -> VideoMode | None:
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
        modes = ", ".join(
            f"{m.h_active} x {m.v_active} at {round(m.frame_rate)} Hz" for m in board.modes
        )
        raise InputError(
            f"{columns} x {rows} at {frame.rate_hz:g} Hz is not a mode of the "
            f"{board.title}; use one of {modes}",
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


def _outputs_of(loaded: LoadedScene, shifts: tuple[int, ...], model: RayModel | None) -> Screen:
    """What comes out of a scene's core or board, for its slices."""
    scene, where = loaded.scene, str(loaded.path)
    m, frame = scene.camera.micro_image_size, scene.frame
    if scene.stack is not None:
        return stack_of(scene.stack, shifts, m, (frame.channels, frame.bits), where=where)
    return screen_of(scene.screen, shifts, m, model, (frame.rows, frame.columns), where=where)


def _lag_lines(loaded: LoadedScene) -> int:
    """Lines by which a sensor's raster is behind the raw frames that a screen shows."""
    if (chip := loaded.sensor) is None:
        return 0
    lines = sensor_delay_lines(loaded.scene.camera.micro_image_size, mosaic=chip.mosaic is not None)
    return lines + (loaded.video_size[1] - loaded.scene.frame.rows + 1) // 2


def _built_mhz(chosen: Candidate, needed: float | None) -> float:
    """The clock that a scene is built for: the scene's own, what the rate needs, a usual one."""
    asked = chosen.loaded.scene.build.clock_mhz
    if asked is not None:
        return asked
    if chosen.camera is not None:
        return chosen.camera.wanted_mhz
    if needed is not None:
        return needed
    # Stills need no rate: the usual clock of video, or the slower one that the core keeps.
    return min(STILL_CLOCK_MHZ, chosen.core.kept_mhz(chosen.device) or STILL_CLOCK_MHZ)


def _box_notes(loaded: LoadedScene, slices: Iterable[PlannedSlice]) -> Iterator[str]:
    """Notes on slices that do not resolve what the scene wants."""
    resolution = loaded.scene.build.resolution
    for part in slices:
        if resolution is not None and part.half_contrast < resolution:
            views = gcd(part.shift, loaded.scene.camera.micro_image_size)
            yield (
                f"a = {part.a} resolves {part.half_contrast:.3f} cycles a micro lens at most"
                + f": views meet in groups of {views}" * (views > 1)
            )


def _beside_notes(core: CoreConfiguration, screen: Screen) -> Iterator[str]:
    """Notes on slices whose smaller box lies beside that of M samples."""
    m = core.micro_image_size
    for shift, box in zip(core.shifts, core.slice_boxes, strict=True):
        if screen.sharp_box is not None and (m - box) % 2:
            yield (
                f"a = {shift_to_text(shift, m)} lies half a pixel beside where it is in focus: "
                f"M - B = {m - box} is odd"
            )


def _clock_notes(chosen: Candidate) -> tuple[str, ...]:
    asked, kept = chosen.loaded.scene.build.clock_mhz, chosen.core.kept_mhz(chosen.device)
    if asked is None or asked <= kept:
        return ()
    return (
        f"{asked:g} MHz is more than the {kept:g} MHz that such cores are trusted to keep on the "
        f"{chosen.device.title}: the tool's timing report decides",
    )


def make_plan(loaded: LoadedScene) -> Plan:
    """Plan the smallest hardware for a scene.

    InputError if no slice covers anything, the core's limits are exceeded, or the device is too
    small.
    """
    scene, device, model = loaded.scene, loaded.device, loaded.model()
    columns, rows = scene.frame.columns, scene.frame.rows
    shifts = _shifts_of(loaded, model)
    screen = _outputs_of(loaded, shifts, model)
    loaded = loaded.model_copy(update={"shown": screen})
    chosen = choose_core(loaded, shifts, device)
    core, mode = chosen.core, _mode_of(loaded, chosen.core)
    clock_mhz, frame_clocks = chosen.clock
    if mode is None:
        blanking = None if scene.frame.blanking == "none" else scene.frame.blank
        latency_clocks = screen.core_latency_clocks(core, columns, rows)
        latency_lines = screen.core_delay_lines(core)
    else:
        lag, (video_columns, video_rows) = _lag_lines(loaded), loaded.video_size
        blanking = mode.h_total - video_columns, mode.v_total - video_rows
        clock_mhz, frame_clocks = mode.pixel_clock / 1000, mode.h_total * mode.v_total
        latency_clocks = screen.latency_clocks(core, mode.h_total) + lag * mode.h_total
        latency_lines = screen.delay_lines(core) + lag
    engines, reason = engine_choice(chosen)
    if chosen.camera is not None:
        chosen.camera.check_clock(where=str(loaded.path))
    slices = planned_slices(core, model, screen)
    gaps = _gaps_of(loaded, slices)
    # Beside the same board, sensor and screen, so that the core alone makes the difference.
    full = replace(chosen, core=screen.in_pairs(full_core(core)))

    def needs(blocks: Iterable[Block]) -> dict[str, int]:
        return device.amounts(estimate(blocks, device.family))

    return Plan(
        scene=scene.name,
        path=scene.build.path,
        device=device.name,
        grade=device.grade,
        part=device.part,
        chip=device,
        built_mhz=_built_mhz(chosen, clock_mhz),
        kept_mhz=core.kept_mhz(device),
        clock_mhz=clock_mhz,
        blanking=blanking,
        frame_clocks=frame_clocks,
        latency_clocks=latency_clocks,
        latency_lines=latency_lines,
        slices=slices,
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
        needs=device.amounts(chosen.usage),
        error_class=chosen.usage.error_class,
        video_needs=needs([VIDEO]) if scene.build.path == "video" else None,
        full=device.amounts(full.usage),
        full_build=(
            f"{len(screen.shifts(full.core))} slices, {full.core.channels} channels, "
            f"{extent(full.core)}"
        ),
        available=device.amounts(device.total),
        left_out=left_out(chosen),
        screen=screen,
        screen_needs=None if screen.overlay is None else needs(screen.overlay.blocks),
        stored=loaded.stored,
        stored_needs=None if loaded.stored is None else needs(loaded.stored.blocks),
        sensor=None if loaded.sensor is None else planned_sensor(loaded.sensor, device),
        camera=chosen.camera,
        edid=None if loaded.edid is None else loaded.edid.hex(),
        notes=(
            *_notes_on(model),
            *_box_notes(loaded, slices),
            *_beside_notes(core, screen),
            *_clock_notes(chosen),
        ),
    )


def compared_boxes(loaded: LoadedScene, plan: Plan) -> list[tuple[int, Plan | InputError]]:
    """Plans of a scene with other boxes: B from 1 to M, for each slice that can have it.

    Other slices have the smallest larger box that they can have; of two B that are the same for
    all slices, the smaller one. Instead of a plan stands the error if there is none. `plan`: of the
    scene; its slices are those of all plans.
    """
    m, shifts = plan.core.micro_image_size, plan.screen.shifts(plan.core)
    loaded = loaded.model_copy(update={"shifts": shifts})
    plans: dict[tuple[int, ...], tuple[int, Plan | InputError]] = {}
    for box in range(1, m + 1):
        boxes = tuple(least_box(m, shift, box) for shift in shifts)
        if boxes in plans:
            continue
        try:
            plans[boxes] = box, make_plan(with_wishes(loaded, box=boxes))
        except InputError as error:
            plans[boxes] = box, error
    return list(plans.values())
