// SPDX-License-Identifier: Apache-2.0
// The light field on the GPU: refocused, all in focus, or its depth in false colours (WebGL 2).
//
// The views are layers of integer textures. With all views the shader adds integers and rounds once,
// halves up: on the grid of a (shift a M whole) that is Eq. (6.1), as plenofir.refocus computes it.
// Off the grid each view moves by the whole number of pixels that is nearest.

const VERTICES = `#version 300 es
void main() {
    gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}`;

// M and the number of views beside each other in a layer are known when the shader is compiled.
const fragments = (m, tiles) => `#version 300 es
#define M ${m}
#define TILES ${tiles}
precision highp float;
precision highp int;
precision highp usampler2DArray;
precision highp usampler2D;

uniform usampler2DArray views;
uniform usampler2D depths;
uniform sampler2D colours;
uniform int mode;        // 0 refocused, 1 all in focus, 2 depth
uniform int channels;
uniform int stride;      // pixels of the picture for each that is drawn, in both dimensions
uniform ivec2 lenses;    // columns, rows
uniform ivec2 size;      // of the picture
uniform ivec2 depthSize;
uniform vec2 depthShift; // shift of depth 0 and of depth 65535
uniform vec2 depthShown; // depths of the first and the last colour, 0 to 1
uniform int moves;       // whole part of the shift a M
uniform float part;      // what is left of it, 0 to 1
uniform vec2 view;       // centre of the aperture: u, v
uniform float radius;    // of the aperture in views; negative: all views count
uniform uint full;       // value of white
uniform float gain;      // on pixel values; 1: none
out vec4 colour;

// Micro lens of pixel n, -1 for none: n / M, rounded down, which is right for all n that count.
int lensOf(int n, int limit) {
    int lens = int(floor((float(n) + 0.5) * (1.0 / float(M))));
    return lens < limit ? max(lens, -1) : -1;
}

// Index of S that output 0 takes, centred.
int offset(int shift) {
    return ((M - 1) * shift) >> 1;
}

uvec3 texel(int column, int row, int u, int v) {
    int number = v * M + u;
#if TILES == 1
    return texelFetch(views, ivec3(column, row, number), 0).rgb;
#else
    int layer = number / TILES;
    return texelFetch(views, ivec3((number - layer * TILES) * lenses.x + column, row, layer), 0).rgb;
#endif
}

// Micro lens that view i takes pixel k from. Views move by whole pixels, the nearest ones.
int lensAt(int k, int i, int whole, float rest, int limit) {
    int start = k + offset(whole) - i * whole;
    float more = rest * float(offset(whole + 1) - offset(whole) - i);
    return lensOf(start + int(floor(more + 0.5)), limit);
}

// Mean of all views, rounded once, halves up.
uvec3 fullMean(ivec2 k, int whole, float rest) {
    uvec3 sums = uvec3(0u);
    int columns[M];
    for (int u = 0; u < M; u++) columns[u] = lensAt(k.x, u, whole, rest, lenses.x);
    for (int v = 0; v < M; v++) {
        int row = lensAt(k.y, v, whole, rest, lenses.y);
        for (int u = 0; u < M; u++) {
            if (columns[u] >= 0 && row >= 0) sums += texel(columns[u], row, u, v);
        }
    }
    return (sums + uint(M * M) / 2u) / uint(M * M);
}

// Mean of the views in the aperture; those on its edge count in part.
uvec3 apertureMean(ivec2 k, int whole, float rest) {
    vec3 sums = vec3(0.0);
    float weights = 0.0;
    ivec2 first = max(ivec2(ceil(view - radius - 0.5)), 0);
    ivec2 last = min(ivec2(floor(view + radius + 0.5)), M - 1);
    for (int v = first.y; v <= last.y; v++) {
        int row = lensAt(k.y, v, whole, rest, lenses.y);
        for (int u = first.x; u <= last.x; u++) {
            int column = lensAt(k.x, u, whole, rest, lenses.x);
            float weight = clamp(radius + 0.5 - distance(vec2(u, v), view), 0.0, 1.0);
            weights += weight;
            if (column >= 0 && row >= 0) sums += weight * vec3(texel(column, row, u, v));
        }
    }
    return uvec3(sums / weights + 0.5);
}

float depthAt(ivec2 k) {
    vec2 place = (vec2(k) + 0.5) / vec2(size) * vec2(depthSize) - 0.5;
    ivec2 first = ivec2(floor(place));
    vec2 share = place - floor(place);
    float sum = 0.0;
    for (int y = 0; y < 2; y++) {
        for (int x = 0; x < 2; x++) {
            ivec2 at = clamp(first + ivec2(x, y), ivec2(0), depthSize - 1);
            float of = (x == 0 ? 1.0 - share.x : share.x) * (y == 0 ? 1.0 - share.y : share.y);
            sum += of * float(texelFetch(depths, at, 0).r);
        }
    }
    return sum / 65535.0;
}

void main() {
    ivec2 drawn = (size + stride - 1) / stride;
    ivec2 k = ivec2(gl_FragCoord.xy);
    k.y = drawn.y - 1 - k.y;
    k = min(k * stride + stride / 2, size - 1);
    if (mode == 2) {
        float shown = (depthAt(k) - depthShown.x) / (depthShown.y - depthShown.x);
        int number = int(clamp(shown, 0.0, 1.0) * 255.0 + 0.5);
        colour = vec4(texelFetch(colours, ivec2(number, 0), 0).rgb, 1.0);
        return;
    }
    int whole = moves;
    float rest = part;
    if (mode == 1) {
        float shift = mix(depthShift.x, depthShift.y, depthAt(k));
        whole = int(floor(shift));
        rest = fract(shift);
    }
    uvec3 value = radius < 0.0 ? fullMean(k, whole, rest) : apertureMean(k, whole, rest);
    uvec3 levels = (value * 255u + full / 2u) / full;
    if (gain != 1.0) levels = uvec3(vec3(value) * (gain * 255.0 / float(full)) + 0.5);
    levels = min(levels, 255u);
    colour = vec4(vec3(channels == 1 ? levels.rrr : levels) / 255.0, 1.0);
}`;

