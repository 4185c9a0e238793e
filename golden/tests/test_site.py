# SPDX-License-Identifier: Apache-2.0
"""The documentation as a site: no link leads nowhere, the light field is in it."""

import subprocess
import sys
from importlib.util import find_spec

import pytest

from plenofir import project


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
