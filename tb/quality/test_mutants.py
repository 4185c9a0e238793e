"""The mutation check: small changes of the VHDL are noticed, or it is known why not."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from plenofir import project
from plenofir.fpga import hdl

sys.path.insert(0, str(project.root() / "scripts"))

import mutate

SCRIPT = project.root() / "scripts" / "mutate.py"


@pytest.mark.slow
def test_survivors_are_explained(tmp_path: Path) -> None:
    out = tmp_path / "mutants.json"
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--count", "120", "--out", str(out)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(r"(\d+) of (\d+) mutants killed", done.stdout)
    assert found
    assert int(found.group(2)) >= 100
    assert len(json.loads(out.read_text())) == 120


def test_explained_mutants_exist() -> None:
    # What is explained is a change that the rules make of a line that is there.
    keys = {mutant.key for mutant in mutate.mutants(hdl.board_sources())}
    assert len(keys) > 3000
    assert mutate.explained() - keys == set()


def test_every_source_has_mutants_and_tests() -> None:
    files = {mutant.file for mutant in mutate.mutants(hdl.board_sources())}
    names = {source.name for source in hdl.board_sources()}
    # Packages of constants, wiring.
    without = {
        "clock_input.vhd",
        "edid_pkg.vhd",
        "gearbox_5_to_10.vhd",
        "hdmi_pkg.vhd",
        "pixel_clock_select.vhd",
        "pll_settings_pkg.vhd",
        "serial_clocks.vhd",
        "stored_product.vhd",
        "tmds_output.vhd",
        "token_pkg.vhd",
    }
    assert names - files == without
    for _, tests in mutate.TESTS:
        for test in tests:
            file = next(word for word in test.split() if word.endswith(".py"))
            assert (project.root() / file).is_file()


def test_sample_stays_where_sources_change() -> None:
    every = list(dict.fromkeys(mutate.mutants(hdl.board_sources())))
    sample = {mutant.key for mutant in mutate.chosen(every, 1, 120)}
    rest = [mutant for mutant in every if mutant.file != "fir_array.vhd"]
    without = {mutant.key for mutant in mutate.chosen(rest, 1, 120)}
    assert {key for key in sample if key[0] != "fir_array.vhd"} <= without
