# SPDX-License-Identifier: Apache-2.0
"""The GPU's refocuser: its kernel on the processor, its compiler where it is, its failures."""

import secrets
from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction
from math import gcd

import array_api_strict
import numpy as np
import pytest
from kernels_on_cpu import KernelsOnCpu

from plenofir.ground import compiling
from plenofir.ground.errors import InputError
from plenofir.refocus import ExactArithmetic, arrays, refocus
from plenofir.refocus.gpu import program
from plenofir.refocus.gpu.constants import run_steps, source, tile_of
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


def tiled(kinds, rng):
    """Slices with tiles of few threads, unrolled or not whatever the lengths are."""
    for kind, limit in kinds:
        tile = tile_of(kind, limit) or tile_of(kind, 100_000)
        yield kind, replace(tile, threads=32, unrolled=bool(rng.integers(2)))


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


def test_kernels_equal_the_reference(tmp_path):
    seed = secrets.randbits(32)
    print("seed", seed)
    rng = np.random.default_rng(seed)
    kinds = [*KINDS, *(drawn_kind(rng) for _ in range(4))]
    kernels = KernelsOnCpu(tmp_path, list(tiled(kinds, rng)))
    for number, (kind, tile) in enumerate(kernels.kinds):
        for raw in pictures(kind, rng):
            want = reference(kind, raw)
            for inner in (0, 1):
                rows, columns = (range(inner, n - inner) for n in want.shape[:2])
                got = kernels.refocus(number, raw, (rows, columns))
                part = want[rows.start : rows.stop, columns.start : columns.stop]
                assert np.array_equal(got, part), (kind, tile)


@pytest.mark.parametrize("architecture", ["sm_80", "sm_90"])
def test_nvidia_s_compiler_takes_the_source(architecture):
    core = pytest.importorskip("cuda.core")
    options = core.ProgramOptions(std="c++17", arch=architecture)
    shape = 500, 700
    for kind in (
        slice_of(5, 3, shape=shape),
        slice_of(6, 4, 2, 3, 16, shape, order=1, units=2, normalise=True),
    ):
        text = source(kind, tile_of(kind, 48 * 1024))
        assert bytes(core.Program(text, "c++", options).compile("cubin").code)


@pytest.mark.parametrize(("m", "shift"), [(11, 33), (11, -3201), (1601, 1), (1601, 1601), (400, 7)])
@pytest.mark.parametrize("pixel_bits", [8, 16])
def test_any_lens_and_setting_have_a_tile(m, shift, pixel_bits):
    for channels in (1, 3):
        kind = slice_of(m, shift, m, channels, pixel_bits, (3201, 3201))
        tile = tile_of(kind, 99 * 1024)
        assert tile is not None
        assert tile.shared_bytes + 4 * run_steps(kind, tile.rows) <= 99 * 1024
        assert tile.columns % tile.segment == 0


@pytest.fixture
def pretended_gpu(monkeypatch):
    """Arrays of array-api-strict, as if they lay on a GPU; what the user is told."""
    told = []
    monkeypatch.setattr(compiling, "tell", told.append)
    monkeypatch.setattr(compiling, "_announced", set())
    there = arrays._Gpu(0, nullcontext(), lambda: 0)
    monkeypatch.setattr(arrays, "_gpu_of", lambda xp, array: there)
    monkeypatch.setattr(arrays, "_contiguous", lambda xp, array: array)
    monkeypatch.setattr(arrays, "_address", lambda array: array._array.ctypes.data)
    return told


def test_arrays_are_refocused_where_they_lie(tmp_path, pretended_gpu, monkeypatch):
    rng = np.random.default_rng(3)
    raw = rng.integers(0, 256, (*SHAPE, 3), np.uint8)
    kind = slice_of(5, 3, 3, 3, units=2, normalise=True)
    kernels = KernelsOnCpu(tmp_path, list(tiled([(kind, 20_000)], rng)))
    slices = []

    def refocus_at(slice_, addresses, stream, device):
        slices.append(slice_)
        kernels.start(0, addresses, slice_.shape, slice_.region)
        return True

    monkeypatch.setattr(program, "refocus_at", refocus_at)
    options = {"sharpen": Fraction(1, 32), "border": "normalise", "box": 3}
    part = slice(3, 30), slice(2, 40)
    out = array_api_strict.zeros((27, 38, 3), dtype=array_api_strict.uint8)
    on_gpu = array_api_strict.asarray(raw)
    got = refocus(on_gpu, 5, "3/5", region=part, out=out, **options)
    assert got is out
    assert np.array_equal(np.asarray(got), reference(kind, raw)[part])
    assert np.array_equal(np.asarray(refocus(on_gpu, 5, "3/5", **options)), reference(kind, raw))
    assert slices == [replace(kind, region=(range(3, 30), range(2, 40))), kind]
    # A picture may take the place of the raw one.
    want = reference(kind, raw)
    assert refocus(on_gpu, 5, "3/5", out=on_gpu, **options) is on_gpu
    assert np.array_equal(np.asarray(on_gpu), want)
    assert not pretended_gpu


def test_an_array_that_cannot_be_written_is_refused(pretended_gpu, monkeypatch):
    monkeypatch.setattr(program, "refocus_at", lambda *_: False)
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
    failure, reason, pretended_gpu, monkeypatch
):
    def refocus_at(*_):
        raise failure

    monkeypatch.setattr(program, "refocus_at", refocus_at)
    raw = np.random.default_rng(4).integers(0, 256, SHAPE, np.uint8)
    for _ in range(2):
        image = refocus(array_api_strict.asarray(raw), 5, "1/5", border="normalise")
        assert np.array_equal(np.asarray(image), refocus(raw, 5, "1/5", border="normalise"))
    (line,) = pretended_gpu
    assert reason in line


def test_a_gpu_with_too_little_memory_leaves_it_to_the_library(pretended_gpu, monkeypatch):
    monkeypatch.setattr(program, "refocus_at", lambda *_: False)
    raw = np.random.default_rng(5).integers(0, 256, SHAPE, np.uint8)
    image = refocus(array_api_strict.asarray(raw), 4, "1/2", box=2)
    assert np.array_equal(np.asarray(image), refocus(raw, 4, "1/2", box=2))
    assert not pretended_gpu
