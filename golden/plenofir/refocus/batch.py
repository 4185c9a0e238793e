"""Many frames through Dask: resumable, in any order; a failed frame is reported, the others go on.

Each worker process has one thread and refocuses one frame at a time. Only paths are sent to it,
never pixels, so workers on other machines need the same file system.
"""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

from plenofir.errors import InputError
from plenofir.images import read_image, write_png
from plenofir.refocus import (
    check_raw,
    focus_to_shift,
    interpolation_order,
    processors,
    refocus,
)

Progress = Callable[[int, int], None]
State = Literal["done", "kept", "failed"]

RECORD = "batch.json"


@dataclass(frozen=True)
class Settings:
    """What is done to every frame."""

    m: int  # M in pixels
    a: tuple[Fraction, ...]  # focus settings
    order: int = 0  # order of the interpolation
    upsample: bool = True  # see `plenofir.refocus.refocus`

    def signature(self) -> str:
        """Text that is equal for equal settings."""
        focus = " ".join(str(a) for a in self.a)
        return f"M={self.m} a={focus} order={self.order} upsample={self.upsample}"


@dataclass(frozen=True)
class Frame:
    """A frame and what became of it."""

    source: Path  # raw image
    results: tuple[Path, ...]  # refocused images, one for each focus setting
    state: State  # "done", "kept" (there already) or "failed"
    reason: str = ""  # why it failed


def find_frames(pattern: str) -> list[Path]:
    """Frames of a pattern, in the order of the numbers in their names."""
    import glob
    import re

    def by_number(path: str) -> list[tuple[int, int, str]]:
        parts = re.split(r"(\d+)", path)
        return [(0, int(p), "") if p.isdigit() else (1, 0, p) for p in parts if p]

    found = [Path(p) for p in sorted(glob.glob(pattern, recursive=True), key=by_number)]
    found = [path for path in found if path.is_file()]
    if not found:
        raise InputError("no such files", where=pattern, expected="a pattern of image files")
    return found


def result_names(sources: Sequence[Path], settings: Settings) -> list[tuple[str, ...]]:
    """Names of the results of each frame."""
    names: list[tuple[str, ...]] = []
    seen: dict[str, Path] = {}
    for source in sources:
        if source.stem in seen:
            raise InputError(
                f"{seen[source.stem]} has the same name",
                where=str(source),
                expected="frames of different names",
            )
        seen[source.stem] = source
        if len(settings.a) == 1:
            names.append((f"{source.stem}.png",))
        else:
            shifts = [focus_to_shift(a, settings.m) for a in settings.a]
            names.append(tuple(f"{source.stem}_a{shift:+d}.png" for shift in shifts))
    return names


def refocus_frame(source: Path, results: tuple[Path, ...], settings: Settings) -> str:
    """Refocus a frame and write its results, each in one step."""
    try:
        raw = read_image(source)
        check_raw(raw, settings.m, where=str(source))
        for a, result in zip(settings.a, results, strict=True):
            image = refocus(
                raw,
                settings.m,
                a,
                interpolation=settings.order,
                upsample=settings.upsample,
                threads=1,
            )
            partial = result.with_name(f".{result.stem}.{os.getpid()}.png")
            try:
                write_png(partial, image)
                partial.replace(result)
            finally:
                partial.unlink(missing_ok=True)
    except (InputError, OSError, MemoryError) as error:
        return str(error) or type(error).__name__
    return ""


@contextmanager
def _client(scheduler: str, workers: int | None) -> Iterator[Any]:
    """Client of a Dask cluster: one of its own on this machine, or one that runs already."""
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise InputError(
            "the package distributed is not installed",
            where="batch",
            expected="pip install 'plenofir[batch]'",
        ) from None
    if scheduler != "local" and not scheduler.startswith(("tcp://", "tls://")):
        raise InputError(f"{scheduler!r}", where="--scheduler", expected="local or tcp://HOST:PORT")
    if scheduler == "local":
        with (
            LocalCluster(
                n_workers=workers or processors(),
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs=50,
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, TimeoutError, ValueError):
        raise InputError(
            "no scheduler answers", where=scheduler, expected="the address of a Dask scheduler"
        ) from None
    with client:
        yield client


def _identity(source: Path) -> str:
    """What changes when the file changes."""
    status = source.stat()
    return f"{status.st_size} {status.st_mtime_ns}"


def run_batch(
    sources: Sequence[Path],
    settings: Settings,
    out: Path,
    *,
    scheduler: str = "local",
    workers: int | None = None,
    progress: Progress | None = None,
) -> list[Frame]:
    """Refocus many frames.

    Frames whose results are there already, made from the same file with the same settings, are
    kept, so a run that was interrupted continues where it stopped.

    Parameters
    ----------
    sources
        Raw images.
    settings
        What to do to each of them.
    out
        Folder for the results and for the record ``batch.json``.
    scheduler
        "local", or the address of a Dask scheduler.
    workers
        Number of local processes; as many as there are processors if None.
    progress
        Called with the frames done and to do.

    Returns
    -------
    list of Frame
        In the order of `sources`, whatever order they were finished in.

    Raises
    ------
    InputError
        If the settings, the folder or the scheduler cannot be used.
    """
    interpolation_order(settings.order)
    for a in settings.a:
        if not settings.upsample and a.denominator != 1:
            raise InputError(str(a), where="a", expected="an integer for a pixel each micro lens")
        focus_to_shift(a, settings.m)
    names = result_names(sources, settings)
    results = [tuple((out / name).absolute() for name in group) for group in names]
    inputs = {source.absolute() for source in sources}
    for group in results:
        for path in group:
            if path in inputs:
                raise InputError(
                    "would replace a frame", where=str(path), expected="another folder for results"
                )
    try:
        out.mkdir(parents=True, exist_ok=True)
        record = out / RECORD
        known: dict[str, str] = json.loads(record.read_text()) if record.is_file() else {}
    except OSError as error:
        raise InputError(
            f"cannot be used ({error.strerror})",
            where=str(out),
            expected="a folder that can be written",
        ) from None
    except ValueError:
        known = {}
    marks = [
        sha256(
            f"{settings.signature()} {source.absolute()} {_identity(source)}".encode()
        ).hexdigest()
        for source in sources
    ]
    frames: dict[int, Frame] = {}
    waiting = []
    for number, (source, group, mark) in enumerate(zip(sources, results, marks, strict=True)):
        if known.get(source.name) == mark and all(path.is_file() for path in group):
            frames[number] = Frame(source, group, "kept")
        else:
            waiting.append(number)

    def tell() -> None:
        if progress is not None:
            progress(len(frames), len(sources))

    def note(number: int) -> None:
        known[sources[number].name] = marks[number]
        partial = record.with_name(f".{RECORD}.{os.getpid()}")
        partial.write_text(json.dumps(known, indent=1) + "\n")
        partial.replace(record)

    tell()
    if waiting:
        with _client(scheduler, workers) as client:
            from distributed import as_completed

            futures = {
                client.submit(
                    refocus_frame,
                    sources[number].absolute(),
                    results[number],
                    settings,
                    pure=False,
                    retries=1,
                ): number
                for number in waiting
            }
            for future in as_completed(list(futures)):
                number = futures[future]
                if future.status == "finished":
                    reason = future.result()
                else:
                    reason = f"worker failed: {future.exception()}"
                state: State = "failed" if reason else "done"
                frames[number] = Frame(sources[number], results[number], state, reason)
                if not reason:
                    note(number)
                tell()
    return [frames[number] for number in range(len(sources))]
