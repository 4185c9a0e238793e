// SPDX-License-Identifier: Apache-2.0
// The light field on the GPU: refocused, all in focus, or its depth in false colours (WebGL 2).

import { BOX, picture, SCREEN, SHARPEN, VERTICES } from "./shaders.js";

const MODES = ["refocused", "sharp", "depth"];
// Shifts this near to a whole number count as it: a comes from decimal fractions.
const SNAP = 1e-6;
// Pixels around what is shown that interpolation needs.
const MARGIN = 2;
// Pixels that are drawn at once for a file.
const BAND = 1 << 22;

/** What a GPU cannot hold. */
export class TooLarge extends Error {}

/** Radius of the round aperture, in views, that a share of all M x M views has at the centre. */
export function radiusOfShare(share, m) {
    if (share >= 1) return -1;
    const c = (m - 1) / 2;
    const area = (r) => {
        let sum = 0;
        for (let v = 0; v < m; v++) {
            for (let u = 0; u < m; u++) {
                sum += Math.min(Math.max(r + 0.5 - Math.hypot(u - c, v - c), 0), 1);
            }
        }
        return sum;
    };
    let low = 0.5;
    let high = m;
    if (area(low) >= share * m * m) return low;
    for (let n = 0; n < 40; n++) {
        const middle = (low + high) / 2;
        if (area(middle) < share * m * m) low = middle;
        else high = middle;
    }
    // Wider than the pupil.
    return high > m / 2 ? -1 : high;
}

/** Smallest number of micro lenses to be made one, each way, so that a GPU can hold the field. */
export function neededBinning(field, limits) {
    const m = field.micro_image_size;
    const count = field.view_rows * field.view_columns;
    for (let bin = 1; ; bin++) {
        const columns = Math.ceil(field.lens_columns / bin);
        const rows = Math.ceil(field.lens_rows / bin);
        const tiles = Math.min(Math.floor(limits.texture / columns), count);
        if (tiles < 1 || rows > limits.texture) continue;
        if (Math.ceil(count / tiles) > limits.layers) continue;
        if (columns * m > limits.picture + (bin === 1 ? m - 1 : 0)) continue;
        const bytes = columns * rows * count * field.channels * (field.bits / 8);
        if (bytes <= limits.bytes || (columns === 1 && rows === 1)) return bin;
    }
}

export class Renderer {
    constructor(canvas) {
        this.canvas = canvas;
        const options = { alpha: false, antialias: false, depth: false, stencil: false };
        this.gl = canvas.getContext("webgl2", { ...options, preserveDrawingBuffer: true });
        if (!this.gl) throw new Error("this browser has no WebGL 2, which draws the picture");
    }

    limits() {
        const { gl } = this;
        const get = (name) => gl.getParameter(gl[name]);
        return {
            texture: get("MAX_TEXTURE_SIZE"),
            layers: get("MAX_ARRAY_TEXTURE_LAYERS"),
            picture: Math.min(get("MAX_TEXTURE_SIZE"), ...get("MAX_VIEWPORT_DIMS")),
            bytes: 768 * 2 ** 20,
        };
    }

