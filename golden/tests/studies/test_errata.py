# SPDX-License-Identifier: Apache-2.0
"""The errata of the thesis: each computation shows what its entry says."""

import pytest

from plenofir_studies.errata import CHAPTERS, ERRATA
from plenofir_studies.errata.calibration import bilinear, printed_algorithm, printed_equation
from plenofir_studies.thesis_tables import TABLES, load_table


@pytest.mark.parametrize("key", ERRATA)
def test_what_is_printed_misses_and_what_holds_does_not(key: str) -> None:
    shown = ERRATA[key].show()
    assert shown.confirmed, shown
    assert shown.text


def test_keys_are_unique() -> None:
    assert len(ERRATA) == sum(len(errata) for errata in CHAPTERS.values())


def test_errata_in_the_tables_have_entries() -> None:
    parts = [part for number in TABLES for part in load_table(number).parts]
    marked = {part.erratum for part in parts} | {row.erratum for p in parts for row in p.rows}
    assert marked - {None} == {"exit-pupil-at-3-m", "disparity-per-view", "micro-image-centre"}
    assert marked - {None} <= ERRATA.keys()


def test_printed_weights_are_right_where_the_text_tried_them() -> None:
    # Below one half Algorithm 1 is bilinear; Eq. 4.11 is so on the diagonal.
    assert printed_algorithm(0.2, 0.4) == pytest.approx(bilinear(0.2, 0.4))
    assert printed_equation(0.3, 0.3) == pytest.approx(bilinear(0.3, 0.3))
