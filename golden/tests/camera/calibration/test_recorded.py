# SPDX-License-Identifier: Apache-2.0
"""Results of the calibration are those of the record (`recorded.py` records them anew)."""

import pytest
from recorded import differences, measured, record
from recorded_cases import CASES


def test_the_record_is_of_these_cases() -> None:
    assert list(record()) == list(CASES)


@pytest.mark.parametrize("name", CASES)
def test_recorded(name: str) -> None:
    assert not list(differences(measured(CASES[name]), record()[name]))
