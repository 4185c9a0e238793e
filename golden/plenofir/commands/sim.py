# SPDX-License-Identifier: Apache-2.0
"""The command ``sim``: a raw image through the VHDL, compared with the golden model."""

import random
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands import options
from plenofir.commands.console import kept_bars, print_line
from plenofir.commands.groups import grouped
from plenofir.commands.rasters import recognised, tell
from plenofir.fpga.names import (
    DEFAULT_BOARD,
    DEFAULT_ENGINE,
    DEFAULT_SIMULATOR,
    ENGINE_ROWS,
    MAX_SEED,
    Chain,
    EngineName,
    HdmiBoardName,
    Lanes,
    RawBits,
    SimulatorName,
    WaveChoice,
    engines_with,
)
from plenofir.ground.errors import EXIT_MISMATCH, InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from plenofir.fpga.core.configuration import CoreConfiguration
    from plenofir.fpga.core.engine import Engine
    from plenofir.fpga.screen.board_screen import Screen
    from plenofir.fpga.simulate.request import Run
    from plenofir.plan.sensor.sensor_chain import SensorFrame
    from plenofir.plan.sensor.sensor_csi import CsiFrame
    from plenofir.plan.sensor.sensor_run import Sensor

app = typer.Typer()

# What a scene decides.
_BY_SCENE = (
    "micro_image",
    "a",
    "parallel_rows",
    "engine",
    "any_rows",
    "pixels",
    "interpolation",
    "sharpen",
    "box",
    "border",
    "arith",
)


def _only(field: str) -> str:
    """The engines that have a field, for its help."""
    return f" (engine {', '.join(engines_with(field))})"


@dataclass(frozen=True)
class _Capture:
    """Core and input of a simulation."""

    raw: Annotated[
        Path | None,
        typer.Option(
            help="Raw image: 8 or 16 bit, grey or RGB; by default a photograph of a flower."
        ),
    ] = None
    calib: Annotated[
        Path | None,
        typer.Option(
            help="Calibration; the raw image is then a camera's capture, which the VHDL resamples."
        ),
    ] = None
    bayer: Annotated[
        options.Bayer | None,
        typer.Option(
            help="Colour filters of the first 2 x 2 pixels, for a capture with a colour mosaic."
        ),
    ] = None
    scene: options.SceneIfGiven = None


@dataclass(frozen=True)
class _Core:
    """The core, where no scene decides."""

    micro_image: options.MicroImage = 5
    a: options.SettingsIfGiven = None
    engine: options.EngineOrStack = DEFAULT_ENGINE
    radius: options.Radius = 1
    parallel_rows: Annotated[
        int, typer.Option(help=f"Rows filtered at once{_only('parallel_rows')}.", min=1)
    ] = 1
    any_rows: Annotated[
        bool,
        typer.Option(
            "--any-rows",
            help=f"Take frames of any number of rows without a pause between{_only('any_rows')}.",
        ),
    ] = False
    pixels: Annotated[
        options.Pixels,
        typer.Option(
            help="Neighbouring pixels taken at each clock; above 1 the engine is "
            f"{engines_with('pixels_per_clock')[0]}, if it is not stack."
        ),
    ] = "1"
    interpolation: options.Interpolation = "nearest"
    sharpen: options.Sharpen = "off"
    box: options.Boxes = None
    border: options.Border = "zero"
    arith: options.Arith = "exact"
    fraction: options.FractionIfGiven = None
    guard: options.GuardIfGiven = None

    def shifts(self) -> tuple[int, ...]:
        """The a' in pixels of the focus settings."""
        settings = options.focus_settings(self.a or ["-3/5"], self.micro_image)
        return options.shifts_of(settings, self.micro_image)

    def configuration(
        self, raw: Path, chain: Chain, shifts: tuple[int, ...]
    ) -> "CoreConfiguration":
        """The core for a raw image, and the slices of the focus settings."""
        from plenofir.fpga.simulate.request import core_for_image
        from plenofir.refocus import interpolation_order, sharpening_units
        from plenofir.refocus.operator import box_size

        order, m = interpolation_order(self.interpolation), self.micro_image
        boxes = options.boxes_of(self.box, shifts)
        # A box of M is the core's own.
        boxes = boxes if any(box != m for box in boxes) else ()
        # A box that cannot be is refused by its name here, before a weight follows from it.
        weights = [
            sharpening_units(self.sharpen, m, shift, order, box=box_size(m, shift, box))
            for shift, box in zip(shifts, boxes or (None,) * len(shifts), strict=True)
        ]
        return core_for_image(
            raw,
            chain,
            micro_image_size=m,
            shifts=shifts,
            arithmetic=options.arithmetic(self.arith, self.fraction, self.guard),
            order=order,
            sharpening=tuple(weights) if any(weights) else (),
            boxes=boxes,
            border=self.border,
            engine=_engine(
                self.engine, self.parallel_rows, any_rows=self.any_rows, pixels=self.pixels
            ),
        )


