# SPDX-License-Identifier: Apache-2.0
"""Stand-ins for the tools of a build with nextpnr."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from plenofir.fpga.bitstream import open_build
from plenofir.ground.errors import ToolError


@pytest.fixture
def open_tools(monkeypatch: pytest.MonkeyPatch) -> Callable[..., dict[str, Any]]:
    """Installs stand-ins, whose report and failure can be changed."""

    def stand_in(report: dict[str, Any], bits: str) -> dict[str, Any]:
        content: dict[str, Any] = {"report": report, "fails": "", "log": "Info: Packing IOs..\n"}

        def run_tool(command: Sequence[str], log: Path, **_: object) -> None:
            name = Path(command[0]).name
            if content["fails"] and content["fails"] in name:
                raise ToolError(f"{name} failed with status 1:\nERROR: Unable to place cell")
            if "nextpnr" not in name:
                (log.parent / bits).write_bytes(b"bits")
                return
            content["placed by"] = command
            (log.parent / command[command.index("--report") + 1]).write_text(
                json.dumps(content["report"])
            )
            if "--textcfg" in command:
                config = command[command.index("--textcfg") + 1]
                (log.parent / config).write_text(".tile R1C2:X\n")
            log.write_text(content["log"])

        monkeypatch.setattr(open_build, "run_tool", run_tool)
        monkeypatch.setattr(open_build, "write_verilog", lambda *_, **__: None)
        monkeypatch.setattr(open_build, "versions", lambda _: {"nextpnr": "1"})
        return content

    return stand_in
