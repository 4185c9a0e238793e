# SPDX-License-Identifier: Apache-2.0
"""Many frames through Dask: resumable, in any order; a failed frame is reported, the others go on.

Each worker process has one thread and refocuses one frame at a time, or some that overlap on a GPU
(`plenofir.refocus.batch_frames`). Only paths are sent to it, never pixels, so workers on other
machines need the same file system. Workers write into a hidden folder of their run; the run itself
moves results to their places and adds them to the record. So nothing left from an earlier run, not
even a worker, can change a result.
"""

import glob
import os
import re
import shutil
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from itertools import islice
from multiprocessing import resource_tracker
from pathlib import Path
from tempfile import gettempdir
from typing import Any, Literal
from uuid import uuid4

from plenofir.ground import compiling
from plenofir.ground.errors import InputError, ToolError
from plenofir.ground.files import as_text, cannot_write
from plenofir.ground.shell import quoted
from plenofir.refocus import (
    processors,
    setting_names,
)
from plenofir.refocus.batch_frames import Made, Settings, refocus_frames
from plenofir.refocus.batch_record import Entry, Record
from plenofir.refocus.checks import whole_number

Progress = Callable[[int, int], None]
State = Literal["done", "kept", "failed"]

WORKERS_PER_PROCESSOR = 4
"""More wait for each other, or for memory."""
_AHEAD = 1000
"""Tasks that the scheduler holds at once, however many there are."""
_MOST_TOGETHER = 8
"""Frames that a worker with a GPU gets at once."""
_ADVICE = "name image files, or a pattern of them"
_STAGING = ".plenofir-batch-"


@dataclass(frozen=True)
class Frame:
    """A frame and its outcome."""

    source: Path  # raw image
    results: tuple[Path, ...]  # refocused images, one for each focus setting
    state: State  # "done", "kept" (there already) or "failed"
    reason: str = ""  # why it failed


def find_frames(patterns: Iterable[str]) -> list[Path]:
    """Files of names and patterns, those of a pattern in the order of the numbers in their names.

    A name of an existing file is not a pattern, even if it has brackets.
    """

    def by_number(path: str) -> list[tuple[int, int, str]]:
        parts = re.split(r"(\d+)", path)
        return [(0, int(p), "") if p.isdecimal() else (1, 0, p) for p in parts if p]

    frames: dict[Path, None] = {}
    for pattern in patterns:
        named = Path(pattern)
        try:
            files = [named] if named.exists() else []
            if not files:
                names = sorted(glob.glob(pattern, recursive=True), key=by_number)
                files = [path for path in map(Path, names) if path.is_file()]
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise InputError(f"{reason}; {_ADVICE}", where=pattern) from None
        if not files:
            raise InputError(f"no such files; {_ADVICE}", where=pattern)
        if files[0].is_dir():
            inside = Path(glob.escape(str(named))) / "*.png"
            raise InputError(f"is a folder; give a pattern such as {quoted(inside)}", where=pattern)
        frames |= dict.fromkeys(files)
    return list(frames)


def result_names(sources: Sequence[Path], settings: Settings) -> list[tuple[str, ...]]:
    """Names of the results of each frame: the frame's own, and the focus setting."""
    named = setting_names(settings.a, settings.micro_image_size)
    suffixes = [f"_{name}.png" for name in named]
    names = []
    sources_of: dict[str, Path] = {}
    for source in sources:
        if source.stem in sources_of:
            raise InputError(
                f"{sources_of[source.stem]} has the same name; results are named after their "
                "frames",
                where=str(source),
            )
        sources_of[source.stem] = source
        names.append(tuple(source.stem + suffix for suffix in suffixes))
    return names


def _check_lengths(sources: Sequence[Path], names: Sequence[tuple[str, ...]], folder: Path) -> None:
    """Refuse a frame whose results would have names that the folder's file system refuses."""
    # Windows has no call that tells it; its file systems take 255.
    limit = os.pathconf(folder, "PC_NAME_MAX") if hasattr(os, "pathconf") else 255
    for source, group in zip(sources, names, strict=True):
        if max(len(os.fsencode(name)) for name in group) > limit:
            raise InputError(
                "the names of its results would be too long; give it a shorter name",
                where=str(source),
            )


