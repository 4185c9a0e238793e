// SPDX-License-Identifier: Apache-2.0
// Black, white, gamma and shoulder, as plenofir.camera.exposure has them, and the histogram.

// Screens have this gamma: one EV is twice their light.
const SCREEN_GAMMA = 2.2;
const BINS = 256;

/** What the screen shows, 0 to 255, of 65,536 values; `unit` of them are one of the file's. */
export function toneTable({ black, white, gamma, ev, shoulder = 1 }, unit) {
    const brighter = 2 ** (ev / SCREEN_GAMMA);
    const table = new Uint8Array(65536);
    for (let n = 0; n < table.length; n++) {
        const level = Math.max((n / unit - black) / (white - black), 0);
        const light = (level * (shoulder + level)) / (1 + shoulder * level);
        table[n] = Math.floor(255 * Math.min(brighter * light ** (1 / gamma), 1) + 0.5);
    }
    return table;
}

/** The value that a histogram ends with: white, halved as often as all values fit. */
export function topOf(fullScale, largest) {
    let top = fullScale;
    while (top / 2 >= largest && top > 1) top /= 2;
    return top;
}

/**
 * How many of RGBA values lie in each of 256 bins up to a top, and which share of the pixels is at
 * black and at white.
 */
export function histogram(values, channels, unit, top, { black, white }) {
    const bins = Array.from({ length: channels }, () => new Uint32Array(BINS));
    let dark = 0;
    let bright = 0;
    for (let n = 0; n < values.length; n += 4) {
        let largest = 0;
        for (let c = 0; c < channels; c++) {
            const value = values[n + c] / unit;
            bins[c][Math.min(Math.floor((BINS * value) / top), BINS - 1)] += 1;
            largest = Math.max(largest, value);
        }
        dark += largest <= black;
        bright += largest >= white;
    }
    const pixels = values.length / 4;
    return { bins, dark: dark / pixels, bright: bright / pixels };
}

/** Draw a histogram, and where black and white are. */
export function drawHistogram(canvas, { bins }, top, { black, white }) {
    const context = canvas.getContext("2d");
    const { width, height } = canvas;
    context.clearRect(0, 0, width, height);
    context.globalCompositeOperation = "lighter";
    const colours = bins.length === 1 ? ["#c8cdd5"] : ["#d0453f", "#3fae4e", "#4a6fd8"];
    // A few bins with most of the pixels would flatten the others.
    const sorted = bins.flatMap((counts) => [...counts]).sort((a, b) => a - b);
    const most = Math.max(1.1 * sorted[Math.floor(0.99 * sorted.length)], 1);
    bins.forEach((counts, channel) => {
        context.fillStyle = colours[channel];
        for (let n = 0; n < BINS; n++) {
            const tall = height * Math.min(Math.sqrt(counts[n] / most), 1);
            context.fillRect((n * width) / BINS, height - tall, width / BINS, tall);
        }
    });
    context.globalCompositeOperation = "source-over";
    context.fillStyle = "#ffb454";
    for (const level of [black, white]) {
        const x = Math.min(Math.max((level / top) * width, 1), width - 1);
        context.fillRect(x - 1, 0, 2, height);
    }
}
