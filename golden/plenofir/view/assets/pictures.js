// SPDX-License-Identifier: Apache-2.0
// Two pictures of a folder of results: side by side, one over the other, or their difference.

import { Pane } from "./pane.js";
import { loadField, loadPicture } from "./source.js";
import { toneTable } from "./tone.js";

const MODES = ["pair", "wipe", "difference"];
const at = (id) => document.getElementById(id);
const canvases = [at("left"), at("right")];
const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;
const loaded = new Map();

let field;
let images = [];
let compared = null;
let panes = [];
// What each canvas shows, at the pictures' own resolution.
let shown = [];

function load(name) {
    if (!loaded.has(name)) loaded.set(name, loadPicture(name));
    return loaded.get(name);
}

function state() {
    return {
        first: at("first").value,
        second: at("second").value,
        mode: chosen("mode"),
        levels: chosen("levels"),
        ev: Number(at("exposure").value),
        wipe: Number(at("wipe").value),
        gain: 2 ** Number(at("gain").value),
        smooth: at("smooth").checked,
    };
}

const same = ([a, b]) => a.width === b.width && a.height === b.height && a.bits === b.bits;
const valueAt = (image, n, c) => image.values[image.channels === 1 ? n : 3 * n + c];

/** Largest difference of two pictures' values, and how many pixels differ; null for other sizes. */
function compare([a, b]) {
    if (!same([a, b])) return null;
    let largest = 0;
    let differ = 0;
    for (let n = 0; n < a.width * a.height; n++) {
        let here = 0;
        for (let c = 0; c < 3; c++) here = Math.max(here, Math.abs(valueAt(a, n, c) - valueAt(b, n, c)));
        largest = Math.max(largest, here);
        differ += here > 0;
    }
    return { largest, differ, pixels: a.width * a.height };
}

/** A picture of 8 bit, of a function of pixel and channel. */
function made({ width, height }, value) {
    const image = new ImageData(width, height);
    for (let n = 0; n < width * height; n++) {
        for (let c = 0; c < 3; c++) image.data[4 * n + c] = value(n, c);
        image.data[4 * n + 3] = 255;
    }
    return image;
}

function exposed(image, { levels, ev }) {
    const unit = image.bits === 8 ? 256 : 1;
    const tones = toneTable({ ...image.exposure[levels], ev }, unit);
    return made(image, (n, c) => tones[valueAt(image, n, c) * unit]);
}

function difference([a, b], gain) {
    const scale = gain / (a.bits === 8 ? 1 : 257);
    return made(a, (n, c) => Math.min(scale * Math.abs(valueAt(a, n, c) - valueAt(b, n, c)), 255));
}

function wiped([a, b], share) {
    const from = Math.round(share * a.width);
    const whole = new ImageData(new Uint8ClampedArray(a.data), a.width, a.height);
    for (let y = 0; y < a.height; y++) {
        const [start, end] = [4 * (y * a.width + from), 4 * (y + 1) * a.width];
        whole.data.set(b.data.subarray(start, end), start);
    }
    return whole;
}

/** Make what is on show. */
function show() {
    const now = state();
    const { mode, wipe, gain, ev } = now;
    const alone = mode !== "pair" && compared !== null;
    at("pair").classList.toggle("one", alone);
    canvases[1].hidden = alone;
    at("gain-text").value = gain;
    at("exposure-text").value = `${ev > 0 ? "+" : ""}${ev.toFixed(1)} EV`;
    const both = images.map((image) => exposed(image, now));
    if (alone) shown = [mode === "wipe" ? wiped(both, wipe) : difference(images, gain)];
    else shown = both;
    at("compared").textContent = !compared
        ? "The pictures differ in size."
        : compared.differ === 0
          ? `Equal in all ${compared.pixels} pixels.`
          : `${compared.differ} of ${compared.pixels} pixels differ, by ${compared.largest} grey levels at most.`;
    const words = new URLSearchParams({ left: now.first, right: now.second, show: mode, wipe: wipe.toFixed(3), gain, levels: now.levels, ev });
    history.replaceState(null, "", `#${words}`);
    canvases.forEach((canvas, n) => canvas.setAttribute("aria-label", [now.first, now.second][n]));
    panes.forEach((pane, n) => (pane.size = [images[n].width, images[n].height]));
    draw();
}