def worker_count(scheduler: str, workers: int | None) -> int:
    """Local processes to start; refuses a scheduler without an address, and too many processes."""
    if scheduler != "local" and not scheduler.startswith(("tcp://", "tls://")):
        raise InputError(
            f"{scheduler!r} is not a scheduler; use local or tcp://HOST:PORT", where="scheduler"
        )
    most = WORKERS_PER_PROCESSOR * processors()
    count = processors() if workers is None else whole_number(workers, "workers", 1)
    if count > most:
        raise InputError(
            f"{count} workers are not possible on these processors; use 1 to {most}",
            where="workers",
        )
    return count


def failure(error: BaseException) -> str:
    """Why a frame's worker ended without a result."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return "its worker process died, again and again (too little memory, or killed)"
    return f"{type(error).__name__} {error}".splitlines()[0]


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Only this process handles Ctrl-C: workers inherit what the cluster's threads block."""
    if hasattr(signal, "pthread_sigmask"):
        # The first worker would start multiprocessing's tracker, which unblocks them.
        resource_tracker.ensure_running()
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    else:
        yield


@contextmanager
def dask_client(scheduler: str, workers: int) -> Iterator[Any]:
    """Client of a Dask cluster: a new one on this machine, or a running one."""
    try:
        import cryptography  # noqa: F401  (of Security.temporary)
        import dask
        from distributed import Client, LocalCluster, Security
    except ImportError as error:
        raise InputError(
            f"the package {error.name} is not installed; pip install distributed cryptography"
        ) from None
    if scheduler == "local":
        temporary = dask.config.get("temporary-directory") or gettempdir()
        try:
            str(temporary).encode()
        except UnicodeEncodeError:
            raise InputError(
                f"{as_text(temporary)} is no text, which the folder for temporary files of worker "
                "processes must be; name another one",
                where="TMPDIR",
            ) from None
        # Whoever reaches a port of these processes can run code as their user, so all of them
        # require a certificate that only this run has. HTTP servers cannot be disabled, but have no
        # pages.
        routes: dict[str, list[str]] = {
            f"distributed.{role}.http.routes": [] for role in ("scheduler", "worker")
        }
        try:
            with _interrupts_blocked(), dask.config.set(routes):
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    security=Security.temporary(),
                    dashboard_address=None,
                    # Any free port, so that several runs can share the machine.
                    scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
                    worker_dashboard_address=None,
                    silence_logs=50,
                )
        except (RuntimeError, TimeoutError) as error:
            # A machine with much else to do lets them miss Dask's limits of time.
            raise ToolError(
                f"worker processes do not start ({error}); run it again when the machine has less "
                "to do, or with fewer --workers"
            ) from None
        with cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(scheduler, timeout=10)
    except TypeError:
        raise InputError(
            "needs certificates: a CA, a certificate and a key in Dask's configuration "
            "distributed.comm.tls",
            where=scheduler,
        ) from None
    except (OSError, TimeoutError, ValueError):
        raise InputError("no Dask scheduler answers there", where=scheduler) from None
    with client:
        yield client


@contextmanager
def _staging(out: Path) -> Iterator[Path]:
    """Hidden folder for the workers of this run; folders of killed runs are removed."""
    for left in out.glob(f"{_STAGING}*"):
        shutil.rmtree(left, ignore_errors=True)
    folder = out / f"{_STAGING}{uuid4().hex}"
    try:
        folder.mkdir()
    except OSError as error:
        raise cannot_write(folder, error) from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _mark(source: Path, settings: Settings) -> str:
    """Text that changes with the file and the settings."""
    try:
        status = source.stat()
        identity = f"{status.st_size} {status.st_mtime_ns}"
    except OSError:
        identity = "missing"
    text = f"{settings.signature()} {source.absolute()} {identity}"
    return sha256(os.fsencode(text)).hexdigest()


