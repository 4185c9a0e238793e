# SPDX-License-Identifier: Apache-2.0
"""The parts of the TMDS path, each on its own, in one simulation."""

import pytest

from plenofir_tb.runner import Case, run_cases


def unit(entity: str, bench: str = "unit", **case: int) -> Case:
    """The entity's generics are what the case says."""
    generics = {name.upper(): value for name, value in case.items()}
    return Case(entity, f"tmds.{bench}_bench", generics, {"entity": entity, **case})


UNITS = [
    unit("tmds_encoder"),
    unit("tmds_decoder"),
    unit("tmds_periods"),
    unit("info_frame_reader"),
    unit("tmds_deskew", timeout=400),
    unit("gearbox_5_to_10", "rate"),
    unit("gearbox_10_to_5", "rate"),
    unit("tmds_word_align", timeout=100, run=8),
    unit("tmds_polarity"),
    # The smallest, the usual and the largest depth.
    *(unit("elastic_buffer", "rate", width=8, address_bits=bits) for bits in (3, 4, 6)),
]


# `make mutants` chooses by the names of entities.
@pytest.mark.parametrize(
    "cases",
    [UNITS, [Case("tmds_receiver", "tmds.receiver_bench")]],
    ids=lambda cases: "-".join(case.top for case in cases),
)
def test_unit(cases: list[Case]) -> None:
    run_cases(cases)
