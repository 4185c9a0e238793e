# SPDX-License-Identifier: Apache-2.0
"""A short hunt, and the detection of planted faults."""

import ast
import os
import random
import re
import sys
from functools import partial
from importlib import import_module
from pathlib import Path
from unittest import mock

import pytest

from hunt.hunt import main
from hunt.simulate import entities, run_design
from hunt.start_values import with_start_values
from plenofir.fpga import hdl
from plenofir.fpga.tools.dumps import Dump
from plenofir.fpga.tools.simulators import find_simulator
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name

HERE = Path(__file__).parent
# Streams of a design in the short hunt; number of designs of entities without another such bench.
STREAMS = 2
DESIGNS = {"colour_mosaic": 4, "i2c_rom_slave": 2, "load_port": 3}
FAULTS = [
    # A fault may give the number of the first design to try.
    (entity, *(*fault, 0)[:4])
    for entity in entities()
    for fault in import_module(f"hunt.{entity}_hunt").FAULTS
]


@pytest.fixture(autouse=True)
def simulator():
    with mock.patch.dict(os.environ, find_simulator(simulator_name(), brief=True).environment):
        yield


@pytest.mark.parametrize("entity", entities())
def test_short_draw(entity: str) -> None:
    # Fixed seeds here, so that a failure is due to the change; `make hunt` draws new ones.
    seed = int(os.environ.get("SEED") or 1)
    rng = random.Random(f"{seed} {entity}")
    print(f"SEED={seed}")
    for _ in range(int(os.environ.get("DESIGNS") or DESIGNS.get(entity, 1))):
        result = run_design(entity, rng.randrange(10**6), streams=STREAMS)
        assert not result.fault, f"make hunt CASE={result.name}: {result.fault}"
        assert result.streams == STREAMS


@pytest.mark.slow
@pytest.mark.parametrize(("entity", "file", "old", "new", "first"), FAULTS)
def test_planted_fault_is_found(
    monkeypatch: pytest.MonkeyPatch, entity: str, file: str, old: str, new: str, first: int
) -> None:
    # Errors by changed VHDL elsewhere do not count.
    monkeypatch.delenv("NVC_COVERAGE", raising=False)
    for number in range(first, first + 30):
        result = run_design(
            entity,
            number,
            streams=4,
            change=lambda sources, folder: plant(folder, sources, file, old, new),
        )
        if result.fault:
            assert not run_design(entity, number, streams=4).fault
            return
    pytest.fail("not noticed")


def test_the_command_names_the_case_that_failed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def hunt(options: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["hunt.py", *options.split()])
        return main(), capsys.readouterr().out

    code, text = hunt("--case raster-7")
    assert code == 2
    assert "no hunt of raster" in text
    code, text = hunt("--minutes 0.001 --seed 1 --jobs 1 --entity parallel_to_stream")
    assert code == 0
    assert "parallel_to_stream: 12 cases on 1 designs, 0 failed" in text
    code, text = hunt("--waves")
    assert code == 2
    assert "CASE=" in text

    # The printed line, as a command, repeats the case and writes its waveform.
    _, file, old, new, _ = next(fault for fault in FAULTS if fault[0] == "parallel_to_stream")
    planted = partial(
        run_design, change=lambda sources, folder: plant(folder, sources, file, old, new)
    )
    monkeypatch.setattr("hunt.hunt.run_design", planted)
    code, text = hunt("--minutes 0.001 --seed 1 --jobs 1 --entity parallel_to_stream")
    assert code == 1
    line = re.search(r"make hunt CASE=(\S+) WAVES=1  # (.*)", text)
    assert line is not None
    code, text = hunt(f"--case {line[1]} --waves")
    assert code == 1
    told, waveform = text.splitlines()
    assert told == line[2]
    names = {signal.canonical for signal in Dump(Path(waveform.removeprefix("waveform: "))).signals}
    assert any(name.endswith(".pixel_valid") for name in names), names


def test_references_import_numpy_alone() -> None:
    """They import nothing of plenofir, so that a misunderstanding is not on both sides."""
    for source in (HERE / "references").glob("*.py"):
        for node in ast.walk(ast.parse(source.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert name.split(".")[0] == "numpy" or name.startswith(
                    ("hunt.references", "collections", "dataclasses", "math")
                ), f"{source.name} imports {name}"


def test_start_values_reach_nearly_all_registers(tmp_path: Path) -> None:
    """Nearly all declared start values can be drawn, except those of types of unknown size."""
    sources = hdl.hdl_sources()
    copies = with_start_values(sources, tmp_path, random.Random(1))[1:]
    declared = changed = 0
    for source, copy in zip(sources, copies, strict=True):
        pattern = r"^ *(?:signal|shared variable) [^;]*:=[^;]*;"
        before = re.findall(pattern, source.read_text(), re.M)
        after = re.findall(pattern, copy.read_text(), re.M)
        declared += len(before)
        changed += sum("start_values" in a or a != b for a, b in zip(before, after, strict=True))
    assert declared > 500
    # A random bit equals the declared one half of the time.
    assert changed > 0.6 * declared
