# SPDX-License-Identifier: Apache-2.0
"""One frame refocused by compiled code, its blocks distributed to threads."""

import numpy as np

from plenofir.ground.images import Image
from plenofir.refocus.compiled.blocks import refocus_blocks
from plenofir.refocus.compiled.parameters import Frame
from plenofir.refocus.compiled.plans import blocks_of, work_of
from plenofir.refocus.slices import Slice
from plenofir.refocus.threads import in_threads, processors

# Fewer samples are not worth the start of a second thread.
_SAMPLES_FOR_A_THREAD = 1 << 19
# Larger pictures, in bytes, bypass the caches when written: the next frame would evict them.
_PAST_CACHES = 4 << 20


def compiled_refocus(
    raw: Image, slice_: Slice, *, out: Image | None = None, threads: int | None = None
) -> Image:
    """Refocus an image; equal to `plenofir.refocus.plain.plain_refocus` to the bit.

    `out`: memory for the result, C-contiguous. `threads`: as many as there are processors if None.
    """
    image: Image = np.empty(slice_.result_shape, raw.dtype) if out is None else out
    if image.size == 0:
        return image
    if slice_.micro_image_size == 1 and slice_.units == 0:
        rows, columns = (slice(part.start, part.stop) for part in slice_.region)
        np.copyto(image, raw[rows, columns])
        return image
    work = work_of(slice_)
    plan, loops = work.plan, work.loops
    pixels = np.ascontiguousarray(raw).reshape(-1).view(np.uint8)
    # One variant, whether the caller may write there or not.
    pixels.flags.writeable = False
    flat = image.reshape(-1).view(np.uint8)
    count = processors() if threads is None else threads
    samples = image.size * (plan.step // plan.rows.scale) ** 2
    count = max(1, min(count, samples // _SAMPLES_FOR_A_THREAD))
    past = int(flat.nbytes > _PAST_CACHES)
    blocks = blocks_of(plan, loops.word_bytes, count)
    frame = Frame(pixels, plan, work.taps, work.weights, work.first, loops)
    counter = np.zeros(1, np.int64)
    in_threads(lambda: refocus_blocks(frame, flat, blocks, counter, past), count)
    return image
