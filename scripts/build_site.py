# SPDX-License-Identifier: Apache-2.0
"""Build the documentation as a site in build/site; it needs no network.

Usage: python scripts/build_site.py

The pages are those of the repository, at the same places, so that they read alike on a code host
and here; the entities' pages, a reference of the Python packages and a light field to refocus are
added.
A link that leads nowhere, or to a heading that is not there, fails the build.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from entity_pages import entity_pages
from plenofir.ground import project

ROOT = project.root()
OUT = ROOT / "build" / "site"
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
LIGHT_FIELD = "planes.html"
# Where the entities' pages are in the site.
ENTITIES = Path("hdl/entities")

# Packages in the reference: those that users import.
PACKAGES = {
    "plenofir.refocus": "The golden model and the fast refocuser",
    "plenofir.camera.calibration": "Micro image centres, decoding",
    "plenofir.camera.lightfield": "Views, stacks, disparity, depth",
    "plenofir.camera.optics": "Glasses, lenses, paraxial rays",
    "plenofir.camera.rays": "The ray model",
    "plenofir.camera.resampling": "Resampling as the VHDL does it",
    "plenofir_studies.synthetic": "A synthetic camera",
    "plenofir.plan": "From a scene to a core",
    "plenofir.driver": "The driver of a core behind a bus",
    "plenofir.ground.images": "Reading and writing images",
    "plenofir.ground.errors": "Errors",
}

# Four groups of pages; pages of docs/ in none of them come after the first. A folder's page comes
# before the others in it.
WAYS: dict[str, tuple[str, ...]] = {
    "Use it": ("files", "light-field", "viewer", "golden-model", "ray-model"),
    "Build it": (
        *("core", "flows", "scenes", "simulation", "boards", "architecture", "decisions"),
        *("fir-array", "moving-sum", "stack", "resampling", "hdmi", "resources"),
    ),
    "Trust it": ("verification", "faults", "never-run", "studies", "measured"),
    "Beside the thesis": ("thesis",),
}

CONFIGURATION = """\
site_name: plenofir
docs_dir: pages
site_dir: site
use_directory_urls: false
theme:
  name: material
  font: false
  features: [navigation.tabs, navigation.indexes, search.highlight, content.code.copy]
  palette:
    - media: "(prefers-color-scheme: light)"
      scheme: default
      toggle: {icon: material/weather-night, name: Dark}
    - media: "(prefers-color-scheme: dark)"
      scheme: slate
      toggle: {icon: material/weather-sunny, name: Light}
extra:
  polyfills: [assets/iframe-worker.js]
plugins:
  - search
  - mkdocstrings:
      handlers:
        python:
          paths: [%(golden)s, %(studies)s]
          options: {docstring_style: numpy, show_source: false, show_root_heading: true,
                    heading_level: 2, show_if_no_docstring: false}
  - offline
markdown_extensions:
  - tables
  - toc: {permalink: true}
  - pymdownx.superfences
  - pymdownx.highlight
validation:
  omitted_files: ignore
  links: {not_found: warn, anchors: warn, absolute_links: warn, unrecognized_links: warn}
nav:
%(nav)s
"""


def heading(page: Path) -> str:
    """Title of a page, without code marks."""
    return re.sub(r"[`:]", "", re.search(r"^# (.*)$", page.read_text(), re.M)[1])  # type: ignore[index]


def copied(page: Path, pages: Path) -> None:
    """Copy a page and what it links to; of a VHDL source that is its entity's page.

    Links to folders become plain text.
    """
    copy = pages / page.relative_to(ROOT)

    def target(match: re.Match[str]) -> str:
        mark, text, link = match.groups()
        if re.match(r"[a-z]+:|#", link):
            return match[0]
        place = link.partition("#")[0]
        file = (page.parent / place).resolve()
        if file.is_dir():
            return str(text)
        there = pages / file.relative_to(ROOT)
        if file.suffix == ".vhd" and (entity := pages / ENTITIES / f"{file.stem}.md").exists():
            return f"{mark}[{text}]({os.path.relpath(entity, copy.parent)})"
        if file.suffix != ".md" and not there.exists():
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, there)
        # A place in a source is of no use in a browser.
        return match[0] if file.suffix == ".md" else f"{mark}[{text}]({place})"

    copy.parent.mkdir(parents=True, exist_ok=True)
    parts = re.split(r"(^```.*?^```)", page.read_text(), flags=re.S | re.M)
    parts[::2] = [LINK.sub(target, part) for part in parts[::2]]
    copy.write_text("".join(parts))


def among_entities(match: re.Match[str]) -> str:
    """A link from one entity's page to another; of others the text alone."""
    return match[0] if re.fullmatch(r"\w+\.md", match[3]) else match[2]