def _made(
    sources: Sequence[Path], settings: Settings, folder: Path, client: Any, together: int
) -> Iterator[tuple[int, Made]]:
    """Frames in the order in which workers finish them; a worker gets so many at once."""
    from distributed import as_completed

    waiting = iter(range(len(sources)))
    running = as_completed()
    numbers: dict[str, Sequence[int]] = {}

    def submit(group: Sequence[int]) -> None:
        if group:
            paths = [sources[number].absolute() for number in group]
            future = client.submit(refocus_frames, paths, settings, folder, pure=False)
            numbers[future.key] = group
            running.add(future)

    for _ in range(_AHEAD):
        submit([*islice(waiting, together)])
    for future in running:
        group = numbers.pop(future.key)
        try:
            # A worker may die with a result that nobody fetched; Dask makes it anew meanwhile.
            of_group = future.result()
        except Exception as error:
            if len(group) > 1:
                # Without the one that fails the others succeed.
                for number in group:
                    submit([number])
                continue
            of_group = [Made(failure=f"{sources[group[0]]}: {failure(error)}")]
        yield from zip(group, of_group, strict=True)
        submit([*islice(waiting, together)])


def run_batch(
    sources: Sequence[Path],
    settings: Settings,
    out: Path,
    *,
    scheduler: str = "local",
    workers: int | None = None,
    progress: Progress | None = None,
) -> list[Frame]:
    """Refocus many frames, with the record ``batch.jsonl`` beside their results.

    Existing results of the same file and settings that are unchanged (size and hash) are kept, so
    an interrupted run continues where it stopped. `scheduler` is "local" or the address of a Dask
    scheduler; `workers` is the number of local processes, by default one for each processor. After
    an InputError (a full disk, say) finished frames are kept. Result: frames in the order of
    `sources`.
    """
    settings.check()
    count = worker_count(scheduler, workers)
    names = result_names(sources, settings)
    there = out.resolve()
    for source in sources:
        if source.resolve().parent == there:
            raise InputError("lies in the folder for results; name another one", where=str(source))
    frames: dict[int, Frame] = {}

    def note(number: int, state: State, reason: str = "") -> None:
        results = tuple((out / name).absolute() for name in names[number])
        frames[number] = Frame(sources[number], results, state, reason)
        if progress is not None:
            progress(len(frames), len(sources))

    with Record(out) as record, _staging(out.absolute()) as folder:
        _check_lengths(sources, names, out)
        marks = [_mark(source, settings) for source in sources]

        def is_there(number: int) -> bool:
            entry = record.entries.get(marks[number])
            return (
                entry is not None
                and [*entry.results] == [*map(as_text, names[number])]
                and all(
                    content.is_in(out / name)
                    for name, content in zip(names[number], entry.results.values(), strict=True)
                )
            )

        with ThreadPoolExecutor(processors()) as pool:
            for number, kept in enumerate(pool.map(is_there, range(len(sources)))):
                if kept:
                    note(number, "kept")
        waiting = [number for number in range(len(sources)) if number not in frames]
        if waiting:
            with dask_client(scheduler, count) as client:
                # A GPU works on frames while others are read and written.
                together = max(1, min(_MOST_TOGETHER, len(waiting) // count)) if settings.gpu else 1
                left = [sources[number] for number in waiting]
                frames_made = _made(left, settings, folder, client, together)
                for place, made in frames_made:
                    number = waiting[place]
                    for text in made.notes:
                        compiling.hindered("gpu", text)
                    for name, (path, _) in zip(names[number], made.results, strict=False):
                        try:
                            path.replace(out / name)
                        except OSError as error:
                            raise cannot_write(out / name, error) from None
                    if made.stop is not None:
                        unwritten = out / names[number][len(made.results)]
                        raise cannot_write(unwritten, made.stop)
                    if made.failure:
                        note(number, "failed", made.failure)
                        continue
                    contents = [content for _, content in made.results]
                    record.add(
                        Entry(
                            source=as_text(sources[number]),
                            mark=marks[number],
                            results=dict(zip(map(as_text, names[number]), contents, strict=True)),
                        )
                    )
                    note(number, "done")
    return [frames[number] for number in range(len(sources))]
