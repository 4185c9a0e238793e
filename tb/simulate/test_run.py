# SPDX-License-Identifier: Apache-2.0
"""A run: file bench, command line, results, bad input."""

import json
import os
import re
import sys
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
from in_process import plenofir

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.simulate.file_bench import run_bench, wave_signals
from plenofir.fpga.tools.simulators import SimulationError, Simulator, find_simulator
from plenofir.ground.errors import EXIT_MISMATCH, EXIT_TOOL_FAILED
from plenofir.ground.images import read_image, write_png
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic, refocus
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name


def sim(*arguments: str, cwd: Path | None = None) -> CompletedProcess[str]:
    return plenofir("sim", "--simulator", simulator_name(), *arguments, cwd=cwd)


def random_image(shape: tuple[int, ...], dtype: type = np.uint8, seed: int = 0) -> np.ndarray:
    largest = np.iinfo(dtype).max
    return np.random.default_rng(seed).integers(0, largest, shape, dtype, endpoint=True)


@pytest.mark.parametrize("severity", ["Error", "Fatal", "Failure"])
def test_what_nvc_found_is_told(tmp_path: Path, severity: str) -> None:
    message = f"** {severity}: (init): frame_sequencer: no modulus"
    notes = [f"   Note: generic G{i} => {i}" for i in range(20)]
    code = f"print(*{['** Note: a', message, *notes]!r}, sep='\\n'); raise SystemExit(1)"
    with pytest.raises(SimulationError) as failed:
        Simulator("nvc", "nvc 1.23", {}).run([sys.executable, "-c", code], tmp_path)
    told = str(failed.value).splitlines()[1:]
    assert told == [message, *notes[:14]]


@pytest.mark.parametrize("stall_percent", [0, 40])
@pytest.mark.parametrize("arithmetic", [ExactArithmetic(), StoredProductArithmetic()])
def test_file_bench_equals_golden_model(tmp_path: Path, arithmetic, stall_percent: int) -> None:
    core = CoreConfiguration(
        micro_image_size=5, shifts=(-3,), max_columns=64, channels=3, arithmetic=arithmetic
    )
    frames = random_image((2, 26, 37, 3))
    result = run_bench(
        find_simulator(simulator_name()), core, frames, tmp_path, stall_percent=stall_percent
    )
    want = np.array([arithmetic.refocus(frame, 5, shift=-3) for frame in frames])
    assert np.array_equal(result.frames, want)
    if stall_percent == 0:
        assert result.input_clocks == 2 * 26 * 37
        assert result.latency_clocks == core.latency_clocks(37)


def test_a_band_of_one_line_waits_no_longer_than_it_must(tmp_path: Path) -> None:
    # The filters turn through three rows: the fourth line waits for a clock after a band of 14.
    engine = FirEngine(parallel_rows=3)
    core = CoreConfiguration(micro_image_size=3, shifts=(3,), max_columns=24, engine=engine)
    frames = random_image((3, 4, 14))
    result = run_bench(find_simulator(simulator_name()), core, frames, tmp_path)
    assert np.array_equal(result.frames, [core.golden(frame)[0] for frame in frames])
    assert result.latency_clocks == core.latency_clocks(14, 4, 3)


def test_a_second_run_leaves_nothing_of_the_first(tmp_path: Path) -> None:
    raw = random_image((20, 25))
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "out"

    def files(*arguments: str) -> set[str]:
        done = sim("-M", "5", "--out", str(out), *arguments)
        assert done.returncode == 0, done.stderr
        found = {file.name for file in out.iterdir()}
        assert found == {*json.loads((out / "report.json").read_text())["files"], "own.png"}
        return found

    out.mkdir()
    write_png(out / "own.png", raw)
    assert len(files("--raw", str(tmp_path / "raw.png"), "-a", "0 1")) == 8
    # The first run's own file is not removed while the second run uses it.
    kept = out / "golden_1.png"
    done = sim("-M", "5", "-a", "0", "--out", str(out), "--raw", str(kept))
    assert done.returncode == 0, done.stderr
    kept.unlink()
    left = ["diff.png", "golden.png", "own.png", "refocused.png", "report.json"]
    assert sorted(file.name for file in out.iterdir()) == left


