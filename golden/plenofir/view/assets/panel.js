// SPDX-License-Identifier: Apache-2.0
// What the page shows besides the picture: settings in words, pupil, histogram, distances.

import { drawBench } from "./bench.js";
import { Heights, Planes, worded, wordedRange } from "./planes.js";
import { radiusOfShare } from "./renderer.js";
import { drawHistogram, histogram, topOf } from "./tone.js";

const at = (id) => document.getElementById(id);

/** A number with as many digits as matter. */
export const short = (x) => String(Number(x.toFixed(4)));

const digits = (x) => String(Number(x.toPrecision(7)));

export class Panel {
    /** Describe a light field. */
    constructor(field) {
        this.field = field;
        this.planes = null;
        document.title = `${field.title} - plenofir`;
        at("title").textContent = field.title;
        this.setRange(field.range);
        if (field.planes) {
            const { table, heights } = field.planes;
            this.planes = table ? new Planes(table) : new Heights(heights);
            at("distances").hidden = false;
            at("bench").toggleAttribute("hidden", !table);
            at("camera").textContent = field.planes.text;
        }
        // The value of the histogram's right end.
        this.top = topOf(field.full_scale, Math.max(field.exposure.largest, field.exposure.start.white));
        for (const name of ["film-focus", "film-view"]) at(name).hidden = Boolean(field.live);
        const context = at("colours").getContext("2d");
        const strip = context.createImageData(256, 1);
        for (let n = 0; n < 256; n++) {
            strip.data.set([...field.colours.subarray(3 * n, 3 * n + 3), 255], 4 * n);
        }
        context.putImageData(strip, 0, 0);
    }

    /** Range of the slider, with a mark for each a of the grid where they are few. */
    setRange([low, high]) {
        const m = this.field.micro_image_size;
        Object.assign(at("focus"), { min: low, max: high });
        if ((high - low) * m > 40) return;
        const marks = [];
        for (let n = Math.ceil(low * m - 1e-6); n <= high * m + 1e-6; n++) marks.push(new Option("", n / m));
        at("grid").replaceChildren(...marks);
    }

    /** Depth is known: its colours, and what needs it. */
    takeDepth(depth) {
        const [low, high] = depth.range;
        const ends = depth.shown.map((share) => low + share * (high - low));
        const { range } = this.field;
        this.setRange([Math.min(range[0], ends[0]), Math.max(range[1], ends[1])]);
        at("scale-far").textContent = `a = ${ends[0].toFixed(2)}`;
        at("scale-near").textContent = ends[1].toFixed(2);
        for (const input of document.querySelectorAll("input[name=mode]")) input.disabled = false;
    }

    /** A state in words, and where its sliders stand. */
    showState(state) {
        const m = this.field.micro_image_size;
        at("focus").value = state.focus;
        const shift = state.focus * m;
        const onGrid = Math.abs(shift - Math.round(shift)) < 1e-6;
        const fraction = onGrid && Math.round(shift) % m ? ` = ${Math.round(shift)}/${m}` : "";
        const texts = {
            focus: `a = ${short(state.focus)}${fraction}`,
            aperture: state.aperture === 1 ? "all views" : `${(100 * state.aperture).toFixed(0)} % of the views`,
            exposure: `${state.exposure.ev > 0 ? "+" : ""}${state.exposure.ev.toFixed(1)} EV`,
            gamma: state.exposure.gamma.toFixed(2),
        };
        // What a person is typing stays.
        if (document.activeElement !== at("typed")) at("typed").value = fraction.slice(3) || digits(state.focus);
        at("aperture").value = Math.sqrt(state.aperture);
        at("exposure").value = state.exposure.ev;
        at("gamma").value = Math.log(state.exposure.gamma) / Math.log(5);
        for (const [name, text] of Object.entries(texts)) {
            at(`${name}-text`).value = text;
            at(name).setAttribute("aria-valuetext", text);
        }
        at("flat").hidden = state.tilt.every((rise) => rise === 0);
        at("command").textContent = this.#command(state);
        at("view-text").value = `u = ${state.view[0].toFixed(1)}, v = ${state.view[1].toFixed(1)}`;
        at("smooth").checked = state.smooth;
        document.querySelector(`input[value="${state.mode}"]`).checked = true;
        at("scale").hidden = state.mode !== "depth";
        const names = { refocused: `Refocused to ${texts.focus}`, sharp: "All in focus", depth: "Depth in false colours" };
        at("picture").setAttribute("aria-label", names[state.mode]);
        this.#showLevels(state);
        this.#drawPupil(state);
        this.showDistances(state);
    }

