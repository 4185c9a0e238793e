# SPDX-License-Identifier: Apache-2.0
"""Which pixels enter a sum, which leave it, and which sums an output takes."""

from typing import cast

import numpy as np

from plenofir.ground.kept_code import borrowing, inner
from plenofir.refocus.compiled.parameters import Axis, Integers, Plan
from plenofir.refocus.compiled.vector_code import LINE_BYTES

# Beyond all pixels.
ANYWHERE = cast("int", np.int64(1 << 62))


@borrowing
def entering(
    plan: Plan, first: Integers, p: int, low: int, high: int, places: Integers, n: int
) -> int:
    """Write the pixels low to high - 1 of sample p to places[n ...]; result: their end.

    Sample p of the re-ordered line enters S[p], and leaves S[p + box].
    """
    u = first[p % plan.micro_image_size]
    while 0 <= u < plan.micro_image_size:
        k = p - u * (plan.shift - 1)
        if low <= k < high:
            places[n] = k
            n += 1
        u += plan.micro_image_size // plan.common
    return n


@borrowing
def whole(
    plan: Plan, first: Integers, p: int, low: int, high: int, places: Integers, n: int
) -> int:
    """Write the pixels low to high - 1 in the sum S[p] to places[n ...]; result: their end."""
    for sample in range(p - plan.box + 1, p + 1):
        n = entering(plan, first, sample, low, high, places, n)
    return n


@inner
def ranges_of(plan: Plan, axis: Axis, reach: int, t0: int, t1: int) -> Integers:
    """First and last + 1 sum that outputs t0 to t1 - 1 need; line j: after j more moving sums.

    `reach`: how many sums away the taps of sharpening lie.
    """
    ranges = np.empty((plan.order + 1, 2), np.int64)
    ranges[plan.order, 0], ranges[plan.order, 1] = t0, t1
    if plan.order + reach > 0:
        # Limited to the picture.
        low, high = axis.offset, axis.offset + axis.length
        for level in range(plan.order, -1, -1):
            t0, t1 = max(low, t0 - reach), min(high, t1 + reach)
            ranges[level, 0], ranges[level, 1] = t0, t1
            reach = 0
            t0, t1 = t0 + plan.box_offset - plan.box + 1, t1 + plan.box_offset
    return ranges


@inner
def aligned(count: int, size: int) -> Integers:
    """Zeros of `size` bytes, the first of them at a line of the cache: no vector lies in two."""
    memory = np.zeros(count * size + LINE_BYTES, np.uint8)
    return memory[(LINE_BYTES - memory.ctypes.data % LINE_BYTES) :]
