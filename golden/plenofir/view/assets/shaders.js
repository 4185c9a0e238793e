// SPDX-License-Identifier: Apache-2.0
// What the GPU computes of a light field (WebGL 2).
//
// Three steps. First pixels of the picture, in integers of 16 bit: views are layers of integer
// textures, the shader adds them and rounds once, halves up. As computed, a view moves by whole
// pixels: with all views and on the grid of a (shift a M whole) that is Eq. (6.1) with a normalised
// border, as plenofir.refocus computes it; elsewhere by the nearest. For a smooth display the result
// is what plenofir.refocus.best_picture makes. With all views of odd M off the grid a mixture of the
// pictures before and after, then the mean over a micro lens in both dimensions, which is linear
// interpolation between micro lenses. With an aperture, a tilt or even M each view is interpolated
// where it is. Then sharpening. Last what the screen shows of that: zoomed, exposed, with 8 bits.

export const VERTICES = `#version 300 es
void main() {
    gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}`;

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2DArray;
precision highp usampler2D;
`;

/**
 * M, which of the M x M views there are, and the number of views beside each other in a layer are
 * known when it is compiled.
 */
export const picture = (field, tiles) => `${HEAD}
#define M ${field.micro_image_size}
#define FIRST ivec2(${field.first_view})
#define VIEWS ivec2(${field.view_columns}, ${field.view_rows})
#define TILES ${tiles}
uniform usampler2DArray views;
uniform usampler2D depths;
uniform usampler2D everywhere;  // the picture that is in focus everywhere
uniform int mode;        // 0 refocused, 1 all in focus, 2 depth
uniform ivec2 origin;    // first pixel of the picture that is drawn
uniform int stride;      // pixels of the picture for each that is drawn, in both dimensions
uniform ivec2 lenses;    // columns, rows
uniform ivec2 size;      // of the picture
uniform ivec2 extent;    // of the raw image: its last micro images may be cut
uniform int moves;       // whole part of the shift a M in the middle of the picture
uniform float part;      // what is left of it, 0 to 1
uniform vec2 tilt;       // by how much the shift grows to the right edge and to the bottom
uniform int between;     // 1: each view is interpolated where it is
uniform vec2 view;       // centre of the aperture: u, v
uniform float radius;    // of the aperture in views; negative: all views count
uniform uint unit;       // of 16 bit values for one of a view
uniform int mixed;       // 1: not rounded to values of a view
out uvec4 value;

// Micro lens of pixel n, -1 for none: n / M, rounded down, which is right for all n that count.
int lensOf(int n, int limit) {
    int lens = int(floor((float(n) + 0.5) * (1.0 / float(M))));
    return lens < limit ? max(lens, -1) : -1;
}

// Index of S that output 0 takes, centred.
int offset(int shift) {
    return ((M - 1) * shift) >> 1;
}

uint fine() {
    return mixed == 1 ? unit : 1u;
}

uvec3 texel(int column, int row, int u, int v) {
    int number = (v - FIRST.y) * VIEWS.x + u - FIRST.x;
#if TILES == 1
    return texelFetch(views, ivec3(column, row, number), 0).rgb;
#else
    int layer = number / TILES;
    return texelFetch(views, ivec3((number - layer * TILES) * lenses.x + column, row, layer), 0).rgb;
#endif
}

// Micro lens that view i takes pixel k from, -1 for none. Views move by whole pixels, the nearest.
int lensAt(int k, int i, int whole, float rest, int limit, int length) {
    int start = k + offset(whole) - i * whole;
    float more = rest * float(offset(whole + 1) - offset(whole) - i);
    int lens = lensOf(start + int(floor(more + 0.5)), limit);
    return lens * M + i < length ? lens : -1;
}

// Mean of all views that reach the pixel, in values of fine(), rounded once, halves up.
uvec3 fullMean(ivec2 k, int whole, float rest) {
    uvec3 sums = uvec3(0u);
    int columns[M];
    uint across = 0u;
    uint down = 0u;
    for (int u = FIRST.x; u < FIRST.x + VIEWS.x; u++) {
        columns[u] = lensAt(k.x, u, whole, rest, lenses.x, extent.x);
        across += columns[u] >= 0 ? 1u : 0u;
    }
    for (int v = FIRST.y; v < FIRST.y + VIEWS.y; v++) {
        int row = lensAt(k.y, v, whole, rest, lenses.y, extent.y);
        if (row < 0) continue;
        down += 1u;
        for (int u = FIRST.x; u < FIRST.x + VIEWS.x; u++) {
            if (columns[u] >= 0) sums += texel(columns[u], row, u, v);
        }
    }
    uint count = max(across * down, 1u);
    return (sums * fine() + count / 2u) / count;
}

