# SPDX-License-Identifier: Apache-2.0
"""Small frames are simulated by the GHDL that need not compile, except in `COMPILED`."""

import os
import shutil

import pytest

COMPILED = ("test_every_engine", "test_chain_run", "test_capture_sweep")


@pytest.fixture(autouse=True)
def back_end(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    given = "GHDL_BACKEND" in os.environ or shutil.which("ghdl-mcode") is None
    if not given and request.path.stem not in COMPILED:
        monkeypatch.setenv("GHDL_BACKEND", "mcode")
