# SPDX-License-Identifier: Apache-2.0
"""The tables of the thesis: that they load, are complete and consistent in themselves."""

import math
import re
from importlib import resources
from itertools import pairwise

import pytest

from plenofir.ground.errors import InputError
from plenofir_studies.thesis_tables import TABLES, Printed, load_table

ROWS = {
    "5.1": [2],
    "5.2": [11],
    "5.3": [3, 3, 3],
    "5.4": [3, 3, 3],
    "5.5": [15],
    "5.6": [15],
    "5.7": [15],
    "5.8": [9],
    "5.9": [29],
    "5.10": [15, 15, 15],
    "5.11": [4, 4, 2],
    "5.12": [4, 4, 2],
    "5.13": [2],
}
UNITS = ("mm", "cm", "m", "um", "nm", "deg", "px", "pct")
WITHOUT_UNIT = {"a", "n", "f_number", "s_over_p_m", "gap", "view"}
REFOCUSING = ("5.5", "5.6", "5.7", "5.10")
# Printed deviations that do not follow from the two printed numbers beside them.
MISPRINTED = {("5.4a", 56, "exit_pupil"), ("5.4b", 14, "principal_plane")}


def all_cells():
    for number in TABLES:
        for part in load_table(number).parts:
            yield number, part.settings
            for row in part.rows:
                yield number, row


def all_rows(*numbers):
    for number in numbers:
        for part in load_table(number).parts:
            for row in part.rows:
                yield part, row


def error(prediction, measurement):
    return (prediction - measurement) / prediction * 100


def test_every_file_is_a_table():
    folder = resources.files("plenofir_studies").joinpath("data", "thesis")
    names = {file.name for file in folder.iterdir() if file.name.endswith(".toml")}
    assert names == {f"table_{number.replace('.', '_')}.toml" for number in TABLES}


@pytest.mark.parametrize("number", TABLES)
def test_rows(number):
    table = load_table(number)
    assert table.number == number
    assert table.topic
    assert [len(part.rows) for part in table.parts] == ROWS[number]
    assert len({part.name for part in table.parts}) == len(table.parts)


def test_names_end_in_a_unit():
    for number, cells in all_cells():
        for name in cells.numbers:
            assert name in WITHOUT_UNIT or name.rpartition("_")[2] in UNITS, (number, name)
        assert cells.labels.get("lens", "f100") in {"f100", "f193", "f90", "f197"}
        assert cells.labels.get("mla", "I") in {"I", "II"}


def test_numbers_are_plain():
    for number, cells in all_cells():
        for printed in cells.numbers.values():
            assert re.fullmatch(r"-?(\d+(\.\d+)?(/\d+)?|inf)", printed.text), (number, printed)


@pytest.mark.parametrize("kind", ["predicted{}_mm", "simulated{}_mm", "{}_cm"])
def test_near_is_nearer_than_far(kind):
    found = 0
    for _, row in all_rows(*REFOCUSING):
        names = [kind.format(border) for border in ("_near", "", "_far")]
        if kind == "{}_cm":
            names = ["near_cm", "distance_cm", "far_cm"]
        distances = [row[name] for name in names if name in row.numbers]
        assert distances == sorted(distances)
        assert all(distance > 0 for distance in distances)
        found += len(distances)
    assert found >= 134


@pytest.mark.parametrize("number", REFOCUSING)
def test_planes_come_nearer_with_a(number):
    for part in load_table(number).parts:
        by_focus = {}
        for row in part.rows:
            focus = row.numbers.get("d_f_m", part.settings.numbers.get("d_f_m"))
            by_focus.setdefault(focus, []).append(row)
        for rows in by_focus.values():
            for name in set.intersection(*(set(row.numbers) for row in rows)) - {"d_f_m"}:
                if name == "a":
                    steps = [later["a"] - row["a"] for row, later in pairwise(rows)]
                    assert all(step > 0 for step in steps)
                elif not name.endswith("_pct"):
                    values = [row[name] for row in rows if not math.isinf(row[name])]
                    assert values == sorted(values, reverse=True)


@pytest.mark.parametrize("number", ["5.5", "5.6", "5.7"])
def test_errors_of_refocusing(number):
    for row in load_table(number).part().rows:
        for border in ("_near", "", "_far"):
            printed = row.numbers.get(f"error{border}_pct")
            if printed is not None:
                simulated = row[f"simulated{border}_mm"]
                assert printed.agrees(error(row[f"predicted{border}_mm"], simulated))
                assert abs(printed.value) < 0.35
        wrong = number != "5.7" and row["d_f_m"] == 3 and row["a"] >= 1
        assert (row.erratum is not None) == wrong


