# SPDX-License-Identifier: Apache-2.0
"""Bitstreams of scenes with open tools: each board by its family's, with its clocks."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from plenofir.commands.bitstream import chosen_board, scene_plan
from plenofir.fpga.bitstream import gowin, nextpnr, nexus
from plenofir.fpga.boards import BOARDS
from plenofir.plan import load_scene, make_plan
from plenofir.plan.board_build import build_scene


@pytest.mark.parametrize(
    ("scene", "family", "packages", "generics"),
    [
        ("tangnano20k", gowin, {"screen_pkg", "stored_pkg"}, {"MAX_COLUMNS": 480}),
        ("lifcl40", nexus, {"camera_pkg", "sensor_pkg"}, {"CLOCK_DIVIDE": 11}),
        ("lifcl40-360", nexus, {"camera_pkg"}, {"CLOCK_DIVIDE": 3, "ROWS": 1200}),
        ("ulx3s-480p", nextpnr, set(), {"MICRO_IMAGE_SIZE": 3}),
        ("ulx3s-csi", nextpnr, {"camera_pkg", "sensor_pkg"}, {"MICRO_IMAGE_SIZE": 5}),
    ],
)
def test_each_board_is_built_with_the_tools_of_its_family(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    scene: str,
    family: Any,
    packages: set[str],
    generics: dict[str, int],
) -> None:
    calls: list[tuple[Any, tuple[Any, ...], dict[str, Any]]] = []
    for module in (gowin, nextpnr, nexus):

        def build(*given: Any, module: Any = module, **named: Any) -> None:
            calls.append((module, given, named))

        monkeypatch.setattr(module, "build", build)
    plan = make_plan(load_scene(scene))
    build_scene(plan, tmp_path, lambda *_: None, beyond=True)
    ((module, given, named),) = calls
    assert module is family
    assert given[1] == plan.device
    assert generics.items() <= given[2].items()
    assert set(given[-1]) == packages
    if family is nexus:
        wanted = {"lifcl40": (40.12, 114.0), "lifcl40-360": (120.38, 112.5)}[scene]
        assert given[3] == dict(zip(("clk", "byte_clk"), wanted, strict=True))
    if family is nextpnr:
        camera = nextpnr.CameraClocks(228.0, 25.0) if scene == "ulx3s-csi" else None
        assert named == {"beyond": True, "camera": camera}


def test_a_named_board_is_built_though_another_comes_first(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    second = replace(BOARDS["ulx3s"], top="second_top", devices=("lfe5u-25f",), package="cabga256")
    monkeypatch.setitem(BOARDS, "second", second)
    built: list[tuple[Any, ...]] = []
    monkeypatch.setattr(nextpnr, "build", lambda *given, **_: built.append(given))
    plan = scene_plan("ulx3s-480p", "second")
    board, device = chosen_board("second", None, plan)
    build_scene(plan, tmp_path, lambda *_: None, board=board)
    assert (device, [given[:2] for given in built]) == ("lfe5u-25f", [(second, "lfe5u-25f")])
