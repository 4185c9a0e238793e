// SPDX-License-Identifier: Apache-2.0
// Zoom and pan: which part of a picture a canvas shows, by wheel, fingers, drags and keys.

// A finger or mouse that moves less has clicked.
const CLICK_PIXELS = 6;
// Pixels of the screen for each of the picture, at most.
const LARGEST = 32;
const clamp = (x, low, high) => Math.min(Math.max(x, low), Math.max(low, high));

export class Pane {
    /** `canvas` fills its place; `changed` is called when another part is to be shown. */
    constructor(canvas, changed) {
        this.canvas = canvas;
        this.changed = changed;
        this.size = [1, 1];
        this.zoom = 1;
        this.centre = [0.5, 0.5];
        this.pointers = new Map();
    }

    /** What keys do: zoom by Q and E, move by I, J, K and L, all of the picture, pixel for pixel. */
    get keys() {
        const far = () => this.canvas.clientWidth / 10;
        return {
            q: () => this.zoomBy(1 / 1.25),
            e: () => this.zoomBy(1.25),
            i: () => this.panBy(0, far()),
            k: () => this.panBy(0, -far()),
            j: () => this.panBy(far(), 0),
            l: () => this.panBy(-far(), 0),
            f: () => this.fit(),
            1: () => this.actualSize(),
        };
    }

    /** Take a picture of another size, all of it. */
    take(size) {
        this.size = size;
        this.fit();
    }

    /** Pixels of the screen, as the device counts them. */
    get screen() {
        const ratio = window.devicePixelRatio || 1;
        const { clientWidth, clientHeight } = this.canvas;
        return [clientWidth, clientHeight].map((n) => Math.max(Math.round(n * ratio), 1));
    }

    /** Pixels of the screen for each of the picture, where all of it is shown. */
    get fitting() {
        const { screen, size } = this;
        return Math.min(screen[0] / size[0], screen[1] / size[1]);
    }

    get scale() {
        return this.zoom * this.fitting;
    }

    /** For the renderer: size of the canvas, place of its corner, pixels for each of the screen. */
    get view() {
        const [width, height] = this.screen;
        const step = 1 / this.scale;
        const [x, y] = this.centre.map((share, n) => share * this.size[n]);
        return { width, height, step, left: x - (width * step) / 2, top: y - (height * step) / 2 };
    }

    /** The place in the picture, in shares of its size, that an event points at. */
    shareAt(event) {
        const box = this.canvas.getBoundingClientRect();
        const { width, height, step, left, top } = this.view;
        const x = left + ((event.clientX - box.left) / box.width) * width * step;
        const y = top + ((event.clientY - box.top) / box.height) * height * step;
        return [x / this.size[0], y / this.size[1]];
    }

    /** Where a share of the picture is on the page. */
    placeOf([x, y]) {
        const box = this.canvas.getBoundingClientRect();
        const { width, height, step, left, top } = this.view;
        return [
            box.left + (((x * this.size[0] - left) / step) * box.width) / width,
            box.top + (((y * this.size[1] - top) / step) * box.height) / height,
        ];
    }

    #moveTo(centre) {
        // No farther than the picture reaches.
        this.centre = centre.map((x, n) => {
            const half = this.screen[n] / this.scale / this.size[n] / 2;
            return half >= 0.5 ? 0.5 : clamp(x, half, 1 - half);
        });
        this.changed();
    }

    fit() {
        this.zoom = 1;
        this.#moveTo([0.5, 0.5]);
    }

    /** One pixel of the screen for each of the picture. */
    actualSize() {
        this.zoomTo(1 / this.fitting);
    }

    /** Zoom; what lies at a share of the picture stays where it is. */
    zoomTo(zoom, share = this.centre) {
        const before = this.zoom;
        // All of the picture at least, and a picture with few pixels twice as large.
        this.zoom = clamp(zoom, 1, Math.max(LARGEST / this.fitting, 2));
        const keep = before / this.zoom;
        this.#moveTo(this.centre.map((x, n) => share[n] + (x - share[n]) * keep));
    }

    zoomBy(factor, share) {
        this.zoomTo(this.zoom * factor, share);
    }

    /** Move the picture by pixels of the page. */
    panBy(dx, dy) {
        const ratio = (window.devicePixelRatio || 1) / this.scale;
        this.#moveTo([this.centre[0] - (dx * ratio) / this.size[0], this.centre[1] - (dy * ratio) / this.size[1]]);
    }

    /**
     * Listen to the canvas. `on.hover(event)` and `on.leave()`: nothing is pressed; `on.tap(event)`;
     * `on.drag(dx, dy, event)` with one pointer, in pixels of the page since the last, unless it
     * returns false the pane leaves the drag to it. Two fingers, or the middle button, zoom and pan.
     */
    listen(on) {
        const { canvas, pointers } = this;
        let tapped = false;
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            const lines = event.deltaMode === 0 ? 1 : event.deltaMode === 1 ? 30 : 400;
            // Two fingers on a touchpad come with the control key.
            const speed = event.ctrlKey ? 0.01 : 0.002;
            const delta = clamp(event.deltaY * lines, -300, 300);
            this.zoomBy(Math.exp(-delta * speed), this.shareAt(event));
        }, { passive: false });
        canvas.addEventListener("pointerdown", (event) => {
            if (event.button > 1) return;
            if (event.button === 1) event.preventDefault();
            canvas.setPointerCapture(event.pointerId);
            pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, from: event });
            tapped = pointers.size === 1 && event.button === 0;
        });
        canvas.addEventListener("pointermove", (event) => {
            const last = pointers.get(event.pointerId);
            if (!last) {
                on.hover?.(event);
                return;
            }
            const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
            const { from } = last;
            if (pointers.size === 1) {
                if (tapped && Math.hypot(event.clientX - from.clientX, event.clientY - from.clientY) <= CLICK_PIXELS) return;
                tapped = false;
                if (from.button === 1 || on.drag?.(dx, dy, event) === false) this.panBy(dx, dy);
            } else {
                const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
                const [before, after] = [last, { x: event.clientX, y: event.clientY }].map((p) => Math.hypot(p.x - other.x, p.y - other.y));
                const middle = { clientX: (event.clientX + other.x) / 2, clientY: (event.clientY + other.y) / 2 };
                this.zoomBy(after / Math.max(before, 1), this.shareAt(middle));
                this.panBy(dx / 2, dy / 2);
            }
            [last.x, last.y] = [event.clientX, event.clientY];
        });
        const end = (event) => {
            const there = pointers.delete(event.pointerId);
            if (there && tapped && event.type === "pointerup") on.tap?.(event);
            tapped = false;
        };
        canvas.addEventListener("pointerup", end);
        canvas.addEventListener("pointercancel", end);
        canvas.addEventListener("pointerleave", () => on.leave?.());
    }
}
