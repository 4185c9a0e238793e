# SPDX-License-Identifier: Apache-2.0
"""How a camera distorts an even grid: the terms, and the models composed of them.

With z, a complex number, the position of a lens in an even grid relative to the middle of the image
in half diagonals, centres are sums of terms z^a conj(z)^b with real factors:

    even        1, i, z, iz, conj(z), i conj(z)     offset, pitch, rotation, shear
    radial      z |z|^2                             distortion, r' = r + k r^3
    tilt        z Re(z), z Im(z)                    perspective
    axis        |z|^2, i |z|^2                      distortion about another point
    quadratic, cubic                                remaining terms of orders 2 and 3
    high        z |z|^4, z |z|^2 Re(z), z |z|^2 Im(z)
    quintic                                         remaining terms of orders 4 and 5

Where orders 2 and 3 are not fitted in full, perspective and distortion are exact: their terms of
higher order follow from tilt and distortion (`beyond`).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.grid import Floats

Complexes = npt.NDArray[np.complex128]
_Term = dict[tuple[int, int], complex]


def _both(a: int, b: int) -> list[_Term]:
    return [{(a, b): 1.0}, {(a, b): 1j}]


def _tilt(times: int) -> list[_Term]:
    """Terms z Re(z) and z Im(z), times a power of |z|^2."""
    high, low = (2 + times, times), (1 + times, 1 + times)
    return [{high: 0.5, low: 0.5}, {high: -0.5j, low: 0.5j}]


# Terms of each group, and the standard deviations of their factors in half diagonals.
GROUPS: dict[str, tuple[list[_Term], float]] = {
    "even": ([*_both(0, 0), *_both(1, 0), *_both(0, 1)], np.inf),
    "radial": ([{(2, 1): 1.0}], 0.02),
    "tilt": (_tilt(0), 0.03),
    "axis": (_both(1, 1), 0.005),
    "quadratic": (_both(0, 2), 0.005),
    "cubic": ([{(2, 1): 1j}, *_both(3, 0), *_both(1, 2), *_both(0, 3)], 0.005),
    "high": ([{(3, 2): 1.0}, *_tilt(1)], 0.003),
    "quintic": (
        [
            *(term for a in (4, 3, 1, 0) for term in _both(a, 4 - a)),
            {(3, 2): 1j},
            *(term for a in (5, 4, 2, 1, 0) for term in _both(a, 5 - a)),
        ],
        0.002,
    ),
}
_PLANE = ("even", "tilt", "axis", "quadratic")


@dataclass(frozen=True)
class Model:
    """Groups of terms, and the order of the polynomial that they make."""

    groups: tuple[str, ...]
    order: int

    @property
    def perspective(self) -> bool:
        """Whether its terms of higher order follow from its tilt."""
        return "tilt" in self.groups and "quadratic" not in self.groups

    @property
    def needs(self) -> tuple[int, ...]:
        """Orders of which it has all terms."""
        order_of_group = {"quadratic": 2, "cubic": 3, "high": 4, "quintic": 5}
        return tuple(order_of_group[name] for name in self.groups if name in order_of_group)


EVEN = Model(("even",), 1)
BENT = Model(("even", "tilt", "radial"), 3)
FULL = {
    1: EVEN,
    2: Model(_PLANE, 2),
    3: Model((*_PLANE, "radial", "cubic"), 3),
    5: Model((*_PLANE, "radial", "cubic", "high", "quintic"), 5),
}
"""Models that have all terms of an order."""
_LENS = Model(("even", "tilt", "axis", "radial"), 3)
_HIGH = Model((*_LENS.groups, "high"), 5)
MODELS = (
    EVEN,
    Model(("even", "radial"), 3),
    Model(("even", "tilt"), 2),
    BENT,
    _LENS,
    FULL[2],
    FULL[3],
    _HIGH,
    Model((*FULL[3].groups, "high"), 5),
    FULL[5],
)
HIGHEST = max(model.order for model in MODELS)
_ALL = tuple(GROUPS)


@cache
def places_of(groups: tuple[str, ...]) -> npt.NDArray[np.int64]:
    """Indices of the terms of some groups among all terms."""
    ends = np.cumsum([0, *(len(GROUPS[name][0]) for name in _ALL)])
    parts = [np.arange(ends[_ALL.index(n)], ends[_ALL.index(n) + 1]) for n in groups]
    return np.sort(np.concatenate(parts))


TERMS = [term for name in _ALL for term in GROUPS[name][0]]
SPREADS = np.concatenate([np.full(len(terms), spread) for terms, spread in GROUPS.values()])


def columns(z: Complexes, groups: tuple[str, ...]) -> Complexes:
    """Terms of some groups at places z, shape (places, terms)."""
    powers = [np.ones_like(z)]
    for _ in range(HIGHEST):
        powers.append(powers[-1] * z)
    result = np.empty((len(z), len(places_of(groups))), dtype=np.complex128)
    for column, n in enumerate(places_of(groups)):
        result[:, column] = sum(
            factor * powers[a] * powers[b].conj() for (a, b), factor in TERMS[n].items()
        )
    return result


def beyond(z: Complexes, tilt: Floats, bend: float) -> Complexes:
    """Terms of higher order that follow from a tilt and a distortion, in half diagonals.

    It is z / (1 - s), s = tilt . z, distorted, up to the fifth order.
    """
    s = z.real * tilt[0] + z.imag * tilt[1]
    return np.asarray(z * (s**2 + s**3 + s**4 + bend * np.abs(z) ** 2 * (3 * s + 6 * s**2)))


@dataclass(frozen=True)
class Frame:
    """An even grid in the middle of an image, in which places z are measured.

    `vectors` are its steps along rows and columns in pixels, `origin` the lattice coordinates at
    `middle` (y, x), and `half` the half diagonal in pixels.
    """

    vectors: Floats
    origin: Floats
    middle: Floats
    half: float

    def places(self, lattice: Floats) -> Complexes:
        """Places z of lattice coordinates."""
        away = (lattice - self.origin) @ self.vectors / self.half
        return away[..., 0] + 1j * away[..., 1]
