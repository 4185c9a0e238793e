# SPDX-License-Identifier: Apache-2.0
"""The fast refocuser: compiled on the user's machine, at a cost that depends on neither M nor a.

`compiled_refocus` is its entry; `plenofir.refocus.plain.plain_refocus` is the same in NumPy, equal
to the bit. Plain loops for Numba take six times as long: most of the time goes into transposing
sums between registers, so the inner loops (`column_vectors`, `row_vectors`) are written in LLVM's
vector types (`vector_code`) and compiled one by one (`machine_code`); Numba compiles what calls
them (`blocks` down to `places`). ``docs/decisions.md`` has the reasons, and when to drop this room.

Lines and pixels that leave a box lie as many samples behind those that enter as it is wide
(`plenofir.refocus.slices.Slice.box`), whatever M is; only the taps of sharpening lie a micro image
apart.
"""

from plenofir.refocus.compiled.frames import compiled_refocus

__all__ = ["compiled_refocus"]