@dataclass(frozen=True)
class _Bench:
    """The chain around the core, and the simulator's options."""

    simulator: Annotated[SimulatorName, typer.Option(help="Simulator to use.")] = DEFAULT_SIMULATOR
    chain: Annotated[
        Chain,
        typer.Option(
            help="What to simulate: the core, a whole board from HDMI to HDMI, or the core behind "
            "a camera's MIPI CSI-2."
        ),
    ] = "core"
    board: Annotated[HdmiBoardName, typer.Option(help="Board to simulate (chain hdmi).")] = (
        DEFAULT_BOARD
    )
    lanes: Annotated[Lanes, typer.Option(help="Lanes of the camera (chain csi).")] = "1"
    raw_bits: Annotated[
        RawBits | None,
        typer.Option(
            help="Bits of a pixel on the lanes; the capture is scaled to them (chain csi)."
        ),
    ] = None
    waves: Annotated[
        WaveChoice,
        typer.Option(
            help="Write a waveform: 1 of the signals that explain the picture, with a GTKWave save "
            "file; all: of all signals."
        ),
    ] = "0"
    waves_depth: Annotated[
        int,
        typer.Option(
            help="Write the signals of so many levels of instances (waves all); 0: of all levels.",
            min=0,
        ),
    ] = 0
    stalls: Annotated[
        int | None,
        typer.Option(
            help="Seed with which a part of the picture passes the core once more, source and sink "
            "stalling at random; by default drawn, 0: none. With calib, the resampler takes the "
            "capture again, too, and a camera (chain csi) sends it again, if a seed is given.",
            min=0,
            max=MAX_SEED,
        ),
    ] = None

    @property
    def seed(self) -> int:
        """Seed of the stalls: a camera's whole capture takes as long as the run without them."""
        if self.chain == "csi":
            return self.stalls or 0
        return random.SystemRandom().randint(1, MAX_SEED) if self.stalls is None else self.stalls


def _check(context: typer.Context, capture: _Capture, core: _Core, bench: _Bench) -> None:
    """Refuse options that cannot be combined."""
    # A value that equals the default contradicts nothing, typed or not.
    used = {
        parameter.name
        for parameter in context.command.params
        if context.params[parameter.name] != parameter.default
    }
    scene, calib = capture.scene, capture.calib
    if scene is not None:
        for name in (*_BY_SCENE, "fraction", "guard", "radius"):
            if _was_typed(context, name):
                options.refuse_both(name, options.typed("scene"))
    decided = {name: getattr(bench, name) for name in ("chain", "simulator", "waves")}
    decided["arith"] = core.arith
    options.check_combinations(used, decided if scene else {**decided, "engine": core.engine})
    options.require("bayer", "calib", calib is None and capture.bayer is not None)
    options.require("calib", "raw", capture.raw is None and calib is not None)
    options.require("chain", "calib", bench.chain == "csi" and calib is None)
    if scene is not None and calib is not None:
        options.refuse_both("calib", options.typed("scene"))
    if bench.stalls and bench.chain == "hdmi" and calib is None:
        options.refuse_both("stalls", options.typed("chain", bench.chain), "video cannot wait")


