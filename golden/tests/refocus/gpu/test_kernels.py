# SPDX-License-Identifier: Apache-2.0
"""The GPU's refocuser: its kernel on the processor, its compiler where it is, its failures."""

import secrets
import sys
from dataclasses import replace
from fractions import Fraction
from math import gcd
from weakref import ref

import array_api_strict
import numpy as np
import pytest
from kernels_on_cpu import beside_protected, compiled_kernels

from plenofir.ground.errors import InputError
from plenofir.refocus import ExactArithmetic, arrays, refocus, refocus_stack, sharpest_slices
from plenofir.refocus import settings as user_settings
from plenofir.refocus.border import arrived
from plenofir.refocus.gpu import constants, program
from plenofir.refocus.gpu.constants import run_steps, source, tiles_of
from plenofir.refocus.sharpness import local_sharpness, slice_weight
from plenofir.refocus.slices import Slice

SHAPE = (37, 45)


def slice_of(m, shift, box=None, channels=1, pixel_bits=8, shape=SHAPE, **options):
    """A slice of a whole picture."""
    shape = shape if channels == 1 else (*shape, channels)
    step = 1 if options.get("upsample", True) else m
    region = tuple(range(length // step) for length in shape[:2])
    return Slice(shape, pixel_bits, m, shift, region, box_samples=box, **options)


# Every option, and memory from a row of a line to whole lines with zeros around them.
KINDS = [
    (slice_of(5, 3), 6_000),
    (slice_of(4, 6, None, 3, 16, units=4, normalise=True), 9_000),
    (slice_of(3, 3, align="causal", upsample=False), 2_000),
    (slice_of(7, -9, 3, order=1, units=2), 12_000),
    (slice_of(6, 4, 2, 3, align="causal", order=2, normalise=True), 9_000),
    (slice_of(11, 7, pixel_bits=16), 60_000),
    (slice_of(1, 1, units=16), 3_000),
    (slice_of(34, 9), 20_000),
    # A weight of more than 33 bits.
    (slice_of(9, 4, order=3, units=4), 20_000),
    # Four columns and two rows at once, where views meet; four columns alone.
    (slice_of(4, 6, channels=3), 20_000),
    (slice_of(16, -7, order=1, normalise=True), 20_000),
    # Tiles and segments that reach no border, sharpened in words and not, and linear.
    (slice_of(3, 2, units=12, shape=(42, 199)), 14_000),
    (slice_of(3, 2, pixel_bits=16, units=12, shape=(42, 199)), 14_000),
    (slice_of(3, 2, order=1, shape=(42, 199)), 10_000),
]


def drawn_kind(rng):
    m, shift = int(rng.integers(1, 10)), int(rng.integers(-20, 25))
    common = gcd(shift, m)
    box = int(rng.choice([m, common * int(rng.integers(1, m // common + 1))]))
    kind = slice_of(
        m,
        shift,
        box,
        int(rng.choice([1, 3])),
        int(rng.choice([8, 16])),
        align=str(rng.choice(["centred", "causal"])),
        order=int(rng.integers(0, 4)),
        units=int(rng.choice([0, 1, 5, 16])),
        normalise=bool(rng.integers(2)),
    )
    return kind, int(rng.integers(4_000, 60_000))


def tiled(kind, limit, rng):
    """A tile of few threads, unrolled or not whatever the lengths are."""
    (tile,) = tiles_of([kind], limit) or tiles_of([kind], 100_000)
    return replace(tile, threads=32, unrolled=bool(rng.integers(2)))


def by_kernel(run, kind, tile, raw, region):
    """The region of a picture by one of the kernels."""
    # Arrays begin and end at any byte, and what is beyond them is not touched.
    at_end = region[0].start == 0
    shape = len(region[0]), len(region[1]), *raw.shape[2:]
    out = beside_protected(np.full(shape, 77, raw.dtype), at_end)
    reached = [
        arrived(n, kind.micro_image_size, kind.shift, kind.order, kind.align, kind.box)
        for n in raw.shape[:2]
    ]
    weights = [np.ascontiguousarray(weight[:: kind.step], np.int64) for weight in reached]
    frame = beside_protected(raw, at_end)
    down, across, pixels, picture = (array.ctypes.data for array in (*weights, frame, out))
    ends = (end for part in region for end in (part.start, part.stop))
    numbers = (pixels, picture, down, across, 0, 0, *raw.shape[:2], *ends, 0)
    run(tile.blocks(1, region), tile.threads, tile.shared_bytes, numbers)
    return out


def reference(kind, raw):
    picture = ExactArithmetic().refocus(
        raw,
        kind.micro_image_size,
        shift=kind.shift,
        align=kind.align,
        order=kind.order,
        sharpen=Fraction(kind.units, 64),
        border="normalise" if kind.normalise else "zero",
        box=kind.box,
    )
    rows, columns = kind.result_shape[:2]
    return picture[:: kind.step, :: kind.step][:rows, :columns]


def pictures(kind, rng):
    """A raw picture of noise, and one that is white all over."""
    dtype = np.uint8 if kind.pixel_bits == 8 else np.uint16
    white = np.iinfo(dtype).max
    yield rng.integers(0, white, kind.shape, dtype, endpoint=True)
    yield np.full(kind.shape, white, dtype)


def test_kernels_equal_the_reference():
    seed = secrets.randbits(32)
    print("seed", seed)
    rng = np.random.default_rng(seed)
    kinds = [*KINDS, *(drawn_kind(rng) for _ in range(4))]
    tiles = [tiled(kind, limit, rng) for kind, limit in kinds]
    texts = [source([kind], [tile]) for (kind, _), tile in zip(kinds, tiles, strict=True)]
    kernels = zip(kinds, tiles, compiled_kernels(texts), strict=True)
    for (kind, _), tile, kernel in kernels:
        for raw in pictures(kind, rng):
            want = reference(kind, raw)
            for inner in (0, 1):
                rows, columns = (range(inner, n - inner) for n in want.shape[:2])
                got = by_kernel(kernel["refocus_tiles"], kind, tile, raw, (rows, columns))
                part = want[rows.start : rows.stop, columns.start : columns.stop]
                assert np.array_equal(got, part), (kind, tile)


def test_a_tile_may_end_at_the_frame_s_last_row():
    kind = slice_of(3, 1)
    tile = replace(tiled(kind, 9_000, np.random.default_rng(1)), rows=8)
    (kernel,) = compiled_kernels([source([kind], [tile])])
    for rows in range(16, 24):
        raw = np.full((rows, SHAPE[1]), 255, np.uint8)
        regions = range(rows), range(SHAPE[1])
        got = by_kernel(kernel["refocus_tiles"], kind, tile, raw, regions)
        assert np.array_equal(got, reference(replace(kind, shape=raw.shape, region=regions), raw))


@pytest.mark.parametrize(
    ("architecture", "kind"),
    [
        ("sm_80", slice_of(5, 3, shape=(500, 700))),
        ("sm_90", slice_of(6, 4, 2, 3, 16, (500, 700), order=1, units=2, normalise=True)),
    ],
)
def test_nvidia_s_compiler_takes_the_source(architecture, kind):
    core = pytest.importorskip("cuda.core")
    options = core.ProgramOptions(std="c++17", arch=architecture)
    slices = [kind, replace(kind, shift=5)] if kind.order == 0 else [kind]
    text = source(slices, tiles_of(slices, 48 * 1024))
    assert bytes(core.Program(text, "c++", options).compile("cubin").code)


@pytest.mark.parametrize(("m", "shift"), [(11, 33), (11, -3201), (1601, 1), (1601, 1601), (400, 7)])
@pytest.mark.parametrize("pixel_bits", [8, 16])
def test_any_lens_and_setting_have_a_tile(m, shift, pixel_bits):
    for channels in (1, 3):
        kind = slice_of(m, shift, m, channels, pixel_bits, (3201, 3201))
        (tile,) = tiles_of([kind], 99 * 1024)
        assert tile.shared_bytes >= 4 * run_steps(kind, tile.rows)
        assert tile.shared_bytes <= 99 * 1024
        assert tile.columns % tile.segment == 0


def test_arrays_are_refocused_where_they_lie(gpu_on_cpu):
    rng = np.random.default_rng(3)
    raw = rng.integers(0, 256, (*SHAPE, 3), np.uint8)
    kind = slice_of(5, 3, 3, 3, units=2, normalise=True)
    options = {"sharpen": Fraction(1, 32), "border": "normalise", "box": 3}
    part = slice(3, 30), slice(2, 40)
    out = array_api_strict.zeros((27, 38, 3), dtype=array_api_strict.uint8)
    on_gpu = array_api_strict.asarray(raw)
    got = refocus(on_gpu, 5, "3/5", region=part, out=out, **options)
    assert got is out
    assert np.array_equal(np.asarray(got), reference(kind, raw)[part])
    assert np.array_equal(np.asarray(refocus(on_gpu, 5, "3/5", **options)), reference(kind, raw))
    # A picture may take the place of the raw one.
    want = reference(kind, raw)
    assert refocus(on_gpu, 5, "3/5", out=on_gpu, **options) is on_gpu
    assert np.array_equal(np.asarray(on_gpu), want)
    assert gpu_on_cpu.launched == ["refocus_tiles"] * 3
    assert not gpu_on_cpu.told


@pytest.mark.parametrize(
    ("first", "second", "overlap"),
    [(0, 20, True), (20, 0, True), (0, SHAPE[0], False), (SHAPE[0], 0, False)],
)
def test_a_picture_may_overlap_the_raw_one(first, second, overlap, gpu_on_cpu, monkeypatch):
    empty, shapes = array_api_strict.empty, []

    def noted(shape, **how):
        shapes.append(shape)
        return empty(shape, **how)

    monkeypatch.setattr(array_api_strict, "empty", noted)
    options = {"sharpen": Fraction(1, 32), "border": "normalise", "box": 3}
    memory = np.random.default_rng(9).integers(0, 256, (2 * SHAPE[0], SHAPE[1], 3), np.uint8)
    want = refocus(memory[first : first + SHAPE[0]], 5, "3/5", **options)
    on_gpu = array_api_strict.asarray(memory)
    raw, out = (on_gpu[start : start + SHAPE[0], :, :] for start in (first, second))
    assert np.shares_memory(raw._array, on_gpu._array)
    assert refocus(raw, 5, "3/5", out=out, **options) is out
    assert np.array_equal(np.asarray(out), want)
    # Memory of its own is for pictures that overlap the raw one only.
    assert shapes == [want.shape] * overlap
    assert not gpu_on_cpu.told


@pytest.mark.parametrize("a", ["3/5", ["3/5"]])
def test_a_second_call_prepares_nothing_anew(a, gpu_on_cpu, monkeypatch):
    prepared = []

    def note(owner, name):
        step = getattr(owner, name)

        def noted(*given, **named):
            prepared.append(name)
            return step(*given, **named)

        monkeypatch.setattr(owner, name, noted)

    for cached in (user_settings._whole, user_settings._part, arrays._stacked):
        cached.cache_clear()
    note(user_settings, "check_raw")
    note(user_settings, "focus_to_shift")
    note(Slice, "__post_init__")
    note(arrays, "_weights")
    note(program, "tiles_of")
    note(sys.modules["cuda.core"], "LaunchConfig")
    steps = ["check_raw", "focus_to_shift", "__post_init__", "_weights", "tiles_of", "LaunchConfig"]
    options = {"sharpen": Fraction(1, 32), "border": "normalise", "box": 3}
    options["region"] = slice(3, 30), slice(2, 40)
    call = refocus if isinstance(a, str) else refocus_stack
    for number in range(2):
        raw = np.random.default_rng(number).integers(0, 256, (*SHAPE, 3), np.uint8)
        want = call(raw, 5, a, **options)
        on_gpu = array_api_strict.asarray(raw)
        out = array_api_strict.zeros(want.shape, dtype=array_api_strict.uint8)
        prepared.clear()
        assert np.array_equal(np.asarray(call(on_gpu, 5, a, out=out, **options)), want)
        assert set(prepared) == set(() if number else steps)
        # Arrays that a user drops leave the card's memory.
        kept = ref(on_gpu), ref(out)
        del on_gpu, out
        assert [each() for each in kept] == [None, None]
    assert not gpu_on_cpu.told


@pytest.mark.parametrize(
    ("shape", "options"),
    [
        (SHAPE, {"border": "normalise", "align": "causal"}),
        ((*SHAPE, 3), {"interpolation": 1, "region": (slice(5, 31), slice(7, 40))}),
    ],
)
def test_slices_of_one_read_equal_those_of_the_cpu(shape, options, gpu_on_cpu, monkeypatch):
    monkeypatch.setattr(program, "MOST_SLICES", 3)
    raw = np.random.default_rng(6).integers(0, 256, shape, np.uint8)
    settings = [Fraction(n, 5) for n in (-7, 0, 5, 3, 1)]
    want = refocus_stack(raw, 5, settings, **options)
    alone = [refocus(raw, 5, a, **options) for a in settings]
    assert np.array_equal(want, alone)
    on_gpu = array_api_strict.asarray(raw)
    assert np.array_equal(np.asarray(refocus_stack(on_gpu, 5, settings, **options)), want)
    assert gpu_on_cpu.launched == ["refocus_tiles"] * 2
    assert not gpu_on_cpu.told
    # Without the GPU's code the library's operations make it.
    monkeypatch.setattr(program, "run_tiles", lambda *_: False)
    out = array_api_strict.zeros(want.shape, dtype=array_api_strict.uint8)
    assert refocus_stack(on_gpu, 5, settings, out=out, **options) is out
    assert np.array_equal(np.asarray(out), want)


@pytest.mark.parametrize(
    ("m", "shape", "pixel_bits", "options"),
    [
        (4, (61, 58, 3), 16, {"between": True, "vote_radius": 2, "border": "normalise"}),
        (4, (43, 67), 8, {"radius": 2, "interpolation": 1}),
        # Lenses begin at any byte of a word, and tiles cut them.
        (5, (43, 67, 3), 8, {"radius": 2}),
    ],
)
def test_depth_without_slices_equals_that_of_the_cpu(
    m, shape, pixel_bits, options, gpu_on_cpu, monkeypatch
):
    monkeypatch.setattr(program, "MOST_SLICES", 3)
    options = dict(options)
    if m == 5:
        monkeypatch.setattr(constants, "_ROW_CHOICES", (16,))
    seed = secrets.randbits(32)
    print("seed", seed)
    rng = np.random.default_rng(seed)
    raw = rng.integers(0, 1 << pixel_bits, shape).astype(f"uint{pixel_bits}")
    # A half without texture, with a spot that votes.
    raw[:, : shape[1] // 2] = 90
    raw[27:31, 3:7] = 200
    settings = [Fraction(n, m) for n in (-3, 0, 1, 4, 6)]
    how = {name: options[name] for name in ("border", "interpolation") if name in options}
    sharpness = [
        local_sharpness(image, m, options.get("radius", 1))
        * (slice_weight(int(m * a), m) if "between" in options else 16)
        >> 4
        for image, a in zip(refocus_stack(raw, m, settings, **how), settings, strict=True)
    ]
    # Half of the lenses have texture.
    options["confidence"] = int(np.median(np.ptp(sharpness, axis=0)))
    want = sharpest_slices(raw, m, settings, **options)
    on_gpu = array_api_strict.asarray(raw)
    got = sharpest_slices(on_gpu, m, settings, **options)
    kernels = ["find_sharpest", *["vote", "fill"] * ("vote_radius" in options)]
    assert gpu_on_cpu.launched == ["refocus_tiles"] * 2 + kernels + ["refocus_tiles"] * 2
    # The noise of RGB lenses leaves two slices only in some draws.
    assert len(np.unique(want.index)) > (1 if m == 5 else 2)
    assert not np.all(want.textured)
    assert np.any(want.textured)
    monkeypatch.setattr(program, "run_tiles", lambda *_: False)
    by_library = sharpest_slices(on_gpu, m, settings, **options)
    for of_cpu, *others in zip(
        *(vars(each).values() for each in (want, got, by_library)), strict=True
    ):
        for other in others:
            assert (of_cpu is None) == (other is None)
            if of_cpu is not None:
                assert np.array_equal(np.asarray(other), of_cpu)
                assert np.asarray(other).dtype == of_cpu.dtype
    assert not gpu_on_cpu.told


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"region": (slice(1, 9), slice(1, 9))}, "region: depth is found in whole"),
        ({"upsample": False}, "upsample: depth is found in whole"),
        ({"radius": 9}, "radius of 9"),
        ({"between": True}, "going up or down"),
    ],
)
def test_depth_that_is_not_possible_is_refused(options, reason):
    with pytest.raises(InputError, match=reason):
        sharpest_slices(np.zeros(SHAPE, np.uint8), 5, [1, 0, 1], **options)


def test_a_stack_of_nothing_is_refused():
    with pytest.raises(InputError, match="no focus settings"):
        refocus_stack(np.zeros(SHAPE, np.uint8), 5, [])


def test_an_array_that_cannot_be_written_is_refused(gpu_on_cpu, monkeypatch):
    monkeypatch.setattr(program, "run_tiles", lambda *_: False)
    raw = array_api_strict.zeros(SHAPE, dtype=array_api_strict.uint8)
    out = array_api_strict.zeros(SHAPE, dtype=array_api_strict.uint8)
    out._array.flags.writeable = False
    with pytest.raises(InputError, match="out: cannot be written to"):
        refocus(raw, 5, "1/5", out=out)


def test_a_compiler_that_failed_is_not_asked_again(monkeypatch):
    asked = []

    def compiled(text, architecture):
        asked.append(text)
        raise RuntimeError("NVRTC_ERROR")

    monkeypatch.setattr(program, "_compiled", compiled)
    for _ in range(2):
        assert isinstance(program._code_or_failure("no code", "sm_0"), RuntimeError)
    assert asked == ["no code"]


@pytest.mark.parametrize(
    ("failure", "reason"),
    [
        (ModuleNotFoundError("No module named 'cuda'", name="cuda.core"), "'plenofir[gpu]'"),
        (AttributeError("no row_stack"), "no row_stack"),
        (RuntimeError("NVRTC_ERROR: sm_999\nmore lines"), "NVRTC_ERROR: sm_999)"),
        (MemoryError(), "MemoryError"),
    ],
)
def test_a_failing_gpu_is_told_once_and_the_picture_is_right(
    failure, reason, gpu_on_cpu, monkeypatch
):
    def run_tiles(*_):
        raise failure

    monkeypatch.setattr(program, "run_tiles", run_tiles)
    raw = np.random.default_rng(4).integers(0, 256, SHAPE, np.uint8)
    for _ in range(2):
        image = refocus(array_api_strict.asarray(raw), 5, "1/5", border="normalise")
        assert np.array_equal(np.asarray(image), refocus(raw, 5, "1/5", border="normalise"))
    (line,) = gpu_on_cpu.told
    assert reason in line


def test_a_gpu_with_too_little_memory_leaves_it_to_the_library(gpu_on_cpu, monkeypatch):
    monkeypatch.setattr(program, "run_tiles", lambda *_: False)
    raw = np.random.default_rng(5).integers(0, 256, SHAPE, np.uint8)
    image = refocus(array_api_strict.asarray(raw), 4, "1/2", box=2)
    assert np.array_equal(np.asarray(image), refocus(raw, 4, "1/2", box=2))
    assert not gpu_on_cpu.told
