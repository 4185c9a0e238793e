# SPDX-License-Identifier: Apache-2.0
"""Plans the hardware that a scene needs, and lists what it leaves out."""

from math import inf

from plenofir.camera.rays import RayModel
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.resources.estimate import VIDEO, Design, estimate
from plenofir.fpga.screen.board_screen import Screen
from plenofir.plan.choice import choose_core, engine_choice
from plenofir.plan.design import design_with
from plenofir.plan.omissions import extent, full_core, left_out, sensor_left_out
from plenofir.plan.plan import Plan, planned_sensor
from plenofir.plan.scene import LoadedScene
from plenofir.plan.scene_screen import screen_of
from plenofir.plan.scene_stack import stack_of
from plenofir.plan.sensor.board_sensor import sensor_delay_lines
from plenofir.plan.slices import cover_of, notes_on, planned_slice
from plenofir.plan.timing import clock_of, mode_of


def _slices_of(
    loaded: LoadedScene, model: RayModel | None
) -> tuple[tuple[int, ...], tuple[tuple[float, float], ...]]:
    """The a' in pixels of a scene's slices, and the depths that none of them covers."""
    if loaded.shifts is not None:
        return loaded.shifts, ()
    assert model is not None
    cover = cover_of(loaded, model)
    return tuple(int(part.a * loaded.scene.camera.micro_image_size) for part in cover.slices), (
        cover.gaps
    )


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


def make_plan(loaded: LoadedScene) -> Plan:
    """Plan the smallest hardware for a scene.

    InputError if no slice covers anything, the core's limits are exceeded, or the device is too
    small.
    """
    scene, device, model = loaded.scene, DEVICES[loaded.scene.build.device], loaded.model()
    m, columns, rows = scene.camera.micro_image_size, scene.frame.columns, scene.frame.rows
    shifts, gaps = _slices_of(loaded, model)
    shown = _outputs_of(loaded, shifts, model)
    loaded = loaded.model_copy(update={"shown": shown})
    core = choose_core(loaded, shifts, device)
    mode = mode_of(loaded, core)
    clock_mhz, frame_clocks = clock_of(loaded, core, mode)
    if mode is None:
        blanking = None
        latency_clocks = shown.core_latency_clocks(core, columns, rows)
        latency_lines = shown.core_delay_lines(core)
    else:
        lag, (video_columns, video_rows) = _lag_lines(loaded), loaded.video_size
        blanking = mode.h_total - video_columns, mode.v_total - video_rows
        latency_clocks = shown.latency_clocks(core, mode.h_total) + lag * mode.h_total
        latency_lines = shown.delay_lines(core) + lag
    engines, reason = engine_choice(loaded, core, device)
    design, full = design_with(loaded, core), full_core(core)
    if design.camera is not None:
        design.camera.check_clock(where=str(loaded.path))
    whole = estimate(design, device.family)

    def needs(part: Design | None) -> dict[str, int] | None:
        return None if part is None else device.amounts(estimate(part, device.family))

    return Plan(
        scene=scene.name,
        path=scene.build.path,
        device=device.name,
        clock_mhz=clock_mhz,
        blanking=blanking,
        frame_clocks=frame_clocks,
        latency_clocks=latency_clocks,
        latency_lines=latency_lines,
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
        needs=device.amounts(whole),
        error_class=whole.error_class,
        video_needs=needs(VIDEO if design.video else None),
        full=device.amounts(estimate(design_with(loaded, full), device.family)),
        full_build=f"{len(full.shifts)} slices, {full.channels} channels, {extent(full)}",
        available=device.amounts(device.total),
        left_out=(
            *left_out(core, scene.build.path, device, shown),
            *sensor_left_out(loaded.sensor, device),
        ),
        screen=shown,
        screen_needs=needs(shown.overlay),
        stored=loaded.stored,
        stored_needs=needs(loaded.stored),
        sensor=None if loaded.sensor is None else planned_sensor(loaded.sensor, device),
        camera=design.camera,
        edid=None if loaded.edid is None else loaded.edid.hex(),
        notes=notes_on(model),
    )
