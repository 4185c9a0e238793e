// SPDX-License-Identifier: Apache-2.0
// The page of a focused camera's capture: refocused to a virtual depth, all in focus, or its depth.

import { FocusedGpu } from "./focused_gpu.js";
import { Pane } from "./pane.js";
import { loadCapture, loadField, loadShown } from "./source.js";
import { toneTable } from "./tone.js";

const MODES = ["refocused", "sharp", "depth"];
// Steps of the arrow keys from one end of the slider to the other.
const STEPS = 100;
const at = (id) => document.getElementById(id);
const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;
const canvas = at("picture");

let field;
let gpu;
let pane;
let depth;
// 1 / v that is laid over.
let laid = null;
// All in focus and depth, made when they are first on show.
const made = new Map();
let shown = null;
let soon = null;

function say(text) {
    at("message").textContent = text;
}

/** The virtual depth of words or a number; errors for what is none. */
function depthOf(what) {
    const v = typeof what === "number" ? what : Number(what.trim() || "none");
    const [least, most] = field.limits;
    if (!(Math.abs(v) >= least && Math.abs(v) <= most)) {
        throw new RangeError(`v is a number from ${least} to ${most} or their negatives, such as 2.75`);
    }
    return v;
}

const inverseOf = (v) => field.of_inverse[0] + field.of_inverse[1] / v;

/** Make what is on show, and draw it. */
async function show() {
    const mode = chosen("mode");
    const ev = Number(at("exposure").value);
    if (mode === "refocused") {
        const inverse = inverseOf(depth);
        if (laid !== inverse) gpu.refocus(inverse);
        laid = inverse;
        gpu.expose(toneTable({ ...field.exposure[chosen("levels")], ev }, field.unit));
        shown = gpu.canvas;
    } else {
        if (!made.has(mode)) {
            say("looking for depth …");
            made.set(mode, loadShown(mode));
        }
        shown = await made.get(mode);
        say("");
    }
    const text = `v = ${Number(depth.toFixed(4))}`;
    at("depth").value = depth;
    at("depth").setAttribute("aria-valuetext", text);
    at("depth-text").value = text;
    if (document.activeElement !== at("typed")) at("typed").value = Number(depth.toFixed(4));
    at("command").textContent = mode === "refocused" ? `-v ${Number(depth.toFixed(4))}` : "";
    at("exposure-text").value = `${ev > 0 ? "+" : ""}${ev.toFixed(1)} EV`;
    const names = { refocused: `Refocused to ${text}`, sharp: "All in focus", depth: "Depth in false colours" };
    canvas.setAttribute("aria-label", names[mode]);
    const words = new URLSearchParams({ v: Number(depth.toFixed(4)), show: mode, levels: chosen("levels"), ev });
    history.replaceState(null, "", `#${words}`);
    draw();
}

function draw() {
    const { width, height, step, left, top } = pane.view;
    Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = at("smooth").checked || step > 1;
    context.imageSmoothingQuality = "high";
    context.drawImage(shown, -left / step, -top / step, shown.width / step, shown.height / step);
}

/** What the user changed, on show with the next frame of the screen. */
function showSoon() {
    soon ??= requestAnimationFrame(() => {
        soon = null;
        show().catch((error) => say(error.message));
    });
}

function take(what) {
    try {
        depth = depthOf(what);
    } catch (error) {
        say(error.message);
        return;
    }
    say("");
    document.querySelector("input[value=refocused]").checked = true;
    showSoon();
}

function pixels() {
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [shown.width, shown.height];
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(shown, 0, 0);
    return context.getImageData(0, 0, copy.width, copy.height);
}

function save() {
    const image = pixels();
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [image.width, image.height];
    copy.getContext("2d").putImageData(image, 0, 0);
    copy.toBlob((blob) => {
        const link = document.createElement("a");
        link.href = URL.createObjectURL(blob);
        const mode = chosen("mode");
        link.download = mode === "refocused" ? `refocused_v${Number(depth.toFixed(4))}.png` : `${mode}.png`;
        link.click();
        URL.revokeObjectURL(link.href);
    });
}

function listen() {
    pane.listen({ drag: () => false });
    const [low, high] = field.range;
    const further = (event, steps) => {
        const v = depth + ((high - low) / STEPS) * steps * (event.shiftKey ? 0.1 : 1);
        take(Math.min(Math.max(v, low), high));
    };
    const brighter = (ev) => {
        at("exposure").value = Number(at("exposure").value) + ev;
        showSoon();
    };
    const keys = {
        arrowleft: (event) => further(event, -1),
        arrowright: (event) => further(event, 1),
        ...pane.keys,
        "+": () => brighter(0.2),
        "-": () => brighter(-0.2),
    };
    document.addEventListener("keydown", (event) => {
        const key = event.key.toLowerCase();
        const busy = event.ctrlKey || event.metaKey || event.altKey;
        const ownKeys = event.target instanceof HTMLInputElement && event.target.id !== "depth";
        if (busy || ownKeys || !Object.hasOwn(keys, key)) return;
        event.preventDefault();
        keys[key](event);
    });
    at("out").addEventListener("click", keys.q);
    at("in").addEventListener("click", keys.e);
    at("fit").addEventListener("click", keys.f);
    at("actual").addEventListener("click", keys[1]);
    at("depth").addEventListener("input", () => take(Number(at("depth").value)));
    at("typed").addEventListener("change", () => take(at("typed").value));
    for (const id of ["mode", "levels", "exposure"]) at(id).addEventListener("input", showSoon);
    at("smooth").addEventListener("input", draw);
    at("save").addEventListener("click", save);
    new ResizeObserver(draw).observe(at("stage"));
}

async function start() {
    field = await loadField();
    document.title = `${field.title} - plenofir`;
    at("title").textContent = field.title;
    at("notes").textContent = field.notes.join(" ");
    const [low, high] = field.range;
    Object.assign(at("depth"), { min: low, max: high });
    depth = field.start;
    const words = new URLSearchParams(location.hash.slice(1));
    for (const [name, kinds] of [["show", MODES], ["levels", ["start", "stored"]]]) {
        if (kinds.includes(words.get(name))) document.querySelector(`input[value="${words.get(name)}"]`).checked = true;
    }
    if (words.has("v")) depth = depthOf(words.get("v"));
    if (words.has("ev")) at("exposure").value = words.get("ev");
    gpu = new FocusedGpu(field, await loadCapture());
    pane = new Pane(canvas, draw);
    pane.size = [field.columns, field.rows];
    say("");
    await show();
    listen();
}

const ready = start();
ready.catch((error) => say(error.message));

async function changed(what) {
    await ready;
    what();
    await show();
}

// What scripts and tests drive the page with; all promises are kept when the picture is drawn.
window.plenofir = {
    ready,
    setDepth: (v) =>
        changed(() => {
            depth = depthOf(v);
            document.querySelector("input[value=refocused]").checked = true;
        }),
    setMode: (mode) => changed(() => (document.querySelector(`input[value="${mode}"]`).checked = true)),
    setExposure: (ev, levels = chosen("levels")) =>
        changed(() => {
            at("exposure").value = ev;
            document.querySelector(`input[value="${levels}"]`).checked = true;
        }),
    /** The picture on show, at its own resolution. */
    pixels: async () => {
        await ready;
        return pixels();
    },
    get depth() {
        return depth;
    },
};