@pytest.mark.parametrize(
    ("shape", "dtype", "m", "a"),
    [
        ((40, 50), np.uint8, 3, "2/3"),
        ((31, 29, 3), np.uint8, 4, "-1/2"),
        ((24, 36), np.uint16, 3, "1"),
        ((25, 25, 3), np.uint16, 5, "6/5"),
        ((1, 9), np.uint8, 1, "7"),
    ],
)
def test_command_leaves_the_correctly_rounded_image(tmp_path: Path, shape, dtype, m, a) -> None:
    raw = random_image(shape, dtype)
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "new" / "out"
    done = sim("--raw", str(tmp_path / "raw.png"), "-M", str(m), f"--a={a}", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert sorted(f.name for f in out.iterdir()) == [
        "diff.png",
        "golden.png",
        "refocused.png",
        "report.json",
    ]
    want = refocus(raw, m, a)
    refocused = read_image(out / "refocused.png")
    assert refocused.dtype == dtype
    assert np.array_equal(refocused, want)
    assert np.array_equal(read_image(out / "golden.png"), want)
    assert not read_image(out / "diff.png").any()
    report = json.loads((out / "report.json").read_text())
    assert report["mismatches"] == 0
    assert report["pixels_compared"] == shape[0] * shape[1]
    assert report["slices"][0]["largest_error"] <= report["error_bound"] <= 0.5
    assert (report["M"], report["columns"], report["rows"]) == (m, shape[1], shape[0])


def test_stored_products_by_command(tmp_path: Path) -> None:
    raw = random_image((30, 40, 3))
    write_png(tmp_path / "raw.png", raw)
    done = sim(
        *("--raw", str(tmp_path / "raw.png"), "-M", "3", "--a", "2/3", "--out", str(tmp_path)),
        *("--arith", "stored", "--fraction", "0", "--guard", "0"),
    )
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["arithmetic"] == {"kind": "stored", "fraction_bits": 0, "guard_bits": 0}
    assert 0.5 < report["slices"][0]["largest_error"] <= report["error_bound"]
    want = StoredProductArithmetic(fraction_bits=0, guard_bits=0).refocus(raw, 3, shift=2)
    assert np.array_equal(read_image(tmp_path / "refocused.png"), want)


def test_sweep_through_the_array(tmp_path: Path) -> None:
    raw = random_image((31, 40, 3))
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "out"
    done = sim(
        *("--raw", str(tmp_path / "raw.png"), "-M", "3", "-a", "-2/3 0 1", "--parallel-rows", "4"),
        *("--interpolation", "linear", "--out", str(out)),
    )
    assert done.returncode == 0, done.stderr
    report = json.loads((out / "report.json").read_text())
    assert report["mismatches"] == 0
    assert report["pixels_compared"] == 3 * 31 * 40
    assert report["parallel_rows"] == 4
    for a, name in (("-2/3", "-2_3"), ("0", "0"), ("1", "1")):
        got = read_image(out / f"refocused_{name}.png")
        assert np.array_equal(got, refocus(raw, 3, a, interpolation="linear"))
    assert len(list(out.iterdir())) == 10


def test_frames_of_any_rows_without_a_pause(tmp_path: Path) -> None:
    write_png(tmp_path / "raw.png", random_image((42, 30)))
    clocks = {}
    for any_rows in ((), ("--any-rows",)):
        done = sim(
            *("--raw", str(tmp_path / "raw.png"), "-M", "5", "-a", "-1/5 2", "--engine"),
            *("moving_sum", *any_rows, "--out", str(tmp_path / "out")),
        )
        assert done.returncode == 0, done.stderr
        report = json.loads((tmp_path / "out" / "report.json").read_text())
        assert report["mismatches"] == 0
        clocks[bool(any_rows)] = report["clocks_per_pixel"]
    # Three blank lines after the first of the two frames, or none.
    assert clocks[False] > clocks[True] == 1


def test_waves(tmp_path: Path) -> None:
    import pywellen

    write_png(tmp_path / "raw.png", random_image((12, 12)))
    done = sim(
        *("--raw", str(tmp_path / "raw.png"), "-M", "3", "--a", "0", "--out", str(tmp_path)),
        *("--waves", "1"),
    )
    assert done.returncode == 0, done.stderr
    names = {var.full_name for var in pywellen.Waveform(str(tmp_path / "refocused.fst")).all_vars()}
    assert any(name.endswith("column_pass(0).stage.control.closed") for name in names)
    saved = (tmp_path / "refocused.gtkw").read_text().splitlines()
    shown = {line.partition("[")[0] for line in saved if line[0] not in "[@-*"}
    assert shown <= names
    core = CoreConfiguration(micro_image_size=3, shifts=(0,), max_columns=12)
    assert len(shown) == len(wave_signals(core))
    # The frame with stalls has a waveform of its own.
    assert (tmp_path / "stalled.gtkw").read_text().splitlines()[1:] == saved[1:]


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("axis_fifo.vhd", "s_axis_tready <= can_write;", "s_axis_tready <= '1';"),
        ("axis_fifo.vhd", "read_enable   => word_free,", "read_enable   => has_words,"),
    ],
)
def test_words_lost_under_stalls_are_found(tmp_path, monkeypatch, capsys, file, old, new) -> None:
    """By a run without options, which tells the seed that repeats it, and leaves the waveform."""
    from plenofir.commands import app as cli
    from plenofir.fpga.simulate import file_bench

    sources = plant(tmp_path / "hdl", file_bench.core_sources(), file, old, new)
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    write_png(tmp_path / "raw.png", random_image((20, 24)))
    arguments = ["plenofir", "sim", "--raw", str(tmp_path / "raw.png"), "-M", "3", "--a", "2/3"]
    arguments += ["--out", str(tmp_path / "out"), "--simulator", simulator_name()]

    def run(*more: str) -> tuple[int | str | None, str]:
        monkeypatch.setattr(sys, "argv", [*arguments, *more])
        with pytest.raises(SystemExit) as exit_:
            cli.main()
        printed = capsys.readouterr()
        return exit_.value.code, printed.out + printed.err

    assert run("--stalls", "0")[0] == 0
    code, told = run("--waves", "1")
    assert code in (EXIT_MISMATCH, EXIT_TOOL_FAILED)
    seed = re.search(r"seed (\d+)", told)
    assert seed is not None
    assert run("--stalls", seed[1])[0] == code
    assert (tmp_path / "out" / "stalled.gtkw").exists()


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("switch_control.vhd", "switches and mask when", "switches when"),
        ("switched_fir.vhd", "at_first_step = '1' and", "false and"),
        ("divide_round.vhd", "NUMERATOR_BITS) + HALF;", "NUMERATOR_BITS);"),
    ],
)
def test_a_fault_in_the_core_is_found(tmp_path, monkeypatch, capsys, file, old, new) -> None:
    """Exit code 1, the first wrong pixel named, and a difference picture that shows it."""
    from plenofir.commands import app as cli
    from plenofir.fpga.simulate import file_bench

    sources = plant(tmp_path / "hdl", file_bench.core_sources(), file, old, new)
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    write_png(tmp_path / "raw.png", random_image((20, 24)))
    arguments = ["plenofir", "sim", "--raw", str(tmp_path / "raw.png"), "-M", "3", "--a", "2/3"]
    arguments += ["--out", str(tmp_path / "out"), "--simulator", simulator_name()]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as exit_:
        cli.main()
    assert exit_.value.code == EXIT_MISMATCH
    assert "pixels differ; first: a = 2/3, frame 0, line " in capsys.readouterr().out
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["mismatches"] > 0
    assert read_image(tmp_path / "out" / "diff.png").any()


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("images")
    write_png(folder / "grey.png", random_image((20, 20)))
    write_png(folder / "rgb.png", random_image((20, 20, 3)))
    write_png(folder / "alpha.png", random_image((20, 20, 4)))
    write_png(folder / "deep.png", random_image((20, 20), np.uint16))
    write_png(folder / "wide.png", random_image((8, 8200)))
    (folder / "text.png").write_text("no image")
    (folder / "cut.png").write_bytes((folder / "rgb.png").read_bytes()[:200])
    (folder / "folder.png").mkdir()
    (folder / "file").write_text("")
    return folder


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--raw", "none.png"], "no such file"),
        (["--raw", "folder.png"], "folder.png: is a folder"),
        (["--raw", "text.png"], "no image of a known kind"),
        (["--raw", "cut.png"], "cut.png: is damaged"),
        (["--raw", "alpha.png"], "alpha channel that is not opaque"),
        (["--raw", "grey.png", "-M", "21", "--a", "0"], "less than one micro image"),
        (["--raw", "grey.png", "-M", "0"], "--micro-image: '0'"),
        (["--raw", "grey.png", "-M", "-3"], "--micro-image: '-3'"),
        (["--raw", "grey.png", "-M", "five"], "--micro-image: 'five'"),
        (["--raw", "grey.png", "-M", "5", "--a", "1/2"], "not on the grid of M = 5"),
        (["--raw", "grey.png", "--a", "1/x"], "not a focus setting"),
        (["--raw", "grey.png", "--a", "1/0"], "not a focus setting"),
        (["--raw", "grey.png", "--a", "100"], "taps"),
        (["--raw", "grey.png", "--a", "99999"], "taps"),
        (["--raw", "wide.png", "--a", "1"], "8192 columns"),
        (["--raw", "grey.png", "--a", "0 1/2"], "not on the grid of M = 5"),
        (["--raw", "grey.png", "--a", "0 1 5/5"], "--a: 1 is given twice"),
        (["--raw", "grey.png", "--parallel-rows", "0"], "--parallel-rows: '0'"),
        (["--raw", "grey.png", "--parallel-rows", "65"], "limit of 64"),
        (["--raw", "grey.png", "--any-rows"], "--any-rows cannot be combined with --engine fir"),
        (["--raw", "grey.png", "--interpolation", "cubic"], "'nearest', 'linear'"),
        (["--raw", "deep.png", "-M", "8", "--a", "0", "--interpolation", "3"], "--interpolation: "),
        (["--raw", "grey.png", "--arith", "float"], "--arith: 'float'"),
        (["--raw", "grey.png", "--arith", "stored", "--fraction", "13"], "--fraction: '13'"),
        (
            ["--raw", "grey.png", "--arith", "stored", "--fraction", "1", "--guard", "2"],
            "--guard: ",
        ),
        (
            ["--raw", "grey.png", "--fraction", "3"],
            "--fraction cannot be combined with --arith exact",
        ),
        (["--raw", "deep.png", "--arith", "stored"], "2^18 words"),
        (["--raw", "grey.png", "--simulator", "isim"], "--simulator: 'isim'"),
        (["--raw", "grey.png", "--out", "file"], "not a folder"),
        (["--raw", "grey.png", "--out", "file/below"], "not a folder"),
        (["--raw", "grey.png", "--out", "/proc/plenofir"], "--out: "),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(images: Path, arguments, message) -> None:
    before = sorted(images.rglob("*"))
    done = sim(*arguments, cwd=images)
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert done.stderr.startswith("plenofir: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stderr
    assert sorted(images.rglob("*")) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_write_permission(images: Path, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    done = sim("--raw", str(images / "grey.png"), "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
