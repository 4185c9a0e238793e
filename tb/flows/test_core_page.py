# SPDX-License-Identifier: Apache-2.0
"""The core in a user's design: the lists and designs of docs/core.md, copied."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.hdl_text import used_components, used_units
from plenofir.ground import project
from plenofir_tb.flows import EXAMPLES, Run, icarus
from plenofir_tb.runner import run_case

PAGE = (project.root() / "docs" / "core.md").read_text()


def blocks(language: str) -> list[str]:
    """Code of the page in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.S | re.M)


FILES = blocks("sh")[0]
PLAIN, MODERN = blocks("vhdl")


@pytest.fixture
def analysed(
    tmp_path: Path, need: Callable[..., None], run: Run, monkeypatch: pytest.MonkeyPatch
) -> Callable[[str], Path]:
    """Analyse what the page lists; gives the folder with the library."""
    need("ghdl")
    if shutil.which("ghdl-mcode"):  # It analyses fast.
        monkeypatch.setenv("GHDL_BACKEND", "mcode")

    def call(commands: str) -> Path:
        shutil.copytree(project.root() / "hdl", tmp_path / "hdl")
        run("sh", "-e", "-c", commands)
        return tmp_path / "hdl"

    return call


def elaborates(run: Run, folder: Path, text: str, *options: str) -> None:
    """Analyse a design of the page and synthesise it."""
    (folder / "design.vhd").write_text(text)
    name = re.search(r"^entity (\w+) is", text, re.M)[1]
    run("ghdl", "-a", *options, "design.vhd", directory=folder)
    out = run("ghdl", "--synth", *options, "--out=none", name, directory=folder)
    assert "latch" not in out


def test_files_and_instance_in_vhdl_93(analysed, run: Run) -> None:
    elaborates(run, analysed(FILES), PLAIN, "--std=93")


def test_files_and_instances_in_vhdl_2008(analysed, run: Run) -> None:
    folder = analysed(FILES.replace("--std=93", "--std=08 --work=plenofir"))
    elaborates(run, folder, MODERN, "--std=08")
    # The first one too, in the core's library, as the page says.
    elaborates(run, folder, PLAIN, "--std=08", "--work=plenofir")


def test_no_file_too_many() -> None:
    listed = re.findall(r"(\w+)\.vhd", FILES)
    assert len(set(listed)) == len(listed)
    text = {path.stem: path.read_text() for path in hdl.hdl_sources()}
    used = {
        name for file in listed for name in used_units(text[file]) | used_components(text[file])
    }
    assert used - {"all"} == set(listed) - {"raster_refocuser"}


def test_every_pixel_of_the_instance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page's design with shorter lines, by the bench of the core."""
    file = tmp_path / "rgb_camera.vhd"
    assert "1280" in PLAIN
    file.write_text(PLAIN.replace("1280", "24"))
    sources = [*hdl.hdl_sources(), file]
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    core = CoreConfiguration(
        micro_image_size=5, shifts=(-3, 0), max_columns=24, channels=3, engine=MovingSumEngine()
    )
    case = {"core": core.model_dump(mode="json"), "thorough": False, "enclosed": True}
    run_case("rgb_camera", "core.raster_bench", generics={}, case=case)


def test_instance_in_verilog(need, run: Run, tmp_path: Path, verilog_scene: Path) -> None:
    """The page's instance between the example and the core, whose bench checks every pixel."""
    need("iverilog")
    (text,) = blocks("verilog")
    core = (verilog_scene / "scene_top.v").read_text()
    (tmp_path / "core.v").write_text(core.replace("module scene_top\n", "module scene_core\n"))
    inside = text.replace("scene_top core", "scene_core core")
    (tmp_path / "page.v").write_text(inside.replace("rgb_camera", "scene_top"))
    names = ("refocus_button", "tb_refocus_button", "check_frames")
    files = [EXAMPLES / "verilog" / f"{name}.v" for name in names]
    files += [tmp_path / "page.v", tmp_path / "core.v"]
    folders = [verilog_scene, EXAMPLES / "verilog"]
    found = icarus(run, folders, files, tmp_path / "bench")
    assert found == "PASS: 4 frames of 24 x 18 pixels, 3 slices\n"
    assert "configure examples/verilog/scene.toml --verilog" in PAGE
