# SPDX-License-Identifier: Apache-2.0
"""Constants of depth and calibration: each has its unit, its origin, and what half of it does."""

import ast
import tomllib
from importlib import import_module

import pytest

from plenofir.ground.project import root

PARTS = tomllib.loads((root() / "scripts" / "constants.toml").read_text())
PAGE = (root() / "docs" / "measured" / "studies.md").read_text()
# Of modules with all their constants in a table, those that no table has, and why.
ELSEWHERE = {
    "lightfield.matching": {
        "_SIDE_OF_LINE": "views in a line alone",
        "_WHITE": "a percentile, which has no double",
        "_SPLINE": "values of a cubic B-spline",
    },
    "lightfield.disparity": {
        "LEAST_CONFIDENCE": "what users set, after the search",
        "_SURROUNDINGS": "after the search",
        "_MOST_COSTS": "memory alone",
    },
    "focused.depth": {},
}


def constants(module: str) -> set[str]:
    """Names of a module's numbers, and of tuples of numbers."""
    path = root() / "golden" / "plenofir" / "camera" / f"{module.replace('.', '/')}.py"
    names = set[str]()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign):
            named = [one.id for one in ast.walk(node.targets[0]) if isinstance(one, ast.Name)]
            leaves = [one for one in ast.walk(node.value) if not isinstance(one, ast.operator)]
            plain = (
                ast.Constant | ast.Tuple | ast.UnaryOp | ast.BinOp | ast.expr_context | ast.unaryop
            )
            if all(isinstance(one, plain) for one in leaves):
                names |= {name for name in named if name.isupper()}
    return names


@pytest.mark.parametrize("module", ELSEWHERE)
def test_each_constant_of_depth_is_in_a_table(module: str) -> None:
    tables = {name: rows for part in PARTS.values() for name, rows in part.items()}
    assert constants(module) == {*tables[module], *ELSEWHERE[module]}


@pytest.mark.parametrize("part", PARTS)
def test_tables_have_the_values_of_the_code(part: str) -> None:
    """They are measured by scripts/constants.py, which takes minutes."""
    for module, rows in PARTS[part].items():
        for name, (meaning, origin) in rows.items():
            value = getattr(import_module(f"plenofir.camera.{module}"), name)
            if part != "calibration":
                value = (
                    tuple(0.5 * one for one in value)
                    if isinstance(value, tuple)
                    else type(value)(0.5 * value)
                )
            row = f"| `{module}.{name}`: {meaning} | {origin} | {value} | "
            assert row in PAGE, row