// Mean of the views in the aperture that reach the pixel; those on its edge count in part.
uvec3 apertureMean(ivec2 k, int whole, float rest) {
    vec3 sums = vec3(0.0);
    float weights = 0.0;
    ivec2 first = max(ivec2(ceil(view - radius - 0.5)), FIRST);
    ivec2 last = min(ivec2(floor(view + radius + 0.5)), FIRST + VIEWS - 1);
    for (int v = first.y; v <= last.y; v++) {
        int row = lensAt(k.y, v, whole, rest, lenses.y, extent.y);
        if (row < 0) continue;
        for (int u = first.x; u <= last.x; u++) {
            int column = lensAt(k.x, u, whole, rest, lenses.x, extent.x);
            if (column < 0) continue;
            float weight = clamp(radius + 0.5 - distance(vec2(u, v), view), 0.0, 1.0);
            weights += weight;
            sums += weight * vec3(texel(column, row, u, v));
        }
    }
    return weights > 0.0 ? uvec3(sums / weights * float(fine()) + 0.5) : uvec3(0u);
}

bool inPicture(int lens, int i, int limit, int length) {
    return lens >= 0 && lens < limit && lens * M + i < length;
}

// Mean of the views in the aperture, each interpolated at its place, as picture_lines.py has it.
vec3 meanBetween(ivec2 k, float shift) {
    const float c = float(M - 1) * 0.5;
    vec2 straight = (vec2(k) - c) / float(M);
    vec3 sums = vec3(0.0);
    float weights = 0.0;
    for (int v = FIRST.y; v < FIRST.y + VIEWS.y; v++) {
        float t = straight.y - shift / float(M) * (float(v) - c);
        int row = int(floor(t));
        for (int u = FIRST.x; u < FIRST.x + VIEWS.x; u++) {
            float inside = radius < 0.0 ? 1.0
                : clamp(radius + 0.5 - distance(vec2(u, v), view), 0.0, 1.0);
            if (inside == 0.0) continue;
            float s = straight.x - shift / float(M) * (float(u) - c);
            int column = int(floor(s));
            for (int y = 0; y < 2; y++) {
                if (!inPicture(row + y, v, lenses.y, extent.y)) continue;
                for (int x = 0; x < 2; x++) {
                    if (!inPicture(column + x, u, lenses.x, extent.x)) continue;
                    float weight = inside * (1.0 - abs(t - float(row + y))) * (1.0 - abs(s - float(column + x)));
                    weights += weight;
                    sums += weight * vec3(texel(column + x, row + y, u, v));
                }
            }
        }
    }
    return weights > 0.0 ? sums / weights * float(fine()) : vec3(0.0);
}

// A map or picture of any size, at a pixel.
vec3 mapped(usampler2D map, ivec2 k) {
    ivec2 mapSize = textureSize(map, 0);
    vec2 place = (vec2(k) + 0.5) / vec2(size) * vec2(mapSize) - 0.5;
    ivec2 first = ivec2(floor(place));
    vec2 share = place - floor(place);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 2; y++) {
        for (int x = 0; x < 2; x++) {
            ivec2 at = clamp(first + ivec2(x, y), ivec2(0), mapSize - 1);
            float of = (x == 0 ? 1.0 - share.x : share.x) * (y == 0 ? 1.0 - share.y : share.y);
            sum += of * vec3(texelFetch(map, at, 0).rgb);
        }
    }
    return sum;
}

void main() {
    ivec2 k = clamp(origin + ivec2(gl_FragCoord.xy) * stride + stride / 2, ivec2(0), size - 1);
    if (mode == 2) {
        value = uvec4(uint(mapped(depths, k).r + 0.5));
        return;
    }
    if (mode == 1) {
        value = uvec4(uvec3(mapped(everywhere, k) * float(unit) + 0.5), 0u);
        return;
    }
    int whole = moves;
    float rest = part;
    bool tilted = tilt != vec2(0.0);
    if (tilted) {
        float shift = float(moves) + part + dot(tilt, (2.0 * vec2(k) + 1.0) / vec2(size) - 1.0);
        whole = int(floor(shift));
        rest = fract(shift);
    }
    uvec3 mean;
    if (between == 1) {
        // With all views off the grid the pictures before and after are mixed.
        bool mixes = radius < 0.0 && !tilted && rest > 0.0;
        vec3 found = meanBetween(k, float(whole) + (mixes ? 0.0 : rest));
        if (mixes) found = mix(found, meanBetween(k, float(whole + 1)), rest);
        mean = uvec3(found + 0.5);
    } else if (radius >= 0.0) {
        mean = apertureMean(k, whole, rest);
    } else if (mixed == 1 && rest > 0.0) {
        vec3 before = vec3(fullMean(k, whole, 0.0));
        mean = uvec3(mix(before, vec3(fullMean(k, whole + 1, 0.0)), rest) + 0.5);
    } else {
        mean = fullMean(k, whole, rest);
    }
    value = uvec4(mean * (unit / fine()), 0u);
}`;

/** Mean over a width in one dimension. */
export const BOX = `${HEAD}
uniform usampler2D from;
uniform ivec2 along;     // 1, 0 or 0, 1
uniform float width;
out uvec4 value;

