# SPDX-License-Identifier: Apache-2.0
"""Arrays of other libraries: equal to the reference, and never copied to the host's memory."""

from fractions import Fraction
from math import gcd

import array_api_strict
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_refocus import random_image

from plenofir.ground.errors import InputError
from plenofir.refocus import ExactArithmetic, refocus


@settings(max_examples=60)
@given(data=st.data())
def test_array_api_equals_the_reference(data):
    m, shift = data.draw(st.integers(1, 9)), data.draw(st.integers(-20, 25))
    order = data.draw(st.sampled_from([0, 0, 1, 2]))
    align = data.draw(st.sampled_from(["centred", "causal"]))
    dtype = data.draw(st.sampled_from([np.uint8, np.uint16]))
    shape = tuple(m + data.draw(st.integers(0, 30)) for _ in range(2))
    raw = random_image(shape + data.draw(st.sampled_from([(), (3,)])), dtype)
    region = tuple(slice(*sorted(data.draw(st.tuples(*[st.integers(0, 40)] * 2)))) for _ in "yx")
    sharpen = data.draw(st.sampled_from(["off", "auto", Fraction(5, 64)]))
    border = data.draw(st.sampled_from(["zero", "normalise"]))
    common = gcd(shift, m)
    box = common * data.draw(st.integers(1, m // common))
    image = refocus(
        array_api_strict.asarray(raw),
        m,
        Fraction(shift, m),
        align=align,
        interpolation=order,
        region=region,
        sharpen=sharpen,
        border=border,
        box=box,
    )
    options = {"align": align, "order": order, "sharpen": sharpen, "border": border, "box": box}
    want = ExactArithmetic().refocus(raw, m, shift=shift, **options)[region]
    assert image.dtype == getattr(array_api_strict, dtype.__name__)
    assert np.array_equal(np.asarray(image), want)


@given(st.integers(1, 7), st.integers(-3, 4))
def test_array_api_pixel_for_each_micro_lens(m, a):
    raw = random_image((6 * m + 1, 5 * m + 1), np.uint8)
    image = refocus(array_api_strict.asarray(raw), m, a, upsample=False)
    assert np.array_equal(np.asarray(image), refocus(raw, m, a, upsample=False))


def test_bad_arrays():
    with pytest.raises(InputError, match="float64"):
        refocus(array_api_strict.zeros((9, 9)), 3, 1)
    with pytest.raises(InputError, match="list"):
        refocus([[1, 2], [3, 4]], 1, 1)  # type: ignore[arg-type]
    image = array_api_strict.zeros((9, 9), dtype=array_api_strict.uint8)
    with pytest.raises(InputError, match=r"^out: "):
        refocus(image, 3, 1, out=np.zeros((9, 9), np.uint8))


def on_gpu(library):
    """Function that puts an array on a GPU, or skip the test."""
    if library == "cupy":
        cupy = pytest.importorskip("cupy", exc_type=ImportError)
        try:
            cupy.cuda.runtime.getDeviceCount()
        except cupy.cuda.runtime.CUDARuntimeError:
            pytest.skip("no GPU")
        return cupy.asarray, cupy.asnumpy
    torch = pytest.importorskip("torch", exc_type=ImportError)
    if not torch.cuda.is_available():
        pytest.skip("no GPU")
    return (lambda x: torch.from_numpy(x).cuda()), (lambda x: x.cpu().numpy())


@pytest.mark.parametrize("library", ["cupy", "torch"])
@pytest.mark.parametrize(("m", "shift", "order"), [(5, -3, 0), (11, 7, 0), (4, 6, 0), (5, 2, 2)])
def test_gpu_equals_the_reference(library, m, shift, order):
    put, get = on_gpu(library)
    for shape, dtype in (((203, 305), np.uint8), ((100, 120, 3), np.uint16)):
        raw = random_image(shape, dtype)
        image = refocus(put(raw), m, Fraction(shift, m), interpolation=order)
        assert type(image) is type(put(raw))
        want = ExactArithmetic().refocus(raw, m, shift=shift, order=order)
        assert np.array_equal(get(image), want)
