# SPDX-License-Identifier: Apache-2.0
"""Engines, boards, devices and simulators are named in few files only."""

import ast
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import get_args

import pytest

import plenofir
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import SLICE_ENGINES
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.names import (
    DEFAULT_SIMULATOR,
    ENGINE_ROWS,
    VHDL_SIMULATORS,
    BoardName,
    SimulatorName,
    SliceEngineName,
    engines_with,
)
from plenofir.fpga.tools.simulators import FINDERS

pytestmark = pytest.mark.quick

ROOT = Path(plenofir.__file__).parent


@cache
def said() -> dict[str, tuple[str, set[str]]]:
    """Strings in each file of the package, without docstrings, and the modules that it imports."""
    files = {}
    for path in ROOT.rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        spoken = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        texts = [
            node.value
            for node in nodes
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
            if id(node) not in spoken
        ]
        modules = {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)}
        files[str(path.relative_to(ROOT))] = ("\n".join(texts), modules)
    return files


def named(words: Iterable[str], modules: Iterable[str] = ()) -> set[str]:
    """Files of the package that name one of these words, or import one of the modules."""
    pattern = re.compile("|".join(rf"(?<![\w-]){re.escape(word)}(?![\w-])" for word in words))
    return {
        name
        for name, (text, imported) in said().items()
        if pattern.search(text) or imported & set(modules)
    }


def test_engines() -> None:
    """The class of an engine, its name, and the table; what else names one measures this one."""
    core = "fpga/core"
    classes = {kind.__module__ for kind in SLICE_ENGINES.values()}
    assert get_args(SliceEngineName) == tuple(SLICE_ENGINES) == tuple(ENGINE_ROWS)
    for name, engine in SLICE_ENGINES.items():
        assert engine().kind == name
        assert set(ENGINE_ROWS[name].fields) <= engine.model_fields.keys()
    assert all(map(engines_with, ("parallel_rows", "any_rows", "pixels_per_clock")))
    files = {f"{name.removeprefix('plenofir.').replace('.', '/')}.py" for name in classes}
    assert named(SLICE_ENGINES, classes) == files | {
        "fpga/names.py",
        f"{core}/configuration.py",
        # A stack holds row stages and adders of moving sums, whose waves it shows.
        f"{core}/stack_engine.py",
    }


def test_boards() -> None:
    """The row of a board and its name; what else names one builds for it alone."""
    assert get_args(BoardName) == tuple(BOARDS)
    assert named(BOARDS) == {"fpga/names.py", "fpga/boards.py"}


def test_devices() -> None:
    """The row of a device, one of the tool that places it, and that of a board that has it."""
    rows = {"fpga/devices.py", "fpga/synthesis/placers.py", "fpga/boards.py"}
    assert named(DEVICES) == rows | {
        # Names and places that nextpnr has for the ECP5 of a board.
        "fpga/synthesis/ecp5.py",
        "fpga/bitstream/ecp5_netlist.py",
        # The parts whose bitstreams are built.
        "fpga/bitstream/gowin.py",
        "fpga/bitstream/nexus.py",
        "fpga/bitstream/top_level.py",
        # Examples in a help text and in a readme.
        "commands/bitstream.py",
        "commands/plan.py",
        "plan/ip/files.py",
    }


def test_simulators() -> None:
    """The name of a simulator, and how it is found and called."""
    assert get_args(SimulatorName) == tuple(FINDERS)
    assert VHDL_SIMULATORS[0] == DEFAULT_SIMULATOR
    # GHDL synthesises, too, and Verilator is built for its netlists.
    assert named({"nvc"}) == {"fpga/names.py", "fpga/tools/simulators.py"}
