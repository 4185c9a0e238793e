// SPDX-License-Identifier: Apache-2.0
// What is on show, apart from zoom and pan: checked, and as words of the address.

export const MODES = ["refocused", "sharp", "depth"];
const MOST_EV = 24;
const MOST_SHOULDER = 100;
/** The steepest tilt, as plenofir.refocus.pictures has it. */
export const STEEPEST = 100;
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
const short = (x) => String(Number(x.toFixed(4)));

function number(value, name) {
    if (typeof value !== "number" || !Number.isFinite(value)) {
        throw new TypeError(`${name} is ${value}, not a number`);
    }
    return value;
}

/** The state that a page starts with. */
export function startingState(field) {
    const [low, high] = field.range;
    const c = (field.micro_image_size - 1) / 2;
    return {
        focus: clamp(0, low, high),
        tilt: [0, 0],
        aperture: 1,
        view: [c, c],
        exposure: { ...field.exposure.start },
        smooth: true,
        mode: "refocused",
    };
}

/** A state with changes; errors for what can be no state. */
export function changedState(state, what, m, hasDepth) {
    const next = { ...state, ...what };
    number(next.focus, "a");
    next.tilt = next.tilt.map((rise) => clamp(number(rise, "tilt"), -STEEPEST, STEEPEST));
    next.aperture = clamp(number(next.aperture, "share"), 0, 1);
    next.view = next.view.map((x, n) => clamp(number(x, "uv"[n]), 0, m - 1));
    if (what.exposure) {
        const { black, white, gamma, ev, shoulder = 1 } = what.exposure;
        next.exposure = {
            black: Math.min(number(black, "black"), number(white, "white") - 1e-3),
            white,
            gamma: clamp(number(gamma, "gamma"), 0.2, 5),
            ev: clamp(number(ev, "exposure"), -MOST_EV, MOST_EV),
            shoulder: clamp(number(shoulder, "shoulder"), 1, MOST_SHOULDER),
        };
    }
    next.smooth = Boolean(next.smooth);
    if (!MODES.includes(next.mode)) {
        throw new RangeError(`there is no mode ${next.mode}; use one of ${MODES}`);
    }
    if (next.mode !== "refocused" && !hasDepth) {
        throw new RangeError(`${next.mode}: the depth is not known yet`);
    }
    return next;
}

/** A state, and the part of the picture on show, as an address; what is as at the start is left out. */
export function stateInAddress(state, home, pane) {
    const words = { a: state.focus, aperture: state.aperture, u: state.view[0], v: state.view[1] };
    words.ev = state.exposure.ev;
    for (const name of ["black", "white", "gamma", "shoulder"]) {
        if (state.exposure[name] !== home.exposure[name]) words[name] = state.exposure[name];
    }
    if (pane.zoom > 1) Object.assign(words, { zoom: pane.zoom, x: pane.centre[0], y: pane.centre[1] });
    const parts = Object.entries(words).map(([name, value]) => `${name}=${short(value)}`);
    if (state.tilt.some((rise) => rise !== 0)) parts.push(`tilt=${state.tilt.map(short)}`);
    if (!state.smooth) parts.push("smooth=0");
    return `#${[...parts, `show=${state.mode}`].join("&")}`;
}

/** The state of the page's address; where it says nothing, that of the start. */
export function stateFromAddress(home, hasDepth) {
    const words = new URLSearchParams(location.hash.slice(1));
    const read = (name, otherwise) => {
        const value = Number.parseFloat(words.get(name));
        return Number.isFinite(value) ? value : otherwise;
    };
    const exposure = { ...home.exposure };
    for (const name of Object.keys(exposure)) exposure[name] = read(name, exposure[name]);
    const mode = words.get("show");
    const tilt = (words.get("tilt") ?? "").split(",").map(Number.parseFloat);
    return {
        state: {
            focus: read("a", home.focus),
            tilt: tilt.length === 2 && tilt.every(Number.isFinite) ? tilt : home.tilt,
            aperture: read("aperture", home.aperture),
            view: [read("u", home.view[0]), read("v", home.view[1])],
            exposure,
            smooth: words.get("smooth") !== "0",
            mode: MODES.includes(mode) && (mode === "refocused" || hasDepth) ? mode : "refocused",
        },
        pane: { zoom: read("zoom", 1), centre: [read("x", 0.5), read("y", 0.5)] },
        mode,
    };
}
