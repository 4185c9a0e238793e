# SPDX-License-Identifier: Apache-2.0
"""A plain installation: from the source distribution, where no checkout can be read."""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import numpy as np
import pytest

import plenofir
from plenofir import InputError
from plenofir.fpga.hdl import board_sources, model_sources
from plenofir.ground import project
from plenofir.ground.images import read_image, write_png
from plenofir.plan.project_files import TOOLS
from plenofir.refocus import refocus

# Folders whose files are all read.
NAMED = ("constraints", "scenes", "scripts/ise", "tb/file_bench")
# Installed in the environment: opening any file of the checkout is an error.
NO_CHECKOUT = """
import sys
def look(event, arguments):
    if event == "open" and str(arguments[0]).startswith({checkout!r}):
        if not str(arguments[0]).startswith({packages!r}):
            raise AssertionError(arguments[0])
sys.addaudithook(look)
"""


@pytest.fixture(scope="module")
def bin_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Programs of an environment with the package, and the packages of this one beside it."""
    folder = tmp_path_factory.mktemp("install")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(folder)]
    subprocess.run(build, cwd=project.root(), check=True, stdout=subprocess.DEVNULL)
    (source,) = folder.glob("*.tar.gz")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    python = folder / "bin" / "python"
    (own,) = folder.glob("lib/python*/site-packages")
    packages = sysconfig.get_path("purelib")
    (own / "others.pth").write_text(f"{packages}\n")
    pip = [sys.executable, "-m", "pip", "-q", "--python", str(python), "install", "--no-index"]
    studies = project.root() / "studies"
    subprocess.run([*pip, "--no-deps", "--no-build-isolation", source, studies], check=True)
    audit = NO_CHECKOUT.format(checkout=f"{project.root()}{os.sep}", packages=packages)
    (own / "sitecustomize.py").write_text(audit)
    return python.parent


@pytest.fixture
def call(bin_folder: Path, tmp_path: Path):
    """Run a program of that environment in an empty folder."""

    def run(*words: str, path: str = os.environ["PATH"]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [bin_folder / words[0], *words[1:]],
            cwd=tmp_path,
            env={"HOME": str(tmp_path), "PATH": path},
            capture_output=True,
            text=True,
            check=False,
        )

    return run


def test_commands_find_their_files(call, tmp_path: Path) -> None:
    code = "import plenofir.ground.project as p; print(p.root(), p.in_checkout())"
    root, _, inside = call("python", "-c", code).stdout.strip().rpartition(" ")
    assert Path(root).parts[-3:] == ("site-packages", "plenofir", "_project")
    assert inside == "False"
    assert call("plenofir", "--version").stdout == f"{plenofir.__version__}\n"
    planned = call("plenofir", "plan", "rgb-480p", "--json")
    assert json.loads(planned.stdout)["scene"] == "rgb-480p", planned.stderr
    done = call("plenofir", "configure", "video-m11", "--out", "scene")
    assert (done.returncode, done.stderr) == (0, "")
    for line in (tmp_path / "scene" / "sources.txt").read_text().splitlines():
        assert (tmp_path / "scene" / line).is_file(), line
    write_png(tmp_path / "raw.png", np.full((15, 20), 7, np.uint8))
    assert "precision" in call("plenofir", "report", "--help").stdout
    done = call("plenofir", "views", "raw.png", "-M", "5")
    assert (done.stdout, done.stderr) == ("views: 25 views of 4 x 3 pixels\n", "")
    done = call("plenofir", "sim", "--raw", "raw.png", path="")
    assert done.returncode == 2
    assert done.stderr.startswith("plenofir: GHDL is not on the PATH; ")


@pytest.mark.slow
def test_sim_and_refocus(call, tmp_path: Path) -> None:
    raw = np.random.default_rng(5).integers(0, 256, (15, 20, 3), np.uint8)
    write_png(tmp_path / "raw.png", raw)
    done = call("plenofir", "sim", "--raw", "raw.png", "-a", "1/5", "--out", "sim")
    assert done.returncode == 0, done.stderr
    want = refocus(raw, 5, "1/5")
    assert (read_image(tmp_path / "sim" / "refocused.png") == want).all()
    words = ("raw.png", "-M", "5", "-a", "1/5", "--interpolation", "nearest", "--border", "zero")
    done = call("plenofir", "refocus", *words)
    assert done.returncode == 0
    assert done.stderr in (
        "",
        "note: compiling loops for this machine, once: some ten seconds of processor time\n",
    )
    assert (read_image(tmp_path / "refocused.png") == want).all()


def test_the_wheel_holds_what_commands_read(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=project.root(), check=True, stdout=subprocess.DEVNULL)
    (wheel,) = tmp_path.glob("*.whl")
    for tool in ("twine check --strict", "check-wheel-contents"):
        program, *words = tool.split()
        program = Path(sys.executable).parent / program
        if program.exists():
            done = subprocess.run([program, *words, wheel], capture_output=True, text=True)
            assert done.returncode == 0, done.stdout
    names = set(zipfile.ZipFile(wheel).namelist())
    root = project.root()
    needed = [
        *board_sources(),
        *model_sources(),
        *(root / "hdl").rglob("sources*.txt"),
        *(file for name in NAMED for file in (root / name).iterdir()),
    ]
    for file in needed:
        assert f"plenofir/_project/{file.relative_to(root)}" in names, file
    packages = [root / "golden" / "plenofir"]
    for file in (path for package in packages for path in package.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            assert str(file.relative_to(root / "golden")) in names, file
    assert not [name for name in names if "__pycache__" in name]
    # Any system takes it: no code of one, and file names that Windows and macOS tell apart.
    assert wheel.name.endswith("-py3-none-any.whl")
    assert not [name for name in names if re.search(r'[<>:"\\|?*]|[. ](/|$)|[^ -~]', name)]
    stems = {part.partition(".")[0].lower() for name in names for part in name.split("/")}
    assert not [stem for stem in stems if re.fullmatch("aux|con|nul|prn|com[0-9]|lpt[0-9]", stem)]
    assert len({name.lower() for name in names}) == len(names)
    # Windows takes 260 characters; a user's site-packages take about 110 of them.
    assert max(map(len, names)) < 150


def test_what_a_user_imports() -> None:
    assert issubclass(InputError, ValueError)
    assert (Path(plenofir.__file__).parent / "py.typed").is_file()


def test_components_of_a_scene_from_an_installation(call, tmp_path: Path) -> None:
    done = call(
        *("plenofir", "project", "grey-microscope", "--device", "xc7z020", "--tool", "ipxact"),
        *("--out", "components"),
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "interrupt_mask" in (tmp_path / "components" / "refocuser_axi.xml").read_text()


# Tool: scene, device and its constraints or script, for all tools, and a board that one builds.
PROJECTS = {
    "vivado": ("grey-microscope", "xc7z020", "scene_top.xdc"),
    "quartus": ("grey-microscope", "5ceba4", "scene_top.sdc"),
    "radiant": ("grey-microscope", "lifcl-40", "scene_pins.pdc"),
    "gowin": ("grey-microscope", "gw2ar-18", "scene_pins.sdc"),
    "diamond": ("grey-microscope", "lfe5u-45f", "scene_pins.lpf"),
    "ise": ("grey-microscope", "xc6slx9", "scene_pins.ucf"),
    "gatemate": ("rgb-480p", "ccgm1a1", "scene_pins.ccf"),
    "trellis": ("grey-microscope", "lfe5u-12f", "scene_pins.lpf"),
    "ipxact": ("grey-microscope", "xc7z010", "package_ip.tcl"),
}
BOARD_PROJECT = ("pynqz2-720p", "xc7z020", "pynqz2_top.xdc")


def analyses(folder: Path, sources: list[str], work: Path) -> None:
    """GHDL takes the sources of a project in their order; those of a board with its primitives."""
    ghdl = ["ghdl", "-a", "--std=93", f"--workdir={work}", f"-P{work}"]
    models = [str(model) for model in model_sources()]
    for words in ([*ghdl, "--work=unisim", *models], [*ghdl, *sources]):
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_projects_from_the_wheel_in_an_empty_environment(tmp_path: Path) -> None:
    """As a user installs it, with what the package index has: nothing of this environment."""
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=project.root(), check=True, stdout=subprocess.DEVNULL)
    (wheel,) = tmp_path.glob("*.whl")
    subprocess.run([sys.executable, "-m", "venv", str(tmp_path / "empty")], check=True)
    programs = tmp_path / "empty" / "bin"
    pip = [str(programs / "python"), "-m", "pip", "-q", "--disable-pip-version-check", "install"]
    done = subprocess.run([*pip, f"{wheel}[projects]"], capture_output=True, text=True)
    if "No matching distribution" in done.stderr or "Could not fetch URL" in done.stderr:
        pytest.skip("the package index cannot be reached")
    assert done.returncode == 0, done.stderr
    assert set(PROJECTS) == {*TOOLS, "ipxact"}
    ghdl = shutil.which("ghdl")
    for tool, (scene, device, file) in (*PROJECTS.items(), ("vivado", BOARD_PROJECT)):
        verilog = tool in TOOLS and TOOLS[tool].verilog
        if verilog and ghdl is None:
            continue
        out = f"{scene}-{tool}"
        words = ("project", scene, "--tool", tool, "--device", device, "--out", out)
        done = subprocess.run(
            [programs / "plenofir", *words],
            cwd=tmp_path,
            env={"HOME": str(tmp_path), "PATH": str(Path(str(ghdl)).parent) if verilog else ""},
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, ""), out
        names = {path.name for path in (tmp_path / out).iterdir()}
        listed = re.findall(r"^  (\S+)$", (tmp_path / out / "README").read_text(), re.M)
        assert {file, "README", *listed} <= names, out
        sources = [name for name in listed if name.endswith(".vhd")]
        assert verilog or tool == "ipxact" or {"refocuser.vhd", file} <= {*listed}, out
        if sources and ghdl is not None:
            (tmp_path / f"{out}-work").mkdir()
            analyses(tmp_path / out, sources, tmp_path / f"{out}-work")
