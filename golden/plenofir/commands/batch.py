# SPDX-License-Identifier: Apache-2.0
"""The command ``batch``: many frames through Dask."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plenofir.commands import file_options, options
from plenofir.commands.capture import Dark
from plenofir.commands.console import progress_bar
from plenofir.commands.groups import CameraData, LookIfGiven, Operator, Pupil
from plenofir.commands.rasters import check_aligned
from plenofir.commands.results import VOLUMES, check_file, is_volume
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.camera.recognise import Hints
    from plenofir.commands.development import Job

app = typer.Typer()

# What tells, in a folder of unpacked frames, which film they are from.
_UNPACKED = "frames.json"


def _unpacked(sources: list[Path], out: Path) -> list[Path]:
    """Files, with the frames of films and the pages of TIFF files in their place.

    These are unpacked once, into folders of their own.
    """
    from plenofir.ground.films import FILMS
    from plenofir.ground.pages import has_pages

    frames: list[Path] = []
    for source in sources:
        is_film = source.suffix.lower() in FILMS or has_pages(source)
        frames += _frames_of(source, out) if is_film else [source]
    return frames


def _frames_of(film: Path, out: Path) -> list[Path]:
    from plenofir.commands.volumes import pictures_of_file
    from plenofir.ground.files import Results
    from plenofir.ground.images import encode_png

    folder = out / f"frames_of_{film.name}"
    status = film.stat()
    # Films are too large to be read for a checksum.
    mark = f"{status.st_size} {status.st_mtime_ns}"
    try:
        report = json.loads((folder / _UNPACKED).read_bytes())
        there = [folder / name for name in report["frames"] if (folder / name).is_file()]
        if report["film"] == mark and len(there) == len(report["frames"]):
            return there
    except (OSError, ValueError, KeyError, TypeError):
        pass
    names = []
    with Results(folder) as results:
        for number, (picture, _) in enumerate(pictures_of_file(film), 1):
            names.append(f"{film.stem}_{number:05}.png")
            results.write(names[-1], encode_png(picture))
        results.write(_UNPACKED, json.dumps({"film": mark, "frames": names}))
    return [folder / name for name in names]


def _develop_frame(source: Path, job: "Job", folder: Path) -> tuple[str, tuple[str, ...]]:
    """Develop a capture: what is wrong with it, if anything is, and what changes its result."""
    from plenofir.commands.development import develop_capture

    try:
        developed = develop_capture(source, job, folder, lambda *_: None)
    except InputError as error:
        return str(error), ()
    except MemoryError:
        return f"{source}: too large for the memory; use a smaller capture", ()
    return "", developed.notes


def _calibrated(job: "Job", out: Path) -> "Job":
    """The job with a calibration file in the place of the white image: found once for all."""
    from plenofir.camera.recognise.captures import calibration_of
    from plenofir.ground.files import publish

    hints = job.hints
    if hints.white is None:
        return job
    publish({"calib.json": calibration_of(hints.white, hints.dark, hints.bayer).text()}, out)
    calib = str((out / "calib.json").absolute())
    return job._replace(hints=hints._replace(white=None, calib=calib))


def _develop_all(
    sources: list[Path],
    job: "Job",
    out: Path,
    workers: "_Workers",
    show: Callable[[int, int], None],
    *,
    per_frame: bool,
) -> tuple[int, list[str]]:
    """Develop captures into folders of their own: how many were there already, what failed."""
    from plenofir.commands.development import is_developed, run_exposure
    from plenofir.ground.files import check_folder
    from plenofir.refocus.batch import dask_client, failure, worker_count

    count = worker_count(workers.scheduler, workers.workers)
    folders = {source.stem: source for source in sources}
    for source in sources:
        if folders[source.stem] is not source:
            raise InputError(
                f"{folders[source.stem]} has the same name; rename one of them", where=str(source)
            )
        check_folder(out / source.stem, str(out))
    job = _calibrated(job, out)
    if not per_frame:
        job = job._replace(run=run_exposure(sources, job, out / "exposure.json"))
    # Captures that an earlier run finished are kept: a night of captures starts where it ended.
    waiting = [one for one in sources if not is_developed(one, job, out / one.stem)]
    kept = len(sources) - len(waiting)
    failed: list[str] = []
    show(kept, len(sources))
    if not waiting:
        return kept, failed
    with dask_client(workers.scheduler, min(count, len(waiting))) as client:
        from distributed import as_completed

        running = {
            client.submit(
                # Workers run in folders of their own, so paths are absolute; a run is never a
                # cached answer.
                _develop_frame,
                one.absolute(),
                job,
                (out / one.stem).absolute(),
                pure=False,
            ): one
            for one in waiting
        }
        for number, future in enumerate(as_completed(running), 1):
            notes: tuple[str, ...] = ()
            try:
                # A worker may die with a result that nobody fetched; Dask makes it anew.
                text, notes = future.result()
            except Exception as error:
                text = f"{running[future]}: {failure(error)}"
            for note in notes:
                typer.echo(f"note: {running[future]}: {note}", err=True)
            if text:
                failed.append(text)
            show(kept + number, len(sources))
    return kept, failed


def _refocused(
    frames: list[str],
    hints: "Hints",
    a: list[str] | None,
    out: Path,
    workers: "_Workers",
    **how: Any,
) -> tuple[int, list[str], int]:
    """Refocus frames: how many were there already, what failed, and how many there are."""
    from plenofir.refocus.batch import find_frames, run_batch
    from plenofir.refocus.batch_frames import Settings

    micro_image = hints.micro_image
    used = {"crop": hints.crop, "white_balance": hints.white_balance not in ("auto", "off")}
    options.refuse_used(used, "is for captures and volumes; frames keep their values and size")
    if micro_image is None:
        raise InputError("give -M for aligned raw images, or --white or --calib for captures")
    best = how["best"]
    chosen = options.focus_settings(a or ["0"], micro_image, rounded=not best)
    if not best:
        options.shifts_of(chosen, micro_image)
    settings = Settings(micro_image, chosen, **how)
    files = find_frames(frames)
    sources = _unpacked(files, out)
    check_aligned(sources[0], hints)
    with progress_bar("refocusing") as show:
        outcomes = run_batch(sources, settings, out, **asdict(workers), progress=show)
    failed = [frame.reason for frame in outcomes if frame.state == "failed"]
    return sum(frame.state == "kept" for frame in outcomes), failed, len(outcomes)


def _volume(
    patterns: list[str],
    hints: "Hints",
    planes: tuple[list[str] | None, list[str] | None, str | None, float],
    out: str,
    **how: Any,
) -> str:
    """Write the slices of all frames as one file; what was written, for people."""
    from plenofir.commands.volumes import Film, slices_of_volume, volume_of_film
    from plenofir.refocus.batch import find_frames

    hints.check()
    if hints.dark is not None:
        options.require("dark", "calib", hints.white is None and hints.calib is None)
    sources = find_frames(patterns)
    path = check_file(out, VOLUMES, *sources)
    film = Film(sources, hints)
    with progress_bar("refocusing") as show:
        return volume_of_film(film, lambda m: slices_of_volume(*planes, m), path, show, **how)


@dataclass(frozen=True)
class _Workers:
    """Who computes."""

    scheduler: Annotated[
        str,
        typer.Option(
            help="local for processes on this machine, or tcp://HOST:PORT of a Dask scheduler."
        ),
    ] = "local"
    workers: Annotated[
        int | None,
        typer.Option(help="Number of local processes; by default one for each processor.", min=1),
    ] = None


@dataclass(frozen=True)
class _Files:
    """Files of the camera; with them frames are captures."""

    white: Annotated[
        Path | None,
        typer.Option(
            help="White image of the camera; frames are then captures, which are developed."
        ),
    ] = None
    calib: Annotated[
        str | None,
        typer.Option(
            help="Calibration file of the camera; frames are then captures, which are developed."
        ),
    ] = None
    dark: Dark = None

    @property
    def of_captures(self) -> bool:
        """Whether frames are captures."""
        return self.white is not None or self.calib is not None


@dataclass(frozen=True)
class _Run:
    """How all frames of a run are treated."""

    workers: _Workers
    operator: Operator
    files: _Files
    camera: CameraData
    pupil: Pupil
    look: LookIfGiven
    per_frame: bool
    gpu: bool

    def volume(
        self, frames: list[str], hints: "Hints", a: list[str] | None, z: list[str] | None, out: str
    ) -> str:
        """Write the slices of all frames as one file; what was written, for people."""
        of_folders = {
            "scheduler": self.workers.scheduler != "local",
            "workers": self.workers.workers,
            "interpolation": self.operator.interpolation,
            "sharpen": self.operator.sharpen,
            "upsample": not self.operator.upsample,
            "exposure": self.look.exposure,
            "gamma": self.look.gamma,
            "exposure_per_frame": self.per_frame,
            "gpu": self.gpu,
        }
        options.refuse_used(of_folders, "is for a folder of results")
        planes = (a, z, self.camera.camera, self.camera.focus)
        return _volume(frames, hints, planes, out, **self.pupil.how())

    def refocus(
        self, frames: list[str], hints: "Hints", a: list[str] | None, out: Path
    ) -> tuple[int, list[str], int]:
        """Refocus frames: how many were there already, what failed, and how many there are."""
        from plenofir.refocus import interpolation_order

        for name, is_given in (
            ("dark", self.files.dark is not None),
            ("camera", self.camera.camera is not None),
        ):
            options.require(name, "calib", is_given)
        options.require("focus", "camera", self.camera.focus != inf)
        for name, is_given in (
            ("exposure", self.look.exposure is not None),
            ("gamma", self.look.gamma is not None),
            ("exposure_per_frame", self.per_frame),
        ):
            options.require(name, "calib", is_given)
        if self.gpu and not self.operator.is_set:
            raise InputError(
                "makes the operator's pictures; give --interpolation, --sharpen or --no-upsample",
                where=options.typed("gpu"),
            )
        if self.operator.is_set:
            self.pupil.refuse_beside("--interpolation, --sharpen or --no-upsample")
        return _refocused(
            frames,
            hints,
            a,
            out,
            self.workers,
            order=interpolation_order(self.operator.interpolation or "nearest"),
            upsample=self.operator.upsample,
            sharpen=self.operator.sharpen or "off",
            best=not self.operator.is_set,
            gpu=self.gpu,
            **self.pupil.how(),
        )

    def develop(
        self, frames: list[str], hints: "Hints", a: list[str] | None, out: str
    ) -> tuple[int, list[str], int]:
        """Develop captures: how many were there already, what failed, and how many there are."""
        from plenofir.commands.development import Job
        from plenofir.ground.files import check_folder
        from plenofir.refocus.batch import find_frames

        if a or self.operator.interpolation or self.operator.sharpen or not self.operator.upsample:
            raise InputError(
                "captures are developed with --white or --calib: leave out -a, "
                "--interpolation, --sharpen and --no-upsample"
            )
        options.refuse_used({"gpu": self.gpu}, "is for frames, not for captures")
        hints.check()
        self.camera.check()
        check_folder(Path(out), out)
        sources = _unpacked(find_frames(frames), Path(out))
        job = Job(
            hints,
            self.camera.camera,
            self.camera.focus,
            exposure=self.look.exposure or "auto",
            gamma=self.look.gamma,
            **self.pupil.how(),
        )
        with progress_bar("developing") as show:
            kept, failed = _develop_all(
                sources, job, Path(out), self.workers, show, per_frame=self.per_frame
            )
        return kept, failed, len(sources)


@app.command()
@file_options.takes_light_fields
def batch(
    frames: Annotated[
        list[str],
        typer.Argument(
            help="Aligned raw images, or with --white or --calib captures: file names, or patterns "
            "in quotes; films and TIFF files of several pages are taken frame by frame."
        ),
    ],
    hints: "Hints",
    *,
    a: options.SettingsIfGiven = None,
    z: options.Heights = None,
    out: Annotated[
        str,
        typer.Option(
            "--out",
            help="Folder for the results, or one volume of all frames: NAME.ome.tif (OME-TIFF) or "
            "NAME.tif (a hyperstack of ImageJ).",
        ),
    ] = "batch",
    workers: _Workers,
    operator: Operator,
    files: _Files,
    camera: CameraData,
    pupil: Pupil,
    look: LookIfGiven,
    per_frame: Annotated[
        bool,
        typer.Option(
            "--exposure-per-frame",
            help="Expose each capture by itself; by default one exposure serves the run, so that "
            "changes of light are seen.",
        ),
    ] = False,
    gpu: Annotated[
        bool,
        typer.Option(
            "--gpu",
            help="Refocus frames on an NVIDIA GPU where there is one (extra gpu); with "
            "--interpolation, --sharpen or --no-upsample.",
        ),
    ] = False,
) -> None:
    """Refocus many frames, or develop many captures; a run that was interrupted continues.

    Frames are refocused to a = 0 unless told otherwise, to pictures as refocus makes them; their
    values stay as they are. --interpolation, --sharpen and --no-upsample take the operator. Frames
    of films and of TIFF files with several pages are first unpacked, into frames_of_NAME in the
    folder for results.

    With --white or --calib each capture gets a folder with all that plenofir develop makes, with
    one calibration and one exposure for all of them (exposure.json).

    A volume has the slices of every frame, aligned or captured, in one file: the frames' values in
    16 bits, and with a microscope as --camera sizes in um. One frame is in memory at a time.
    """
    run = _Run(workers, operator, files, camera, pupil, look, per_frame, gpu)
    # A bad aperture or tilt is refused before anything else.
    pupil.how()
    captured = hints._replace(white=files.white, calib=files.calib, dark=files.dark)
    try:
        if is_volume(out):
            typer.echo(run.volume(frames, captured, a, z, out))
            return
        if z:
            raise InputError(
                "is for volumes; give --out NAME.ome.tif, too", where=options.typed("z")
            )
        if files.of_captures:
            kept, failed, total = run.develop(frames, captured, a, out)
        else:
            kept, failed, total = run.refocus(frames, hints, a, Path(out))
    except KeyboardInterrupt:
        rest = "nothing was written" if is_volume(out) else "the same command goes on from here"
        typer.echo(f"plenofir: stopped; {rest}", err=True)
        raise typer.Exit(130) from None
    for text in failed:
        typer.echo(f"failed: {text}", err=True)
    results = "captures developed" if files.of_captures else "frames refocused"
    typer.echo(
        f"{out}: {total - kept - len(failed)} {results}, {kept} there already, {len(failed)} failed"
    )
    if failed:
        raise typer.Exit(1)
