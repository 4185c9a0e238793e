# SPDX-License-Identifier: Apache-2.0
"""Every way to ISE has the options of ``xst.opt``: scripts, projects and FuseSoC's cores."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from plenofir.fpga.bitstream import ise, ise_project
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir.plan.project_files import write_project
from xst_lint import loop_limit

ROOT = project.root()
STUBS = Path(__file__).with_name("ise_stubs.tcl")


@pytest.mark.parametrize(("scene", "top"), [("grey-microscope", "scene_top"), ("rgb-720p", None)])
def test_configured_scripts(scene: str, top: str | None, tmp_path: Path) -> None:
    configure(make_plan(load_scene(scene, "xc6slx45" if top else None)), tmp_path)
    script = (tmp_path / f"{top or ise.TOP}.xst").read_text()
    assert set(ise.xst_options()) <= set(script.splitlines())


def calls(script: Path) -> list[list[str]]:
    """Commands of a project's Tcl to ISE."""
    tclsh = shutil.which("tclsh")
    if tclsh is None:
        pytest.skip("tclsh is not installed (scripts/setup.sh tests)")
    done = subprocess.run(
        [tclsh, str(STUBS), str(script)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [line.split("\t")[1:] for line in done.stdout.splitlines() if line.startswith("CALL")]


def set_properties(found: list[list[str]]) -> dict[str, str]:
    return {c[2]: c[3] for c in found if c[:2] == ["project", "set"] and len(c) == 6}


@pytest.mark.parametrize("parallel", [False, True])
def test_a_project_sets_each_option(parallel: bool, tmp_path: Path) -> None:
    plan = make_plan(load_scene("grey-microscope", "xc6slx45"))
    write_project(plan, "ise", tmp_path, parallel=parallel)
    top = "parallel_top" if parallel else "scene_pins"
    found = calls(tmp_path / f"{top}.tcl")
    properties = set_properties(found)
    assert properties == ise_project.project_properties()
    assert loop_limit(properties["Other XST Command Line Options"]) == 131072
    added = [call[2] for call in found if call[:2] == ["xfile", "add"]]
    assert sorted(added) == sorted(
        path.name for path in tmp_path.iterdir() if path.suffix in (".vhd", ".ucf")
    )


def core_files() -> dict[str, dict[str, Any]]:
    """FuseSoC's cores by their names."""
    read = (yaml.safe_load(path.read_text()) for path in sorted(ROOT.glob("*.core")))
    return {core["name"].rpartition(":")[0]: core for core in read}


def dependencies(core: dict[str, Any], cores: dict[str, dict[str, Any]]) -> set[str]:
    """Names of all cores whose files a core gets."""
    found = set()
    for fileset in core.get("filesets", {}).values():
        for name in fileset.get("depend", ()):
            plain = name.rpartition(":")[0]
            found |= {plain} | dependencies(cores[plain], cores)
    return found


def test_fusesoc_cores_for_ise_get_the_options() -> None:
    cores, holder = core_files(), "plenofir:ip:refocuser"
    with_ise = {
        name
        for name, core in cores.items()
        if any("ise" in target.get("tools", {}) for target in core.get("targets", {}).values())
    }
    assert len(with_ise) == 4
    for name in with_ise:
        assert name == holder or holder in dependencies(cores[name], cores)
    core = cores[holder]
    assert "tool_ise? (ise)" in core["targets"]["default"]["filesets"]
    ((file, facts),) = core["filesets"]["ise"]["files"][0].items()
    assert facts == {"file_type": "tclSource"}
    # What ISE sees of it is what xst.opt says; it was built from it (scripts/build_hdl.py).
    text = (ROOT / file).read_text()
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    assert lines == ise_project.project_tcl().splitlines()


def test_all_options_reach_a_project(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """An option without a property of its own goes with the others; a wrong value is refused."""
    monkeypatch.setattr(ise, "option_folder", lambda: tmp_path)
    (tmp_path / "xst.opt").write_text("-fsm_extract NO\n-async_to_sync NO\n-mux_extract Yes\n")
    assert ise_project.project_properties() == {
        "FSM Encoding Algorithm": "None",
        "Other XST Command Line Options": "-async_to_sync NO -mux_extract Yes",
    }
    (tmp_path / "xst.opt").write_text("-opt_level 7\n")
    with pytest.raises(InputError, match="'-opt_level 7': a project takes 1, 2 for it"):
        ise_project.project_properties()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('project set "FSM Encoding" "None" -process "Synthesize - XST"', "no property"),
        ('project set "RAM Extraction" "Yes" -process "Synthesize - XST"', "takes no Yes"),
        ("project set device xc7a35t", "takes no xc7a35t"),
        ("xfile add missing.vhd", "no file missing.vhd"),
        ("synthesise all", "invalid command"),
    ],
)
def test_the_stubs_refuse(line: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "script.tcl").write_text(f"project new name\n{line}\n")
    with pytest.raises(AssertionError, match=re.escape(message)):
        calls(tmp_path / "script.tcl")