    /** Compile the shaders and take in the light field: once, and after a lost context. */
    start(field, data) {
        const { gl } = this;
        this.field = field;
        this.data = data;
        const m = field.micro_image_size;
        const limits = this.limits();
        this.count = field.view_rows * field.view_columns;
        this.tiles = Math.min(Math.ceil(this.count / limits.layers),
            Math.floor(limits.texture / data.columns));
        for (const texture of this.textures ?? []) gl.deleteTexture(texture);
        this.textures = [];
        this.drawn = null;
        this.msPerPixel = 0;
        this.programs = {
            picture: this.#program(picture(field, this.tiles)),
            box: this.#program(BOX),
            sharpen: this.#program(SHARPEN),
            screen: this.#program(SCREEN),
        };
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
        this.size = [
            Math.min(data.columns * m, Math.ceil(field.columns / data.bin)),
            Math.min(data.rows * m, Math.ceil(field.rows / data.bin)),
        ];
        const lenses = [data.columns * m, data.rows * m];
        // Micro lenses that were made one are whole.
        this.extent = data.bin * field.scale === 1 ? this.size : lenses;
        this.unit = field.bits === 8 ? 256 : 1;
        this.#takeViews();
        this.#texture(1, gl.TEXTURE_2D);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, 1, 1, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT,
            new Uint16Array(1));
        this.#texture(2, gl.TEXTURE_2D);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, field.colours);
        this.#texture(3, gl.TEXTURE_2D);
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R8, 256, 256);
        // Pixels of the picture, and those smoothed in one dimension.
        this.targets = [4, 5].map((place) => ({ unit: place, width: 0, height: 0 }));
        for (const target of this.targets) {
            target.texture = this.#texture(target.unit, gl.TEXTURE_2D);
            target.buffer = gl.createFramebuffer();
        }
        this.file = { texture: this.#texture(6, gl.TEXTURE_2D), buffer: gl.createFramebuffer(), width: 0, height: 0 };
        this.#texture(7, gl.TEXTURE_2D);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8UI, 1, 1, 0, gl.RED_INTEGER, gl.UNSIGNED_BYTE, new Uint8Array(1));
        if (this.depth) this.takeDepth(this.depth);
        if (this.everywhere) this.takeEverywhere(this.everywhere);
        if (this.tones) this.takeTones(this.tones);
        const error = gl.getError();
        if (error === gl.OUT_OF_MEMORY) throw new TooLarge("the GPU has not enough memory");
        if (error !== gl.NO_ERROR && error !== gl.CONTEXT_LOST_WEBGL) {
            throw new Error(`the GPU refuses the light field (error ${error})`);
        }
    }

    #program(fragments) {
        const { gl } = this;
        const program = gl.createProgram();
        for (const [kind, text] of [[gl.VERTEX_SHADER, VERTICES], [gl.FRAGMENT_SHADER, fragments]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, text);
            gl.compileShader(shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
                throw new Error(`the shader is refused: ${gl.getShaderInfoLog(shader)}`);
            }
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        const uniforms = new Map();
        const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
        for (let n = 0; n < count; n++) {
            const { name, type } = gl.getActiveUniform(program, n);
            uniforms.set(name, [gl.getUniformLocation(program, name), type]);
        }
        return { program, uniforms };
    }

    /** Use a program with these values. */
    #use({ program, uniforms }, values) {
        const { gl } = this;
        gl.useProgram(program);
        for (const [name, value] of Object.entries(values)) {
            const [place, type] = uniforms.get(name) ?? [null, 0];
            if (type === gl.FLOAT) gl.uniform1f(place, value);
            else if (type === gl.FLOAT_VEC2) gl.uniform2f(place, ...value);
            else if (type === gl.INT_VEC2) gl.uniform2i(place, ...value);
            else if (type === gl.UNSIGNED_INT) gl.uniform1ui(place, value);
            else gl.uniform1i(place, value);
        }
    }

    #texture(unit, kind) {
        const { gl } = this;
        gl.activeTexture(gl.TEXTURE0 + unit);
        const texture = gl.createTexture();
        this.textures.push(texture);
        gl.bindTexture(kind, texture);
        gl.texParameteri(kind, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(kind, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        return texture;
    }

    #takeViews() {
        const { gl, field, data, tiles, count } = this;
        this.#texture(0, gl.TEXTURE_2D_ARRAY);
        const stored = gl[`${field.channels === 1 ? "R" : "RGB"}${field.bits}UI`];
        gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, stored, tiles * data.columns, data.rows,
            Math.ceil(count / tiles));
        this.#fillViews();
    }

    #fillViews() {
        const { gl, field, data, tiles } = this;
        const format = field.channels === 1 ? gl.RED_INTEGER : gl.RGB_INTEGER;
        const type = field.bits === 8 ? gl.UNSIGNED_BYTE : gl.UNSIGNED_SHORT;
        const length = data.columns * data.rows * field.channels;
        for (let n = 0; n < this.count; n++) {
            const place = [(n % tiles) * data.columns, 0, Math.floor(n / tiles)];
            gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, ...place, data.columns, data.rows, 1, format,
                type, data.views.subarray(n * length, (n + 1) * length));
        }
        this.drawn = null;
    }

    /** Take in the views of another frame. */
    takeFrame(views) {
        this.data.views = views;
        this.gl.activeTexture(this.gl.TEXTURE0);
        this.#fillViews();
    }

    /** Take in the depth map: values 0 to 65535 for a from its range. */
    takeDepth(depth) {
        const { gl } = this;
        this.depth = depth;
        this.drawn = null;
        gl.activeTexture(gl.TEXTURE1);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, depth.columns, depth.rows, 0, gl.RED_INTEGER,
            gl.UNSIGNED_SHORT, depth.values);
    }

    /** Take in the picture that is in focus everywhere: its values are of the views' kind. */
    takeEverywhere(everywhere) {
        const { gl, field } = this;
        this.everywhere = everywhere;
        this.drawn = null;
        gl.activeTexture(gl.TEXTURE7);
        const format = field.channels === 1 ? gl.RED_INTEGER : gl.RGB_INTEGER;
        const type = field.bits === 8 ? gl.UNSIGNED_BYTE : gl.UNSIGNED_SHORT;
        const stored = gl[`${field.channels === 1 ? "R" : "RGB"}${field.bits}UI`];
        const { columns, rows, values } = everywhere;
        gl.texImage2D(gl.TEXTURE_2D, 0, stored, columns, rows, 0, format, type, values);
    }

    /** Take in what the screen shows of each of 65,536 values, 8 bit. */
    takeTones(tones) {
        const { gl } = this;
        this.tones = tones;
        gl.activeTexture(gl.TEXTURE3);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 256, gl.RED, gl.UNSIGNED_BYTE, tones);
    }

    /** Shift in pixels of the field on the GPU. */
    #shift(a) {
        return (a * this.field.micro_image_size) / (this.data.bin * this.field.scale);
    }

    /** A target of at least this size, bound; what was in it may be lost. */
    #target(target, format, width, height) {
        const { gl } = this;
        gl.bindFramebuffer(gl.FRAMEBUFFER, target.buffer);
        gl.viewport(0, 0, width, height);
        if (target.width === width && target.height === height) return;
        gl.activeTexture(gl.TEXTURE0 + (target.unit ?? 6));
        const [shape, type] = format === gl.RGBA8 ? [gl.RGBA, gl.UNSIGNED_BYTE] : [gl.RGBA_INTEGER, gl.UNSIGNED_SHORT];
        gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, shape, type, null);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target.texture, 0);
        Object.assign(target, { width, height });
        if (gl.getError() === gl.OUT_OF_MEMORY) throw new TooLarge("the GPU has not enough memory");
    }

    /** Pixels of the picture into the first target: a region of so many pixels, one of stride x stride. */
    #drawPicture(state, { origin, width, height, stride }) {
        const { gl, field, data } = this;
        const { mode, focus, tilt, aperture, view, smooth } = state;
        const key = JSON.stringify([mode, focus, tilt, aperture, view, smooth, origin, width, height, stride]);
        if (this.drawn === key) return 0;
        const [pixels, smoothed] = this.targets;
        let shift = this.#shift(state.focus);
        if (Math.abs(shift - Math.round(shift)) < SNAP) shift = Math.round(shift);
        const radius = radiusOfShare(aperture, field.micro_image_size);
        const even = field.micro_image_size % 2 === 0;
        const between = smooth && (even || radius >= 0 || tilt.some((rise) => rise !== 0));
        this.#target(pixels, gl.RGBA16UI, width, height);
        this.#use(this.programs.picture, {
            views: 0,
            depths: 1,
            everywhere: 7,
            mode: MODES.indexOf(state.mode),
            origin,
            stride,
            lenses: [data.columns, data.rows],
            size: this.size,
            extent: this.extent,
            moves: Math.floor(shift),
            part: shift - Math.floor(shift),
            tilt: tilt.map((rise) => this.#shift(rise)),
            between: Number(between),
            view: state.view,
            radius,
            unit: this.unit,
            mixed: Number(state.smooth),
        });
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        const lens = field.micro_image_size / stride;
        if (smooth && lens > 1 && mode === "refocused") {
            const begins = origin.map((n) => -n / stride);
            const ends = begins.map((n, axis) => n + this.size[axis] / stride);
            const steps = between ? [] : [
                [this.programs.box, [1, 0], { width: lens }],
                [this.programs.box, [0, 1], { width: lens }],
            ];
            steps.push(
                [this.programs.sharpen, [0, 1], { lens: Math.round(lens), begins, ends }],
                [this.programs.sharpen, [1, 0], { lens: Math.round(lens), begins, ends }],
            );
            let [from, to] = [pixels, smoothed];
            for (const [program, along, values] of steps) {
                this.#target(to, gl.RGBA16UI, width, height);
                this.#use(program, { from: from.unit, along, ...values });
                gl.drawArrays(gl.TRIANGLES, 0, 3);
                [from, to] = [to, from];
            }
        }
        this.drawn = key;
        return width * height;
    }

    /** What the screen shows of the drawn pixels, into what is bound. */
    #drawScreen(state, values) {
        const { gl, field, depth } = this;
        this.#use(this.programs.screen, {
            from: this.targets[0].unit,
            tones: 3,
            colours: 2,
            isDepth: Number(state.mode === "depth"),
            depthShown: depth?.shown ?? [0, 1],
            grey: Number(field.channels === 1),
            smoothly: Number(state.smooth),
            ...values,
        });
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    /** The region that a part of the picture needs, from one place to another. */
    #region(state, from, to, stride) {
        const lens = state.smooth ? this.field.micro_image_size / stride : 0;
        // Half a lens for the mean, one for the taps of sharpening.
        const around = MARGIN + Math.ceil(1.5 * lens);
        const origin = from.map((x) => (Math.floor(Math.max(x, 0) / stride) - around) * stride);
        const ends = to.map((x, n) => Math.min(x, this.size[n]));
        const [width, height] = ends.map((x, n) => Math.max(Math.ceil((x - origin[n]) / stride) + around, 1));
        return { origin, width, height, stride };
    }

    /**
     * Draw a state into the canvas, from one of stride x stride pixels; the time in ms, the GPU's
     * work included. `pane`: the canvas's size, the place of its top left corner in the picture,
     * and pixels of the picture for each of the screen.
     */
    draw(state, pane, stride = 1) {
        const { gl, canvas, size } = this;
        const begin = performance.now();
        const { width, height, left, top, step } = pane;
        if (canvas.width !== width) canvas.width = width;
        if (canvas.height !== height) canvas.height = height;
        if (gl.isContextLost()) return 0;
        const region = this.#region(state, [left, top], [left + width * step, top + height * step], stride);
        const pixels = this.#drawPicture(state, region);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, width, height);
        const at = ([x, y]) => [(x - region.origin[0]) / stride, (y - region.origin[1]) / stride];
        this.#drawScreen(state, {
            first: at([left, top]),
            step: step / stride,
            begins: at([0, 0]),
            ends: at(size),
            rows: height,
        });
        // Reading waits for the GPU.
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        const ms = performance.now() - begin;
        if (pixels) this.msPerPixel = ms / pixels;
        return ms;
    }

    /** The picture of a state as an ImageData, of another size, or at its own resolution. */
    image(state, width = this.size[0], height = this.size[1]) {
        const { gl, size, file } = this;
        const step = size[0] / width;
        const stride = Math.max(Math.floor(step), 1);
        const image = new ImageData(width, height);
        const band = Math.max(Math.floor(BAND / Math.ceil(step * step) / width), 1);
        for (let y = 0; y < height; y += band) {
            const rows = Math.min(band, height - y);
            const region = this.#region(state, [0, y * step], [size[0], (y + rows) * step], stride);
            this.#drawPicture(state, region);
            this.#target(file, gl.RGBA8, width, rows);
            this.#drawScreen(state, {
                first: [-region.origin[0] / stride, (y * step - region.origin[1]) / stride],
                step: step / stride,
                begins: [-1e9, -1e9],
                ends: [1e9, 1e9],
                rows: 0,
            });
            const part = new Uint8Array(image.data.buffer, y * width * 4, rows * width * 4);
            gl.readPixels(0, 0, width, rows, gl.RGBA, gl.UNSIGNED_BYTE, part);
        }
        return image;
    }

    /** Values of the picture, 16 bit, RGBA, one of stride x stride pixels. */
    values(state, stride) {
        const { gl, size } = this;
        const [width, height] = size.map((n) => Math.ceil(n / stride));
        this.#drawPicture({ ...state, smooth: false }, { origin: [0, 0], width, height, stride });
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.targets[0].buffer);
        const found = new Uint32Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
        return found;
    }
}
