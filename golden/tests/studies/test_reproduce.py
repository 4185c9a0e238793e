# SPDX-License-Identifier: Apache-2.0
"""`plenofir reproduce`: tables and figures of the thesis by their numbers."""

import json
import re
import subprocess
from pathlib import Path

import pytest
from in_process import plenofir

from plenofir.ground.images import read_image
from plenofir_studies.errata import ERRATA
from plenofir_studies.ray_validation import all_checks
from plenofir_studies.reproduce import ELSEWHERE, FIGURES, errata_of, table_or_figure
from plenofir_studies.thesis_tables import TABLES, load_table

SLOW_FIGURES = ("5.16", "5.17", "5.18")


def reproduced(*words: str) -> subprocess.CompletedProcess[str]:
    return plenofir("reproduce", *words)


@pytest.mark.parametrize("number", TABLES)
def test_tables_with_all_their_numbers(number: str) -> None:
    ran = reproduced(number, "--json")
    assert ran.returncode == 0, ran.stderr
    content = json.loads(ran.stdout)
    assert content["topic"] == load_table(number).topic
    # Of every row of the table something is predicted.
    parts = [part.name for part in load_table(number).parts]
    assert {row["part"] for row in content["rows"]} == set(parts)
    for row in content["rows"]:
        assert row["agrees"] or row["erratum"]


def test_a_table_as_text_says_from_which_distances_digits_agree() -> None:
    ran = reproduced("table", "5.7")
    assert ran.returncode == 0, ran.stderr
    for text in ("876.4830", "agrees from rounded b_U", "of 45 agree in every printed digit"):
        assert text in reproduced("5.5").stdout
    assert "Table 5.7: " in ran.stdout


def test_errata_stand_below_their_tables() -> None:
    # "Tables 5.5 and 5.6", "below Table 5.7", "Tables 5.3(a), 5.4(a)".
    for number, where in (("5.6", "Tables 5.5 and 5.6"), ("5.4", "Tables 5.3(a), 5.4(a)")):
        errata = json.loads(reproduced(number, "--json").stdout)["errata"]
        assert any(where in erratum["where"] for erratum in errata)
    assert json.loads(reproduced("5.1", "--json").stdout)["errata"] == []


@pytest.mark.parametrize(
    "number",
    [pytest.param(n, marks=pytest.mark.slow) if n in SLOW_FIGURES else n for n in FIGURES],
)
def test_figures(tmp_path: Path, number: str) -> None:
    out = tmp_path / "figure.png"
    ran = reproduced("figure", number, "--out", str(out))
    assert ran.returncode == 0, ran.stderr
    picture = read_image(out)
    assert min(picture.shape[:2]) > 300
    assert picture.std() > 10


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("5.5", ("table", "5.5")),
        ("5.16", ("figure", "5.16")),
        ("Table 5.9", ("table", "5.9")),
        ("Fig. 5.9", ("figure", "5.9")),
        ("figure 5.10", ("figure", "5.10")),
    ],
)
def test_numbers_as_people_write_them(text: str, wanted: tuple[str, str]) -> None:
    assert table_or_figure(text.split()) == wanted


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("5.99",), "figure 5.99 is not drawn anew"),
        (("table", "6.1"), "the project has no table 6.1"),
        (("tabel",), "names no table or figure"),
        (("5.5", "--out", "a.png"), "a table is printed"),
        (("figure", "5.9", "--json"), "--json is for tables"),
        (("figure", "5.9", "--out", "a.jpg"), "must end in .png"),
        (("6.3",), "`make waves`"),
    ],
)
def test_wrong_calls(words: tuple[str, ...], text: str) -> None:
    ran = reproduced(*words)
    assert ran.returncode == 2
    assert text in ran.stderr
    assert ran.stderr.count("\n") == 1


def test_no_figure_has_two_homes() -> None:
    assert not set(FIGURES) & set(ELSEWHERE)


def test_errata_are_those_of_the_page() -> None:
    # Whatever table or figure an entry's place names, the command says it, with the page's words.
    named = 0
    for erratum in ERRATA.values():
        for kind, numbers in re.findall(
            r"(Tables?|Figs?\.) ((?:5\.\d+(?:\([a-c]\))?(?:, | and | to )?)+)", erratum.where
        ):
            for number in re.findall(r"5\.\d+", numbers):
                of = errata_of("table" if kind.startswith("Table") else "figure", number)
                assert (erratum.where, erratum.printed, erratum.holds) in of, (erratum.key, number)
                named += 1
    assert named > 15
    # And rows that are called wrong have their entry below the table.
    for number in TABLES:
        keys = {check.erratum for check in all_checks() if check.table.rstrip("abc") == number}
        places = [where for where, _, _ in errata_of("table", number)]
        assert all(ERRATA[key].where in places for key in keys - {None})
