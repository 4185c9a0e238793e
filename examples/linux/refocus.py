# SPDX-License-Identifier: Apache-2.0
"""Switches a core on from Linux, as on a PYNQ-Z2, and says what passes through it.

Usage, as root:
    python refocus.py 1280 720 --overlay plenofir.bit --address 0x43C00000    (PYNQ)
    python refocus.py 1280 720 --address 0x43C00000                           (/dev/mem)
    python refocus.py 1280 720                                   (the UIO device "plenofir")
with --focus A for one slice, or --sweep FRAMES for all in turn, and --frames to watch.
It needs plenofir's driver alone: pip install --no-deps plenofir.
"""

import argparse
import sys
from collections.abc import Sequence
from contextlib import ExitStack, closing
from fractions import Fraction

from plenofir import driver
from plenofir.errors import InputError


def words_of(overlay: str, address: int | None, stack: ExitStack) -> driver.Access:
    """The way to the core: PYNQ's where an overlay is named, /dev/mem, or userspace I/O."""
    if overlay:
        if address is None:
            raise InputError("an overlay needs the core's address, that of the block design")
        from pynq import MMIO, Overlay

        Overlay(overlay)
        return MMIO(address, 4096)
    if address is not None:
        return stack.enter_context(closing(driver.Memory(address)))
    return stack.enter_context(closing(driver.Uio(driver.find_uio())))


def main(words: Sequence[str] | None = None) -> int:
    """Switch the core on, and print the slice of each frame that comes out."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("columns", type=int)
    parser.add_argument("rows", type=int)
    parser.add_argument("--overlay", default="")
    parser.add_argument("--address", type=lambda text: int(text, 0))
    parser.add_argument("--focus", type=Fraction)
    parser.add_argument("--sweep", type=int)
    parser.add_argument("--frames", type=int, default=60)
    given = parser.parse_args(words)
    with ExitStack() as stack:
        try:
            core = driver.Core(words_of(given.overlay, given.address, stack))
            print(core.description)
            core.set_frame_size(given.columns, given.rows)
            if given.focus is not None:
                core.set_focus(given.focus)
            if given.sweep is not None:
                core.sweep(given.sweep)
            core.enable()
            for _ in range(given.frames):
                if not core.wait("frame_out"):
                    raise InputError(f"no frame came out within a second: {core.counters()}")
                print("slice", core.shown_slice)
            print(core.counters(), core.errors() or "no faults")
        except InputError as error:
            print(f"refocus: {error}", file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
