// SPDX-License-Identifier: Apache-2.0
// Pictures and films of what is on show, as files.

const RATE = 24;
const FRAMES = 48;
// Of the pupil's radius: the circle that the viewpoint goes around on.
const AROUND = 0.8;
const KINDS = [
    ["video/mp4;codecs=avc1.640028", "mp4"],
    ["video/webm;codecs=vp9", "webm"],
    ["video/webm;codecs=vp8", "webm"],
    ["video/webm", "webm"],
];

/** The states of a film: "focus" goes through a range of a and back, "view" once around the lens. */
export function filmStates(kind, state, [low, high], m) {
    return Array.from({ length: FRAMES }, (_, n) => {
        const turn = (2 * Math.PI * n) / FRAMES;
        if (kind === "focus") {
            // Slowly where it turns.
            const focus = low + ((high - low) * (1 - Math.cos(turn))) / 2;
            return { ...state, focus, mode: "refocused" };
        }
        const c = (m - 1) / 2;
        const view = [c + AROUND * c * Math.cos(turn), c + AROUND * c * Math.sin(turn)];
        return { ...state, view, aperture: 1 / (m * m), mode: "refocused" };
    });
}

/** An even width for a film of a picture, and what it is then high. */
export function filmSize([width, height], longest = 960) {
    const scale = Math.min(longest / Math.max(width, height), 1);
    return [width, height].map((n) => Math.max(2 * Math.round((n * scale) / 2), 2));
}

/** A PNG of an ImageData. */
export async function pictureFile(image) {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    canvas.getContext("2d").putImageData(image, 0, 0);
    return new Promise((done) => canvas.toBlob(done, "image/png"));
}

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

/** A film of ImageData of one size, played while it is recorded, and its file's ending. */
export async function filmFile(images) {
    const kind = KINDS.find(([type]) => window.MediaRecorder?.isTypeSupported(type));
    if (!kind) throw new Error("this browser records no films");
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [images[0].width, images[0].height];
    const context = canvas.getContext("2d");
    context.putImageData(images[0], 0, 0);
    const options = { mimeType: kind[0], videoBitsPerSecond: 10_000_000 };
    const recorder = new MediaRecorder(canvas.captureStream(RATE), options);
    const parts = [];
    recorder.addEventListener("dataavailable", (event) => parts.push(event.data));
    const ended = new Promise((done, fail) => {
        recorder.addEventListener("stop", done);
        recorder.addEventListener("error", (event) => fail(event.error ?? new Error("recording failed")));
    });
    recorder.start();
    const begin = performance.now();
    // The last one is there until the recorder has it.
    for (const [n, image] of [...images, images[images.length - 1]].entries()) {
        context.putImageData(image, 0, 0);
        await wait(Math.max(begin + ((n + 1) * 1000) / RATE - performance.now(), 1));
    }
    recorder.stop();
    await ended;
    return { blob: new Blob(parts, { type: kind[0].split(";")[0] }), ending: kind[1] };
}

/** Give a file to the user. */
export function download(blob, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