const MODES = ["refocused", "sharp", "depth"];
// Shifts this near to a whole number count as it: a comes from decimal fractions.
const SNAP = 1e-6;

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
    return high;
}

/** Smallest number of micro lenses to be made one, each way, so that a GPU can hold the field. */
export function neededBinning(field, limits) {
    const m = field.micro_image_size;
    for (let bin = 1; ; bin++) {
        const columns = Math.ceil(field.lens_columns / bin);
        const rows = Math.ceil(field.lens_rows / bin);
        const tiles = Math.min(Math.floor(limits.texture / columns), m * m);
        if (tiles < 1 || rows > limits.texture) continue;
        if (Math.ceil((m * m) / tiles) > limits.layers) continue;
        if (Math.max(columns, rows) * m > limits.picture + (bin === 1 ? m - 1 : 0)) continue;
        const bytes = columns * rows * m * m * field.channels * (field.bits / 8);
        if (bytes <= limits.bytes || (columns === 1 && rows === 1)) return bin;
    }
}

export class Renderer {
    constructor(canvas) {
        this.canvas = canvas;
        const options = { alpha: false, antialias: false, depth: false, stencil: false };
        this.gl = canvas.getContext("webgl2", options);
        if (!this.gl) throw new Error("this browser has no WebGL 2, which draws the picture");
    }

    limits() {
        const { gl } = this;
        const get = (name) => gl.getParameter(gl[name]);
        return {
            texture: get("MAX_TEXTURE_SIZE"),
            layers: get("MAX_ARRAY_TEXTURE_LAYERS"),
            picture: Math.min(get("MAX_RENDERBUFFER_SIZE"), ...get("MAX_VIEWPORT_DIMS")),
            bytes: 768 * 2 ** 20,
        };
    }

