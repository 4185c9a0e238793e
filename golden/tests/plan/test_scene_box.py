# SPDX-License-Identifier: Apache-2.0
"""Boxes of scenes: what they resolve, the noise that they leave, and which one is chosen."""

import json
from fractions import Fraction
from math import gcd
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir
from written_scenes import BASE, scene, write

from plenofir.ground.errors import InputError
from plenofir.plan import make_plan
from plenofir.plan.planner import compared_boxes
from plenofir.plan.scene_box import quality, with_wishes
from plenofir.refocus import refocus
from plenofir.refocus.operator import interpolated_sums
from plenofir_studies.box_report import half_contrast
from plenofir_studies.resolution import aligned_model

RANGE = "near_mm = 800.0\nfar_mm = inf"


@pytest.mark.parametrize(("m", "shift", "box", "units"), [(7, 3, 2, 0), (5, 6, 5, 4)])
def test_resolution_is_that_of_a_rendered_edge(m: int, shift: int, box: int, units: int) -> None:
    measured = half_contrast(
        m,
        shift,
        lambda raw, m, k: refocus(raw, m, Fraction(k, m), box=box, sharpen=Fraction(units, 64)),
    )
    assert quality(m, shift, box, 0, units, aligned_model(m)).half_contrast == pytest.approx(
        measured, abs=0.01
    )


def test_noise_is_the_sum_of_squared_weights() -> None:
    seed = int(np.random.SeedSequence().entropy) % 2**32
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    for _ in range(12):
        m, order = int(random.integers(2, 9)), int(random.integers(0, 3))
        shift = int(random.integers(-m, m + 1))
        common = gcd(shift, m)
        box = common * int(random.integers(1, m // common + 1))
        reach = m * (abs(shift) + order + 4)
        impulses = np.eye(2 * reach + m, dtype=np.int64)
        sums = interpolated_sums(impulses, m, shift, axis=0, order=order, box=box)
        weights = sums[reach : reach + m] / box ** (1 + order)
        # The mean over the outputs of a micro image, in both dimensions.
        left = (weights**2).sum(axis=1).mean()
        assert quality(m, shift, box, order, 0, None).noise == pytest.approx(left), (m, shift, box)


def test_the_box_follows_resolution_and_noise(tmp_path: Path) -> None:
    loaded = scene(tmp_path, (RANGE, 'slices = ["2/5", "1/5", "0"]'))
    plan = make_plan(loaded)
    assert [part.box for part in plan.slices] == [5, 5, 5]
    resolved = make_plan(with_wishes(loaded, resolution=0.55))
    assert resolved.core.slice_boxes == (3, 3, 5)
    for part, box in zip(resolved.slices, (4, 4, None), strict=True):
        assert box is None or part.half_contrast >= 0.55
        assert box is None or quality(5, part.shift, box, 0, 0, loaded.model()).half_contrast < 0.55
    (note,) = (text for text in resolved.notes if "resolves" in text)
    assert note.startswith("a = 0 resolves 0.4")
    assert note.endswith("views meet in groups of 5")
    quiet = make_plan(with_wishes(loaded, noise=0.3))
    assert quiet.core.slice_boxes == (4, 4, 5)
    assert make_plan(with_wishes(loaded, noise=0.2)).core.boxes == ()
    # Of the boxes that are as quiet the largest one that resolves enough.
    assert make_plan(with_wishes(loaded, noise=0.5, resolution=0.55)).core == resolved.core
    for wishes, problem in (
        ({"resolution": 0.7}, r"build\.resolution: no box resolves 0\.7 .* 0\.\d+ at most"),
        ({"noise": 0.1}, r"build\.noise: no box leaves 0\.1 of the noise: all 5 .* leave 0\.200"),
        ({"noise": 0.3, "resolution": 0.55}, r"need 3 samples or fewer, .* 0\.333 .* needs 4 or"),
        ({"noise": -1.0}, r"build: noise = -1\.0 should be greater than 0"),
    ):
        with pytest.raises(InputError, match=problem):
            make_plan(with_wishes(loaded, **wishes))


def test_stored_products_have_one_box(tmp_path: Path) -> None:
    slices = (RANGE, 'slices = ["2/5", "1/5"]')
    exact, stored = (
        make_plan(scene(tmp_path, slices, build=f'arithmetic = "{kind}"\nresolution = 0.56\n')).core
        for kind in ("exact", "stored")
    )
    assert exact.slice_boxes == (3, 2)
    assert stored.slice_boxes == (2, 2)


def test_depths_of_field_are_those_of_the_box(tmp_path: Path) -> None:
    loaded = scene(tmp_path)
    plan = make_plan(loaded)
    assert not plan.gaps_mm
    boxed = make_plan(with_wishes(loaded, resolution=0.55))
    assert boxed.core.shifts == plan.core.shifts
    assert boxed.gaps_mm
    for part, wide in zip(boxed.slices, plan.slices, strict=True):
        assert part.near_mm is not None
        assert wide.near_mm is not None
        assert (part.near_mm > wide.near_mm) == (part.box < wide.box)


def test_boxes_are_compared(tmp_path: Path) -> None:
    loaded = scene(tmp_path, (RANGE, 'slices = ["3/5", "-1/5"]'))
    plan = make_plan(loaded)
    compared = dict(compared_boxes(loaded, plan))
    assert list(compared) == [1, 2, 3, 4, 5]
    assert compared[5] == plan
    for box, other in compared.items():
        assert not isinstance(other, InputError)
        assert other == make_plan(with_wishes(loaded, box=box))
    file = str(write(tmp_path, BASE, (RANGE, 'slices = ["3/5", "1"]')))
    done = plenofir("plan", file, "--boxes", "--resolution", "0.5", "--json")
    content = json.loads(done.stdout)
    assert [part["box"] for part in content["slices"]] == [3, 5]
    assert [row["box"] for row in content["boxes"]] == [1, 2, 3, 4, 5]
    assert content["boxes"][2]["needs"] == content["needs"]
    text = plenofir("plan", file, "--boxes", "--noise", "0.5").stdout
    assert "box of 2: half contrast at 0." in text
    assert "*2 │" in text
    wrong = plenofir("plan", file, "--noise", "nan")
    assert wrong.returncode == 2
    assert wrong.stderr.count("\n") == 1
    assert "noise" in wrong.stderr
