// SPDX-License-Identifier: Apache-2.0
// A tilted plane in focus, through three points of the picture.

import { STEEPEST } from "./state.js";

// Least height of the triangle of three points, as a share of its longest side, and in micro lenses.
const [LEAST_SHARE, LEAST_LENSES] = [0.05, 2];

/**
 * The plane through three points [x, y, a], places in shares of the picture's size in pixels: a in
 * the middle, and by how much it grows to the right edge and to the bottom.
 */
export function planeThrough(points, size, m) {
    const [first, ...others] = points.map(([x, y, a]) => [2 * x - 1, 2 * y - 1, a]);
    const [e, f] = others.map((point) => point.map((value, n) => value - first[n]));
    const cross = e[0] * f[1] - e[1] * f[0];
    const sides = [e, f, e.map((value, n) => f[n] - value)];
    const longest = Math.max(...sides.map(([x, y]) => Math.hypot(x * size[0], y * size[1]) / 2));
    const high = (Math.abs(cross) * size[0] * size[1]) / 4 / longest;
    if (!(high >= Math.max(LEAST_SHARE * longest, LEAST_LENSES * m))) {
        throw new RangeError("the three points lie on a line, or close together; choose three that span the picture");
    }
    const tilt = [(e[2] * f[1] - f[2] * e[1]) / cross, (e[0] * f[2] - f[0] * e[2]) / cross];
    if (Math.max(...tilt.map(Math.abs)) > STEEPEST) {
        throw new RangeError(`the plane through these points is too steep: a would grow by more than ${STEEPEST} to an edge`);
    }
    return { focus: first[2] - tilt[0] * first[0] - tilt[1] * first[1], tilt };
}

/** How much a is more than in the middle, at a place in shares of the picture. */
export const riseAt = ([right, down], [x, y]) => right * (2 * x - 1) + down * (2 * y - 1);
