# SPDX-License-Identifier: Apache-2.0
"""Errata of chapter 6, the hardware."""

from collections.abc import Callable

import numpy as np

from plenofir.refocus.operator import gather_sums
from plenofir_studies.errata.entry import Erratum, Shown
from plenofir_studies.thesis_tables import load_table

_SEED = 6
_LENSES = 12


def _line(m: int) -> np.ndarray:
    return np.random.default_rng(_SEED).integers(0, 256, _LENSES * m)


def _sums(x: np.ndarray, m: int, shift: int, offset: int = 0) -> np.ndarray:
    """S of Eq. (6.1) from an index on."""
    return gather_sums(x, m, shift, axis=0, offset=offset)


def _by_index(
    x: np.ndarray, m: int, index: Callable[[int, int], int], outputs: range
) -> np.ndarray:
    """Sums of x[index(k, i)] over i = 0..M-1 for each output k."""
    return np.array([sum(int(x[index(k, i)]) for i in range(m)) for k in outputs])


def _differing(first: np.ndarray, second: np.ndarray) -> int:
    return int((first != second).sum())


def _natural() -> Shown:
    rows = [row for n in ("5.5", "5.6") for row in load_table(n).part().rows if row["a"] < 0]
    m, shift = 3, -2
    x = _line(m)
    scattered = np.zeros_like(x)
    for k in range(len(x)):
        for n in range(m):
            place = k + n + (k % m) * (shift - 1)
            if 0 <= place < len(x):
                scattered[place] += x[k]
    # Eq. (3.50): view i moved by a (c + i) micro lenses, every pixel repeated M times.
    want = np.zeros_like(x)
    for k in range(len(x)):
        for u in range(m):
            lens = (k - u * shift) // m
            if 0 <= lens < _LENSES:
                want[k] += x[m * lens + u]
    return Shown(
        f"Tables 5.5 and 5.6 have {len(rows)} rows with a = -1, Fig. 5.15 slices from a = -2/11 "
        "on. For a' = -2, M = 3 Eq. 6.1 is what Eq. 3.50 gives, for every pixel.",
        len(rows),
        _differing(scattered, want),
        0,
    )


def _eq_6_2() -> Shown:
    m = 5
    x = _line(m)
    outputs = range(2 * m, len(x) - m)
    printed = _by_index(x, m, lambda k, i: k - i - (k + 1) % m, outputs)
    now = _sums(x, m, 0)[outputs.start : outputs.stop]
    before = _sums(x, m, 0)[outputs.start - (m - 1) : outputs.stop - (m - 1)]
    return Shown(
        f"M = 5, random pixels: {_differing(printed, now)} of {len(outputs)} outputs differ from "
        "those of Eq. 6.1 with a' = 0 at the same index, none from those four pixels earlier.",
        _differing(printed, now),
        _differing(printed, before),
        0,
    )


def _eq_6_3() -> Shown:
    counts = {}
    for m in (3, 5):
        x = _line(m)
        starts = range(m * m, len(x), m)
        want = _sums(x, m, m)[starts.start :: m]
        printed = _by_index(x, m, lambda k, i: k - 2 * i, starts)
        right = _by_index(x, m, lambda k, i, m=m: k - i * (m - 1), starts)  # type: ignore[misc]
        held = np.repeat(want, m)
        counts[m] = (
            _differing(printed, want),
            _differing(right, want) + _differing(held, _sums(x, m, m)[starts.start :]),
            len(starts),
        )
    return Shown(
        f"M = 5: at k mod 5 = 0 a spacing of a + 1 = 2 pixels gives {counts[5][0]} of "
        f"{counts[5][2]} outputs wrong, a spacing of 4 none; the other phases repeat the value. "
        f"For M = 3 both spacings are 2 pixels ({counts[3][0]} wrong).",
        counts[5][0],
        counts[5][1] + counts[3][1],
        0,
    )


def _eq_6_5() -> Shown:
    m, shift = 3, 2
    x = _line(m)
    outputs = range(2 * m, len(x) - m)
    want = _sums(x, m, shift, 1)[outputs.start : outputs.stop]

    def index(sign: int) -> Callable[[int, int], int]:
        return lambda k, i: k - i + (sign * (i - 1) if (k + 1) % m == 0 else 0)

    printed, right = (_by_index(x, m, index(sign), outputs) for sign in (1, -1))
    example = x[3] + x[2] + x[1]
    agree = sum(int(_by_index(x, m, index(s), range(3, 4))[0] == example) for s in (1, -1))
    return Shown(
        f"Random pixels: as printed {_differing(printed, want)} of {len(outputs)} outputs differ "
        "from Eq. 6.1 with a' = 2, one pixel later: wherever k mod 3 = 2 it adds the same pixel "
        f"three times. With (1 - i) none differs. The example, Eq. 6.6, agrees with {agree} of "
        "the two signs.",
        _differing(printed, want),
        _differing(right, want),
        0,
    )


def _share_of_the_picture() -> Shown:
    side, before = 589, 3201
    return Shown(
        f"{before} / {side} is {before / side:.2f}: the sides are more than a sixth as long. One "
        f"pixel in {before**2 / side**2:.1f} is left.",
        side / before - 1 / 6,
        0,
        1e-3,
    )


ERRATA = (
    Erratum(
        "natural-numbers",
        "Eq. 6.1",
        "a' is a natural number",
        "any integer: negative ones are the planes beyond the focused one",
        _natural,
    ),
    Erratum(
        "eq-6-2",
        "Eq. 6.2",
        "the filter for a = 0/M, output k",
        "the output of Eq. 6.1 delayed by M - 1 pixels, as a causal filter must",
        _eq_6_2,
    ),
    Erratum(
        "eq-6-3",
        "Eq. 6.3",
        "the filter for a = M/M adds pixels that are a + 1 apart",
        "M - 1 apart, and only where k mod M = 0; the other phases repeat that value",
        _eq_6_3,
    ),
    Erratum(
        "eq-6-5",
        "Eqs. 6.5, 6.6",
        "the factor (i - 1)",
        "(1 - i): then it is Eq. 6.1 one pixel earlier",
        _eq_6_5,
    ),
    Erratum(
        "share-of-the-picture",
        "Section 6.1.2, benchmark",
        "a picture of 589 by 589 pixels is less than a sixth of one of 3201 by 3201",
        "1 / 5.4 in each dimension, 1 / 29.5 of the pixels",
        _share_of_the_picture,
    ),
)
