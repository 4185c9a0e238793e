# SPDX-License-Identifier: Apache-2.0
"""The archive of bitstreams that scripts/bitstreams.py writes."""

import hashlib
import io
import zipfile
from pathlib import Path

import pytest

import bitstreams
from plenofir.fpga.bitstream.open_build import NextpnrReport
from plenofir.fpga.boards import BOARDS
from plenofir.ground.errors import InputError, ToolError
from plenofir_studies.records import load_builds


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bitstreams, "FOLDER", tmp_path)


def _build(plan, out: Path, _progress: object, *, board) -> NextpnrReport:
    report = NextpnrReport.model_validate(load_builds()[board.scene])
    out.mkdir(parents=True)
    (out / board.bitstream).write_bytes(plan.device.encode())
    (out / "report.json").write_text(report.model_dump_json())
    return report


def test_each_board_has_its_bitstream_report_and_hashes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setattr(bitstreams, "build_scene", _build)
    assert bitstreams.main([]) == 0
    (archive,) = tmp_path.glob("*.zip")
    with zipfile.ZipFile(io.BytesIO(archive.read_bytes())) as packed:
        files = {name: packed.read(name) for name in packed.namelist()}
    sums = dict(line.split("  ")[::-1] for line in files.pop("SHA256SUMS").decode().splitlines())
    assert sums == {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    usual = {name: BOARDS[name].devices[0] for name in bitstreams.PREBUILT}
    assert {f"{name}-{device}" for name, device in usual.items()} == {
        name.partition("/")[0] for name in files
    }
    assert files["tangnano20k-gw2ar-18/plenofir.fs"] == b"gw2ar-18"
    said = NextpnrReport.model_validate_json(files["ulx3s-lfe5u-85f/report.json"])
    assert {"ghdl", "yosys"} < said.tools.keys()
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(",")[0] for line in lines[:-1]] == list(bitstreams.PREBUILT)
    assert all("nextpnr" in line for line in lines[:-1])


@pytest.mark.parametrize(
    ("targets", "said", "code"),
    [
        (["atlys"], "board: there is no atlys; choose from ulx3s, tangnano20k, lifcl40", 2),
        (["ulx3s:99f"], "--device: the Radiona ULX3S has no 99f", 2),
        (["lifcl40", "ulx3s"], "nextpnr is not installed", 2),
        (["ulx3s"], "nextpnr failed", 3),
    ],
)
def test_no_archive_without_all_bitstreams(
    targets: list[str],
    said: str,
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture,
) -> None:
    def build(plan, out: Path, progress: object, *, board) -> NextpnrReport:
        if board.name == "ulx3s":
            raise (InputError if code == 2 else ToolError)(said)
        return _build(plan, out, progress, board=board)

    monkeypatch.setattr(bitstreams, "build_scene", build)
    (tmp_path / f"plenofir-{bitstreams.plenofir.__version__}-bitstreams.zip").touch()
    assert bitstreams.main(targets) == code
    assert capsys.readouterr().err.startswith(f"bitstreams: {said}")
    assert not list(tmp_path.glob("*.zip"))
