# SPDX-License-Identifier: Apache-2.0
"""Threads and processes: how many to start, and threads that are kept for the next call."""

import os
import threading
from collections.abc import Callable


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Helper:
    """A thread that waits for work. A new one begins half a millisecond later than a kept one."""

    def __init__(self) -> None:
        self._go, self._done = threading.Lock(), threading.Lock()
        self._go.acquire()
        self._done.acquire()
        self._work: Callable[[], None] = lambda: None
        self._failure: BaseException | None = None
        threading.Thread(target=self._loop, name="refocus", daemon=True).start()

    def _loop(self) -> None:
        while True:
            self._go.acquire()
            try:
                self._work()
            except BaseException as failure:
                self._failure = failure
            self._done.release()

    def begin(self, work: Callable[[], None]) -> None:
        """Start the work."""
        self._work = work
        self._go.release()

    def wait(self) -> BaseException | None:
        """Wait until it is done, and keep nothing of it; how it failed."""
        self._done.acquire()
        failure, self._failure, self._work = self._failure, None, lambda: None
        return failure


# Each is used by one caller at a time, so there are as many as were ever needed at once.
_idle: list[_Helper] = []
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle.clear)


def in_threads(work: Callable[[], None], threads: int) -> None:
    """Run the same work in several threads, one of them the caller's.

    Where the system has no more threads, those that there are do it all.
    """
    helpers: list[_Helper] = []
    try:
        for _ in range(threads - 1):
            try:
                helpers.append(_idle.pop())
            except IndexError:
                helpers.append(_Helper())
            helpers[-1].begin(work)
    except RuntimeError:
        pass
    failures: list[BaseException | None] = []
    try:
        work()
    finally:
        for helper in helpers:
            failures.append(helper.wait())
            _idle.append(helper)
    for failure in failures:
        if failure:
            raise failure
