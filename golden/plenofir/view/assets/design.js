// SPDX-License-Identifier: Apache-2.0
// The page of a camera's figures: sliders ask the server, which computes; nothing is computed here.

const by = (id) => document.getElementById(id);
const moved = new Map();
let asked = 0;
let shown = 0;
let idle = Promise.resolve();

function query() {
    return new URLSearchParams([...moved].map(([name, value]) => [name, String(value)])).toString();
}

function digits(value) {
    if (typeof value !== "number") return value === null ? "–" : String(value);
    return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(6)));
}

function row(cells, kind = "td") {
    const line = document.createElement("tr");
    for (const text of cells) {
        const cell = document.createElement(kind);
        cell.textContent = text;
        line.append(cell);
    }
    return line;
}

function show(content) {
    by("figures").tBodies[0].replaceChildren(...Object.entries(content.figures).map(([name, value]) =>
        row([content.texts[name][0], digits(value), content.texts[name][1]])));
    const names = content.planes.length ? Object.keys(content.planes[0]) : [];
    by("planes").tHead.replaceChildren(row(names.map((name) => name.replace("_mm", "").replaceAll("_", " ")), "th"));
    by("planes").tBodies[0].replaceChildren(...content.planes.map((plane) =>
        row(names.map((name) => digits(plane[name])))));
    by("warnings").replaceChildren(...content.warnings.map((text) => {
        const item = document.createElement("li");
        item.textContent = text;
        return item;
    }));
}

// The newest answer is shown, whichever comes first.
async function ask() {
    const number = ++asked;
    const words = query();
    const answer = await fetch(`figures.json?${words}`);
    const text = await answer.text();
    if (number < shown) return;
    shown = number;
    const content = answer.ok ? JSON.parse(text) : { refused: text };
    by("message").textContent = content.refused ?? "";
    if (content.refused) return;
    show(content);
    const plot = by("plot");
    const drawn = new Promise((done) => { plot.onload = done; plot.onerror = done; });
    plot.src = `plot.svg?${words}`;
    await drawn;
}

function slider(spec, changed) {
    const label = document.createElement("label");
    label.htmlFor = `slider-${spec.name}`;
    label.textContent = spec.text;
    const value = document.createElement("output");
    label.append(value);
    const input = document.createElement("input");
    Object.assign(input, { type: "range", id: `slider-${spec.name}`, min: -1, max: 1, step: "any", value: 0 });
    // Even in the logarithm, the given value in the middle.
    const reach = Math.log(spec.high / spec.start);
    input.addEventListener("input", () => {
        const now = Number((spec.start * Math.exp(reach * Number(input.value))).toPrecision(4));
        moved.set(spec.name, now);
        value.textContent = `${now} ${spec.unit}`;
        changed();
    });
    const reset = () => { input.value = 0; value.textContent = spec.shown; };
    reset();
    return { nodes: [label, input], reset };
}

async function start() {
    const field = await (await fetch("field.json")).json();
    by("title").textContent = field.title;
    document.title = `${field.title} - plenofir design`;
    let waiting = false;
    const changed = () => {
        if (waiting) return;
        waiting = true;
        // One request at a time, with the latest places of the sliders.
        idle = idle.then(() => { waiting = false; return ask(); });
    };
    const sliders = field.sliders.map((spec) => slider(spec, changed));
    by("sliders").replaceChildren(...sliders.flatMap((one) => one.nodes));
    by("reset").addEventListener("click", () => {
        moved.clear();
        for (const one of sliders) one.reset();
        changed();
    });
    changed();
    await idle;
}

window.plenofir = { ready: start(), settled: () => idle };
