// SPDX-License-Identifier: Apache-2.0
// The page of a light field: what the user does becomes the state, the state becomes the picture.

import { drawBench } from "./bench.js";
import { Planes, worded, wordedRange } from "./planes.js";
import { neededBinning, Renderer, TooLarge } from "./renderer.js";
import { loadDepth, loadField, loadFrame, loadViews } from "./source.js";

// While something moves, as much is drawn as takes about this long; then everything.
const FRAME_MS = 50;
const REST_MS = 150;
// A finger or mouse that moves less has clicked.
const CLICK_PIXELS = 6;
const MODES = ["refocused", "sharp", "depth"];

const at = (id) => document.getElementById(id);
const canvas = at("picture");
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

let field;
let renderer;
let planes = null;
let depth = null;
let home;
let state;
let msPerPixel = 0;
let resting = 0;
let moving = null;
const live = { frames: 0, dropped: 0, rate: 0, milliseconds: 0 };
// All in focus and depth can only be shown when the depth is known.
const wanted = new URLSearchParams(location.hash.slice(1)).get("show");

function say(text) {
    at("message").textContent = text;
}

function number(value, name) {
    if (typeof value !== "number" || !Number.isFinite(value)) {
        throw new TypeError(`${name} is ${value}; expected a number`);
    }
    return value;
}

// ---- The state and its address ----

const centre = () => [(field.micro_image_size - 1) / 2, (field.micro_image_size - 1) / 2];

function startingState() {
    const [low, high] = field.range;
    return { focus: clamp(0, low, high), aperture: 1, view: centre(), exposure: 0, mode: "refocused" };
}

function change(what) {
    const next = { ...state, ...what };
    const m = field.micro_image_size;
    number(next.focus, "a");
    next.aperture = clamp(number(next.aperture, "share"), 0, 1);
    next.view = next.view.map((x, n) => clamp(number(x, "uv"[n]), 0, m - 1));
    next.exposure = clamp(number(next.exposure, "exposure"), -10, 10);
    if (!MODES.includes(next.mode)) throw new RangeError(`${next.mode}; expected ${MODES}`);
    if (next.mode !== "refocused" && !depth) {
        throw new RangeError(`${next.mode}: the depth is not known yet`);
    }
    state = next;
    showState();
}

const short = (x) => String(Number(x.toFixed(4)));

function stateInAddress() {
    const words = { a: state.focus, aperture: state.aperture, u: state.view[0], v: state.view[1], ev: state.exposure };
    const parts = Object.entries(words).map(([name, value]) => `${name}=${short(value)}`);
    return `#${[...parts, `show=${state.mode}`].join("&")}`;
}

function stateFromAddress() {
    const words = new URLSearchParams(location.hash.slice(1));
    const read = (name, otherwise) => {
        const value = Number.parseFloat(words.get(name));
        return Number.isFinite(value) ? value : otherwise;
    };
    const mode = words.get("show");
    return {
        focus: read("a", home.focus),
        aperture: read("aperture", home.aperture),
        view: [read("u", home.view[0]), read("v", home.view[1])],
        exposure: read("ev", home.exposure),
        mode: MODES.includes(mode) && (mode === "refocused" || depth) ? mode : "refocused",
    };
}

// ---- What is on show besides the picture ----

function showState() {
    const m = field.micro_image_size;
    at("focus").value = state.focus;
    const shift = state.focus * m;
    const onGrid = Math.abs(shift - Math.round(shift)) < 1e-6;
    const fraction = onGrid && Math.round(shift) % m ? ` = ${Math.round(shift)}/${m}` : "";
    at("focus-text").value = `a = ${short(state.focus)}${fraction}`;
    at("aperture").value = Math.sqrt(state.aperture);
    at("aperture-text").value = state.aperture === 1 ? "all views" : `${(100 * state.aperture).toFixed(0)} % of the views`;
    at("exposure").value = state.exposure;
    at("exposure-text").value = `${state.exposure > 0 ? "+" : ""}${state.exposure.toFixed(1)} EV`;
    at("view-text").value = `u = ${state.view[0].toFixed(1)}, v = ${state.view[1].toFixed(1)}`;
    document.querySelector(`input[value="${state.mode}"]`).checked = true;
    at("scale").hidden = state.mode !== "depth";
    showDistances(null);
}

