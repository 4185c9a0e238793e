# SPDX-License-Identifier: Apache-2.0
"""Objects are copied if and only if all that they depend on is the same."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from plenofir_tb import object_cache


@pytest.mark.skipif(shutil.which("c++") is None, reason="needs a C++ compiler")
def test_objects_are_those_of_their_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(object_cache, "KEPT", tmp_path / "kept")
    source, header = tmp_path / "verilated.cpp", tmp_path / "verilated.h"
    source.write_text('#include "verilated.h"\nint number = NUMBER;\n')

    def compiled(number: str, *options: str, file: Path = source) -> bytes:
        header.write_text(f"#define NUMBER {number}\n")
        wanted = tmp_path / "new.o"
        wanted.unlink(missing_ok=True)
        words = ["c++", *options, "-c", "-o", str(wanted), str(file)]
        monkeypatch.setattr(sys, "argv", ["object_cache.py", *words])
        assert object_cache.main() == 0
        return wanted.read_bytes()

    def kept() -> int:
        return len(list((tmp_path / "kept").glob("*")))

    first = compiled("1")
    assert kept() == 1
    assert compiled("1") == first
    assert kept() == 1
    assert compiled("2") != first
    assert compiled("1", "-g") != first
    assert kept() == 3
    # A broken source, as Verilator's makefile compiles it; a model's own.
    header.write_text("#define NUMBER none\n")
    words = ["c++", "-c", "-o", str(tmp_path / "new.o"), str(source)]
    command = [sys.executable, object_cache.__file__, *words]
    broken = subprocess.run(command, capture_output=True, text=True, check=False)
    assert broken.returncode == 1
    assert "none" in broken.stderr
    own = tmp_path / "Vmodel.cpp"
    own.write_text(source.read_text())
    assert compiled("1", file=own)
    assert kept() == 3
    next((tmp_path / "kept").glob("*")).write_bytes(b"copied")
    assert b"copied" in (compiled("1"), compiled("2"), compiled("1", "-g"))
