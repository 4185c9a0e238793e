// SPDX-License-Identifier: Apache-2.0
// The page of a light field: what the user does becomes the state, the state becomes the picture.

import { listen } from "./controls.js";
import { download, filmFile, filmSize, filmStates, pictureFile } from "./film.js";
import { Pane } from "./pane.js";
import { Panel, short } from "./panel.js";
import { neededBinning, Renderer, TooLarge } from "./renderer.js";
import { loadDepth, loadEverywhere, loadField, loadFrame, loadViews } from "./source.js";
import { planeThrough, riseAt } from "./tilt.js";
import { changedState, MODES, startingState, stateFromAddress, stateInAddress } from "./state.js";
import { toneTable } from "./tone.js";

// While something moves, as much is drawn as takes about this long; then everything.
const FRAME_MS = 50;
const REST_MS = 150;
// Pixels that the histogram counts.
const COUNTED = 20_000;
// Focus settings by which a film goes farther than what is seen.
const BEYOND = 0.25;
// Share by which the exposure of live frames follows them.
const FOLLOWS = 0.2;

const at = (id) => document.getElementById(id);
const canvas = at("picture");

let field;
let renderer;
let pane;
let panel;
let depth = null;
let home;
let state;
// Black and white follow the picture.
let follows = true;
let resting = 0;
let moving = null;
// Points of a plane to be: [x, y, a]; null while none is chosen.
let corners = null;
let everywhere = null;
const live = { frames: 0, dropped: 0, rate: 0, milliseconds: 0 };
// All in focus and depth can only be shown when the depth is known.
const wanted = new URLSearchParams(location.hash.slice(1)).get("show");

function say(text) {
    at("message").textContent = text;
}

function sayShortly(text) {
    say(text);
    setTimeout(() => say(""), 2500);
}

function change(what) {
    const { exposure } = state;
    state = changedState(state, what, field.micro_image_size, depth !== null);
    if (state.exposure !== exposure) renderer.takeTones(toneTable(state.exposure, renderer.unit));
    panel.showState(state);
}

const inPicture = ([x, y]) => x >= 0 && x < 1 && y >= 0 && y < 1;
const depthValue = ([x, y]) =>
    depth.values[Math.floor(y * depth.rows) * depth.columns + Math.floor(x * depth.columns)];

function depthAt(place) {
    if (!depth || !inPicture(place)) return null;
    const [low, high] = depth.range;
    return low + ((high - low) * depthValue(place)) / 65535;
}

function showHistogram() {
    if (state.mode === "depth") return;
    const [width, height] = renderer.size;
    const stride = Math.max(Math.ceil(Math.sqrt((width * height) / COUNTED)), 1);
    panel.showHistogram(state, renderer.values(state, stride), renderer.unit);
}

// ---- Drawing ----

/** On a narrow screen, where the controls lie below, the stage is as high as its picture. */
function fit() {
    const [width, height] = renderer.size;
    const narrow = matchMedia("(max-width: 46rem)").matches;
    const stage = at("stage");
    const room = Math.min((stage.clientWidth * height) / width, 0.6 * innerHeight);
    stage.style.height = narrow ? `${Math.floor(room)}px` : "";
}

function restStride() {
    return Math.max(1, Math.floor(1 / pane.scale));
}

function movingStride() {
    const { width, height, step } = pane.view;
    const pixels = Math.min(width * step, renderer.size[0]) * Math.min(height * step, renderer.size[1]);
    return Math.max(Math.ceil(Math.sqrt((pixels * renderer.msPerPixel) / FRAME_MS)), restStride());
}

function showZoom() {
    panel.showCorners(corners, (place) => pane.placeOf(place));
    at("zoom-text").value = `${(100 * pane.scale).toFixed(0)} %`;
}

/** Draw in full; resolves when the picture is drawn. */
async function draw() {
    await ready;
    cancelAnimationFrame(moving);
    clearTimeout(resting);
    moving = null;
    showZoom();
    renderer.draw(state, pane.view, restStride());
    showHistogram();
    history.replaceState(null, "", stateInAddress(state, home, pane));
}