function showDistances(pointed) {
    if (!planes) return;
    const shown = planes.at(state.focus);
    drawBench(at("bench"), planes.table, shown, pointed);
    at("plane").textContent = shown ? worded(shown.centre) : "outside of the table";
    at("depth-of-field").textContent = shown ? wordedRange(shown.near, shown.far) : "";
}

function lensAt(event) {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
}

function depthAt([x, y]) {
    if (!depth || !(x >= 0 && x < 1 && y >= 0 && y < 1)) return null;
    const place = Math.floor(y * depth.rows) * depth.columns + Math.floor(x * depth.columns);
    const [low, high] = field.range;
    return low + ((high - low) * depth.values[place]) / 65535;
}

function point(event) {
    const a = depthAt(lensAt(event));
    if (a === null) return;
    const found = planes?.at(a) ?? null;
    const range = found ? `, ${worded(found.centre)}` : "";
    const around = found ? ` (in focus ${wordedRange(found.near, found.far)})` : "";
    at("pointed").textContent = `here: a = ${a.toFixed(2)}${range}${around}`;
    showDistances(found);
}

// ---- Drawing ----

/** As large as there is room for, whatever number of pixels is drawn. */
function fit() {
    const stage = at("stage");
    const [width, height] = renderer.size;
    // Beside the controls the stage has its height; above them it takes that of the picture.
    const room = matchMedia("(max-width: 46rem)").matches ? 0.6 * innerHeight : stage.clientHeight;
    const scale = Math.min(stage.clientWidth / width, room / height);
    canvas.style.width = `${Math.floor(width * scale)}px`;
    canvas.style.height = `${Math.floor(height * scale)}px`;
}

function restStride() {
    const shown = canvas.clientWidth * (window.devicePixelRatio || 1);
    return Math.max(1, Math.floor(renderer.size[0] / Math.max(shown, 1)));
}

function drawn(stride) {
    const ms = renderer.draw(state, stride);
    msPerPixel = ms / Math.max(canvas.width * canvas.height, 1);
}

/** Draw in full; resolves when the picture is drawn. */
async function draw() {
    await ready;
    cancelAnimationFrame(moving);
    clearTimeout(resting);
    moving = null;
    renderer.draw(state, restStride());
    history.replaceState(null, "", stateInAddress());
}

/** Draw soon, as much as there is time for, and in full when nothing moves any more. */
function drawSoon() {
    clearTimeout(resting);
    resting = setTimeout(draw, REST_MS);
    moving ??= requestAnimationFrame(() => {
        moving = null;
        drawn(movingStride());
    });
}

function movingStride() {
    const pixels = renderer.size[0] * renderer.size[1];
    return Math.max(Math.ceil(Math.sqrt((pixels * msPerPixel) / FRAME_MS)), restStride());
}

/** Show the frames of a live source, always the newest one. */
async function follow() {
    await shown;
    let last = 0;
    let begin = performance.now();
    let next = loadFrame(field, renderer.data.bin, last);
    for (;;) {
        const frame = await next;
        if (frame.views) {
            if (last) live.dropped += frame.number - last - 1;
            last = frame.number;
        }
        // While this one is drawn.
        if (!frame.ended) next = loadFrame(field, renderer.data.bin, last);
        if (frame.views) {
            renderer.takeFrame(frame.views);
            drawn(movingStride());
            const now = performance.now();
            live.frames += 1;
            live.milliseconds = Date.now() - frame.captured;
            if (live.frames > 1) live.rate += (1000 / (now - begin) - live.rate) / Math.min(live.frames - 1, 10);
            begin = now;
            const words = [`${live.rate.toFixed(1)} frames a second`, `${live.milliseconds} ms after the capture`];
            at("live").textContent = `${words.join(", ")}, ${live.dropped} dropped`;
        }
        if (frame.ended) break;
    }
    say("the source has ended");
}

// ---- What the user does ----

