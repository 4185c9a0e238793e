// SPDX-License-Identifier: Apache-2.0
// A focused camera's capture on the GPU: micro images, enlarged by v, laid over each other (WebGL 2).
//
// As plenofir.camera.focused.loops has it: each place of the picture adds up what the micro images
// that reach it show there, each weighed by how sharp its type is at this v, over their light.

import { VERTICES } from "./shaders.js";

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
`;

const LAID_OVER = `${HEAD}
uniform usampler2D capture;  // values, and in the last channel the share of light; 0 does not count
uniform sampler2D lenses;    // in cells with one at most: x, y, 1 / v where it is sharpest, there or not
uniform vec2 corner;         // of the first cell in the capture
uniform float side;          // of a cell
uniform float inverse;       // 1 / v
uniform float reach;         // radius within which pixels of a micro image count
uniform float pitch;
uniform float pixels;        // of the capture for one of the picture
uniform vec2 scale;          // first value, and by how much the last one is larger
uniform float unit;          // values of the picture for one of the capture
uniform float top;
uniform int alike;           // all types are
out uvec4 value;

const float FULL = 65535.0;

void main() {
    vec2 place = 0.5 * (pixels - 1.0) + pixels * floor(gl_FragCoord.xy);
    float far = reach / abs(inverse);
    ivec2 first = max(ivec2(floor((place - far - corner) / side)), ivec2(0));
    ivec2 last = min(ivec2(floor((place + far - corner) / side)), textureSize(lenses, 0) - 1);
    ivec2 ends = textureSize(capture, 0) - 1;
    vec3 sums = vec3(0.0);
    float shares = 0.0;
    for (int row = first.y; row <= last.y; row++) {
        for (int column = first.x; column <= last.x; column++) {
            vec4 lens = texelFetch(lenses, ivec2(column, row), 0);
            vec2 away = (place - lens.xy) * inverse;
            if (lens.a == 0.0 || dot(away, away) > reach * reach) continue;
            vec2 at = lens.xy + away;
            ivec2 k = ivec2(floor(at));
            if (any(lessThan(k, ivec2(0))) || any(greaterThanEqual(k, ends))) continue;
            vec4 texels[4];
            for (int n = 0; n < 4; n++) {
                texels[n] = vec4(texelFetch(capture, k + ivec2(n & 1, n >> 1), 0)) / FULL;
            }
            if (min(min(texels[0].a, texels[1].a), min(texels[2].a, texels[3].a)) <= 0.0) continue;
            vec2 part = at - vec2(k);
            vec4 found = mix(mix(texels[0], texels[1], part.x), mix(texels[2], texels[3], part.x), part.y);
            float blur = pitch * (lens.z - inverse);
            float near = max(blur * blur, 0.25);
            float weight = alike == 1 ? 1.0 : 1.0 / (near * near);
            sums += weight * (scale.x + scale.y * found.rgb);
            shares += weight * found.a;
        }
    }
    vec3 mean = shares > 0.0 ? floor(sums / shares * unit + 0.5) : vec3(0.0);
    value = uvec4(uvec3(clamp(mean, 0.0, top)), shares > 0.0 ? 1u : 0u);
}`;

const EXPOSED = `${HEAD}
uniform usampler2D from;     // values, and 1 where a micro image shows the place
uniform sampler2D tones;     // 256 x 256: what the screen shows of each value
uniform ivec2 size;          // of the picture that is made
uniform int swapped;         // rows are columns
uniform ivec2 mirrored;
uniform int grey;
out vec4 colour;

const int FAR = 256;

float tone(uint value) {
    return texelFetch(tones, ivec2(value & 255u, value >> 8), 0).r;
}

