# SPDX-License-Identifier: Apache-2.0
"""The parts of the TMDS path, each on its own."""

import pytest

from plenofir_tb.runner import run_case


def run_unit(entity: str, generics: dict, bench: str = "unit", **case: object) -> None:
    run_case(entity, f"tmds.{bench}_bench", generics=generics, case={"entity": entity, **case})


@pytest.mark.parametrize(
    "entity",
    [
        "tmds_encoder",
        "tmds_decoder",
        "tmds_periods",
        "info_frame_reader",
    ],
)
def test_unit(entity: str) -> None:
    run_unit(entity, {})


def test_tmds_deskew() -> None:
    run_unit("tmds_deskew", {"TIMEOUT": 400}, timeout=400)


@pytest.mark.parametrize("entity", ["gearbox_5_to_10", "gearbox_10_to_5"])
def test_gearbox(entity: str) -> None:
    run_unit(entity, {}, "rate")


def test_tmds_word_align() -> None:
    run_unit("tmds_word_align", {"TIMEOUT": 100, "RUN": 8}, timeout=100, run=8)


def test_elastic_buffer() -> None:
    case = {"width": 8, "address_bits": 4}
    run_unit("elastic_buffer", {name.upper(): n for name, n in case.items()}, "rate", **case)


def test_tmds_receiver() -> None:
    run_case("tmds_receiver", "tmds.receiver_bench", generics={})
