# SPDX-License-Identifier: Apache-2.0
"""Who is told that code is compiled for this machine, and what hinders keeping it.

`plenofir.ground.kept_code` tells; this module loads nothing, so that commands may listen.
"""

import threading
import warnings
from collections.abc import Callable

begins: list[Callable[[], None]] = []
"""Called before a function is compiled, in the thread that does it."""
compiled_now: list[str] = []
"""Names of the functions that are being compiled."""


def _warn(text: str) -> None:
    warnings.warn(text, RuntimeWarning, stacklevel=3)


tell: Callable[[str], None] = _warn
"""Says a sentence to the user."""

_announced: set[str] = set()


def begin(name: str) -> None:
    """Say that a function is about to be compiled."""
    compiled_now.append(name)
    for listener in begins:
        listener()


def end(name: str) -> None:
    """Say that it is compiled."""
    if name in compiled_now:
        compiled_now.remove(name)


def hindered(kind: str, text: str) -> None:
    """Say what hinders keeping code; of each kind only the first."""
    if kind not in _announced:
        _announced.add(kind)
        tell(text)


def tell_of_long_ones(seconds: float, say: Callable[[str], None]) -> None:
    """From now on say what is compiled, once, if it still is so many seconds after the first."""

    def fire() -> None:
        if compiled_now:
            say("compiling loops for this machine, once: some ten seconds of processor time")

    def start() -> None:
        begins.remove(start)
        timer = threading.Timer(seconds, fire)
        timer.daemon = True
        timer.start()

    begins.append(start)
