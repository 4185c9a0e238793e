# SPDX-License-Identifier: Apache-2.0
"""The command `waves compare`: what it prints, exit codes, refusals."""

import json
import subprocess
from pathlib import Path

import pytest
from in_process import plenofir
from vcd import Vcd, counter

from plenofir.fpga.simulate.dump_compare import compare_dumps
from plenofir.fpga.tools.dumps import Dump
from plenofir.ground.errors import InputError


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return plenofir("waves", "compare", *map(str, arguments))


def test_command(tmp_path: Path) -> None:
    a = counter().write(tmp_path / "a.vcd")
    other = counter()
    other.signals["core.odd"][1][3] = "0"
    other.signals["lone"] = (1, ["0"])
    b = other.write(tmp_path / "b.vcd")
    same = run(a, a)
    assert (same.returncode, same.stderr) == (0, "")
    assert same.stdout.splitlines() == [
        "compared        2 signals, 8 cycles of clk",
        "only in A       0 signals",
        "only in B       0 signals",
        "result          equal",
    ]
    different = run(a, b)
    assert (different.returncode, different.stderr) == (1, "")
    assert different.stdout.splitlines() == [
        "compared        2 signals, 8 cycles of clk",
        "only in A       0 signals",
        "only in B       1 signal (--list names them)",
        "first differs   core.odd, cycle 3, 35 ns: 1 in A, 0 in B",
        "result          different",
    ]
    assert "  lone" in run(a, b, "--list").stdout.splitlines()
    assert run(a, b, "--from", "36ns").returncode == 0
    assert run(a, b, "--signals", "count").returncode == 0
    answer = run(a, b, "--json", "--to", "5")
    assert answer.returncode == 1
    content = json.loads(answer.stdout)
    assert (content["equal"], content["samples"], content["only_in_b"]) == (False, 6, ["lone"])
    assert content["differences"][0] == {
        "signal": "core.odd",
        "cycle": 3,
        "time_a": "35 ns",
        "time_b": "35 ns",
        "value_a": "1",
        "value_b": "0",
    }
    short = run(a, counter(cycles=7).write(tmp_path / "short.vcd"))
    assert short.returncode == 1
    assert "length differs  8 cycles in A, 7 in B" in short.stdout


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("files")
    counter().write(folder / "a.vcd")
    wide = counter()
    wide.signals["lone"] = (1, ["0"])
    wide.write(folder / "wide.vcd")
    Vcd({"unknown": (1, ["0"])}, clock="").write(folder / "other.vcd")
    (folder / "text.vcd").write_text("this is no waveform")
    (folder / "empty.vcd").write_text("")
    (folder / "cut.vcd").write_text((folder / "a.vcd").read_text()[:90])
    without_unit = (folder / "a.vcd").read_text().split("\n", 1)[1]
    (folder / "no_unit.vcd").write_text(without_unit)
    (folder / "folder.vcd").mkdir()
    return folder


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.vcd", "none.vcd"], "none.vcd: no such file"),
        (["folder.vcd", "a.vcd"], "no such file"),
        (["a.vcd", "text.vcd"], "text.vcd: cannot be read"),
        (["empty.vcd", "a.vcd"], "cannot be read"),
        (["cut.vcd", "a.vcd"], "cannot be read"),
        (["no_unit.vcd", "a.vcd"], "no time unit"),
        (["a.vcd", "other.vcd"], "no signal of one file is in the other"),
        (["a.vcd", "a.vcd", "--signals", "core.cuont"], "did you mean core.count"),
        (["a.vcd", "wide.vcd", "--signals", "lone"], "'lone' is only in wide.vcd"),
        (["a.vcd", "a.vcd", "--signals", "clk"], "besides the clock"),
        (["a.vcd", "a.vcd", "--clock", "mclk"], "no signal 'mclk' in both"),
        (["wide.vcd", "a.vcd", "--clock", "lone"], "'lone' is only in wide.vcd"),
        (["a.vcd", "a.vcd", "--clock", "core.count"], "core.count never rises"),
        (["a.vcd", "a.vcd", "--from", "12 parsecs"], "--from"),
        (["a.vcd", "a.vcd", "--to", "1.5"], "--to"),
        (["a.vcd", "a.vcd", "--from", "8"], "nothing happens in this range"),
        (["a.vcd", "a.vcd", "--from", "50ns", "--to", "40ns"], "nothing happens in this range"),
        (["a.vcd", "a.vcd", "--clock", "none", "--from", "3"], "a cycle needs a clock"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    files: Path, arguments, message: str, monkeypatch, capfd
) -> None:
    monkeypatch.chdir(files)
    done = run(*arguments)
    # Nor does the reader, which is not written in Python, say anything.
    assert capfd.readouterr() == ("", "")
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_file_of_nothing_but_a_header_has_no_signals(tmp_path: Path) -> None:
    (tmp_path / "a.vcd").write_text("$timescale 1ns $end\n$enddefinitions $end\n")
    assert not Dump(tmp_path / "a.vcd").signals
    with pytest.raises(InputError, match="no signal of one file is in the other"):
        compare_dumps(tmp_path / "a.vcd", tmp_path / "a.vcd")
