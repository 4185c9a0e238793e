# SPDX-License-Identifier: Apache-2.0
"""Every prediction that the thesis prints, to the printed digits."""

from collections import Counter

import pytest

from plenofir_studies.ray_validation import Check, all_checks, digits_of_rounding

CHECKS = all_checks()


@pytest.mark.parametrize(
    "check", CHECKS, ids=lambda c: f"{c.table}-{c.row}-{c.quantity}".replace(" ", "")
)
def test_printed_prediction(check: Check) -> None:
    if check.erratum:
        # Known to be wrong in the thesis, and by how much.
        assert not check.agrees
        assert abs(check.computed / check.printed.value - 1) < 2e-4
    else:
        assert check.agrees, f"printed {check.printed.text}, computed {check.computed!r}"


def test_nothing_is_missing() -> None:
    assert Counter(check.table for check in CHECKS) == {
        "5.1": 8,
        "5.2": 22,
        **dict.fromkeys(("5.3a", "5.3b", "5.3c", "5.4a", "5.4b", "5.4c"), 9),
        **dict.fromkeys(("5.5", "5.6", "5.7", "5.10a", "5.10b", "5.10c"), 45),
        "5.8": 27,
        "5.9": 29,
        **dict.fromkeys(("5.11a", "5.11b", "5.12a", "5.12b", "5.13"), 4),
        **dict.fromkeys(("5.11c", "5.12c"), 2),
    }
    assert sum(check.erratum is not None for check in CHECKS) == 25


def test_digits_that_only_the_rounded_image_distances_give() -> None:
    count, of, far = digits_of_rounding()
    assert (count, of) == (54, 434)
    assert 1e-5 < far < 2e-5
