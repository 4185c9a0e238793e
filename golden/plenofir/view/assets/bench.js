// SPDX-License-Identifier: Apache-2.0
// The optical bench as a small drawing: the plane on show, its depth of field, where it is imaged.

const NAMESPACE = "http://www.w3.org/2000/svg";
const [LEFT, LENS, ARRAY, AXIS] = [14, 218, 262, 42];
// Largest distance from the micro lenses that an image is drawn at.
const REACH = 26;

function element(name, attributes, text = "") {
    const made = document.createElementNS(NAMESPACE, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = text;
    return made;
}

/**
 * Draw into an SVG of 300 x 84: planes at their reciprocal distances, the camera on the right. The
 * nearest plane of a range of a has the end of the scale.
 */
export function drawBench(svg, table, [low, high], shown, pointed) {
    const within = (_, n) => low - 1e-9 <= table.first + n * table.step && table.first + n * table.step <= high + 1e-9;
    const real = table.centre.mm.filter((mm, n) => within(mm, n) && mm !== null && table.centre.state[n] === 0);
    const nearest = Math.min(...real);
    const largest = Math.max(...table.alpha.filter(within).map((alpha) => Math.abs(alpha - 1)), 1e-9);
    const place = ({ mm, state }) =>
        mm === null || state !== 0 ? LEFT : LEFT + (LENS - 24 - LEFT) * Math.min(nearest / mm, 1);
    const line = (x1, y1, x2, y2, kind) => element("line", { x1, y1, x2, y2, class: kind });
    const parts = [
        line(4, AXIS, 296, AXIS, "axis"),
        element("text", { x: 4, y: 80 }, "∞"),
        element("text", { x: LENS - 42, y: 80 }, worded(nearest)),
        element("ellipse", { cx: LENS, cy: AXIS, rx: 6, ry: 30, class: "lens" }),
        line(ARRAY, 14, ARRAY, 70, "array"),
        line(ARRAY + 7, 14, ARRAY + 7, 70, "sensor"),
        element("text", { x: ARRAY - 12, y: 80 }, "sensor"),
    ];
    if (shown) {
        const [near, far] = [place(shown.near), place(shown.far)];
        const width = Math.max(near - far, 1);
        parts.push(element("rect", { x: far, y: 12, width, height: 60, class: "field" }));
        const at = place(shown.centre);
        const image = ARRAY + REACH * Math.min(Math.max((shown.alpha - 1) / largest, -1), 1);
        for (const side of [-26, 26]) {
            const object = shown.centre.state === 0 ? AXIS : AXIS + side;
            parts.push(line(at, object, LENS, AXIS + side, "ray"));
            parts.push(line(LENS, AXIS + side, image, AXIS, "ray"));
        }
        parts.push(line(at, 12, at, 72, "plane"));
        parts.push(element("circle", { cx: image, cy: AXIS, r: 2.5, class: "image" }));
    }
    if (pointed) {
        const at = place(pointed.centre);
        parts.push(line(at, 20, at, 64, "pointed"));
    }
    svg.replaceChildren(...parts);
}

function worded(mm) {
    return `${Math.round(mm)} mm`;
}
