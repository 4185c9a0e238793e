# SPDX-License-Identifier: Apache-2.0
"""What a file, folder or film is: one answer for all commands.

`recognise(path, hints)` reads it by the first row of `readers.READERS` that takes it, and decides
by the rows of `kinds.CLASSIFIERS` what it is. The answer, a `LightFieldSource`, says why and how
sure that is, and reads views (`all_views`) or the aligned raw image (`field`) when asked.
"""

from plenofir.camera.recognise.entry import recognise
from plenofir.camera.recognise.source import Field, Finding, Hints, LightFieldSource

__all__ = ["Field", "Finding", "Hints", "LightFieldSource", "recognise"]
