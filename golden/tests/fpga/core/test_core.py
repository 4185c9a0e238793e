# SPDX-License-Identifier: Apache-2.0
"""Limits of the core, which are the same in Python and VHDL."""

import re

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.core import configuration as core
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import PARTIAL_SUM_LOOP
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.refocus import MAX_INTERPOLATION_ORDER, StoredProductArithmetic


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"micro_image_size": 129, "shifts": (0,), "max_columns": 200}, "limit of 128"),
        ({"micro_image_size": 5, "shifts": (1,), "max_columns": 8193}, "limit of 8192 columns"),
        ({"micro_image_size": 5, "shifts": (200,), "max_columns": 100}, "801 taps"),
        ({"micro_image_size": 1, "shifts": (5000,), "max_columns": 100}, "a' = 5000"),
        (
            {"micro_image_size": 11, "shifts": (48,), "max_columns": 8000, "channels": 3},
            "Mbit of line buffers",
        ),
        ({"micro_image_size": 1, "shifts": (0,) * 257, "max_columns": 8}, "set of 257"),
        (
            {
                "micro_image_size": 3,
                "shifts": (0,),
                "max_columns": 99,
                "engine": FirEngine(parallel_rows=65),
            },
            "limit of 64",
        ),
        ({"micro_image_size": 11, "shifts": (0,), "max_columns": 99, "order": 3}, "sum of 36 bits"),
        (
            {
                "micro_image_size": 3,
                "shifts": (0, 1),
                "max_columns": 99,
                "engine": FirEngine(hold=True),
            },
            "integer a",
        ),
    ],
)
def test_limits_are_named(fields, message):
    with pytest.raises(InputError, match=message) as caught:
        CoreConfiguration(**fields).check_limits()
    assert "\n" not in str(caught.value)


def test_wide_stored_products_are_refused():
    configuration = CoreConfiguration(
        micro_image_size=3,
        shifts=(1,),
        max_columns=64,
        pixel_bits=16,
        arithmetic=StoredProductArithmetic(fraction_bits=8, guard_bits=2),
    )
    with pytest.raises(InputError, match=r"2\^18 words"):
        configuration.check_limits()


def test_stored_products_that_are_all_zero_are_refused():
    stored = StoredProductArithmetic(fraction_bits=1, guard_bits=0)
    configuration = CoreConfiguration(
        micro_image_size=5, shifts=(1,), max_columns=64, pixel_bits=1, arithmetic=stored
    )
    with pytest.raises(InputError, match="would be 0"):
        configuration.check_limits()


@pytest.mark.parametrize(
    ("fields", "message"), [({"channels": 2}, "luma"), ({"max_columns": 8192}, "Mbit")]
)
def test_limits_of_the_depth_index_are_named(fields, message):
    index = {"micro_image_size": 99, "slices": 256, "max_columns": 64, **fields}
    with pytest.raises(InputError, match=message):
        DepthIndexConfiguration(**index).check_limits()


def test_vhdl_declares_the_same_limits():
    text = (project.root() / "hdl" / "refocuser" / "raster_refocuser.vhd").read_text()

    def upper_bound(generic: str) -> int:
        found = re.search(rf"\b{generic}\s*:.*?range -?\d+ to (\d+)", text)
        assert found, generic
        return int(found.group(1))

    assert upper_bound("MICRO_IMAGE_SIZE") == core.MAX_MICRO_IMAGE_SIZE
    assert upper_bound("MAX_COLUMNS") == core.MAX_COLUMNS
    assert upper_bound("INTERPOLATION_ORDER") == MAX_INTERPOLATION_ORDER
    package = (project.root() / "hdl" / "core" / "refocus_pkg.vhd").read_text()
    found = re.search(r"PARTIAL_SUM_LOOP : positive := (\d+)", package)
    assert found
    assert int(found.group(1)) == PARTIAL_SUM_LOOP


def test_all_sums_within_the_limits_fit_a_vhdl_integer():
    for m in (1, 2, 3, 127, 128):
        for bits in (8, 16):
            configuration = CoreConfiguration(
                micro_image_size=m, shifts=(1,), max_columns=128, pixel_bits=bits
            )
            configuration.check_limits()
            assert configuration.arithmetic.largest_sum(m, bits) < 2**31
    stored = StoredProductArithmetic(fraction_bits=12, guard_bits=0)
    assert stored.largest_sum(128, 16) < 2**31


def test_sources_list_names_every_file():
    folder = project.root() / "hdl"
    listed = {path.relative_to(folder) for path in hdl.all_sources()}
    found = {path.relative_to(folder) for path in folder.rglob("*.vhd") if "sim" not in path.parts}
    assert listed == found
