# SPDX-License-Identifier: Apache-2.0
"""Imports of the package run one way: down its layers, without a circle."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import plenofir
from build_site import PACKAGES

pytestmark = pytest.mark.quick

ROOT = Path(plenofir.__file__).parent
# From top to bottom. Rooms of one layer do not import each other.
LAYERS = (
    ("__main__",),
    ("commands",),
    ("driver",),
    ("plan", "view"),
    ("camera", "fpga"),
    ("refocus",),
    ("ground",),
)
LEVELS = {room: level for level, rooms in enumerate(LAYERS) for room in rooms}
# Aliases for users, which nothing in the package imports.
ALIASES = {"calibration": "camera", "errors": "ground"}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in ROOT.rglob("*.py")}


def imported(name: str) -> set[str]:
    """Modules of the package that a module imports, wherever in its text."""
    found = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative import"
            wholes = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {whole if whole in MODULES else str(node.module) for whole in wholes}
    outside = {module for module in found if module.split(".")[0] == "plenofir_studies"}
    assert not outside, f"{name} imports {outside}"
    return found & MODULES.keys() - {"plenofir"}


def test_every_room_has_a_layer() -> None:
    rooms = {name.split(".")[1] for name in MODULES if "." in name}
    assert rooms == LEVELS.keys() | ALIASES.keys()


@pytest.mark.parametrize("name", sorted(MODULES))
def test_imports_run_down_the_layers(name: str) -> None:
    room = name.partition(".")[2].split(".")[0]
    for other in imported(name):
        there = other.split(".")[1]
        assert there not in ALIASES, other
        if room in ALIASES:
            assert there == ALIASES[room], other
        elif room and there != room:
            assert LEVELS[there] > LEVELS[room], f"{name} imports {other}"


def test_few_arrows_between_rooms() -> None:
    arrows = {
        (name.split(".")[1], other.split(".")[1])
        for name in MODULES
        if "." in name
        for other in imported(name)
    }
    assert len({(room, there) for room, there in arrows if room != there}) <= 25


def test_every_module_is_reached() -> None:
    """From commands, driver or a documented name: the package is what people use."""
    driver = {name for name in MODULES if name.startswith("plenofir.driver")}
    reached: set[str] = set()
    ahead = {"plenofir.__main__", *(f"plenofir.{name}" for name in ALIASES), *driver}
    ahead |= PACKAGES.keys() & MODULES.keys()
    while ahead:
        name = ahead.pop()
        # A module's folders are imported with it.
        folder = name.rpartition(".")[0]
        reached.add(name)
        ahead |= ({folder, *imported(name)} if folder else imported(name)) - reached
    assert sorted(MODULES.keys() - reached) == []


def test_no_module_imports_itself_by_way_of_others() -> None:
    # Raises CycleError with the circle.
    TopologicalSorter({name: imported(name) for name in MODULES}).prepare()


FOLDERS = sorted({path.parent for path in ROOT.rglob("__init__.py")})


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(ROOT.parent)))
def test_what_lies_in_a_room_is_imported_one_way(folder: Path) -> None:
    """Files and folders within a folder, each as a whole, have no circular imports."""
    inside = f"{module_name(folder / '__init__.py')}."

    def part(name: str) -> str:
        return name.removeprefix(inside).split(".")[0] if name.startswith(inside) else ""

    graph: dict[str, set[str]] = {}
    for name in MODULES:
        if own := part(name):
            graph.setdefault(own, set()).update(map(part, imported(name)))
    TopologicalSorter({own: others - {own, ""} for own, others in graph.items()}).prepare()


def test_the_compiled_room_has_one_entry() -> None:
    """Nobody reaches behind it; loops of pictures for people are called one by one."""
    room = "plenofir.refocus.compiled"
    inside = {
        (name, other)
        for name in MODULES
        if not name.startswith(room)
        for other in imported(name)
        if other.startswith(f"{room}.") and other != f"{room}.picture_lines"
    }
    assert not inside


def far_too_much(source: str) -> list[str]:
    """Functions of a source that no one keeps in mind, and calls whose arguments have no order."""
    much = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            stars = [part for part in node.args if isinstance(part, ast.Starred)]
            if any(isinstance(star.value, ast.Tuple) for star in stars):
                much.append(f"line {node.lineno}: *(...)")
        if isinstance(node, ast.FunctionDef):
            # Loops that are compiled by themselves are called with addresses and numbers.
            loop = {ast.unparse(mark) for mark in node.decorator_list} & {"loop", "compiled"}
            lines = len(node.body) and node.body[-1].end_lineno - node.body[0].lineno + 1
            if ast.get_docstring(node):
                lines -= node.body[0].end_lineno - node.body[0].lineno + 1
            many = len(node.args.args + node.args.kwonlyargs) > 8
            if not loop and (lines > 60 or many):
                much.append(f"{node.name}: {lines} lines")
    return much


def test_the_fast_refocuser_is_read_in_small_parts() -> None:
    long = "def f():\n" + "    x = 1\n" * 61
    nine = "def f(a, b, c, d, *, e, f, g, h, i):\n    x(*(a, b), c)\n"
    assert far_too_much(long) == ["f: 61 lines"]
    assert far_too_much(nine) == ["f: 1 lines", "line 2: *(...)"]
    room = ROOT / "refocus"
    paths = [*(room / "compiled").glob("*.py"), room / "plain.py", room / "first_calls.py"]
    for path in (*paths, room / "slices.py", room / "arrays.py"):
        assert far_too_much(path.read_text()) == [], path