    /** Compile the shader and take in the light field: once, and after a lost context. */
    start(field, data) {
        const { gl } = this;
        this.field = field;
        this.data = data;
        for (const texture of this.textures ?? []) gl.deleteTexture(texture);
        this.textures = [];
        const program = gl.createProgram();
        const m = field.micro_image_size;
        const limits = this.limits();
        this.tiles = Math.min(Math.ceil(m ** 2 / limits.layers),
            Math.floor(limits.texture / data.columns));
        const texts = [[gl.VERTEX_SHADER, VERTICES], [gl.FRAGMENT_SHADER, fragments(m, this.tiles)]];
        for (const [kind, text] of texts) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, text);
            gl.compileShader(shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
                throw new Error(`the shader is refused: ${gl.getShaderInfoLog(shader)}`);
            }
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        gl.useProgram(program);
        this.places = new Map();
        const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
        for (let n = 0; n < count; n++) {
            const { name } = gl.getActiveUniform(program, n);
            this.places.set(name, gl.getUniformLocation(program, name));
        }
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
        gl.uniform1i(this.places.get("views"), 0);
        gl.uniform1i(this.places.get("depths"), 1);
        gl.uniform1i(this.places.get("colours"), 2);
        gl.uniform1i(this.places.get("channels"), field.channels);
        gl.uniform2i(this.places.get("lenses"), data.columns, data.rows);
        gl.uniform1ui(this.places.get("full"), field.full_scale);
        this.size = [
            Math.min(data.columns * m, Math.ceil(field.columns / data.bin)),
            Math.min(data.rows * m, Math.ceil(field.rows / data.bin)),
        ];
        gl.uniform2i(this.places.get("size"), ...this.size);
        this.#takeViews();
        this.#texture(1, gl.TEXTURE_2D);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, 1, 1, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT,
            new Uint16Array(1));
        gl.uniform2i(this.places.get("depthSize"), 1, 1);
        this.#texture(2, gl.TEXTURE_2D);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, field.colours);
        if (this.depth) this.takeDepth(this.depth);
        const error = gl.getError();
        if (error === gl.OUT_OF_MEMORY) throw new TooLarge("the GPU has not enough memory");
        if (error !== gl.NO_ERROR && error !== gl.CONTEXT_LOST_WEBGL) {
            throw new Error(`the GPU refuses the light field (error ${error})`);
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
    }

    #takeViews() {
        const { gl, field, data, tiles } = this;
        const count = field.micro_image_size ** 2;
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
        for (let n = 0; n < field.micro_image_size ** 2; n++) {
            const place = [(n % tiles) * data.columns, 0, Math.floor(n / tiles)];
            gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, ...place, data.columns, data.rows, 1, format,
                type, data.views.subarray(n * length, (n + 1) * length));
        }
    }

    /** Take in the views of another frame. */
    takeFrame(views) {
        this.data.views = views;
        this.gl.activeTexture(this.gl.TEXTURE0);
        this.#fillViews();
    }

    /** Take in the depth map: values 0 to 65535 for a from the field's range. */
    takeDepth(depth) {
        const { gl } = this;
        this.depth = depth;
        gl.activeTexture(gl.TEXTURE1);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, depth.columns, depth.rows, 0, gl.RED_INTEGER,
            gl.UNSIGNED_SHORT, depth.values);
        gl.uniform2i(this.places.get("depthSize"), depth.columns, depth.rows);
        gl.uniform2f(this.places.get("depthShift"), ...this.field.range.map((a) => this.#shift(a)));
        gl.uniform2f(this.places.get("depthShown"), ...depth.shown);
    }

    /** Shift in pixels of the field on the GPU. */
    #shift(a) {
        return (a * this.field.micro_image_size) / (this.data.bin * this.field.scale);
    }

    /** Draw a state; one of `stride` x `stride` pixels. The time in ms, the GPU's work included. */
    draw(state, stride = 1) {
        const { gl, canvas, size } = this;
        const begin = performance.now();
        const [width, height] = size.map((n) => Math.ceil(n / stride));
        if (canvas.width !== width) canvas.width = width;
        if (canvas.height !== height) canvas.height = height;
        if (gl.isContextLost()) return 0;
        if (gl.drawingBufferWidth < width || gl.drawingBufferHeight < height) {
            throw new TooLarge("the GPU cannot draw a picture of this size");
        }
        gl.viewport(0, 0, width, height);
        const place = (name) => this.places.get(name);
        let shift = this.#shift(state.focus);
        if (Math.abs(shift - Math.round(shift)) < SNAP) shift = Math.round(shift);
        gl.uniform1i(place("mode"), MODES.indexOf(state.mode));
        gl.uniform1i(place("stride"), stride);
        gl.uniform1i(place("moves"), Math.floor(shift));
        gl.uniform1f(place("part"), shift - Math.floor(shift));
        gl.uniform2f(place("view"), state.view[0], state.view[1]);
        gl.uniform1f(place("radius"), radiusOfShare(state.aperture, this.field.micro_image_size));
        // Light of twice as much is a value of 2 ^ (1 / 2.2) times as much.
        gl.uniform1f(place("gain"), 2 ** (state.exposure / 2.2));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        // Reading waits for the GPU.
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        return performance.now() - begin;
    }

    /** Pixels of the canvas as they were just drawn. */
    read() {
        const { gl } = this;
        const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
        const upsideDown = new Uint8Array(width * height * 4);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, upsideDown);
        const image = new ImageData(width, height);
        for (let y = 0; y < height; y++) {
            const from = (height - 1 - y) * width * 4;
            image.data.set(upsideDown.subarray(from, from + width * 4), y * width * 4);
        }
        return image;
    }
}