    /** Options of the commands that make the same picture. */
    #command({ mode, focus, aperture, view, tilt }) {
        const m = this.field.micro_image_size;
        const c = Math.max((m - 1) / 2, 0.5);
        const radius = radiusOfShare(aperture, m);
        if (mode !== "refocused" || this.field.live) return "";
        const words = [`-a ${digits(focus)}`];
        if (radius >= 0) {
            const centre = view.map((x) => digits((x - (m - 1) / 2) / c));
            // A single view has the least radius.
            words.push(`--aperture ${[digits((2 * radius) / m), ...centre]}`);
        }
        if (tilt.some((rise) => rise !== 0)) words.push(`--tilt ${tilt.map(digits)}`);
        return words.join(" ");
    }

    /** Points that are chosen for a tilted plane, in the picture; null while none are. */
    showCorners(points, placeOf) {
        at("tilt").setAttribute("aria-pressed", String(points !== null));
        const stage = at("stage").getBoundingClientRect();
        const marks = (points ?? []).map(([x, y], n) => {
            const mark = document.createElement("span");
            const [left, top] = placeOf([x, y]);
            Object.assign(mark.style, { left: `${left - stage.left}px`, top: `${top - stage.top}px` });
            mark.textContent = n + 1;
            return mark;
        });
        at("corners").replaceChildren(...marks);
    }

    #showLevels(state) {
        const { field, top } = this;
        const { black, white } = state.exposure;
        const digits = top < 8 ? 2 : 0;
        at("levels-text").textContent = `black ${black.toFixed(digits)}, white ${white.toFixed(digits)} of ${field.full_scale}`;
        for (const [name, level] of [["black", black], ["white", white]]) {
            at(name).value = level / top;
            at(name).setAttribute("aria-valuetext", level.toFixed(digits));
        }
    }

    #drawPupil(state) {
        const pupil = at("pupil");
        const context = pupil.getContext("2d");
        const m = this.field.micro_image_size;
        const view = pupil.width / m;
        const radius = radiusOfShare(state.aperture, m);
        context.clearRect(0, 0, pupil.width, pupil.height);
        for (let v = 0; v < m; v++) {
            for (let u = 0; u < m; u++) {
                const far = Math.hypot(u - state.view[0], v - state.view[1]);
                const weight = radius < 0 ? 1 : Math.min(Math.max(radius + 0.5 - far, 0), 1);
                context.fillStyle = `rgb(255 180 84 / ${0.12 + 0.88 * weight})`;
                context.fillRect(u * view + 0.5, v * view + 0.5, Math.max(view - 1, 1), Math.max(view - 1, 1));
            }
        }
    }

    /** Where the plane on show lies, and one that is pointed at. */
    showDistances(state, pointed = null) {
        const { planes } = this;
        if (!planes) return;
        const shown = planes.at(state.focus);
        if (planes.table) drawBench(at("bench"), planes.table, this.field.range, shown, pointed);
        at("plane").textContent = shown ? worded(shown.centre) : "outside of the table";
        at("depth-of-field").textContent = shown ? wordedRange(shown.near, shown.far) : "";
    }

    /** Histogram of values of the picture, RGBA; `unit` of them are one of the file's. */
    showHistogram(state, values, unit) {
        const { field, top } = this;
        const found = histogram(values, field.channels, unit, top, state.exposure);
        drawHistogram(at("histogram"), found, top, state.exposure);
        const [dark, bright] = [found.dark, found.bright].map((share) => `${(100 * share).toFixed(1)} %`);
        at("histogram").setAttribute("aria-label", `Histogram; ${dark} of the pixels are black, ${bright} white`);
        at("histogram").title = `${dark} black, ${bright} white`;
    }

    /** What lies at a place of depth a, null for nowhere. */
    point(state, a) {
        if (a === null) {
            at("pointed").textContent = "\u00a0";
            this.showDistances(state);
            return;
        }
        const found = this.planes?.at(a) ?? null;
        const range = found ? `, ${worded(found.centre)}` : "";
        const around = found ? ` (in focus ${wordedRange(found.near, found.far)})` : "";
        at("pointed").textContent = `here: a = ${a.toFixed(2)}${range}${around}`;
        this.showDistances(state, found);
    }
}