/** Draw soon, as much as there is time for, and in full when nothing moves any more. */
function drawSoon() {
    clearTimeout(resting);
    resting = setTimeout(draw, REST_MS);
    moving ??= requestAnimationFrame(() => {
        moving = null;
        showZoom();
        renderer.draw(state, pane.view, movingStride());
    });
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
            if (follows && frame.levels) followLevels(frame.levels);
            renderer.draw(state, pane.view, movingStride());
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

function followLevels([black, white, shoulder]) {
    const { exposure } = state;
    const part = live.frames ? FOLLOWS : 1;
    const between = (from, to) => from + part * (to - from);
    const levels = {
        black: between(exposure.black, black),
        white: between(exposure.white, white),
        shoulder: between(exposure.shoulder, shoulder),
    };
    change({ exposure: { ...exposure, ...levels } });
    Object.assign(field.exposure.auto, { black, white, shoulder });
}

// ---- What the user does ----

function user(what) {
    change(what);
    drawSoon();
    if (state.mode === "sharp") loadedEverywhere().then(drawSoon, (error) => say(error.message));
}

/** The picture that is in focus everywhere; made when it is first on show. */
function loadedEverywhere() {
    everywhere ??= (async () => {
        say("putting everything in focus …");
        renderer.takeEverywhere(await loadEverywhere(field, renderer.data.bin));
        say("");
    })();
    return everywhere;
}

function expose(what) {
    follows = false;
    user({ exposure: { ...state.exposure, ...what } });
}

function autoExposure() {
    user({ exposure: { ...field.exposure.auto, ev: 0 } });
    follows = true;
}

/** Choose three points for a plane, or choose none after all. */
function startTilt() {
    showCorners(corners ? null : []);
}

function showCorners(points) {
    corners = points;
    panel.showCorners(points, (place) => pane.placeOf(place));
    say(points ? `Tilt: choose point ${points.length + 1} of 3` : "");
}

/** The a of a point of a plane: its depth, or where that is unsure the a that is there now. */
function cornerFocus(place) {
    const sure = depth !== null && depthValue(place) % 2 === 1;
    return sure ? depthAt(place) : state.focus + riseAt(state.tilt, place);
}

const tiltThrough = (points) => planeThrough(points, renderer.size, field.micro_image_size);

function takeCorner(place) {
    if (!inPicture(place)) return;
    const points = [...corners, [...place, cornerFocus(place)]];
    if (points.length < 3) {
        showCorners(points);
        return;
    }
    showCorners(null);
    try {
        user({ ...tiltThrough(points), mode: "refocused" });
    } catch (error) {
        say(error.message);
    }
}

function moveView(du, dv) {
    // With all views there is nothing to look around with.
    const aperture = state.aperture > 0.5 ? 0.15 : state.aperture;
    user({ aperture, view: [state.view[0] + du, state.view[1] + dv] });
}

function reset() {
    follows = true;
    pane.fit();
    user(home);
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

// ---- Files ----

function named(kind = state.mode) {
    const title = field.title.replace(/\.[^.]*$/, "").replace(/[^\w.-]+/g, "_") || "plenofir";
    return kind === "refocused" ? `${title}_a=${short(state.focus)}` : `${title}_${kind}`;
}

async function picture() {
    await ready;
    const blob = await pictureFile(renderer.image(state));
    await draw();
    return blob;
}

async function film(kind) {
    await ready;
    const [low, high] = depth?.range ?? field.range;
    // From behind all that is there to before it.
    const range = depth
        ? depth.shown.map((share, n) => low + share * (high - low) + (n ? BEYOND : -BEYOND))
        : field.range;
    const states = filmStates(kind, state, range, field.micro_image_size);
    const [width, height] = filmSize(renderer.size);
    const images = [];
    for (const [n, each] of states.entries()) {
        say(`drawing picture ${n + 1} of ${states.length} …`);
        // So that the page stays alive.
        await new Promise((done) => setTimeout(done));
        images.push(renderer.image(each, width, height));
    }
    say("recording …");
    const made = await filmFile(images);
    say("");
    await draw();
    return made;
}

async function copyAddress() {
    await draw();
    await navigator.clipboard.writeText(location.href).then(
        () => sayShortly("address copied"),
        () => say(location.href),
    );
}

async function savePicture() {
    download(await picture(), `${named()}.png`);
}

async function saveFilm(kind) {
    const { blob, ending } = await film(kind);
    download(blob, `${named(kind)}.${ending}`);
}

// ---- The start ----

function takeAddress() {
    const found = stateFromAddress(home, depth !== null);
    follows = ["black", "white"].every((name) => found.state.exposure[name] === home.exposure[name]);
    change(found.state);
    Object.assign(pane, { centre: found.pane.centre });
    pane.zoomTo(found.pane.zoom, found.pane.centre);
    drawSoon();
}

async function takeViews() {
    let bin = neededBinning(field, renderer.limits());
    for (;;) {
        try {
            renderer.start(field, await loadViews(field, bin));
            pane.size = renderer.size;
            fit();
            change(stateFromAddress(home, false).state);
            renderer.takeTones(toneTable(state.exposure, renderer.unit));
            renderer.draw(state, pane.view, restStride());
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

async function takeDepth() {
    await ready;
    if (field.has_depth) say("looking for depth …");
    depth = await loadDepth(field);
    if (!depth) return;
    say("");
    renderer.takeDepth(depth);
    panel.takeDepth(depth);
    if (MODES.includes(wanted) && wanted !== state.mode) {
        if (wanted === "sharp") await loadedEverywhere();
        change({ mode: wanted });
        await draw();
    }
}

async function start() {
    field = await loadField();
    home = startingState(field);
    state = home;
    panel = new Panel(field);
    renderer = new Renderer(canvas);
    pane = new Pane(canvas, () => drawSoon());
    listenToContext();
    await takeViews();
    listen({
        field,
        pane,
        top: panel.top,
        get state() {
            return state;
        },
        get hasDepth() {
            return depth !== null;
        },
        change: user,
        get isTilting() {
            return corners !== null;
        },
        startTilt,
        takeCorner,
        point: (a) => panel.point(state, a),
        resized: () => {
            fit();
            drawSoon();
        },
        ...{ say, depthAt, expose, autoExposure, moveView, reset, copyAddress, savePicture, saveFilm, takeAddress },
    });
    takeAddress();
    say("");
}

/** All pixels of the picture on show, as the views give them: smoothing and zoom are the screen's. */
async function pixels() {
    await ready;
    const image = renderer.image({ ...state, smooth: false });
    await draw();
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
    setTilt: (right, down) => changed(() => ({ tilt: [right, down], mode: "refocused" })),
    /** The plane through three points [x, y, a], x and y in shares of the picture's size. */
    tiltThrough: (points) => changed(() => ({ ...tiltThrough(points), mode: "refocused" })),
    /** The a that a point of a tilted plane has when it is clicked. */
    tiltPoint: async (x, y) => {
        await depthReady;
        return cornerFocus([x, y]);
    },
    setAperture: (share) => changed(() => ({ aperture: share })),
    setView: (u, v) => changed(() => ({ view: [u, v] })),
    setExposure: (ev) => changed(() => ({ exposure: { ...state.exposure, ev } })),
    /** "auto", "stored", or some of black, white and gamma. */
    setLevels: (what) => changed(() => ({ exposure: { ...state.exposure, ...(field.exposure[what] ?? what) } })),
    setSmooth: (smooth) => changed(() => ({ smooth })),
    setZoom: async (zoom, x = 0.5, y = 0.5) => {
        await ready;
        pane.centre = [x, y];
        pane.zoomTo(zoom, [x, y]);
        await draw();
    },
    setMode: async (mode) => {
        await depthReady;
        if (mode === "sharp") await loadedEverywhere();
        await changed(() => ({ mode }));
    },
    depthAt: async (x, y) => {
        await depthReady;
        return depthAt([x, y]);
    },
    /** Where on the page a place of the picture is, in shares of its size. */
    placeOf: async (x, y) => {
        await ready;
        return pane.placeOf([x, y]);
    },
    pixels,
    /** A PNG as the button saves it; a film through the "focus" or around the "view". */
    picture,
    film: async (kind) => (await film(kind)).blob,
    /** Mean time of a picture in ms, of as many, drawn in full or one of stride x stride pixels. */
    frameTime: async (count = 1, stride = 1) => {
        await ready;
        let ms = 0;
        for (let n = 0; n < count; n++) {
            renderer.drawn = null;
            const begin = performance.now();
            renderer.values(state, stride);
            ms += performance.now() - begin;
        }
        return ms / count;
    },
    get live() {
        return { ...live };
    },
    get state() {
        return { ...state, zoom: pane.zoom, centre: [...pane.centre] };
    },
};
