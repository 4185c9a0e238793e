# SPDX-License-Identifier: Apache-2.0
"""Damaged or stale compiled code on disk is compiled again, and never executed."""

import ast
import importlib.util
import os
import resource
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import FunctionType, ModuleType

import numpy as np
import pytest
from numba.core.cpu import CPUContext
from numba.core.dispatcher import Dispatcher

from plenofir.ground import compiling
from plenofir.ground.kept_code import KeptCode
from plenofir.refocus.compiled import blocks, column_vectors, machine_code, row_vectors

OF_NUMBA = """
from functools import partial
from pathlib import Path

from plenofir.ground.kept_code import compiled, inner

@inner
def add(target, values):
    for k in range(target.size):
        target[k] += values[k]

@partial(compiled, inlined=[Path(__file__).with_name("shared.py")])
def twice(values):
    add(values, values)

def loaded():
    return bool(twice.stats.cache_hits)
"""
LOOP = """
from ctypes import CFUNCTYPE, c_int64

from plenofir.refocus.compiled.machine_code import loop
from plenofir.refocus.compiled.vector_code import Array, Value

written = []

@loop
def doubled(values: Array, count: Value) -> None:
    written.append(True)
    with count.times() as k:
        values.store(k, values.load(k) + values.load(k))

def twice(values):
    address = doubled.address(8)
    CFUNCTYPE(None, c_int64, c_int64)(address)(values.ctypes.data, values.size)

def loaded():
    return not written
"""


@pytest.fixture(params=[OF_NUMBA, LOOP], ids=["numba", "loop"])
def twice(request, tmp_path: Path, monkeypatch) -> Callable[[], list[int]]:
    """Load the function again, from disk if it is cached, and call it."""
    path = tmp_path / "of_a_test.py"
    path.write_text(request.param)
    path.with_name("shared.py").touch()
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def call() -> list[int]:
        spec = importlib.util.spec_from_file_location("of_a_test", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        values = np.arange(5, dtype=np.uint8)
        module.twice(values)
        call.loaded = module.loaded()
        return values.tolist()

    return call


def kept(folder: Path) -> list[Path]:
    return [path for path in (folder / "__pycache__").iterdir() if path.suffix != ".pyc"]


def flipped(part: int, content: bytes) -> bytes:
    at = len(content) * part // 8
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "cut off": lambda content: content[: len(content) // 2],
    "short": lambda content: content[:20],
    "longer": lambda content: content + b"x",
    "of another version": lambda content: bytes(32) + content[32:],
    **{f"flipped at {part}/8": partial(flipped, part) for part in range(8)},
}


@pytest.fixture(autouse=True)
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What users are told."""
    sentences: list[str] = []
    monkeypatch.setattr(compiling, "tell", sentences.append)
    monkeypatch.setattr(compiling, "_announced", set())
    return sentences


# An empty file, or one of other sources, is no damage.
STALE = ("empty", "short", "of another version", "flipped at 0/8")


def test_code_on_disk_does_not_wait_for_the_compiler(twice, monkeypatch) -> None:
    assert twice() == [0, 2, 4, 6, 8]

    def unwanted(context: CPUContext) -> None:
        raise AssertionError("numba loaded what compiling needs")

    monkeypatch.setattr(CPUContext, "load_additional_registries", unwanted)
    assert twice() == [0, 2, 4, 6, 8]
    assert twice.loaded


@pytest.mark.parametrize("name", DAMAGES)
def test_damaged_files(tmp_path: Path, twice, told: list[str], name: str) -> None:
    assert twice() == [0, 2, 4, 6, 8]
    assert twice() == [0, 2, 4, 6, 8]
    assert twice.loaded
    for path in kept(tmp_path):
        path.write_bytes(DAMAGES[name](path.read_bytes()))
    assert told == []
    assert twice() == [0, 2, 4, 6, 8]
    assert not twice.loaded
    assert [sentence.split(" is ")[1] for sentence in told] == ["damaged; it"] * (name not in STALE)
    assert twice() == [0, 2, 4, 6, 8]
    assert twice.loaded


def test_no_room_and_no_permission(tmp_path: Path, twice, told: list[str]) -> None:
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, old[1]))
    try:
        assert twice() == [0, 2, 4, 6, 8]
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    assert not [path for path in kept(tmp_path) if path.stat().st_size]
    assert twice() == [0, 2, 4, 6, 8]
    # A folder, and nothing that can be read, in a file's place.
    for path in kept(tmp_path):
        path.unlink()
        path.mkdir()
    assert twice() == [0, 2, 4, 6, 8]
    os.chmod(tmp_path / "__pycache__", 0)
    assert twice() == [0, 2, 4, 6, 8]
    os.chmod(tmp_path / "__pycache__", 0o700)
    assert [sentence.partition(" ")[0] for sentence in told] == ["code"]


def test_nowhere_to_keep_code(twice, told: list[str], monkeypatch) -> None:
    monkeypatch.setattr(KeptCode._impl_class, "_locator_classes", [])
    for _ in range(2):
        assert twice() == [0, 2, 4, 6, 8]
        assert not twice.loaded
    assert len(told) == 1
    assert "NUMBA_CACHE_DIR" in told[0]


def test_other_sources(tmp_path: Path, twice, monkeypatch) -> None:
    """Code is made anew when a module changes whose functions are inlined into it."""
    shared = tmp_path / "shared.py"
    shared.write_text("1")
    monkeypatch.setattr(machine_code, "_SHARED", (shared,))
    for text, loaded in (("1", False), ("1", True), ("2", False), ("2", True)):
        shared.write_text(text)
        assert twice() == [0, 2, 4, 6, 8]
        assert twice.loaded == loaded


def of_code(value: object) -> bool:
    """Whether compiled code takes in a value: a number, a function, a class of tuples."""
    tuples = isinstance(value, type) and issubclass(value, tuple)
    return tuples or isinstance(value, int | FunctionType | Dispatcher)


def origins(module: ModuleType) -> set[Path]:
    """Files whose functions and numbers become part of a module's compiled code."""
    return {
        Path(importlib.util.find_spec(node.module).origin)
        for node in ast.walk(ast.parse(Path(module.__file__).read_text()))
        if isinstance(node, ast.ImportFrom) and node.module.startswith("plenofir.refocus")
        if any(of_code(getattr(module, alias.name)) for alias in node.names)
    }


@pytest.mark.parametrize("module", [row_vectors, column_vectors])
def test_loops_depend_on_all_that_they_take_in(module: ModuleType) -> None:
    assert origins(module)
    assert origins(module) <= set(machine_code._SHARED)


@pytest.mark.parametrize("path", [Path(blocks.__file__), *blocks.INLINED], ids=lambda p: p.stem)
def test_blocks_depend_on_all_that_they_take_in(path: Path) -> None:
    """Loops are called by address: their modules give compiled code names of arguments only."""
    loops = {Path(module.__file__) for module in (row_vectors, column_vectors)}
    if path.stem not in ("machine_code", "vector_code"):
        module = importlib.import_module(f"plenofir.refocus.compiled.{path.stem}")
        assert origins(module) - loops <= set(blocks.INLINED)
