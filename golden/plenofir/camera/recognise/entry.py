# SPDX-License-Identifier: Apache-2.0
"""The one entry: from a path and hints to what is there."""

from dataclasses import replace
from pathlib import Path

from plenofir.camera.recognise.source import Hints, LightFieldSource
from plenofir.ground.errors import InputError

_NO_HINTS = Hints()


def recognise(path: Path, hints: Hints = _NO_HINTS) -> LightFieldSource:
    """What a file, folder or film is; its pixels are read when they are asked for.

    `hints`: what a person says about it. Raises `InputError` if it cannot be read, is damaged, or
    its pixels contradict a hint.
    """
    hints.check()
    try:
        if not path.exists():
            raise InputError("no such file or folder", where=str(path))
        if path.is_fifo():
            raise InputError(
                "is a pipe, which can be read once only; save it to a file first", where=str(path)
            )
        # Readers and classifiers load SciPy, which takes most of a second.
        from plenofir.camera.recognise.kinds import classify
        from plenofir.camera.recognise.readers import read
        from plenofir.camera.recognise.storage import Stored

        held = read(path, hints)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(reason or "cannot be read", where=str(path)) from None
    source = classify(held, hints) if isinstance(held, Stored) else held
    return source if source.where else replace(source, where=str(path))
