# SPDX-License-Identifier: Apache-2.0
"""Pictures before the compiled code is there: equal to the bit, and nobody waits for a compiler."""

import os
import random
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from math import gcd
from threading import current_thread
from typing import Any

import numpy as np
import pytest
from test_refocus import random_image

from plenofir.ground import compiling
from plenofir.refocus import Aperture, best_picture, compiled, first_calls, pictures, refocus
from plenofir.refocus.compiled import compiled_refocus, picture_lines
from plenofir.refocus.compiled.picture_lines import views_of_lines
from plenofir.refocus.operator import clamped_shift
from plenofir.refocus.plain import plain_refocus
from plenofir.refocus.slices import Slice


def test_plain_equals_compiled() -> None:
    seed = random.randrange(1 << 30)
    print("seed", seed)
    draw = random.Random(seed)
    for _ in range(80):
        m, order = draw.randint(1, 9), draw.choice([0, 0, 1, 2, 3])
        shape = (draw.randint(1, 50), draw.randint(1, 50), *draw.choice([(), (1,), (3,)]))
        shift = clamped_shift(m, draw.randint(-20, 25), shape)
        units, common = draw.choice([0, 0, 3, 4, 16]), gcd(shift, m)
        upsample = bool(order or units or shift % m) or draw.random() < 0.5
        lengths = [n if upsample else n // m for n in shape[:2]]
        bounds = [sorted((draw.randint(0, n), draw.randint(0, n))) for n in lengths]
        dtype = draw.choice([np.uint8, np.uint16])
        region = tuple(
            draw.choice([range(n), range(*part)]) for n, part in zip(lengths, bounds, strict=True)
        )
        options = {
            "align": draw.choice(["centred", "causal"]),
            "order": order,
            "units": units,
            "upsample": upsample,
            "normalise": draw.random() < 0.5,
            "box_samples": common * draw.randint(1, m // common),
        }
        raw = random_image(shape, dtype)
        case = Slice(shape, 8 * raw.itemsize, m, shift, region, **options)
        plain, fast = (work(raw, case) for work in (plain_refocus, compiled_refocus))
        assert plain.dtype == fast.dtype, case
        assert np.array_equal(plain, fast), case


@pytest.fixture
def loops(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Lets pictures be made by the loops of a name."""

    def choose(name: str) -> None:
        monkeypatch.setattr(
            pictures,
            "soonest",
            lambda _, __, code, numpy: {"code": code, "numpy": numpy}[name](),
        )

    return choose


def test_plain_pictures_equal_compiled_ones(loops: Callable[[str], None]) -> None:
    seed = random.randrange(1 << 30)
    print("seed", seed)
    draw = random.Random(seed)
    for _ in range(60):
        m = draw.randint(1, 9)
        shape = (draw.randint(m, 150), draw.randint(m, 50), *draw.choice([(), (3,)]))
        raw = random_image(shape, draw.choice([np.uint8, np.uint16]))
        a = draw.choice([Fraction(draw.randint(-20, 30), m), draw.uniform(-3, 4)])
        bounds = [sorted((draw.randint(0, n), draw.randint(0, n))) for n in shape[:2]]
        options = {"region": draw.choice([None, tuple(slice(*part) for part in bounds)])}
        if draw.random() < 0.5:
            options["border"] = draw.choice(["normalise", "zero"])
            options["box"] = draw.choice([None, draw.randint(1, m)])
        else:
            places = draw.uniform(0, 1.2), draw.uniform(-1, 1), draw.uniform(-1, 1)
            options["aperture"] = draw.choice([None, Aperture(*places)])
            options["tilt"] = draw.choice([(0.0, 0.0), (draw.uniform(-1, 1), draw.uniform(-2, 2))])
        made = []
        for name in ("numpy", "code"):
            loops(name)
            made.append(best_picture(raw, m, a, **options))
        assert made[0].dtype == made[1].dtype
        assert np.array_equal(*made), (m, shape, raw.dtype, a, options)


def test_plain_in_many_bands() -> None:
    raw = random_image((1300, 40), np.uint16)
    out = np.empty_like(raw)
    case = Slice(raw.shape, 16, 5, 3, (range(1300), range(40)), units=4, order=1)
    assert plain_refocus(raw, case, out=out, threads=2) is out
    assert np.array_equal(out, compiled_refocus(raw, case))


class SlowCompiler:
    """In the place of the fast refocuser: its code is missing until `go`."""

    def __init__(self) -> None:
        self.go, self.calls = threading.Event(), 0

    def instead(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def slow(*arguments, **options):
            if not self.calls:
                compiling.begin("loops")
                self.go.wait()
                compiling.end("loops")
            self.calls += 1
            return work(*arguments, **options)

        return slow


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowCompiler]:
    compiler = SlowCompiler()
    monkeypatch.setattr(compiled, "compiled_refocus", compiler.instead(compiled_refocus))
    monkeypatch.setattr(first_calls, "patient", False)
    monkeypatch.setattr(first_calls, "_jobs", {})
    monkeypatch.setattr(first_calls, "_LOADING_SECONDS", 60)
    yield compiler
    compiler.go.set()
    first_calls.wait_for_compilers()


LOOPS: list[Any] = [getattr(picture_lines, name) for name in pictures.PictureLoops._fields[1:]]
RAW = random_image((50, 40), np.uint8)
WANTED = compiled_refocus(RAW, Slice(RAW.shape, 8, 5, 2, (range(50), range(40))))


def test_pictures_while_loops_compile(slow: SlowCompiler) -> None:
    for _ in range(3):
        assert np.array_equal(refocus(RAW, 5, "2/5"), WANTED)
    assert slow.calls == 0
    # Of another kind: its code waits behind that of the first.
    assert np.array_equal(
        refocus(RAW, 5, Fraction(2, 5), border="normalise")[20:30, 20], WANTED[20:30, 20]
    )
    slow.go.set()
    assert first_calls.wait_for_compilers()
    assert np.array_equal(refocus(RAW, 5, "2/5"), WANTED)
    # One of the thread, one of the caller.
    assert slow.calls == 2
    assert not first_calls.wait_for_compilers()


# A whole shift and one between, of odd M and of even M, and views.
KINDS: list[tuple[int, Any, dict[str, Any]]] = [
    (5, 1, {}),
    (5, 0.33, {}),
    (4, 1, {}),
    (4, "1/4", {}),
    (5, "1/5", {"box": 2}),
    (5, 1, {"aperture": Aperture(0.5)}),
    (5, 1, {"tilt": (0.2, 0.0)}),
]


@pytest.mark.parametrize(("m", "a", "options"), KINDS)
def test_pictures_to_look_at_while_loops_compile(
    slow: SlowCompiler, monkeypatch: pytest.MonkeyPatch, m: int, a: Any, options: dict[str, Any]
) -> None:
    compilers: set[str] = set()
    monkeypatch.setattr(
        compiling, "begins", [*compiling.begins, lambda: compilers.add(current_thread().name)]
    )
    raw = random_image((50, 40, 3), np.uint8)
    if {"aperture", "tilt"} & set(options):
        # They take no slices, so their own loop is the one that is missing.
        monkeypatch.setattr(picture_lines, "views_of_lines", slow.instead(views_of_lines))
    early = best_picture(raw, m, a, **options)
    assert slow.calls == 0
    slow.go.set()
    assert first_calls.wait_for_compilers()
    calls = slow.calls
    variants = [len(loop.signatures) for loop in LOOPS]
    assert np.array_equal(best_picture(raw, m, a, **options), early)
    assert slow.calls > calls
    # Whatever the picture takes was compiled in the thread.
    assert [len(loop.signatures) for loop in LOOPS] == variants
    assert compilers <= {"compiles refocusing_0"}


def test_large_pictures_of_views_wait_for_compiled_code(monkeypatch, loops) -> None:
    """NumPy would take longer than the compiler."""
    loops("numpy")
    raw = random_image((50, 40), np.uint8)
    early = best_picture(raw, 5, 1, tilt=(0.1, 0.0))
    monkeypatch.setattr(pictures, "_numpy_loops", None)
    monkeypatch.setattr(pictures, "_SAMPLES_FOR_NUMPY", 25 * 50 * 40 - 1)
    assert np.array_equal(best_picture(raw, 5, 1, tilt=(0.1, 0.0)), early)
    # Slices take NumPy less time, however large they are.
    with pytest.raises(TypeError):
        best_picture(raw, 5, 1)


def test_threads_share_one_compiler(slow: SlowCompiler) -> None:
    pictures: list[np.ndarray] = []
    threads = [
        threading.Thread(target=lambda: pictures.append(refocus(RAW, 5, "2/5"))) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [np.array_equal(picture, WANTED) for picture in pictures] == [True] * 4
    assert len(first_calls._jobs) == 1


def test_who_wants_compiled_code_waits_for_it(slow: SlowCompiler, monkeypatch) -> None:
    monkeypatch.setattr(first_calls, "patient", True)
    threading.Timer(0.1, slow.go.set).start()
    assert np.array_equal(refocus(RAW, 5, "2/5"), WANTED)
    assert slow.calls == 2


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_fork_while_loops_compile(slow: SlowCompiler) -> None:
    """The child has the compiler's locks, and nobody who opens them: it keeps to NumPy."""
    refocus(RAW, 5, "2/5")
    child = os.fork()
    if child == 0:
        kinds = refocus(RAW, 5, "2/5"), refocus(RAW.astype(np.uint16), 5, "2/5")
        equal = all(np.array_equal(kind, WANTED) for kind in kinds)
        os._exit(not (equal and not first_calls._jobs))
    assert os.waitpid(child, 0)[1] == 0


def test_the_end_of_a_process_waits(tmp_path) -> None:
    code = f"""
import time, numpy as np
from plenofir.ground import compiling
from plenofir.refocus import refocus, compiled
def slow(*arguments, **options):
    compiling.begin("loops")
    time.sleep(0.5)
    open({str(tmp_path / "kept")!r}, "w").close()
compiled.compiled_refocus = slow
assert refocus(np.ones((9, 9), np.uint8), 3, 0).all()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "kept").exists()


def test_what_hinders_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(compiling, "tell", told.append)
    monkeypatch.setattr(compiling, "_announced", set())
    for kind in ("damaged", "unkept", "damaged"):
        compiling.hindered(kind, kind)
    assert told == ["damaged", "unkept"]


@pytest.mark.parametrize(("seconds", "lines"), [(0.0, 1), (5.0, 0)])
def test_long_compilations_are_told(monkeypatch, seconds: float, lines: int) -> None:
    told: list[str] = []
    monkeypatch.setattr(compiling, "begins", [])
    compiling.tell_of_long_ones(seconds, told.append)
    for name in ("one", "other"):
        compiling.begin(name)
        time.sleep(0.1)
    for name in ("other", "one"):
        compiling.end(name)
    assert len(told) == lines
    assert compiling.compiled_now == []


def test_little_is_loaded() -> None:
    code = "import sys, plenofir.refocus; print(*{name.split('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numba", "llvmlite", "scipy", "PIL", "matplotlib"} & set(done.stdout.split())
