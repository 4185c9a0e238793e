# SPDX-License-Identifier: Apache-2.0
"""The LiteX module: an SoC with it is elaborated, and refocuses under control of its registers."""

import csv
import sys
from pathlib import Path

import pytest

from plenofir_tb.flows import EXAMPLES, icarus

LITEX = EXAMPLES / "litex"


@pytest.mark.parametrize("camera", [False, True], ids=["streams", "camera"])
def test_soc_with_a_refocuser(need, run, tmp_path: Path, verilog_scene: Path, camera: bool) -> None:
    need("litex", "migen")
    for file in verilog_scene.glob("*"):
        if file.is_file():
            (tmp_path / file.name).write_bytes(file.read_bytes())
    options = ["--camera"] if camera else []
    run(sys.executable, LITEX / "refocus_soc.py", tmp_path, *options)
    out = tmp_path / "litex"
    rows = csv.reader((out / "csr.csv").read_text().splitlines())
    addresses = {row[1]: int(row[2], 16) for row in rows if row[0] == "csr_register"}
    need("iverilog")
    names = {"CONTROL": "control", "STATUS": "status", "FRAMES_OUT": "frames"}
    found = icarus(
        run,
        [tmp_path, EXAMPLES / "verilog"],
        [LITEX / "tb_refocus_soc.v", out / "refocus_soc.v", tmp_path / "scene_top.v"],
        tmp_path / "bench",
        *(["-DCAMERA"] if camera else []),
        *(f"-D{macro}=32'd{addresses[f'refocuser_{name}']}" for macro, name in names.items()),
    )
    assert found == "PASS: slice 2 by register, 24 x 18 pixels\n"
