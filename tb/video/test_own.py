# SPDX-License-Identifier: Apache-2.0
"""Pictures without a source, and the black sides of a picture."""

import random

import numpy as np
import pytest

from plenofir.fpga.screen.chip_light_field import STORED_PACKAGE, store, stored_package
from plenofir_tb.runner import Case, draw_seed, run_cases


def stored_case(m: int, lenses: tuple[int, int], mode: dict[str, int]) -> Case:
    """A random light field, smaller or larger than the frame."""
    seed = draw_seed()
    print(f"seed {seed}")
    rows, columns = (extent * m for extent in lenses)
    raw = np.random.default_rng(seed).integers(0, 256, (rows, columns, 3), np.uint8)
    light_field = store(raw, m)
    return Case(
        "stored_light_field",
        "video.own_bench",
        {
            "MICRO_IMAGE_SIZE": m,
            "FRAME_COLUMNS": mode["h_active"],
            "FRAME_ROWS": mode["v_active"],
        },
        {
            "entity": "stored_light_field",
            "micro_image_size": m,
            "raster": light_field.raster().tolist(),
            "mode": mode,
        },
        {STORED_PACKAGE: stored_package(light_field)},
    )


def test_stored_light_field() -> None:
    run_cases([stored_case(3, (4, 5), {"h_active": 26, "v_active": 19})])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("m", "lenses", "mode"),
    [
        (5, (3, 2), {"h_active": 10, "v_active": 15}),
        (2, (9, 8), {"h_active": 11, "v_active": 7}),
        (1, (1, 1), {"h_active": 4, "v_active": 3}),
    ],
    ids=["fills", "larger", "one"],
)
def test_sizes_of_stored_light_fields(
    m: int, lenses: tuple[int, int], mode: dict[str, int]
) -> None:
    run_cases([stored_case(m, lenses, mode)])


def test_black_sides() -> None:
    sides = [3, random.Random(draw_seed()).randrange(4, 20)]
    run_cases(
        [
            Case(
                "black_sides",
                "video.own_bench",
                {"COLUMNS": side},
                {"entity": "black_sides", "columns": side},
            )
            for side in sides
        ]
    )
