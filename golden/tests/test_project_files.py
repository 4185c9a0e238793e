# SPDX-License-Identifier: Apache-2.0
"""What belongs to the repository as a project: version, citation, forms, workflow."""

import re
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import get_args

import pytest

from plenofir.camera.recognise.source import Kind
from plenofir.ground import project

ROOT = project.root()
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
GITHUB = ROOT / ".github"


def read_yaml(path: Path) -> dict:
    yaml = pytest.importorskip("yaml")
    return yaml.safe_load(path.read_text())


def test_one_version() -> None:
    studies = tomllib.loads((ROOT / "studies" / "pyproject.toml").read_text())["project"]
    assert studies["version"] == VERSION
    assert f"plenofir=={VERSION}" in studies["dependencies"]
    releases = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)
    newest = next(name.strip("[]") for name in releases if "Unreleased" not in name)
    assert newest == VERSION
    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"version = {{{VERSION}}}," in (ROOT / "docs/thesis.md").read_text()
    cores = [*ROOT.glob("*.core"), *ROOT.glob("examples/*/*.core")]
    assert len(cores) >= 6
    for core in cores:
        assert re.search(r"^name: .*:(.*)$", core.read_text(), re.M)[1] == VERSION, core


def test_the_page_of_cameras_has_all_that_inspect_says() -> None:
    kinds = set(get_args(Kind))
    page = (ROOT / "docs" / "files.md").read_text()
    told = set(re.findall(r"^\| ([^|]+?) \|", page.partition("### By the file")[2], re.M))
    assert kinds <= told, kinds - told


def test_both_citations_are_the_same() -> None:
    """CITATION.cff and the BibTeX of docs/thesis.md: titles, year, author, school."""
    page, file = (ROOT / name for name in ("docs/thesis.md", "CITATION.cff"))
    bibtex = re.findall(r"^  (\w+) += \{(.*)\},$", page.read_text(), re.M)
    told = file.read_text()
    assert len(bibtex) == 8
    for name, value in bibtex:
        for word in value.strip("{}").split() if name == "author" else (value,):
            assert word in told, (name, value)


def test_citation_is_valid() -> None:
    if find_spec("cffconvert") is None:
        pytest.skip("cffconvert is not installed (scripts/setup.sh tests)")
    done = subprocess.run(
        [Path(sys.executable).parent / "cffconvert", "--validate", "-i", ROOT / "CITATION.cff"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_licences_are_told() -> None:
    reuse = Path(sys.executable).parent / "reuse"
    if not reuse.exists():
        pytest.skip("reuse is not installed (scripts/setup.sh tests)")
    if not (ROOT / ".git").exists():
        pytest.skip("no checkout: what git ignores is not known")
    done = subprocess.run(
        [reuse, "--root", ROOT, "lint", "--lines"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.slow
def test_sources_have_their_licence_at_the_head() -> None:
    script = ROOT / "scripts" / "spdx.py"
    done = subprocess.run(
        [sys.executable, script, "--check"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_form_of_a_first_run_is_that_of_the_page() -> None:
    page = (ROOT / "docs" / "boards" / "first-run.md").read_text()
    lines = re.search(r"^## The report.*?```text\n(.*?)```", page, re.S | re.M)[1].splitlines()
    form = read_yaml(GITHUB / "ISSUE_TEMPLATE" / "first-run.yml")
    labels = [part["attributes"].get("label") for part in form["body"] if "id" in part]
    assert labels == [line.split(":")[0] for line in lines]


@pytest.mark.parametrize("form", sorted((GITHUB / "ISSUE_TEMPLATE").glob("*.yml")), ids=str)
def test_forms_are_forms(form: Path) -> None:
    content = read_yaml(form)
    assert {"name", "description", "body"} <= content.keys()
    parts = [part for part in content["body"] if part["type"] != "markdown"]
    assert all(part["type"] in ("input", "textarea", "dropdown") for part in parts)
    names = [part["id"] for part in parts]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z0-9-]+", name) for name in names)
    for part in parts:
        assert part["attributes"]["label"]
        assert ("options" in part["attributes"]) == (part["type"] == "dropdown")


def test_the_workflow_runs_the_commands_of_the_readme() -> None:
    workflow = read_yaml(GITHUB / "workflows" / "ci.yml")
    jobs = workflow["jobs"]
    commands = [step.get("run") for step in jobs["debian"]["steps"]]
    readme = (ROOT / "README.md").read_text()
    wanted = re.findall(r"^    (make (?:sim|test))$", readme, re.M)
    assert wanted == ["make sim", "make test"]
    assert [command for command in commands if command in wanted] == wanted
    versions = jobs["python"]["strategy"]["matrix"]["version"]
    classifiers = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["classifiers"]
    declared = [c.rpartition(" ")[2] for c in classifiers if re.search(r"Python :: 3\.\d", c)]
    assert versions == declared


@pytest.mark.quick
def test_block_diagrams_name_entities() -> None:
    entities = {path.stem for path in (ROOT / "hdl").rglob("*.vhd")}
    diagrams = sorted((ROOT / "docs" / "images").glob("*.svg"))
    assert len(diagrams) > 5
    for diagram in diagrams:
        bold = re.findall(r'class="name"[^>]*>([^<]*)<', diagram.read_text())
        assert bold, diagram
        named = {word for text in bold for word in text.split() if "_" in word}
        assert named <= entities, (diagram.name, named - entities)
