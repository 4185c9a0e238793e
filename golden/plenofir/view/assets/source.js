// SPDX-License-Identifier: Apache-2.0
// Where the page's data come from: beside the page, or inside of it (plenofir view --export).

const inside = (name) => document.getElementById(`data-${name}`);

function decoded(text) {
    const letters = atob(text.trim());
    const bytes = new Uint8Array(letters.length);
    for (let n = 0; n < letters.length; n++) bytes[n] = letters.charCodeAt(n);
    return bytes;
}

async function fetched(name) {
    let answer;
    try {
        answer = await fetch(name);
    } catch {
        throw new Error("plenofir view has ended; start it again");
    }
    if (!answer.ok) throw new Error((await answer.text()) || `${name}: ${answer.status}`);
    return answer;
}

/** What describes the page: parsed JSON. */
export async function loadField() {
    const there = inside("field");
    const field = there ? JSON.parse(there.textContent) : await (await fetched("field.json")).json();
    if (field.colours) field.colours = decoded(field.colours);
    return field;
}

/** What is at a name: its bytes, and facts about them by name. */
async function part(name) {
    const there = inside(name);
    if (there) {
        const blob = new Blob([decoded(there.textContent)], { type: there.dataset.type });
        return { blob, fact: (key) => there.dataset[key] };
    }
    const answer = await fetched(encodeURIComponent(name));
    return { blob: await answer.blob(), fact: (key) => answer.headers.get(`X-${key}`) };
}

/** Pixels of a picture that the browser can decode, RGBA, 8 bit. */
async function decodedImage(blob) {
    const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
    const bitmap = await createImageBitmap(blob, options);
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

/**
 * Values of a picture, one after the other for its channels. 16 bit come as a picture of the high
 * bytes above one of the low bytes.
 */
async function decodedValues(blob, bits, channels) {
    const { data, width, height } = await decodedImage(blob);
    const rows = bits === 8 ? height : height / 2;
    const length = width * rows;
    const values = bits === 8 ? new Uint8Array(length * channels) : new Uint16Array(length * channels);
    for (let n = 0, to = 0; n < length; n++) {
        for (let channel = 0; channel < channels; channel++, to++) {
            const from = 4 * n + channel;
            values[to] = bits === 8 ? data[from] : 256 * data[from] + data[from + 4 * length];
        }
    }
    return { values, width, height: rows };
}

/** A picture of a folder: its values, size, bits, channels, and how it is exposed. */
export async function loadPicture(name) {
    const { blob, fact } = await part(name);
    const [bits, channels] = ["bits", "channels"].map((key) => Number(fact(key)));
    const found = await decodedValues(blob, bits, channels);
    return { ...found, bits, channels, exposure: JSON.parse(fact("exposure")) };
}

/** A capture of a focused camera, four channels of 16 bits, and its lenses, four numbers each. */
export async function loadCapture() {
    const [capture, lenses] = await Promise.all([part("capture"), part("lenses")]);
    return {
        capture: new Uint16Array(await inflated(capture.blob)),
        lenses: new Float32Array(await inflated(lenses.blob)),
    };
}

/** A picture that is shown as it is. */
export async function loadShown(name) {
    const found = await decodedImage((await part(name)).blob);
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [found.width, found.height];
    canvas.getContext("2d").putImageData(found, 0, 0);
    return canvas;
}

function inflated(blob) {
    return new Response(blob.stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}

function samples(field, buffer) {
    return field.bits === 8 ? new Uint8Array(buffer) : new Uint16Array(buffer);
}

/** The next frame of a live source: its views (null for none yet), its number, when it came. */
export async function loadFrame(field, bin, after) {
    const answer = await fetched(`frame?bin=${bin}&after=${after}`);
    const number = Number(answer.headers.get("X-Number"));
    const views = number ? samples(field, await answer.arrayBuffer()) : null;
    const captured = Number(answer.headers.get("X-Captured"));
    const levels = answer.headers.get("X-Levels")?.split(",").map(Number);
    return { views, number, captured, levels, ended: answer.headers.has("X-Ended") };
}

/** Views, one after the other, of a field with `bin` x `bin` micro lenses made one. */
export async function loadViews(field, bin) {
    const columns = Math.ceil(field.lens_columns / bin);
    const rows = Math.ceil(field.lens_rows / bin);
    if (!inside("views")) {
        const views = samples(field, await (await fetched(`views?bin=${bin}`)).arrayBuffer());
        return { views, bin, rows, columns };
    }
    // Views beside and below each other in one picture; of 16 bit perhaps in codes of 8.
    const { codes } = field;
    const { channels, view_rows, view_columns } = field;
    const found = await decodedValues((await part("views")).blob, codes ? 8 : field.bits, channels);
    const views = new (field.bits === 8 ? Uint8Array : Uint16Array)(view_rows * view_columns * rows * columns * channels);
    let to = 0;
    for (let v = 0; v < view_rows; v++) {
        for (let u = 0; u < view_columns; u++) {
            for (let t = 0; t < rows; t++) {
                const from = ((v * rows + t) * found.width + u * columns) * channels;
                for (let n = from; n < from + columns * channels; n++) {
                    views[to++] = codes ? codes[found.values[n]] : found.values[n];
                }
            }
        }
    }
    return { views, bin, rows, columns };
}

/** The picture in focus everywhere: rows, columns, values of the views' kind. */
export async function loadEverywhere(field, bin) {
    if (!inside("everywhere")) {
        const answer = await fetched(`everywhere?bin=${bin}`);
        const [rows, columns] = answer.headers.get("X-Size").split("x").map(Number);
        return { rows, columns, values: samples(field, await answer.arrayBuffer()) };
    }
    const { blob, fact } = await part("everywhere");
    const codes = fact("codes") ? JSON.parse(fact("codes")) : null;
    const found = await decodedValues(blob, codes ? 8 : field.bits, field.channels);
    const values = codes ? Uint16Array.from(found.values, (code) => codes[code]) : found.values;
    return { rows: found.height, columns: found.width, values };
}

/**
 * Depth map: rows, columns, values 0 to 65535 for a from its range (odd ones are sure), and which
 * of them (0 to 1) colours are for; null for none.
 */
export async function loadDepth(field) {
    if (!field.has_depth) return null;
    const { blob, fact } = await part("depth");
    const values = new Uint16Array(await inflated(blob));
    const [rows, columns] = fact("size").split("x").map(Number);
    const range = fact("range").split(",").map(Number);
    // Colours are for what is there; few micro lenses in a hundred may be wrong.
    const sorted = values.slice().sort();
    const shown = [0.01, 0.99].map((share) => sorted[Math.floor(share * (sorted.length - 1))] / 65535);
    if (shown[1] - shown[0] < 0.01) shown[1] = shown[0] + 0.01;
    return { values, rows, columns, range, shown };
}
