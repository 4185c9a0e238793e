# SPDX-License-Identifier: Apache-2.0
"""The first pictures of a machine come from plain NumPy, while a thread compiles the fast loops.

Code that an earlier process has kept on disk is loaded, which takes less than a second; then plain
NumPy is never asked. Compiling takes some ten seconds of processor time, once on a machine. A
process that ends before waits for it, so that the next process finds the code. The thread begins
when the first picture is done: both would take turns at the interpreter's lock.
"""

import os
import sys
import threading
import time
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import NamedTuple, TypeVar

import numpy as np

from plenofir.ground import compiling
from plenofir.refocus.operator import Image
from plenofir.refocus.plain import plain_refocus
from plenofir.refocus.slices import Slice

Result = TypeVar("Result")

patient = False
"""Whether pictures wait for compiled code: for benchmarks, and where many pictures follow."""

# Loading kept code takes less; a disk that takes longer is no reason to wait.
_LOADING_SECONDS = 1.5
# Whoever is interrupted gives no answer.
_ANSWER_SECONDS = 60
# A thread that adds lines asks for the interpreter's lock thousands of times, and waits this long
# each time for a thread that compiles; Python's own 5 ms would make a second half a minute.
_SWITCH_SECONDS = 2e-5


class _Job:
    """Loads the code of one kind of picture, or compiles it."""

    def __init__(self, load: Callable[[], object]) -> None:
        self._load, self._deadline = load, time.monotonic() + _LOADING_SECONDS
        # Code is missing on disk, or all is loaded.
        self._decided = threading.Event()
        self.compiles = False
        self.answered = threading.Event()
        self.future: Future[None] = _pool.submit(self._run)

    def _run(self) -> None:
        before = sys.getswitchinterval()
        _of_thread.job = self
        try:
            self._load()
        finally:
            sys.setswitchinterval(before)
            self._decided.set()

    def missing(self) -> None:
        """Let whoever waits have plain NumPy, and then begin to compile."""
        if not self.compiles:
            self.compiles = True
            self._decided.set()
            self.answered.wait(_ANSWER_SECONDS)
            sys.setswitchinterval(_SWITCH_SECONDS)

    def ready(self) -> bool:
        """Whether the code is there; waits for what is on disk."""
        if self.future.done():
            return True
        if patient:
            self.answered.set()
            wait([self.future])
        elif not any(job.compiles and not job.future.done() for job in _jobs.values()):
            self._decided.wait(max(0.0, self._deadline - time.monotonic()))
        return self.future.done()


_of_thread = threading.local()
_lock = threading.Lock()
_jobs: dict[Hashable, _Job] = {}
_pool = ThreadPoolExecutor(1, "compiles refocusing")
# In a process that was forked while its parent compiled, the compiler's locks stay locked.
_locked_by_parent = False


def _missing() -> None:
    job = getattr(_of_thread, "job", None)
    if job:
        job.missing()


compiling.begins.append(_missing)


def _forked() -> None:
    global _lock, _locked_by_parent, _pool
    _locked_by_parent |= any(not job.future.done() for job in _jobs.values())
    for kind in [kind for kind, job in _jobs.items() if not job.future.done()]:
        del _jobs[kind]
    _lock, _pool = threading.Lock(), ThreadPoolExecutor(1, "compiles refocusing")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def _job_of(kind: Hashable, load: Callable[[], object]) -> _Job | None:
    """The job of a kind, which is begun at its first picture; None where none can be."""
    job = _jobs.get(kind)
    if job or _locked_by_parent:
        return job
    with _lock:
        if kind not in _jobs:
            try:
                _jobs[kind] = _Job(load)
            except RuntimeError:  # no more threads, or the interpreter ends
                return None
        return _jobs[kind]


def soonest(
    kind: Hashable,
    load: Callable[[], object],
    by_compiled_code: Callable[[], Result],
    by_numpy: Callable[[], Result],
) -> Result:
    """A picture by compiled code, or by its equal in NumPy until that is compiled.

    `load`: makes a small picture of this kind by compiled code, in a thread, once for each `kind`:
    whatever the code depends on.
    """
    job = _job_of(kind, load)
    try:
        return by_compiled_code() if job and job.ready() else by_numpy()
    finally:
        if job:
            job.answered.set()


class Kind(NamedTuple):
    """What the compiled code of `refocus_image` depends on."""

    pixel_bytes: int
    channels: tuple[int, ...]
    micro_image_size: int
    box: int
    order: int
    units: int

    def load(self) -> None:
        """Refocus a pixel by the code of this kind."""
        from plenofir.refocus import compiled

        raw = np.zeros((1, 1, *self.channels), f"u{self.pixel_bytes}")
        compiled.compiled_refocus(
            raw,
            Slice(
                raw.shape,
                8 * self.pixel_bytes,
                self.micro_image_size,
                # With a' = 0 all views meet, and a box takes all of them.
                int(self.box < self.micro_image_size),
                (range(1), range(1)),
                order=self.order,
                units=self.units,
                box_samples=self.box,
            ),
        )


def refocus_image(
    raw: Image, slice_: Slice, *, out: Image | None = None, threads: int | None = None
) -> Image:
    """Refocus an image as soon as possible (`soonest`)."""

    def by_compiled_code() -> Image:
        from plenofir.refocus import compiled

        return compiled.compiled_refocus(raw, slice_, out=out, threads=threads)

    def by_numpy() -> Image:
        return plain_refocus(raw, slice_, out=out, threads=threads)

    m, units = slice_.micro_image_size, slice_.units
    if m == 1 and not units:
        return by_numpy()
    kind = Kind(raw.dtype.itemsize, raw.shape[2:], m, slice_.box, slice_.order, units)
    return soonest(kind, kind.load, by_compiled_code, by_numpy)


def wait_for_compilers() -> bool:
    """Wait until nothing is compiled any more; whether anything was."""
    busy = [job.future for job in _jobs.values() if not job.future.done()]
    wait(busy)
    return bool(busy)
