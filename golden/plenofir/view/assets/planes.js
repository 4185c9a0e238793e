// SPDX-License-Identifier: Apache-2.0
// Distances in mm over the focus setting a, from the ray model's table; heights of a microscope.

const STATES = ["", "infinity", "beyond infinity", "inside the lens"];

/** A distance of the table, between its entries: reciprocals are nearly linear in a. */
function between(entry, n, share) {
    const [first, second] = [entry.mm[n], entry.mm[n + 1] ?? entry.mm[n]];
    const state = entry.state[share < 0.5 || entry.state[n + 1] === undefined ? n : n + 1];
    if (share === 0 || first === second) return { mm: first, state: entry.state[n] };
    if (first === null || second === null) return { mm: null, state };
    return { mm: 1 / ((1 - share) / first + share / second), state };
}

export class Planes {
    /** `table`: first a, step, and for centre, near and far the distances and states. */
    constructor(table) {
        this.table = table;
        this.last = table.alpha.length - 1;
    }

    /** Distances of the plane a: centre, near, far and Ng's alpha; null outside of the table. */
    at(a) {
        let place = (a - this.table.first) / this.table.step;
        if (Math.abs(place - Math.round(place)) < 1e-6) place = Math.round(place);
        if (!(place >= 0 && place <= this.last)) return null;
        const n = Math.min(Math.floor(place), this.last);
        const share = place - n;
        const { alpha } = this.table;
        const found = { alpha: alpha[n] + share * ((alpha[n + 1] ?? alpha[n]) - alpha[n]) };
        for (const name of ["centre", "near", "far"]) {
            found[name] = between(this.table[name], n, share);
        }
        return found;
    }
}

export class Heights {
    /** `lines`: for centre, near and far the height in um at a = 0 and what it grows by with a; or null. */
    constructor(lines) {
        this.lines = lines;
    }

    /** Heights of the plane a over the plane in focus: centre, near and far. */
    at(a) {
        const height = ([, line]) => (line ? line[0] + line[1] * a : null);
        return Object.fromEntries(Object.entries(this.lines).map((one) => [one[0], { um: height(one) }]));
    }
}

/** Two distances in words. */
export function wordedRange(near, far) {
    const [from, to] = [worded(near), worded(far)];
    const unit = from.slice(-3);
    return unit === to.slice(-3) && unit.endsWith("m") ? `${from.slice(0, -3)} to ${to}` : `${from} to ${to}`;
}

/** A distance in words. */
export function worded({ mm, state, um }) {
    if (um !== undefined) return um === null ? "no end" : `${um.toFixed(1)} µm`;
    if (mm === null) return STATES[state] || "unknown";
    const digits = Math.abs(mm) < 10000 ? 1 : 0;
    const text = `${mm.toFixed(digits).replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f")} mm`;
    return STATES[state] ? `${text} (${STATES[state]})` : text;
}