void main() {
    ivec2 k = ivec2(gl_FragCoord.xy);
    ivec2 last = textureSize(from, 0) - 1;
    vec3 sums = vec3(0.0);
    float weights = 0.0;
    int reach = int(ceil(0.5 * width - 0.5));
    for (int n = -reach; n <= reach; n++) {
        float weight = min(0.5 * width + 0.5 - abs(float(n)), 1.0);
        sums += weight * vec3(texelFetch(from, clamp(k + n * along, ivec2(0), last), 0).rgb);
        weights += weight;
    }
    value = uvec4(uvec3(sums / weights + 0.5), 0u);
}`;

/** Taps a micro lens apart in one dimension, as plenofir.refocus.pictures has them. */
export const SHARPEN = `${HEAD}
uniform usampler2D from;
uniform ivec2 along;     // 1, 0 or 0, 1
uniform int lens;
uniform vec2 begins;     // of the picture, in drawn pixels
uniform vec2 ends;
out uvec4 value;

vec3 texel(ivec2 k, ivec2 otherwise) {
    bool outside = any(lessThan(vec2(k), begins)) || any(greaterThanEqual(vec2(k), ends));
    ivec2 last = textureSize(from, 0) - 1;
    return vec3(texelFetch(from, clamp(outside ? otherwise : k, ivec2(0), last), 0).rgb);
}

void main() {
    ivec2 k = ivec2(gl_FragCoord.xy);
    vec3 here = texel(k, k);
    vec3 before = texel(k - lens * along, k);
    vec3 after = texel(k + lens * along, k);
    vec3 near = texel(k - lens / 2 * along, k);
    vec3 next = texel(k + lens / 2 * along, k);
    vec3 large = max(before, after);
    vec3 small = min(before, after);
    vec3 high = max(max(large, max(near, next)) - here, 2.0 * (here - large));
    vec3 low = min(min(small, min(near, next)) - here, 2.0 * (here - small));
    vec3 more = clamp(0.109375 * (2.0 * here - before - after), low, high);
    value = uvec4(uvec3(clamp(here + more, 0.0, 65535.0) + 0.5), 0u);
}`;

/** What the screen shows of the picture. */
export const SCREEN = `${HEAD}
uniform usampler2D from;
uniform sampler2D tones;    // 256 x 256: what the screen shows of each value
uniform sampler2D colours;  // of depths
uniform int isDepth;
uniform vec2 depthShown;    // depths of the first and the last colour
uniform int grey;           // one channel
uniform int smoothly;
uniform vec2 first;         // place in the drawn pixels of the screen's top left corner
uniform float step;         // drawn pixels for each pixel of the screen
uniform vec2 ends;          // the picture ends there, in drawn pixels
uniform vec2 begins;
uniform int rows;           // of the screen; 0 to count them upwards
out vec4 colour;

uvec3 texel(ivec2 k) {
    return texelFetch(from, clamp(k, ivec2(0), textureSize(from, 0) - 1), 0).rgb;
}

vec4 cubic(float t) {
    // Catmull and Rom's.
    return vec4(t * (-0.5 + t * (1.0 - 0.5 * t)), 1.0 + t * t * (-2.5 + 1.5 * t),
        t * (0.5 + t * (2.0 - 1.5 * t)), t * t * (-0.5 + 0.5 * t));
}

uvec3 between(vec2 place) {
    ivec2 k = ivec2(floor(place - 0.5));
    vec2 share = place - 0.5 - vec2(k);
    vec4 across = cubic(share.x);
    vec4 down = cubic(share.y);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 4; y++) {
        for (int x = 0; x < 4; x++) {
            sum += across[x] * down[y] * vec3(texel(k + ivec2(x - 1, y - 1)));
        }
    }
    return uvec3(clamp(sum, 0.0, 65535.0) + 0.5);
}

float tone(uint value) {
    return texelFetch(tones, ivec2(value & 255u, value >> 8), 0).r;
}

void main() {
    ivec2 k = ivec2(gl_FragCoord.xy);
    if (rows > 0) k.y = rows - 1 - k.y;
    vec2 place = first + (vec2(k) + 0.5) * step;
    if (any(lessThan(place, begins)) || any(greaterThanEqual(place, ends))) {
        colour = vec4(0.0784, 0.0902, 0.1098, 1.0);
        return;
    }
    uvec3 value = smoothly == 1 ? between(place) : texel(ivec2(floor(place)));
    if (isDepth == 1) {
        float shown = (float(value.r) / 65535.0 - depthShown.x) / (depthShown.y - depthShown.x);
        int number = int(clamp(shown, 0.0, 1.0) * 255.0 + 0.5);
        colour = vec4(texelFetch(colours, ivec2(number, 0), 0).rgb, 1.0);
        return;
    }
    colour = vec4(tone(value.r), tone(value.g), tone(value.b), 1.0);
    if (grey == 1) colour = colour.rrra;
}`;