def _was_typed(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


@app.command()
@grouped
def sim(
    context: typer.Context,
    capture: _Capture,
    core: _Core,
    bench: _Bench,
    out: options.OutFolder = "build/sim",
) -> None:
    """Refocus a raw image in the VHDL core and compare it with the golden model.

    Several focus settings make a sweep, a frame for each; with the engine stack they come out in
    one pass, with a depth index.
    """
    # Some engines take one pixel a clock only; the first of the others is meant then.
    if core.pixels != "1" and not _was_typed(context, "engine"):
        core = replace(core, engine=engines_with("pixels_per_clock")[0])
    _check(context, capture, core, bench)
    from plenofir.fpga.screen.board_screen import Screen
    from plenofir.fpga.simulate.request import DEFAULT_RAW, Run

    raw, calib, m, seed = capture.raw, capture.calib, core.micro_image, bench.seed
    # Focus settings are refused, and noted, before a file is read.
    shifts = core.shifts()

    def run_of(
        path: Path, configuration: "CoreConfiguration", folder: Path, screen: Screen | None = None
    ) -> Run:
        return Run(
            raw=path,
            core=configuration,
            radius=core.radius,
            out=folder,
            simulator=bench.simulator,
            waves=bench.waves,
            waves_depth=bench.waves_depth,
            stalls=seed,
            chain=bench.chain,
            board=bench.board,
            screen=screen or Screen(),
        )

    def core_for(path: Path) -> "CoreConfiguration":
        return core.configuration(path, bench.chain, shifts)

    if raw is not None and calib is not None:
        from plenofir.plan.sensor.sensor_run import load_sensor

        bits = None if bench.raw_bits is None else int(bench.raw_bits)
        sensor = load_sensor(raw, calib, m, capture.bayer, bits=bits)
        for note in sensor.notes:
            typer.echo(f"note: {raw}: {note}", err=True)
        _run_raw(
            *(sensor, lambda path, folder: run_of(path, core_for(path), folder)),
            *(Path(out), int(bench.lanes)),
            stalls=bench.stalls or 0,
        )
        return
    if raw is not None and capture.scene is None:
        _warn(raw, m)
    with tempfile.TemporaryDirectory(prefix="plenofir-") as drawn:
        if capture.scene:
            path, of_scene, screen = _of_scene(capture.scene, raw, bench.chain, Path(drawn))
            _run(run_of(path, of_scene, Path(out), screen))
        else:
            path = raw or DEFAULT_RAW
            _run(run_of(path, core_for(path), Path(out)))


def _warn(raw: Path, micro_image: int) -> None:
    """Warn of what is no aligned raw image of M: any picture can be simulated."""
    from plenofir.camera.recognise import Hints
    from plenofir.ground.images import read_picture
    from plenofir.refocus import check_raw

    # What can't be simulated is refused; the rest is doubted at most.
    check_raw(read_picture(raw).pixels, micro_image, where=str(raw))
    try:
        source = recognised(raw, Hints(micro_image))
        tell(*(one for one in source.findings if one.heading != "axes"))
        for finding in source.findings:
            if finding.heading == "axes" and finding.notable:
                text = finding.text.partition(":")[0]
                typer.echo(f"warning: {raw}: {text}; simulated as stored", err=True)
    except InputError as error:
        typer.echo(f"warning: {error}", err=True)


def _run_raw(
    sensor: "Sensor",
    make_run: "Callable[[Path, Path], Run]",
    out: Path,
    lanes: int,
    *,
    stalls: int,
) -> None:
    """Resample a capture in the VHDL, with stalls too if they have a seed, and refocus it."""
    from plenofir.fpga.simulate.report import report_summary
    from plenofir.ground.images import write_png
    from plenofir.plan.sensor.sensor_run import ALIGNED, run_raw, sensor_summary

    golden = sensor.golden()
    with tempfile.TemporaryDirectory(prefix="plenofir-") as drawn:
        # What the refocuser cannot take is refused before anything is simulated.
        path = Path(drawn) / ALIGNED
        write_png(path, sensor.raster(golden))
        request = make_run(path, out)
        request.core.check_limits()
        frame: SensorFrame | CsiFrame | None = None
        if request.chain == "hdmi":
            frame = sensor.board_frame
        elif request.chain == "csi":
            frame = sensor.csi_frame(lanes)
    with kept_bars() as show:
        how = request.model_copy(update={"stalls": stalls})
        report, aligned = run_raw(sensor, golden, make_run, out, how, frame, show)
    for name, value in [*sensor_summary(sensor, aligned), *report_summary(request.core, report)]:
        print_line(name, f"{out}/{value}, {ALIGNED}" if name == "files" else value)
    if not (report.agrees and aligned.agrees):
        raise typer.Exit(EXIT_MISMATCH)


def _engine(
    kind: EngineName, parallel_rows: int, *, any_rows: bool, pixels: options.Pixels
) -> "Engine":
    from plenofir.fpga.core.configuration import SLICE_ENGINES
    from plenofir.fpga.core.stack_engine import StackEngine

    if kind == "stack":
        return StackEngine.model_validate({"pixels_per_clock": int(pixels)})
    fields = {
        "parallel_rows": parallel_rows,
        "any_rows": any_rows,
        "pixels_per_clock": int(pixels),
    }
    return SLICE_ENGINES[kind].model_validate(
        {name: fields[name] for name in ENGINE_ROWS[kind].fields}
    )


def _of_scene(
    path: str, raw: Path | None, chain: Chain, drawn: Path
) -> tuple[Path, "CoreConfiguration", "Screen"]:
    """Image, core and screen of a scene.

    The flower made to measure, in a folder, if no image is given.
    """
    from plenofir.fpga.simulate.request import scene_image
    from plenofir.ground.images import write_png
    from plenofir.plan import load_scene, make_plan

    plan = make_plan(load_scene(path))
    if raw is None:
        raw = drawn / f"{plan.scene}.png"
        write_png(raw, scene_image(plan.core, plan.rows))
    if chain == "core":
        return raw, plan.core, plan.screen
    # Video has its blanking.
    core = plan.core.model_copy(update={"engine": plan.core.engine.for_video()})
    return raw, core, plan.screen


def _run(request: "Run") -> None:
    from plenofir.fpga.simulate.report import report_summary
    from plenofir.fpga.simulate.run import run

    with kept_bars() as show:
        report = run(request, show)
    for name, value in report_summary(request.core, report):
        print_line(name, f"{request.out}/{value}" if name == "files" else value)
    if not report.agrees:
        raise typer.Exit(EXIT_MISMATCH)