function user(what) {
    change(what);
    drawSoon();
}

function moveView(du, dv) {
    // With all views there is nothing to look around with.
    const aperture = state.aperture > 0.5 ? 0.15 : state.aperture;
    user({ aperture, view: [state.view[0] + du, state.view[1] + dv] });
}

function listenToPointer() {
    let from = null;
    canvas.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        canvas.setPointerCapture(event.pointerId);
        from = { x: event.clientX, y: event.clientY, view: state.view, dragged: false };
    });
    canvas.addEventListener("pointermove", (event) => {
        if (!from) {
            point(event);
            return;
        }
        const [dx, dy] = [event.clientX - from.x, event.clientY - from.y];
        from.dragged ||= Math.hypot(dx, dy) > CLICK_PIXELS;
        if (!from.dragged) return;
        const views = (2 * (field.micro_image_size - 1)) / canvas.clientWidth;
        moveView(from.view[0] + dx * views - state.view[0], from.view[1] + dy * views - state.view[1]);
    });
    canvas.addEventListener("pointerup", (event) => {
        if (from && !from.dragged) {
            const a = depthAt(lensAt(event));
            point(event);
            if (a !== null) user({ focus: a, mode: "refocused" });
        }
        from = null;
    });
    canvas.addEventListener("pointercancel", () => (from = null));
    canvas.addEventListener("pointerleave", () => {
        at("pointed").textContent = "\u00a0";
        showDistances(null);
    });
}

function listenToKeys() {
    const m = field.micro_image_size;
    const keys = {
        ArrowLeft: (fine) => user({ focus: state.focus - (fine ? 0.1 : 1) / m }),
        ArrowRight: (fine) => user({ focus: state.focus + (fine ? 0.1 : 1) / m }),
        ArrowUp: () => user({ aperture: state.aperture + 0.1 }),
        ArrowDown: () => user({ aperture: state.aperture - 0.1 }),
        a: () => moveView(-0.25, 0),
        d: () => moveView(0.25, 0),
        w: () => moveView(0, -0.25),
        s: () => moveView(0, 0.25),
        "+": () => user({ exposure: state.exposure + 0.2 }),
        "-": () => user({ exposure: state.exposure - 0.2 }),
        m: () => depth && user({ mode: MODES[(MODES.indexOf(state.mode) + 1) % MODES.length] }),
        0: () => user(home),
    };
    document.addEventListener("keydown", (event) => {
        const busy = event.ctrlKey || event.metaKey || event.altKey;
        const elsewhere = event.target instanceof HTMLInputElement && event.key.startsWith("Arrow");
        const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
        if (busy || elsewhere || !Object.hasOwn(keys, key)) return;
        event.preventDefault();
        keys[key](event.shiftKey);
    });
}

function listenToControls() {
    const value = (event) => Number(event.target.value);
    at("focus").addEventListener("input", (event) => user({ focus: value(event), mode: "refocused" }));
    at("aperture").addEventListener("input", (event) => user({ aperture: value(event) ** 2 }));
    at("exposure").addEventListener("input", (event) => user({ exposure: value(event) }));
    at("mode").addEventListener("change", (event) => user({ mode: event.target.value }));
    at("reset").addEventListener("click", () => user(home));
    at("copy").addEventListener("click", async () => {
        await draw();
        await navigator.clipboard.writeText(location.href).then(
            () => say("address copied"),
            () => say(location.href),
        );
        setTimeout(() => say(""), 2000);
    });
    at("save").addEventListener("click", async () => {
        renderer.draw(state);
        const blob = await new Promise((done) => canvas.toBlob(done, "image/png"));
        const link = document.createElement("a");
        link.href = URL.createObjectURL(blob);
        link.download = `a=${short(state.focus)}.png`;
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 60000);
        await draw();
    });
    window.addEventListener("hashchange", () => user(stateFromAddress()));
    window.addEventListener("resize", () => {
        fit();
        drawSoon();
    });
}

function listenToContext() {
    canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();
        say("the GPU was lost; waiting for it …");
    });
    canvas.addEventListener("webglcontextrestored", () => {
        renderer.textures = [];
        renderer.start(field, renderer.data);
        say("");
        draw();
    });
}