@pytest.mark.parametrize("number", ["5.3", "5.4"])
def test_micro_image_centres(number):
    for part, row in all_rows(number):
        lens_mm = row["s_over_p_m"] * 0.125
        for name, origin in (
            ("principal_plane", "b_u_mm"),
            ("stop", "d_stop_mm"),
            ("exit_pupil", "d_exit_mm"),
        ):
            predicted = row.numbers[f"{name}_mm"]
            stretch = 1 + part.settings["f_s_mm"] / part.settings[origin]
            wrong = row.erratum is not None and name == "exit_pupil"
            assert predicted.agrees(lens_mm * stretch) is not wrong
            measured = error(predicted.value, row["simulated_mm"])
            misprinted = (number + part.name, row["s_over_p_m"], name) in MISPRINTED
            assert row.numbers[f"{name}_error_pct"].agrees(measured) is not misprinted


def test_moving_the_lens_moves_the_exit_pupil():
    rows = load_table("5.2").part().rows
    infinity = {row.labels["lens"]: row for row in rows if math.isinf(row["d_f_m"])}
    for row in rows:
        start = infinity[row.labels["lens"]]
        moved = row["b_u_mm"] - start["b_u_mm"]
        assert row.numbers["d_exit_mm"].agrees(start["d_exit_mm"] + moved, 1e-4)


def test_micro_lenses():
    for row in load_table("5.1").part().rows:
        assert row.numbers["r1_mm"].agrees(row["f_s_mm"] * (row["n"] - 1))
        assert row["f_number"] == row["f_s_mm"] / (row["p_m_um"] / 1000)
        separation = row["t_s_mm"] * (1 - 1 / row["n"])
        assert row.numbers["h1h2_mm"].agrees(separation)
        assert row.numbers["d_s_mm"].agrees(row["f_s_mm"] + separation - row["t_s_mm"])


def test_virtual_cameras():
    for row in load_table("5.8").part().rows:
        for name in ("pupil_mm", "baseline_mm", "tilt_deg"):
            printed = row.numbers.get(f"{name.rpartition('_')[0]}_error_pct")
            if printed is not None:
                errors = error(row[f"predicted_{name}"], row[f"simulated_{name}"])
                assert printed.agrees(errors)
        assert (row["predicted_tilt_deg"] == 0) == math.isinf(row["d_f_m"])


def test_distances_from_disparities():
    before = None
    for row in load_table("5.9").part().rows:
        setup = {**row.labels, "d_f_m": row["d_f_m"]}
        if before is not None and before[0] == setup:
            assert row["disparity_px"] == before[1]["disparity_px"] + 1
            for name in ("predicted_mm", "simulated_mm"):
                assert row[name] < before[1][name]
        before = setup, row
        at_infinity = row["disparity_px"] == 0 and math.isinf(row["d_f_m"])
        assert ("error_pct" in row.numbers) != at_infinity
        if not at_infinity:
            measured = error(row["predicted_mm"], row["simulated_mm"])
            assert row.numbers["error_pct"].agrees(measured)
            assert abs(measured) < 0.335


@pytest.mark.parametrize("number", ["5.11", "5.12"])
def test_disparity_grows_towards_the_camera(number):
    table = load_table(number)
    for part in (table.part("a"), table.part("b")):
        disparities = [row["disparity_px"] for row in part.rows]
        distances = [row["distance_cm"] for row in part.rows]
        assert disparities == sorted(disparities)
        assert distances == sorted(distances, reverse=True)
    for row_a, row_b in zip(table.part("a").rows, table.part("b").rows, strict=True):
        assert row_b["disparity_px"] == 2 * row_a["disparity_px"]
        assert row_b["distance_cm"] == row_a["distance_cm"]


def test_lytro_baselines():
    part = load_table("5.13").part()
    for row in part.rows:
        baseline = part.settings["p_p_mm"] / row["f_s_mm"] * row["f_u_mm"]
        assert row.numbers["baseline_1_mm"].agrees(baseline)
        assert row.numbers["baseline_8_mm"].agrees(8 * baseline)


def test_printed_numbers():
    assert Printed("4/11").value == pytest.approx(4 / 11)
    assert Printed("4/11").half_unit == 0
    assert Printed("100.5000").decimals == 4
    assert Printed("100.5000").agrees(100.50005)
    assert not Printed("100.5000").agrees(100.5002)
    assert Printed("918").agrees(918.5)
    assert Printed("inf").agrees(math.inf)
    assert not Printed("inf").agrees(-math.inf)
    assert not Printed("1").agrees(math.inf)
    for text in ("nan", "one", "1/two"):
        with pytest.raises(ValueError, match=r"."):
            Printed(text)


def test_unknown_tables_and_parts_are_refused():
    with pytest.raises(InputError, match=r"5\.13"):
        load_table("5.14")
    with pytest.raises(InputError, match=r"'a', 'b', 'c'"):
        load_table("5.3").part("d")
