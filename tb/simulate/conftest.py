# SPDX-License-Identifier: Apache-2.0
"""Small frames are simulated with GHDL's mcode back end, except in `COMPILED`."""

import os
import shutil

import pytest

# Modules; or one test, of a module whose tests differ only in the core.
COMPILED = (
    "test_chain_run.py",
    "test_capture_sweep.py",
)


@pytest.fixture(autouse=True)
def back_end(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    given = "GHDL_BACKEND" in os.environ or shutil.which("ghdl-mcode") is None
    name = f"{request.path.name}::{request.node.name}"
    if not given and not name.startswith(COMPILED):
        monkeypatch.setenv("GHDL_BACKEND", "mcode")