void main() {
    ivec2 k = ivec2(gl_FragCoord.xy);
    k.y = size.y - 1 - k.y;
    if (swapped == 1) k = k.yx;
    ivec2 last = textureSize(from, 0) - 1;
    if (mirrored.x == 1) k.x = last.x - k.x;
    if (mirrored.y == 1) k.y = last.y - k.y;
    uvec4 value = texelFetch(from, k, 0);
    // Places that no micro image shows have the values of the nearest that one shows.
    int best = value.a == 0u ? FAR * FAR : 0;
    for (int r = 1; r < FAR && r * r < best; r++) {
        for (int n = -r; n <= r; n++) {
            for (int edge = 0; edge < 4; edge++) {
                ivec2 away = edge < 2 ? ivec2(n, edge == 0 ? -r : r) : ivec2(edge == 2 ? -r : r, n);
                ivec2 at = k + away;
                int distance = away.x * away.x + away.y * away.y;
                if (distance >= best || any(lessThan(at, ivec2(0))) || any(greaterThan(at, last))) continue;
                uvec4 other = texelFetch(from, at, 0);
                if (other.a == 0u) continue;
                best = distance;
                value = other;
            }
        }
    }
    colour = vec4(tone(value.r), tone(value.g), tone(value.b), 1.0);
    if (grey == 1) colour = colour.rrra;
}`;

export class FocusedGpu {
    /** Take in a capture: `field` describes it, `capture` and `lenses` are its data. */
    constructor(field, { capture, lenses }) {
        this.field = field;
        this.canvas = document.createElement("canvas");
        [this.canvas.width, this.canvas.height] = [field.columns, field.rows];
        const options = { alpha: false, antialias: false, depth: false, stencil: false };
        const gl = this.canvas.getContext("webgl2", { ...options, preserveDrawingBuffer: true });
        if (!gl) throw new Error("this browser has no WebGL 2, which draws the picture");
        this.gl = gl;
        const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
        const [width, height] = field.capture_size;
        if (Math.max(width, height) > most) {
            throw new Error(`the capture is larger than this GPU takes (${most} pixels); use plenofir stack -v`);
        }
        this.laidOver = this.#program(LAID_OVER);
        this.exposed = this.#program(EXPOSED);
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
        this.#texture(0, gl.RGBA16UI, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, capture);
        this.#texture(1, gl.RGBA32F, ...field.cells, gl.RGBA, gl.FLOAT, lenses);
        this.#texture(2, gl.R8, 256, 256, gl.RED, gl.UNSIGNED_BYTE, null);
        this.size = field.plane_size;
        const drawn = this.#texture(3, gl.RGBA16UI, ...this.size, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, null);
        this.buffer = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.buffer);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, drawn, 0);
        if (gl.getError() !== gl.NO_ERROR) throw new Error("the GPU has not enough memory for the capture");
    }

    #texture(unit, stored, width, height, format, type, data) {
        const { gl } = this;
        const texture = gl.createTexture();
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        gl.texImage2D(gl.TEXTURE_2D, 0, stored, width, height, 0, format, type, data);
        return texture;
    }

    #program(fragments) {
        const { gl } = this;
        const program = gl.createProgram();
        for (const [kind, text] of [[gl.VERTEX_SHADER, VERTICES], [gl.FRAGMENT_SHADER, fragments]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, text);
            gl.compileShader(shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
                throw new Error(`the shader is refused: ${gl.getShaderInfoLog(shader)}`);
            }
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        return program;
    }

    /** Lay the micro images over each other at a 1 / v. */
    refocus(inverse) {
        const { gl, field, laidOver: program } = this;
        const place = (name) => gl.getUniformLocation(program, name);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.buffer);
        gl.viewport(0, 0, ...this.size);
        gl.useProgram(program);
        gl.uniform1i(place("capture"), 0);
        gl.uniform1i(place("lenses"), 1);
        gl.uniform1i(place("alike"), Number(field.alike));
        gl.uniform2f(place("corner"), ...field.corner);
        gl.uniform2f(place("scale"), ...field.scale);
        const numbers = { inverse, side: field.side, reach: field.reach, pitch: field.pitch };
        Object.assign(numbers, { pixels: field.step, unit: field.unit, top: field.top });
        for (const [name, value] of Object.entries(numbers)) gl.uniform1f(place(name), value);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    /** Show the plane that was laid over, with tones for each of 65,536 values, on the canvas. */
    expose(tones) {
        const { gl, field, exposed: program, canvas } = this;
        const place = (name) => gl.getUniformLocation(program, name);
        gl.activeTexture(gl.TEXTURE2);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 256, gl.RED, gl.UNSIGNED_BYTE, tones);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.useProgram(program);
        gl.uniform1i(place("from"), 3);
        gl.uniform1i(place("tones"), 2);
        gl.uniform1i(place("swapped"), Number(field.swapped));
        gl.uniform1i(place("grey"), Number(field.channels === 1));
        gl.uniform2i(place("size"), canvas.width, canvas.height);
        gl.uniform2i(place("mirrored"), ...field.mirrored.map(Number));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
}
