# SPDX-License-Identifier: Apache-2.0
"""The build flow with tools that only look like ISE's: order, options, reports, failures.

Their files have the form of public logs of ISE 14.7 for the same device, with other contents:
``source/VmodCAM_Ref.syr``, ``.twr`` and ``_map.mrp`` of github.com/MDMTseng/AtlysSGM.
"""

import json
import os
import re
import stat
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bitstream_check.checks import source_of_line
from plenofir.commands import app as cli
from plenofir.commands.app import app
from plenofir.fpga.bitstream import ise, ise_reports, top_level
from plenofir.fpga.hdmi.edid import make_edid
from plenofir.fpga.hdmi.modes import HD720
from plenofir.ground import project
from plenofir.ground.errors import EXIT_BAD_INPUT, InputError
from plenofir.plan import load_scene, make_plan

TOP, PART = top_level.TOP, top_level.PART

# Each fake tool records its command, and writes the files of the true one.
XST_LOG = """\
Synthesizing Unit <switched_fir_1>.
    Related source file is "/hdl/fir/switched_fir.vhd".
    WARNING:Xst:2404 -  FFs/Latches <sums<2:1>> (without init value) have a constant value of 0 in \
block <switched_fir_1>.
    Summary:
	inferred 135 D-type flip-flop(s).
Unit <switched_fir_1> synthesized.
WARNING:Xst:1710 - FF/Latch <a_0> (without init value) has a constant value of 0 in block \
<atlys_top>. This FF/Latch will be trimmed during the optimization process.
WARNING:Xst:653 - Signal <b> is used but never assigned. This sourceless signal will be
   automatically connected to value GND.
WARNING:Xst:1710 - FF/Latch <a_0> (without init value) has a constant value of 0 in block \
<atlys_top>. This FF/Latch will be trimmed during the optimization process.
WARNING:Xst:647 - Input <c> is never used. This port will be preserved and left unconnected.
"""
SECTION = """\
================================================================================
Timing constraint: {constraint};
For more information, see Period Analysis in the Timing Closure User Guide (UG612).

 {paths} paths analyzed, 678 endpoints analyzed, {errors} failing endpoints
 {errors} timing errors detected. ({errors} setup errors, 0 hold errors, 0 component \
switching limit errors)
 Minimum period is  {best}ns.
--------------------------------------------------------------------------------

"""
DERIVED = {
    "TS_receive_clocks_pll_pixel": "TS_tmds",
    "TS_receive_clocks_pll_half": "TS_tmds / 2",
    "TS_transmit_clocks_pll_pixel": "TS_receive_clocks_pll_pixel",
    "TS_transmit_clocks_pll_half": "TS_receive_clocks_pll_pixel / 2",
}


def period(name: str) -> str:
    """Text of a derived constraint, broken and padded as TRCE does it."""
    return f'{name} = PERIOD TIMEGRP         \n"{name[3:]}"         {DERIVED[name]} HIGH \n50%'


TIMING_REPORT = "".join(
    [
        SECTION.format(
            constraint='TS_control = PERIOD TIMEGRP "control" 10 ns HIGH 50%',
            paths=2345,
            errors=0,
            best=6.123,
        ),
        *(
            SECTION.format(constraint=period(name), paths=123456, errors=0, best=6.001)
            for name in list(DERIVED)[1:]
        ),
        SECTION.format(
            constraint=period("TS_receive_clocks_pll_pixel"),
            paths=123456,
            errors="$FAILING",
            best="${PERIOD}",
        ),
        """\
================================================================================
Timing constraint: TS_control_to_receive = MAXDELAY FROM TIMEGRP "control" TO
TIMEGRP "receive" 10 ns DATAPATHONLY;

 12 paths analyzed, 12 endpoints analyzed, 0 failing endpoints
 0 timing errors detected. (0 setup errors, 0 hold errors)
 Maximum delay is   4.321ns.
--------------------------------------------------------------------------------

""",
    ]
)
REPORTS = {
    "xst": f"cat <<'END'\n{XST_LOG}END\ntouch {TOP}.ngc",
    "ngdbuild": f"touch {TOP}.ngd",
    "map": f"""cat > {TOP}_map.mrp <<'END'
  Number of Slice Registers:                 9,876 out of  54,576   18%
    Number used as Flip Flops:               9,870
  Number of Slice LUTs:                      8,765 out of  27,288   32%
  Number of RAMB16BWERs:                        84 out of     116   72%
  Number of BUFG/BUFGMUXs:                       7 out of      16   43%
END
touch {TOP}_map.ncd""",
    "par": f"touch {TOP}.ncd",
    "trce": f"cat > {TOP}.twr <<END\n{TIMING_REPORT}END\n",
    "bitgen": f"printf BITS > {TOP}.bit",
}


