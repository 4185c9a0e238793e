// SPDX-License-Identifier: Apache-2.0
// Two pictures of a folder of results: side by side, one over the other, or their difference.

import { loadField, loadPicture } from "./source.js";

const MODES = ["pair", "wipe", "difference"];
const at = (id) => document.getElementById(id);
const [left, right] = [at("left"), at("right")];
const loaded = new Map();

let field;
let images = [];
let compared = null;

function load(name) {
    if (!loaded.has(name)) loaded.set(name, loadPicture(name));
    return loaded.get(name);
}

function state() {
    const mode = document.querySelector("input[name=mode]:checked").value;
    return { first: at("first").value, second: at("second").value, mode, wipe: Number(at("wipe").value), gain: 2 ** Number(at("gain").value) };
}

/** Largest difference of two pictures' values, and how many pixels differ; null for other sizes. */
function compare([a, b]) {
    if (a.width !== b.width || a.height !== b.height) return null;
    let largest = 0;
    let differ = 0;
    for (let n = 0; n < a.data.length; n += 4) {
        let here = 0;
        for (let c = 0; c < 3; c++) here = Math.max(here, Math.abs(a.data[n + c] - b.data[n + c]));
        largest = Math.max(largest, here);
        differ += here > 0;
    }
    return { largest, differ, pixels: a.width * a.height };
}

function put(canvas, image) {
    [canvas.width, canvas.height] = [image.width, image.height];
    canvas.getContext("2d").putImageData(image, 0, 0);
}

function difference([a, b], gain) {
    const made = new ImageData(a.width, a.height);
    for (let n = 0; n < a.data.length; n++) {
        made.data[n] = n % 4 === 3 ? 255 : gain * Math.abs(a.data[n] - b.data[n]);
    }
    return made;
}

function draw() {
    const { first, second, mode, wipe, gain } = state();
    const alone = mode !== "pair" && compared !== null;
    at("pair").classList.toggle("one", alone);
    right.hidden = alone;
    at("gain-text").value = gain;
    put(left, alone && mode === "difference" ? difference(images, gain) : images[0]);
    put(right, images[1]);
    if (alone && mode === "wipe") {
        const from = Math.round(wipe * left.width);
        left.getContext("2d").putImageData(images[1], 0, 0, from, 0, left.width - from, left.height);
    }
    at("compared").textContent = !compared
        ? "The pictures differ in size."
        : compared.differ === 0
          ? `Equal in all ${compared.pixels} pixels.`
          : `${compared.differ} of ${compared.pixels} pixels differ, by ${compared.largest} grey levels at most.`;
    const words = new URLSearchParams({ left: first, right: second, show: mode, wipe: wipe.toFixed(3), gain });
    history.replaceState(null, "", `#${words}`);
}

async function choose() {
    const { first, second } = state();
    images = await Promise.all([load(first), load(second)]);
    compared = compare(images);
    draw();
}

function point(event) {
    const box = event.target.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * event.target.width);
    const y = Math.floor(((event.clientY - box.top) / box.height) * event.target.height);
    const values = images.map((image) => {
        const place = (y * image.width + x) * 4;
        return x < image.width && y < image.height ? [...image.data.subarray(place, place + 3)].join(" ") : "outside";
    });
    at("pointed").textContent = `(${x}, ${y}): ${values.join(" | ")}`;
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
    const mode = words.get("show");
    if (MODES.includes(mode)) document.querySelector(`input[value="${mode}"]`).checked = true;
    if (words.has("wipe")) at("wipe").value = words.get("wipe");
    if (words.has("gain")) at("gain").value = Math.log2(Number(words.get("gain")) || 1);
    await choose();
    for (const id of ["mode", "wipe", "gain"]) at(id).addEventListener("input", draw);
    for (const canvas of [left, right]) canvas.addEventListener("pointermove", point);
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
        draw();
    },
    /** The left picture as it is on show. */
    pixels: async () => {
        await ready;
        return left.getContext("2d").getImageData(0, 0, left.width, left.height);
    },
    get compared() {
        return compared;
    },
};