function draw() {
    shown.forEach((image, n) => {
        const { width, height, step, left, top } = panes[n].view;
        const canvas = canvases[n];
        Object.assign(canvas, { width, height });
        const whole = document.createElement("canvas");
        Object.assign(whole, { width: image.width, height: image.height });
        whole.getContext("2d").putImageData(image, 0, 0);
        const context = canvas.getContext("2d");
        context.imageSmoothingEnabled = at("smooth").checked || step > 1;
        context.imageSmoothingQuality = "high";
        context.drawImage(whole, -left / step, -top / step, image.width / step, image.height / step);
    });
}

/** Both show the same part. */
function follow(leader) {
    for (const pane of panes) {
        pane.zoom = leader.zoom;
        pane.centre = leader.centre;
    }
    draw();
}

async function choose() {
    const { first, second } = state();
    images = await Promise.all([load(first), load(second)]);
    compared = compare(images);
    show();
}

function point(event, pane) {
    const [across, down] = pane.shareAt(event);
    const values = images.map((image) => {
        const [x, y] = [Math.floor(across * pane.size[0]), Math.floor(down * pane.size[1])];
        if (!(x >= 0 && y >= 0 && x < image.width && y < image.height)) return "outside";
        const n = y * image.width + x;
        return Array.from({ length: image.channels }, (_, c) => valueAt(image, n, c)).join(" ");
    });
    const place = [across * pane.size[0], down * pane.size[1]].map(Math.floor).join(", ");
    at("pointed").textContent = `(${place}): ${values.join(" | ")}`;
}

function listen() {
    for (const pane of panes) {
        pane.listen({ hover: (event) => point(event, pane), drag: () => false });
    }
    const [pane] = panes;
    const brighter = (ev) => {
        at("exposure").value = Number(at("exposure").value) + ev;
        show();
    };
    const keys = {
        ...pane.keys,
        "+": () => brighter(0.2),
        "-": () => brighter(-0.2),
    };
    document.addEventListener("keydown", (event) => {
        const key = event.key.toLowerCase();
        const busy = event.ctrlKey || event.metaKey || event.altKey;
        if (busy || event.target instanceof HTMLSelectElement || !Object.hasOwn(keys, key)) return;
        event.preventDefault();
        keys[key]();
    });
    at("out").addEventListener("click", keys.q);
    at("in").addEventListener("click", keys.e);
    at("fit").addEventListener("click", keys.f);
    at("actual").addEventListener("click", keys[1]);
    for (const id of ["mode", "wipe", "gain", "levels", "exposure"]) at(id).addEventListener("input", show);
    at("smooth").addEventListener("input", draw);
    new ResizeObserver(draw).observe(at("pair"));
}

async function start() {
    field = await loadField();
    document.title = `${field.title} - plenofir`;
    at("title").textContent = field.title;
    at("notes").textContent = field.notes.join(" ");
    const words = new URLSearchParams(location.hash.slice(1));
    for (const [id, key, otherwise] of [["first", "left", 0], ["second", "right", 1]]) {
        at(id).append(...field.pictures.map((name) => new Option(name, name)));
        const wanted = words.get(key);
        at(id).value = field.pictures.includes(wanted) ? wanted : field.pictures[Math.min(otherwise, field.pictures.length - 1)];
        at(id).addEventListener("change", () => choose().catch(say));
    }
    for (const [name, kinds] of [["show", MODES], ["levels", ["auto", "stored"]]]) {
        if (kinds.includes(words.get(name))) document.querySelector(`input[value="${words.get(name)}"]`).checked = true;
    }
    if (words.has("wipe")) at("wipe").value = words.get("wipe");
    if (words.has("gain")) at("gain").value = Math.log2(Number(words.get("gain")) || 1);
    if (words.has("ev")) at("exposure").value = words.get("ev");
    panes = canvases.map((canvas) => {
        const pane = new Pane(canvas, () => follow(pane));
        return pane;
    });
    await choose();
    listen();
}

function say(error) {
    at("message").textContent = error.message;
}

const ready = start();
ready.catch(say);

window.plenofir = {
    ready,
    choose: async (first, second) => {
        await ready;
        [at("first").value, at("second").value] = [first, second];
        await choose();
    },
    setMode: async (mode) => {
        await ready;
        document.querySelector(`input[value="${mode}"]`).checked = true;
        show();
    },
    setExposure: async (ev, levels = chosen("levels")) => {
        await ready;
        at("exposure").value = ev;
        document.querySelector(`input[value="${levels}"]`).checked = true;
        show();
    },
    /** The left picture as it is on show, at its own resolution. */
    pixels: async () => {
        await ready;
        return shown[0];
    },
    get compared() {
        return compared;
    },
};