def main() -> int:
    """Write the site."""
    with tempfile.TemporaryDirectory(prefix="plenofir-") as name:
        folder = Path(name)
        pages = folder / "pages"
        written = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "hdl" / "README.md"]
        written += [ROOT / "tb/hunt/README.md", *ROOT.glob("golden/plenofir/data/**/CREDITS.md")]
        entities = pages / ENTITIES
        entities.mkdir(parents=True)
        for path, text in entity_pages(ROOT / "build" / "docs" / "entities").items():
            (entities / path.name).write_text(LINK.sub(among_entities, text))
        for page in written:
            copied(page, pages)
        # For the search in pages opened from files, where browsers start no workers.
        (pages / "assets").mkdir()
        shutil.copy(ROOT / "docs" / "site" / "iframe-worker.js", pages / "assets")
        reference = pages / "reference"
        reference.mkdir()
        for package, title in PACKAGES.items():
            (reference / f"{package}.md").write_text(f"# {title}\n\n::: {package}\n")
        command = [sys.executable, "-m", "plenofir", "view", "-M", "5", "--no-browser"]
        command += ["--camera", "f193-mla2", "--focus", "1500", "--export"]
        raw = project.DATA / "planes_5x5.png"
        command += [str(pages / LIGHT_FIELD), str(raw)]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        (folder / "mkdocs.yml").write_text(
            CONFIGURATION
            % {"golden": ROOT / "golden", "studies": ROOT / "studies", "nav": navigation(pages)}
        )
        # Not quietly: then mkdocs does not count warnings either.
        build = [sys.executable, "-m", "mkdocs", "--no-color", "build", "--strict"]
        environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
        process = subprocess.run(
            build, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True, check=False
        )
        if process.returncode:
            wrong = [line for line in process.stderr.splitlines() if not line.startswith("INFO")]
            print("\n".join(wrong), file=sys.stderr)
            return 1
        shutil.rmtree(OUT, ignore_errors=True)
        shutil.copytree(folder / "site", OUT)
    print(f"{OUT.relative_to(ROOT)}/index.html: {sum(1 for _ in OUT.rglob('*.html'))} pages")
    return 0


def navigation(pages: Path) -> str:
    """The four ways, the VHDL, the reference, the project."""
    placed = {name for way in WAYS.values() for name in way}
    others = sorted({p.stem for p in (pages / "docs").glob("*.md")} - placed - {"README"})

    def row(place: str) -> str:
        return f'- "{heading(pages / place)}": {place}'

    def lines(title: str, places: list[str]) -> str:
        return "\n".join([f"  - {title}:", *(f"      {row(place)}" for place in places)])

    parts = ["  - README.md"]
    for way, names in WAYS.items():
        parts.append(f"  - {way}:")
        for name in (*names, *(others if way == "Use it" else ())):
            folder = pages / "docs" / name
            if not folder.is_dir():
                parts.append(f"      {row(f'docs/{name}.md')}")
                continue
            inside = sorted(folder.glob("*.md"), key=lambda page: (page.stem != "README", page))
            parts.append(f"      - {name.capitalize()}:")
            parts += [f"          {row(f'docs/{name}/{page.name}')}" for page in inside]
    entities = [f"hdl/entities/{p.name}" for p in sorted((pages / "hdl/entities").glob("*.md"))]
    parts.append(lines("VHDL", ["hdl/README.md", *entities]))
    parts.append(lines("Python", [f"reference/{package}.md" for package in PACKAGES]))
    project_pages = ["CHANGELOG.md", "CONTRIBUTING.md", "CODE_OF_CONDUCT.md"]
    return "\n".join([*parts, lines("Project", project_pages), f"  - Refocus here: {LIGHT_FIELD}"])


if __name__ == "__main__":
    sys.exit(main())
