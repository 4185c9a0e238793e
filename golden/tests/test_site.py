# SPDX-License-Identifier: Apache-2.0
"""The documentation as a site: no link leads nowhere, the light field is there, and search."""

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from plenofir.ground import project


@pytest.mark.slow
def test_site_builds() -> None:
    for name in ("mkdocs", "material", "mkdocstrings"):
        if find_spec(name) is None:
            pytest.skip(f"{name} is not installed (scripts/setup.sh site)")
    script = project.root() / "scripts" / "build_site.py"
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    site = project.root() / "build" / "site"
    assert "window.plenofir" in (site / "planes.html").read_text()
    reference = (site / "reference" / "plenofir.refocus.html").read_text()
    assert "correctly rounded" in reference
    assert (site / "hdl" / "entities" / "raster_refocuser.html").is_file()
    search_from_a_file(site / "index.html")


def search_from_a_file(page: Path) -> None:
    """Search as a reader does who has opened the site from a folder."""
    path = shutil.which("chromium")
    if path is None:
        return
    driver = pytest.importorskip("playwright.sync_api")
    with driver.sync_playwright() as tools:
        chromium = tools.chromium.launch(executable_path=path, args=["--no-sandbox"])
        tab = chromium.new_page()
        errors: list[str] = []
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.goto(page.as_uri())
        tab.click(".md-search__input", force=True)
        tab.keyboard.type("stored products")
        tab.wait_for_selector(".md-search-result__link")
        assert "fir" in tab.inner_text(".md-search-result__list").lower()
        assert errors == []
        chromium.close()