def install(folder: Path, **bodies: str) -> Path:
    """Put the fake tools into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for tool in ise.TOOLS:
        script = folder / tool
        body = bodies.get(tool, REPORTS[tool])
        notes = folder / "commands.txt"
        script.write_text(
            f'#!/bin/sh\necho "$(basename $0) $*" >> {notes}\n'
            f'echo "$LD_LIBRARY_PATH" >> {folder}/libraries.txt\n{body}\n'
        )
        script.chmod(script.stat().st_mode | stat.S_IXUSR)
    return folder


def commands(folder: Path) -> list[list[str]]:
    """Commands that the fake tools were given."""
    return [line.split() for line in (folder / "commands.txt").read_text().splitlines()]


@pytest.fixture
def tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Fake tools on the PATH, all well."""
    folder = install(tmp_path / "tools")
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("FAILING", "0")
    monkeypatch.setenv("PERIOD", "12.345")
    return folder


def run(out: Path, **generics: top_level.Value) -> ise.BuildReport:
    """Build with what is on the PATH."""
    return ise.build(ise.find_installation(), generics, out, lambda *_: None)


def test_flow(tools: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    report = run(out)
    assert (out / "plenofir.bit").read_text() == "BITS"
    assert report == ise.BuildReport(
        part="xc6slx45-csg324-3",
        generics=top_level.default_generics(),
        utilisation={
            "Slice Registers": (9876, 54576),
            "Slice LUTs": (8765, 27288),
            "RAMB16BWERs": (84, 116),
            "BUFG/BUFGMUXs": (7, 16),
        },
        timing=[
            ise_reports.Timing(
                'TS_control = PERIOD TIMEGRP "control" 10 ns HIGH 50%', 2345, 0, 6.123
            ),
            *(
                ise_reports.Timing(
                    f'{name} = PERIOD TIMEGRP "{name[3:]}" {DERIVED[name]} HIGH 50%',
                    123456,
                    0,
                    12.345 if name == "TS_receive_clocks_pll_pixel" else 6.001,
                )
                for name in [*list(DERIVED)[1:], "TS_receive_clocks_pll_pixel"]
            ),
            ise_reports.Timing(
                'TS_control_to_receive = MAXDELAY FROM TIMEGRP "control" TO TIMEGRP "receive" '
                "10 ns DATAPATHONLY",
                12,
                0,
                4.321,
            ),
        ],
        clocks={
            clock: f'{name} = PERIOD TIMEGRP "{name[3:]}" {DERIVED[name]} HIGH 50%'
            for clock, name in zip(ise.DERIVED_CLOCKS, DERIVED, strict=True)
        },
        warnings=[
            ise_reports.Message(
                "xst",
                "Xst:653",
                "Signal <b> is used but never assigned. This sourceless signal will be "
                "automatically connected to value GND.",
                1,
            )
        ],
        other_warnings=4,
        seconds=report.seconds,
    )
    assert list(report.seconds) == list(ise.TOOLS)
    written = json.loads((out / "report.json").read_text())
    assert written["timing"][4]["best"] == 12.345
    assert "trimmed" in (out / "xst.log").read_text()


def test_commands(tools: Path, tmp_path: Path) -> None:
    run(tmp_path / "out")
    found = commands(tools)
    assert [command[0] for command in found] == list(ise.TOOLS)
    by_tool = {command[0]: command[1:] for command in found}
    assert by_tool["xst"][-4:] == ["-ifn", f"{TOP}.xst", "-ofn", f"{TOP}.syr"]
    constraints = str(project.root() / "constraints" / "atlys.ucf")
    for tool in ("ngdbuild", "map"):
        assert by_tool[tool][by_tool[tool].index("-p") + 1] == PART
    assert by_tool["ngdbuild"][-4:] == ["-uc", constraints, f"{TOP}.ngc", f"{TOP}.ngd"]
    assert by_tool["map"][-4:] == ["-o", f"{TOP}_map.ncd", f"{TOP}.ngd", f"{TOP}.pcf"]
    assert by_tool["par"][-3:] == [f"{TOP}_map.ncd", f"{TOP}.ncd", f"{TOP}.pcf"]
    assert by_tool["bitgen"][-3:] == [f"{TOP}.ncd", f"{TOP}.bit", f"{TOP}.pcf"]
    # Each option of a file is in the command, with its value beside it.
    for tool in ise.TOOLS[1:]:
        text = " ".join(by_tool[tool])
        for option in ise.read_options(project.root() / "scripts" / "ise" / f"{tool}.opt"):
            assert option in text
    script = (tmp_path / "out" / "work" / f"{TOP}.xst").read_text().splitlines()
    assert script[:2] == ['set -tmpdir "xst"', 'set -xsthdpdir "xst"']
    begin = script.index("run")
    assert begin == 2
    assert "-loop_iteration_limit 131072" in script
    assert script[begin + 1 : begin + 6] == [
        f"-ifn {TOP}.prj",
        f"-ofn {TOP}",
        "-ofmt NGC",
        f"-p {PART}",
        f"-top {TOP}",
    ]
    assert "-bus_delimiter <>" in script[begin:]


def test_generics_reach_the_project(tools: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(out, MICRO_IMAGE_SIZE=3, SHIFTS="-2 0 2", EXACT=True, MAX_COLUMNS=640)
    lines = (out / "work" / f"{TOP}.prj").read_text().splitlines()
    top = out / "work" / f"{TOP}.vhd"
    assert source_of_line(lines[-1]) == top
    assert lines[:-1] == top_level.project_lines()[:-1]
    generics = {
        line.split(":")[0].strip(): line.split(":=")[1].strip().rstrip(";")
        for line in top.read_text().split("port (")[0].splitlines()
        if ":=" in line
    }
    assert generics["MICRO_IMAGE_SIZE"] == "3"
    assert generics["SHIFTS"] == '"-2 0 2"'
    assert generics["EXACT"] == "true"
    assert generics["MAX_COLUMNS"] == "640"
    default = top_level.top_source().read_text()
    # Nothing else has changed, and no line has moved.
    changed = [
        (a, b)
        for a, b in zip(default.splitlines(), top.read_text().splitlines(), strict=True)
        if a != b
    ]
    assert len(changed) == 4


@pytest.mark.parametrize(
    ("generics", "message"),
    [
        ({"M": 5}, "atlys_top has no generic M"),
        ({"EXACT": 1}, "EXACT: 1 is not of type bool"),
        ({"SHIFTS": '" & x & "'}, "must be numbers and blanks"),
        ({"MICRO_IMAGE_SIZE": 11, "SHIFTS": "11"}, r"need \d+ of 116 block RAMs"),
        ({"MICRO_IMAGE_SIZE": 0}, "micro_image_size: Input should be greater than or equal to 1"),
        ({"SHIFTS": ""}, "shifts: "),
        ({"GUARD_BITS": 9}, "guard_bits"),
        ({"MICRO_IMAGE_SIZE": 200}, "M = 200 exceeds the core's limit"),
    ],
)
def test_generics_are_refused(
    tools: Path, tmp_path: Path, generics: dict[str, top_level.Value], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        run(tmp_path / "out", **generics)
    assert not (tools / "commands.txt").exists()


@pytest.mark.parametrize("tool", ise.TOOLS)
def test_tool_that_fails(tools: Path, tmp_path: Path, tool: str) -> None:
    out = tmp_path / "out"
    run(out)
    (tools / "commands.txt").unlink()
    message = 'ERROR:HDLCompiler:69 - "a.vhd" Line 12: <b> is not declared.'
    install(tools, **{tool: f"echo '{message}'; echo the end; exit 1"})
    with pytest.raises(InputError) as caught:
        run(out)
    error = caught.value
    assert error.problem == f'{tool} failed: HDLCompiler:69: "a.vhd" Line 12: <b> is not declared.'
    assert error.where == str(out / f"{tool}.log")
    assert [command[0] for command in commands(tools)] == list(
        ise.TOOLS[: ise.TOOLS.index(tool) + 1]
    )
    # No file is left that could be mistaken for a result.
    assert not (out / "plenofir.bit").exists()
    assert not (out / "report.json").exists()


@pytest.mark.parametrize("tool", ise.TOOLS)
def test_tool_that_leaves_nothing(tools: Path, tmp_path: Path, tool: str) -> None:
    install(tools, **{tool: "echo nothing to do"})
    with pytest.raises(InputError, match=f"{tool} failed: nothing to do"):
        run(tmp_path / "out")


def test_timing_not_met(tools: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FAILING", "17")
    monkeypatch.setenv("PERIOD", "14.2")
    with pytest.raises(InputError) as caught:
        run(tmp_path / "out")
    assert caught.value.problem == (
        "timing is not met: TS_receive_clocks_pll_pixel = PERIOD TIMEGRP "
        '"receive_clocks_pll_pixel" TS_tmds HIGH 50% (17 errors, 14.2 ns would be met); '
        "1 of 6 constraints fail"
    )
    assert commands(tools)[-1][0] == "trce"
    assert not (tmp_path / "out" / "plenofir.bit").exists()


def test_nothing_timed(tools: Path, tmp_path: Path) -> None:
    install(tools, trce=f"touch {TOP}.twr")
    with pytest.raises(InputError, match="clock clk is not timed") as caught:
        run(tmp_path / "out")
    assert caught.value.where == str(tmp_path / "out" / "work" / f"{TOP}.twr")
    assert commands(tools)[-1][0] == "trce"


@pytest.mark.parametrize(
    ("tool", "message", "what"),
    [
        (
            "xst",
            "    WARNING:Xst:737 - Found 1-bit latch for signal <b>. Latches may be generated from "
            "incomplete\n   case or if statements.",
            "Xst:737: Found 1-bit latch for signal <b>. Latches may be generated from incomplete "
            "case or if statements.",
        ),
        (
            "ngdbuild",
            "WARNING:ConstraintSystem:190 - The TNM 'tmds', does not directly or indirectly drive\n"
            "   any flip-flops, latches and/or RAMS",
            "ConstraintSystem:190: The TNM 'tmds', does not directly or indirectly drive any "
            "flip-flops, latches and/or RAMS",
        ),
    ],
)
def test_fatal_warnings(tools: Path, tmp_path: Path, tool: str, message: str, what: str) -> None:
    install(tools, **{tool: f"cat <<'END'\n{message}\nEND\n{REPORTS[tool]}"})
    with pytest.raises(InputError) as caught:
        run(tmp_path / "out")
    assert caught.value.problem.startswith(what)
    assert caught.value.where == str(tmp_path / "out" / f"{tool}.log")
    assert commands(tools)[-1][0] == tool
    assert not (tmp_path / "out" / "report.json").exists()


def test_settings_are_read_in_a_subshell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tools = install(tmp_path / "ISE_DS" / "bin")
    settings = tmp_path / "ISE_DS" / "settings64.sh"
    settings.write_text(
        'test "$#" = 1 || exit 1\nPATH="$1/bin:$PATH"\nLD_LIBRARY_PATH=/ise/lib\n'
        "export PATH LD_LIBRARY_PATH\necho settings are read\n"
    )
    monkeypatch.setenv("FAILING", "0")
    monkeypatch.setenv("PERIOD", "12")
    before = dict(os.environ)
    out = tmp_path / "out"
    ise.build(ise.find_installation(str(settings.parent)), {}, out, lambda *_: None)
    assert dict(os.environ) == before
    assert (tools / "libraries.txt").read_text().split() == ["/ise/lib"] * len(ise.TOOLS)
    assert "settings are read" not in (out / "par.log").read_text()


def test_library_path_of_the_caller(
    tools: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LD_LIBRARY_PATH", "")
    monkeypatch.setenv(ise.SAVED_LIBRARY_PATH, "/ise/lib")
    run(tmp_path / "out")
    assert set((tools / "libraries.txt").read_text().split()) == {"/ise/lib"}


def test_without_ise(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(ise, "USUAL_PLACE", tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"Xilinx ISE 14\.7 is not installed"):
        ise.find_installation()
    with pytest.raises(InputError, match="no settings64"):
        ise.find_installation(str(tmp_path))
    (tmp_path / "settings64.sh").touch()
    assert ise.find_installation().folder == tmp_path


def test_command(tools: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = CliRunner().invoke(
        app, ["bitstream", "build", "-a", "-3/5,0 3/5", "--max-columns", "640", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    assert "RAMB16BWERs 84 of 116" in done.output
    assert "warning     xst: Xst:653: Signal <b> is used but never assigned" in done.output
    assert "clock       tx_clk_x2: timed by TS_transmit_clocks_pll_half" in done.output
    generics = json.loads((out / "report.json").read_text())["generics"]
    assert (generics["SHIFTS"], generics["MAX_COLUMNS"]) == ("-3 0 3", 640)


def test_scene(tools: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    file = project.root() / "scenes" / "rgb-480p.toml"
    command = ["bitstream", "build", "--scene", str(file), "--out", str(out)]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    core = make_plan(load_scene(file)).core
    generics = json.loads((out / "report.json").read_text())["generics"]
    assert top_level.configuration(generics) == core
    top = (out / "work" / f"{TOP}.vhd").read_text()
    shifts = " ".join(map(str, core.shifts))
    assert re.search(rf'SHIFTS +: string +:= "{shifts}";', top)


def test_own_edid(tools: Path, tmp_path: Path) -> None:
    edid = make_edid((HD720,))
    (tmp_path / "own.bin").write_bytes(edid)
    file = tmp_path / "scene.toml"
    text = (project.root() / "scenes" / "rgb-480p.toml").read_text()
    file.write_text(
        text.replace("[build]", '[screen]\noverlay = true\n\n[build]\nedid = "own.bin"')
    )
    out = tmp_path / "out"
    command = ["bitstream", "build", "--scene", str(file), "--out", str(out)]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert "1280 x 720 at 60.00 Hz preferred; no extension, so sources send DVI" in done.output
    assert edid[-16:].hex().upper() in (out / "work" / "edid_pkg.vhd").read_text()
    lines = (out / "work" / f"{TOP}.prj").read_text().splitlines()
    # The scene's screen is in the room of the video path.
    for name in ("edid_pkg", "screen_pkg"):
        package = out / "work" / f"{name}.vhd"
        assert [line for line in lines if f"/{name}." in line] == [f'vhdl work "{package}"']


@pytest.mark.parametrize("place", ["report.json", "xst.log", "work/scene.toml"])
def test_a_scene_among_old_results_stays(tools: Path, tmp_path: Path, place: str) -> None:
    file = tmp_path / place
    file.parent.mkdir(exist_ok=True)
    text = (project.root() / "scenes" / "rgb-480p.toml").read_text()
    file.write_text(text)
    (tmp_path / "plenofir.bit").write_text("old")
    with pytest.raises(InputError, match=f"would be removed, but {file} is read"):
        cli.run(["bitstream", "build", "--scene", str(file), "--out", str(tmp_path)])
    assert file.read_text() == text
    assert (tmp_path / "plenofir.bit").read_text() == "old"
    assert not (tools / "commands.txt").exists()


@pytest.mark.parametrize(
    ("scene", "options", "message"),
    [
        ("grey-microscope", [], "a core, not a board"),
        ("rgb-480p", ["--max-columns", "640"], "--max-columns cannot be combined with --scene"),
        ("none", [], "no such scene"),
    ],
)
def test_scenes_are_refused(
    tools: Path, tmp_path: Path, scene: str, options: list[str], message: str
) -> None:
    file = project.root() / "scenes" / f"{scene}.toml"
    command = ["bitstream", "build", "--scene", str(file), "--out", str(tmp_path / "o"), *options]
    done = CliRunner().invoke(app, command)
    assert isinstance(done.exception, InputError)
    assert message in str(done.exception)
    assert not (tools / "commands.txt").exists()
    assert not (tmp_path / "o").exists()


def test_exit_code_without_ise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(ise, "USUAL_PLACE", tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sys.argv", ["plenofir", "bitstream", "build", "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == EXIT_BAD_INPUT
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(
        "plenofir: bitstream: Xilinx ISE 14.7 is not installed (xst, ngdbuild"
    )
