# SPDX-License-Identifier: Apache-2.0
"""A scene's list of sources has exactly those that GHDL needs."""

import shutil
import subprocess
from pathlib import Path

import pytest

from plenofir.fpga.hdl_text import used_components, used_units
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import TOP, configure

GHDL = shutil.which("ghdl") or "ghdl"


@pytest.mark.parametrize("scene", ["grey-microscope", "rgb-720p"])
def test_the_list_is_what_analysis_wants(tmp_path: Path, scene: str) -> None:
    plan = make_plan(load_scene(scene))
    folder = tmp_path / "scene"
    configure(plan.model_copy(update={"path": "core", "device": "xc6slx45"}), folder)
    listed = [folder / line for line in (folder / "sources.txt").read_text().splitlines()]
    work = ("--std=93", f"--workdir={tmp_path}")
    for command in (["-a", *work, *map(str, listed)], ["-e", *work, "-o", f"{tmp_path}/x", TOP]):
        done = subprocess.run(
            [GHDL, *command], capture_output=True, text=True, check=False, cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
    used = {TOP}.union(
        *(
            used_units(text) | used_components(text)
            for text in (source.read_text() for source in listed)
        )
    )
    assert {source.stem for source in listed} <= used
