# SPDX-License-Identifier: Apache-2.0
"""Errata of the thesis, each with a computation: the source of their list in ``docs/thesis.md``."""

from plenofir_studies.errata import calibration, hardware, model, validation
from plenofir_studies.errata.entry import Erratum, Shown

CHAPTERS = {
    "Errata of chapter 3": model.ERRATA,
    "Errata of chapter 4": calibration.ERRATA,
    "Errata of chapter 5": validation.ERRATA,
    "Errata of chapter 6": hardware.ERRATA,
}
ERRATA = {erratum.key: erratum for chapter in CHAPTERS.values() for erratum in chapter}


def page_lines() -> list[str]:
    """Make the lines of ``docs/thesis.md`` that come from the computations."""
    lines: list[str] = []
    for chapter, errata in CHAPTERS.items():
        lines += [f"### {chapter}", ""]
        for erratum in errata:
            lines += [
                f"#### {erratum.where}",
                "",
                f"- Printed: {erratum.printed}.",
                f"- Holds: {erratum.holds}.",
                f"- Computed: {erratum.show().text}",
                "",
            ]
    return lines[:-1]


__all__ = ["CHAPTERS", "ERRATA", "Erratum", "Shown", "page_lines"]