// ---- The start ----

async function takeViews() {
    let bin = neededBinning(field, renderer.limits());
    for (;;) {
        try {
            renderer.start(field, await loadViews(field, bin));
            change(stateFromAddress());
            fit();
            renderer.draw(state, restStride());
            break;
        } catch (error) {
            const most = Math.max(field.lens_rows, field.lens_columns);
            if (!(error instanceof TooLarge) || bin >= most) throw error;
            bin *= 2;
            renderer = new Renderer(canvas);
        }
    }
    const notes = [...field.notes];
    if (bin > 1) {
        notes.push(`Too large for this GPU: ${bin} x ${bin} micro lenses are drawn as one.`);
    }
    at("notes").textContent = notes.join(" ");
}

function describe() {
    document.title = `${field.title} - plenofir`;
    at("title").textContent = field.title;
    const m = field.micro_image_size;
    const [low, high] = field.range;
    Object.assign(at("focus"), { min: low, max: high });
    // A mark for each a of the grid, where they are few.
    if ((high - low) * m <= 40) {
        for (let n = Math.ceil(low * m - 1e-6); n <= high * m + 1e-6; n++) {
            at("grid").append(new Option("", n / m));
        }
    }
    if (field.planes) {
        planes = new Planes(field.planes.table);
        at("distances").hidden = false;
        at("camera").textContent = field.planes.text;
    }
    const context = at("colours").getContext("2d");
    const strip = context.createImageData(256, 1);
    for (let n = 0; n < 256; n++) {
        strip.data.set([...field.colours.subarray(3 * n, 3 * n + 3), 255], 4 * n);
    }
    context.putImageData(strip, 0, 0);
}

async function takeDepth() {
    await ready;
    if (field.has_depth) say("looking for depth …");
    depth = await loadDepth(field);
    if (!depth) return;
    say("");
    renderer.takeDepth(depth);
    const [low, high] = field.range;
    const ends = depth.shown.map((share) => (low + share * (high - low)).toFixed(2));
    at("scale-far").textContent = `a = ${ends[0]}`;
    at("scale-near").textContent = ends[1];
    for (const input of document.querySelectorAll("input[name=mode]")) input.disabled = false;
    if (MODES.includes(wanted) && wanted !== state.mode) {
        change({ mode: wanted });
        await draw();
    }
}

async function start() {
    field = await loadField();
    home = startingState();
    state = home;
    describe();
    renderer = new Renderer(canvas);
    listenToContext();
    await takeViews();
    listenToPointer();
    listenToKeys();
    listenToControls();
    say("");
}

async function pixels() {
    await ready;
    renderer.draw(state);
    const image = renderer.read();
    if (restStride() > 1) await draw();
    return image;
}

async function changed(what) {
    await ready;
    change(what());
    await draw();
}

const ready = start();
const depthReady = takeDepth();
const shown = ready.then(() => draw());
const followed = ready.then(() => (field.live ? follow() : null));
for (const step of [shown, depthReady, followed]) step.catch((error) => say(error.message));

// What scripts and tests drive the page with; all promises are kept when the picture is drawn.
window.plenofir = {
    ready: shown,
    depth: depthReady,
    setFocus: (a) => changed(() => ({ focus: a, mode: "refocused" })),
    setAperture: (share) => changed(() => ({ aperture: share })),
    setView: (u, v) => changed(() => ({ view: [u, v] })),
    setExposure: (ev) => changed(() => ({ exposure: ev })),
    setMode: async (mode) => {
        await depthReady;
        await changed(() => ({ mode }));
    },
    depthAt: async (x, y) => {
        await depthReady;
        return depthAt([x, y]);
    },
    pixels,
    /** Mean time of a picture in ms, of as many, drawn in full or one of stride x stride pixels. */
    frameTime: async (count = 1, stride = 1) => {
        await ready;
        let ms = 0;
        for (let n = 0; n < count; n++) ms += renderer.draw(state, stride);
        return ms / count;
    },
    get live() {
        return { ...live };
    },
    get state() {
        return { ...state };
    },
};
