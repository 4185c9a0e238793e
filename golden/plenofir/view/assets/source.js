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

/** Pixels of a picture that the browser can decode, RGBA. */
export async function loadPicture(name) {
    const there = inside(name);
    const blob = there
        ? new Blob([decoded(there.textContent)], { type: there.dataset.type })
        : await (await fetched(encodeURIComponent(name))).blob();
    const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
    const bitmap = await createImageBitmap(blob, options);
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, bitmap.width, bitmap.height);
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
    return { views, number, captured, ended: answer.headers.has("X-Ended") };
}

/** Views, one after the other, of a field with `bin` x `bin` micro lenses made one. */
export async function loadViews(field, bin) {
    const columns = Math.ceil(field.lens_columns / bin);
    const rows = Math.ceil(field.lens_rows / bin);
    if (!inside("views")) {
        const views = samples(field, await (await fetched(`views?bin=${bin}`)).arrayBuffer());
        return { views, bin, rows, columns };
    }
    // Views beside and below each other in one picture.
    const { data, width } = await loadPicture("views");
    const m = field.micro_image_size;
    const { channels } = field;
    const views = new Uint8Array(m * m * rows * columns * channels);
    let to = 0;
    for (let v = 0; v < m; v++) {
        for (let u = 0; u < m; u++) {
            for (let t = 0; t < rows; t++) {
                let from = ((v * rows + t) * width + u * columns) * 4;
                for (let s = 0; s < columns; s++, from += 4) {
                    for (let channel = 0; channel < channels; channel++) {
                        views[to++] = data[from + channel];
                    }
                }
            }
        }
    }
    return { views, bin, rows, columns };
}

/** Depth map: rows, columns, values 0 to 65535 for a from the field's range, and which of them
 * (0 to 1) colours are for; null for none. */
export async function loadDepth(field) {
    if (!field.has_depth) return null;
    const there = inside("depth");
    let packed;
    let size;
    if (there) {
        packed = new Blob([decoded(there.textContent)]);
        size = there.dataset.size;
    } else {
        const answer = await fetched("depth");
        packed = await answer.blob();
        size = answer.headers.get("X-Size");
    }
    const stream = packed.stream().pipeThrough(new DecompressionStream("deflate"));
    const values = new Uint16Array(await new Response(stream).arrayBuffer());
    const [rows, columns] = size.split("x").map(Number);
    // Colours are for what is there; few micro lenses in a hundred may be wrong.
    const sorted = values.slice().sort();
    const shown = [0.01, 0.99].map((share) => sorted[Math.floor(share * (sorted.length - 1))] / 65535);
    if (shown[1] - shown[0] < 0.01) shown[1] = shown[0] + 0.01;
    return { values, rows, columns, shown };
}
