# SPDX-License-Identifier: Apache-2.0
"""Commands in this process: to start one takes a second."""

import io
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

from plenofir.commands.app import main


def plenofir(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, as its own process would."""
    out, err = io.StringIO(), io.StringIO()
    code: object = None
    with (
        chdir(cwd or Path.cwd()),
        patch.object(sys, "argv", ["plenofir", *arguments]),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as done:
            code = done.code
    assert isinstance(code, int)
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())
