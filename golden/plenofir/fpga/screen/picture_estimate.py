# SPDX-License-Identifier: Apache-2.0
"""Estimated resources of a focal stack with its depth index, and of the text over the picture.

Block RAM and multipliers follow the rules of Yosys, as those of the core do. Look-up tables and
flip-flops are sums over the parts, with weights fitted to synthesised designs of several sizes.
"""

from collections.abc import Iterator

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.memory import Memory, block_sizes
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.core.weights import usage_of_parts
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.screen.overlay import Overlay
from plenofir.fpga.screen.stored import StoredLightField
from plenofir.fpga.synthesis.estimate import multipliers
from plenofir.refocus.sharpness import FRACTION_BITS


def _bits(largest: int) -> int:
    """Bits of a number from 0 to the largest (bits_for)."""
    return max(largest.bit_length(), 1)


def stack_memories(core: CoreConfiguration) -> Iterator[Memory]:
    engine = core.engine
    assert isinstance(engine, StackEngine)
    p, layout = core.pixels_per_clock, engine.layout(core)
    pixel, columns = p * core.channels * core.pixel_bits, engine.line_words(core)
    sums = p * core.channels * core.words(0).sum
    input_bits = _bits(engine.input_lines * core.line_tokens(core.max_columns) + 1)
    yield Memory("input FIFO", input_bits, pixel + 2, 1)
    for lines in layout.history_lines:
        if lines:
            width = lines * pixel
            yield Memory("lines of a phase", _bits(columns - 1), width, 1, words=columns)
    words = sum(layout.slice_words(slice_) for slice_ in range(len(core.shifts)))
    for size in block_sizes(columns, sums):
        yield Memory("sums", (size - 1).bit_length(), sums, words, words=size)
    row_pixels = core.channels * core.words(1).data
    if p == 1:
        copies = len(core.shifts) * (1 + layout.pixels_leave)
        yield Memory("pixels of a line", layout.reach.bit_length(), row_pixels, copies)
    else:
        for lanes in engine.lanes(core):
            rows = (lanes.rows - 1).bit_length()
            yield Memory("pixels of a line", rows, row_pixels, 2 * lanes.banks)
    under_way = 2 + core.array_clocks
    yield Memory("output FIFO", _bits(2 * under_way + 1), len(core.shifts) * pixel + 3, 1)


def index_memories(index: DepthIndexConfiguration, *, chosen_too: bool) -> Iterator[Memory]:
    """Memories of the entity ``depth_index``."""
    slices, p = index.slices, index.pixels_per_clock
    pixel = p * index.channels * index.pixel_bits
    lenses = -(-index.max_columns // index.micro_image_size)
    places, number = _bits(lenses - 1), _bits(slices - 1)

    def of_lenses(name: str, width: int, copies: int = 1) -> Memory:
        return Memory(name, places, width, copies, words=lenses)

    yield of_lenses("sums of micro images", index.lens_bits, 2 * slices)
    yield of_lenses("rows of micro images", 2 * index.lens_bits, slices)
    if index.radius:
        yield of_lenses("rows of sharpness", 2 * index.radius * index.row_bits, slices)
    if index.vote_radius:
        yield of_lenses("rows of votes", 2 * index.vote_radius * (number + 1))
        yield of_lenses("slices above", number)
    between = 2 * FRACTION_BITS if index.shifts else 0
    if between and index.vote_radius:
        yield of_lenses("depths that wait", between * index.vote_radius)
    words = index.delay * index.line_tokens(index.max_columns)
    if index.picture:
        yield Memory("waiting pixels", _bits(words - 1), slices * pixel, 1, words=words)
    yield of_lenses("slices found", number + between)
    under_way = 2 + index.index_latency + 4
    out = (index.picture + chosen_too) * pixel + p * (8 + between) + 3
    out += number if chosen_too else 0
    yield Memory("output FIFO", _bits(2 * under_way + 1), out, 1)


def stack_structure(core: CoreConfiguration) -> dict[str, int]:
    """Parts of ``focal_stack`` that take look-up tables and flip-flops."""
    engine, pixel = core.engine, core.channels * core.pixel_bits
    assert isinstance(engine, StackEngine)
    p, slices = core.pixels_per_clock, len(core.shifts)
    sums, row_bits = slices * core.channels * core.words(0).sum, core.channels * core.words(1).data
    one = {
        "stack": 1,
        "sum bits": sums,
        "history bits": engine.lines(core) * pixel,
        "slices": slices,
    }
    # With several pixels a clock: column sums, what they choose from, and the pixels of all banks.
    lanes = {
        "slices of lanes": slices,
        "lane bits": p * sums,
        "lane choices": p * sums * core.micro_image_size,
        "bank bits": sum(lane.banks for lane in engine.lanes(core)) * row_bits,
    }
    taken, left = (one, lanes) if p == 1 else (lanes, one)
    return taken | dict.fromkeys(left, 0)


def index_structure(index: DepthIndexConfiguration | None) -> dict[str, int]:
    """Parts of ``depth_index``, if there is one, that look-up tables and flip-flops go to."""
    if index is None:
        return dict.fromkeys(("index", "pixel bits", "judged bits", "vote bits"), 0)
    window = (2 * index.vote_radius + 1) ** 2
    return {
        "index": 1,
        "pixel bits": index.slices * index.pixels_per_clock * index.channels * index.pixel_bits,
        "judged bits": (index.slices - 1) * index.row_bits,
        "vote bits": index.slices * window.bit_length() if index.vote_radius else 0,
    }


def picture_usage(core: CoreConfiguration, screen: Screen, family: Family = "spartan6") -> Usage:
    """Estimate what a focal stack, and the depth index behind it if there is one, take of a device.

    Multipliers are exact, block RAM too on an ECP5 (elsewhere up to five too many); LUTs and
    flip-flops are within 15 % on a Spartan-6, within a third on an ECP5.
    """
    index = screen.index(core) if screen.needs_index else None
    parts, memories = stack_structure(core) | index_structure(index), list(stack_memories(core))
    if index is not None:
        memories += index_memories(index, chosen_too="i" not in screen.outputs)
    return usage_of_parts(
        "picture",
        parts,
        memories,
        family,
        len(core.shifts) * multipliers(core, family),
    )


def overlay_usage(overlay: Overlay | None, family: Family = "spartan6") -> Usage:
    """Estimate what the text over the picture, if any, takes of a device.

    Block RAM exactly, LUTs and flip-flops as `picture_usage`.
    """
    if overlay is None:
        return Usage()
    characters = Memory("characters", _bits(overlay.codes - 1), 7, 1, rom=True)
    font = Memory("font", 11, 8, 1, rom=True)
    return usage_of_parts("text", {"text": 1}, [characters, font], family)


def stored_usage(stored: StoredLightField | None, family: Family = "spartan6") -> Usage:
    """Resources of the entity ``stored_light_field``; none without one."""
    if stored is None:
        return Usage()
    # Selecting a pixel's bit, about M * M to one, takes twice as many tables of four inputs.
    lut = 200 if family in ("spartan6", "series7", "cyclonev") else 430
    return Usage(lut=lut, flip_flops=80 + 2 * stored.word_bits, ramb16=stored.block_rams)
