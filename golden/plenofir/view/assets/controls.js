// SPDX-License-Identifier: Apache-2.0
// What the user does, by pointer, keys and controls.

import { MODES } from "./state.js";

// Farther than any picture of a light field is sharp; the sums of the GPU hold it.
const MOST_FOCUS = 100;

const at = (id) => document.getElementById(id);

/**
 * Listen to all of it. `page` has the light field (`field`), its `pane`, the `state`, and what can
 * be done: `change(what)`, `expose(what)`, `moveView(du, dv)` and so on.
 */
export function listen(page) {
    listenToPointer(page);
    listenToKeys(page);
    listenToControls(page);
}

function listenToPointer(page) {
    const { field, pane } = page;
    const canvas = at("picture");
    pane.listen({
        hover: (event) => page.point(page.depthAt(pane.shareAt(event))),
        leave: () => page.point(null),
        tap: (event) => {
            if (page.isTilting) {
                page.takeCorner(pane.shareAt(event));
                return;
            }
            const a = page.depthAt(pane.shareAt(event));
            page.point(a);
            if (a !== null) page.change({ focus: a, mode: "refocused" });
        },
        drag: (dx, dy, event) => {
            if (pane.zoom > 1 && !event.shiftKey) return false;
            const views = (2 * (field.micro_image_size - 1)) / canvas.clientWidth;
            page.moveView(dx * views, dy * views);
            return true;
        },
    });
    const pupil = at("pupil");
    const choose = (event) => {
        const box = pupil.getBoundingClientRect();
        const m = field.micro_image_size;
        const places = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
        const [u, v] = places.map((share) => share * m - 0.5);
        page.moveView(u - page.state.view[0], v - page.state.view[1]);
    };
    pupil.addEventListener("pointerdown", (event) => {
        pupil.setPointerCapture(event.pointerId);
        choose(event);
    });
    pupil.addEventListener("pointermove", (event) => event.buttons && choose(event));
}

function listenToKeys(page) {
    const { field, pane } = page;
    const m = field.micro_image_size;
    const keys = {
        ArrowLeft: (fine) => page.change({ focus: page.state.focus - (fine ? 0.1 : 1) / m }),
        ArrowRight: (fine) => page.change({ focus: page.state.focus + (fine ? 0.1 : 1) / m }),
        ArrowUp: () => page.change({ aperture: page.state.aperture + 0.1 }),
        ArrowDown: () => page.change({ aperture: page.state.aperture - 0.1 }),
        a: () => page.moveView(-0.25, 0),
        d: () => page.moveView(0.25, 0),
        w: () => page.moveView(0, -0.25),
        s: () => page.moveView(0, 0.25),
        "+": () => page.expose({ ev: page.state.exposure.ev + 0.2 }),
        "-": () => page.expose({ ev: page.state.exposure.ev - 0.2 }),
        x: page.autoExposure,
        t: page.startTilt,
        Escape: () => page.isTilting && page.startTilt(),
        p: () => page.change({ smooth: !page.state.smooth }),
        m: () => page.hasDepth && page.change({ mode: MODES[(MODES.indexOf(page.state.mode) + 1) % MODES.length] }),
        ...pane.keys,
        0: page.reset,
    };
    document.addEventListener("keydown", (event) => {
        const busy = event.ctrlKey || event.metaKey || event.altKey;
        const typed = event.target === at("typed");
        const elsewhere = typed || (event.target instanceof HTMLInputElement && event.key.startsWith("Arrow"));
        const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
        if (busy || elsewhere || !Object.hasOwn(keys, key)) return;
        event.preventDefault();
        keys[key](event.shiftKey);
    });
}

/** The a that a person typed: a decimal or a fraction; an error that says what is expected. */
function typedFocus(text) {
    const [whole, over = "1", ...more] = text.replaceAll("\u2212", "-").split("/").map((part) => part.trim());
    const decimal = /^[-+]?(\d+\.?\d*|\.\d+)$/;
    const a = Number(whole) / Number(over);
    if (more.length || !decimal.test(whole) || !decimal.test(over) || !(Math.abs(a) <= MOST_FOCUS)) {
        throw new RangeError(`a is a number such as -0.25 or 1/3, up to ${MOST_FOCUS}; “${text}” is none`);
    }
    return a;
}

function listenToControls(page) {
    const { field, pane, top } = page;
    const onInput = (id, done) => at(id).addEventListener("input", (event) => done(Number(event.target.value)));
    const onClick = (id, done) => at(id).addEventListener("click", () => Promise.resolve(done()).catch((error) => page.say(error.message)));
    onInput("focus", (a) => page.change({ focus: a, mode: "refocused" }));
    at("typed").addEventListener("change", (event) => {
        try {
            const focus = typedFocus(event.target.value);
            // So that keys are those of the page again.
            event.target.blur();
            page.change({ focus, mode: "refocused" });
            page.say("");
        } catch (error) {
            page.say(error.message);
        }
    });
    onInput("aperture", (share) => page.change({ aperture: share ** 2 }));
    onInput("exposure", (ev) => page.expose({ ev }));
    onInput("gamma", (power) => page.expose({ gamma: 5 ** power }));
    onInput("black", (share) => page.expose({ black: Math.min(share * top, page.state.exposure.white - 1e-3) }));
    onInput("white", (share) => page.expose({ white: Math.max(share * top, page.state.exposure.black + 1e-3) }));
    at("mode").addEventListener("change", (event) => page.change({ mode: event.target.value }));
    at("smooth").addEventListener("change", (event) => page.change({ smooth: event.target.checked }));
    onClick("tilt", page.startTilt);
    onClick("flat", () => page.change({ tilt: [0, 0] }));
    onClick("auto", page.autoExposure);
    onClick("stored", () => page.expose(field.exposure.stored));
    onClick("out", () => pane.zoomBy(1 / 1.5));
    onClick("in", () => pane.zoomBy(1.5));
    onClick("fit", () => pane.fit());
    onClick("actual", () => pane.actualSize());
    onClick("reset", page.reset);
    onClick("copy", page.copyAddress);
    onClick("save", page.savePicture);
    onClick("film-focus", () => page.saveFilm("focus"));
    onClick("film-view", () => page.saveFilm("view"));
    window.addEventListener("hashchange", page.takeAddress);
    new ResizeObserver(page.resized).observe(at("stage"));
}
