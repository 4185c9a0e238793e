# SPDX-License-Identifier: Apache-2.0
"""Locks on open files, which end with the file or its process."""

import os
import sys

# Windows locks bytes, and nobody reads or writes a locked one: this one lies behind every file.
_BYTE = 1 << 40


def lock_file(file: int, *, wait: bool) -> None:
    """Lock an open file for this process. Raises BlockingIOError if another one has it."""
    if sys.platform == "win32":
        import msvcrt

        before = os.lseek(file, 0, os.SEEK_CUR)
        os.lseek(file, _BYTE, os.SEEK_SET)
        try:
            while True:
                try:
                    msvcrt.locking(file, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
                    return
                except OSError as error:
                    if not wait:
                        raise BlockingIOError(error.errno, error.strerror) from None
        finally:
            os.lseek(file, before, os.SEEK_SET)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
