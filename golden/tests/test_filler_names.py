# SPDX-License-Identifier: Apache-2.0
"""A name says what it holds: words that fit any value are rare in what people install."""

import ast
from collections import Counter
from collections.abc import Iterator

import pytest

from plenofir.ground import project

pytestmark = pytest.mark.quick

ROOT = project.root()
# Each word with what a reader asks when it stands alone.
FILLERS = {
    "found": "found what: the match, the peak, the grid?",
    "what": "of any kind: the feature, the quantity, the problem?",
    "known": "by whom, and of what: the names, the table, the finite values?",
    "made": "made of what: the design, the part?",
    "wanted": "by whom: the requested, the expected, the constrained value?",
    "own": "whose: the scene's, the lens's, the engine's?",
    "taken": "by whom: the occupied sites, the received words, the capture?",
    "given": "by whom: the option's value, the argument?",
    "told": "by whom: the hint, the note, the stated size?",
    "done": "a finished process, a number of steps?",
    "left": "what remains is a residual or a rest; a side is no filler, see SIDES",
    "seen": "by whom: the view, the texture, the names so far?",
    "shown": "where: the picture, the output, the chosen frames?",
}
# A function that names one of these means the left side by `left`.
SIDES = {"right", "top", "bottom", "width"}
# Largest share of the names that are bound, in percent: of well-kept packages 0.6 at most.
LIMIT = 0.5


def bound(node: ast.AST) -> Iterator[tuple[str, int]]:
    """Names that a part of a module binds, with their lines."""
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        yield node.id, node.lineno
    elif isinstance(node, ast.arg):
        yield node.arg, node.lineno
    elif isinstance(node, ast.FunctionDef | ast.ClassDef):
        yield node.name, node.lineno


def fillers(tree: ast.Module) -> tuple[int, list[tuple[str, int]]]:
    """Number of names that a module binds, and those that are fillers."""
    sides: set[int] = set()
    for scope in ast.walk(tree):
        if isinstance(scope, ast.FunctionDef | ast.ClassDef):
            inside = [name for node in ast.walk(scope) for name in bound(node)]
            if SIDES & {name for name, _ in inside}:
                sides |= {line for name, line in inside if name == "left"}
    names = [name for node in ast.walk(tree) for name in bound(node)]
    return len(names), [
        (name, line)
        for name, line in names
        if name in FILLERS and not (name == "left" and line in sides)
    ]


@pytest.mark.parametrize("folder", ["golden/plenofir", "studies/plenofir_studies"])
def test_names_say_what_they_hold(folder: str) -> None:
    names, by_file, words = 0, Counter[str](), Counter[str]()
    for path in sorted((ROOT / folder).rglob("*.py")):
        count, empty = fillers(ast.parse(path.read_text()))
        names += count
        by_file[str(path.relative_to(ROOT))] += len(empty)
        words.update(name for name, _ in empty)
    worst = "; ".join(f"{count} in {file}" for file, count in by_file.most_common(5))
    hints = "; ".join(f"{word} ({FILLERS[word]})" for word, _ in words.most_common(3))
    share = 100 * words.total() / names
    assert share < LIMIT, f"{share:.2f} % of {names} names: {worst}. {hints}"


def test_fillers_are_told_from_sides() -> None:
    text = "def f(left, right):\n  found = left\ndef g(left):\n  for what in left: done, x = what\n"
    assert fillers(ast.parse(text)) == (
        9,
        [("found", 2), ("left", 3), ("what", 4), ("done", 4)],
    )
