"""The command ``sim``: a raw image through the VHDL, compared with the golden model."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands import options
from plenofir.commands.console import kept_bars, print_line
from plenofir.errors import EXIT_MISMATCH, InputError

if TYPE_CHECKING:
    from plenofir.fpga.simulate.job import SimulationJob
    from plenofir.fpga.simulate.stack_job import StackJob

app = typer.Typer()

# What a scene decides.
_OF_SCENE = ("micro_image", "a", "parallel_rows", "engine", "any_rows", "interpolation", "arith")


@app.command()
def sim(
    context: typer.Context,
    raw: Annotated[
        Path | None, typer.Option(help="Raw image: 8 or 16 bit, grey or RGB; a flower if none.")
    ] = None,
    scene: options.SceneIfGiven = None,
    micro_image: options.MicroImage = 5,
    a: options.SettingsIfGiven = None,
    engine: options.EngineOrStack = "fir",
    radius: options.Radius = 1,
    parallel_rows: Annotated[
        int, typer.Option(help="fir: rows that are filtered at once.", min=1)
    ] = 1,
    any_rows: Annotated[
        bool,
        typer.Option(
            "--any-rows", help="moving_sum: frames of any number of rows without a pause."
        ),
    ] = False,
    interpolation: options.Interpolation = "nearest",
    arith: options.Arith = "exact",
    fraction: options.FractionIfGiven = None,
    guard: options.GuardIfGiven = None,
    simulator: Annotated[options.Simulator, typer.Option(help="Simulator of the VHDL.")] = "ghdl",
    chain: Annotated[
        options.Chain,
        typer.Option(help="The core, or the whole board from serial bits to serial bits."),
    ] = "core",
    waves: Annotated[
        bool, typer.Option("--waves", help="Write a waveform and a GTKWave save file.")
    ] = False,
    out: options.OutFolder = "build/sim",
) -> None:
    """Refocus a raw image in the VHDL core and compare it with the golden model.

    Several focus settings make a sweep, a frame for each; with the engine stack they come out in
    one pass, with a depth index.
    """
    used = {
        parameter.name
        for parameter in context.command.params
        if context.params[parameter.name] != parameter.default
    }
    if scene is not None:
        for name in (*_OF_SCENE, "fraction", "guard", "radius"):
            source = context.get_parameter_source(name)
            if source is not None and source.name == "COMMANDLINE":
                raise InputError(
                    f"cannot be combined with {options.typed('scene')}",
                    where=options.typed(name),
                    expected="one of them",
                )
    decided = {"arith": arith, "chain": chain, "simulator": simulator}
    options.check_combinations(used, decided if scene else {**decided, "engine": engine})
    settings = options.focus_settings(a or ["-3/5"], micro_image)
    options.shifts_of(settings, micro_image)
    focus = tuple(str(setting) for setting in settings)
    from plenofir.fpga.core.fir import FirEngine
    from plenofir.fpga.core.moving_sum import MovingSumEngine
    from plenofir.fpga.simulate.job import DEFAULT_RAW, SimulationJob
    from plenofir.refocus import interpolation_order

    if engine == "stack":
        from plenofir.fpga.simulate.stack_job import StackJob

        _run_stack(
            StackJob(
                raw=raw or DEFAULT_RAW,
                micro_image_size=micro_image,
                focus=focus,
                radius=radius,
                out=Path(out),
                simulator=simulator,
            )
        )
        return
    job = SimulationJob(
        raw=raw or DEFAULT_RAW,
        micro_image_size=micro_image,
        focus=focus,
        interpolation=interpolation_order(interpolation),
        engine=FirEngine(parallel_rows=parallel_rows)
        if engine == "fir"
        else MovingSumEngine(any_rows=any_rows),
        out=Path(out),
        arithmetic=options.arithmetic(arith, fraction, guard),
        simulator=simulator,
        waves=waves,
        chain=chain,
    )
    _run(_scene_job(scene, job, own_image=raw is not None) if scene else job)


def _scene_job(path: str, job: "SimulationJob", *, own_image: bool) -> "SimulationJob":
    """Job of a scene; without an image of one's own, on the flower made to measure."""
    from plenofir import project
    from plenofir.fpga.simulate.job import scene_image, scene_job
    from plenofir.images import write_png
    from plenofir.plan import load_scene, make_plan

    plan = make_plan(load_scene(path))
    if not own_image:
        image = project.root() / "build" / "scenes" / f"{plan.scene}.png"
        image.parent.mkdir(parents=True, exist_ok=True)
        write_png(image, scene_image(plan.core, plan.rows))
        job = job.model_copy(update={"raw": image})
    return scene_job(plan.core, job)


def _run(job: "SimulationJob") -> None:
    from plenofir.fpga.simulate.job import report_summary, run_job

    with kept_bars() as show:
        report = run_job(job, show)
    for name, value in report_summary(report):
        print_line(name, value)
    files = [name for slice_ in report.slices for name in slice_.pictures]
    print_line("files", f"{job.out}/{', '.join(files)}, report.json")
    if report.mismatches:
        raise typer.Exit(EXIT_MISMATCH)


def _run_stack(job: "StackJob") -> None:
    from plenofir.fpga.simulate.stack_job import run_stack_job

    with kept_bars() as show:
        report = run_stack_job(job, show)
    size = f"{report.columns} x {report.rows} pixels, {report.channels} channels"
    print_line("image", f"{report.raw}, {size}, M = {report.M}")
    for setting, count in zip(report.a, report.micro_images_of_slice, strict=True):
        print_line(f"a = {setting}", f"sharpest in {count} micro images")
    print_line("mismatches", f"{report.mismatches} of {report.pixels_compared} pixels")
    print_line("clocks", f"{report.clocks}, {report.clocks_per_pixel} for each pixel")
    parts = {
        "shared": report.history_bits,
        "of the slices": report.slice_bits,
        "waiting": report.waiting_bits,
        "judged": report.sharpness_bits,
    }
    kbit = ", ".join(f"{bits / 1024:.0f} {name}" for name, bits in parts.items())
    print_line("memory", f"kbit: {kbit}")
    print_line("files", f"{job.out}/{', '.join(report.pictures)}, report.json")
    if report.mismatches:
        raise typer.Exit(EXIT_MISMATCH)
