# SPDX-License-Identifier: Apache-2.0
"""Settings of the property tests, signals as a terminal leaves them, and commands to call."""

import signal
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings

from plenofir.commands.app import main

# Speed is measured by benchmarks, never by tests.
settings.register_profile("plenofir", deadline=None, print_blob=True)
settings.load_profile("plenofir")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts what runs in the background so; the commands under test would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)


@dataclass
class Done:
    """What a command in this process did: faster than starting one."""

    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]):
    def command(*arguments: str, cwd: Path) -> Done:
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["plenofir", *arguments])
        capfd.readouterr()
        with pytest.raises(SystemExit) as exit_:
            main()
        out, err = capfd.readouterr()
        return Done(int(exit_.value.code or 0), out, err)

    return command
