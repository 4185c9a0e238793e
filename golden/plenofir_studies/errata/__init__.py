# SPDX-License-Identifier: Apache-2.0
"""Errata of the thesis, each with a computation: the source of ``docs/errata.md``."""

from plenofir_studies.errata import calibration, hardware, model, validation
from plenofir_studies.errata.entry import Erratum, Shown

CHAPTERS = {
    "Chapter 3: the ray model": model.ERRATA,
    "Chapter 4: calibration": calibration.ERRATA,
    "Chapter 5: validation": validation.ERRATA,
    "Chapter 6: hardware": hardware.ERRATA,
}
ERRATA = {erratum.key: erratum for chapter in CHAPTERS.values() for erratum in chapter}


def page_lines() -> list[str]:
    """Make the lines of ``docs/errata.md`` that come from the computations."""
    lines: list[str] = []
    for chapter, errata in CHAPTERS.items():
        lines += [f"## {chapter}", ""]
        for erratum in errata:
            lines += [
                f"### {erratum.where}",
                "",
                f"- Printed: {erratum.printed}.",
                f"- Holds: {erratum.holds}.",
                f"- Computed: {erratum.show().text}",
                "",
            ]
    return lines[:-1]


__all__ = ["CHAPTERS", "ERRATA", "Erratum", "Shown", "page_lines"]
