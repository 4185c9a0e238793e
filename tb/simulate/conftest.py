# SPDX-License-Identifier: Apache-2.0
"""Small frames are simulated with GHDL's mcode back end: they run shorter than compiling takes."""

import os
import shutil

import pytest


@pytest.fixture(autouse=True)
def back_end(monkeypatch: pytest.MonkeyPatch) -> None:
    given = "GHDL_BACKEND" in os.environ or shutil.which("ghdl-mcode") is None
    if not given:
        monkeypatch.setenv("GHDL_BACKEND", "mcode")
