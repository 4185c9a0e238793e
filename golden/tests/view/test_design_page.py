# SPDX-License-Identifier: Apache-2.0
"""The page of a camera's figures shows what the command prints, wherever its sliders are."""

import json
from collections.abc import Callable
from math import exp, log
from typing import Any

import pytest
from in_browser import served

from plenofir.camera.design import design
from plenofir.camera.rays import RayModel, camera_of, load_camera
from plenofir.view.design import design_page
from plenofir.view.page import Wanted

CAMERA = load_camera("f193-mla2")


def shown(tab: Any) -> dict[str, str]:
    """Figures by their texts."""
    rows = tab.locator("#figures tbody tr").all_inner_texts()
    return dict(tuple(row.split("\t")[:2]) for row in rows)


def test_sliders(open_page: Callable[..., Any]) -> None:
    begin = design(RayModel.focused(CAMERA, 1500.0, 13), 500.0, 5000.0)
    with served(design_page(begin, 1500.0)) as address:
        tab = open_page(address, viewport={"width": 1100, "height": 800})

        def check(wanted: Any) -> None:
            found = shown(tab)
            for figure in wanted.figures:
                text = found[figure.text]
                if figure.value is None:
                    assert text == "–"
                else:
                    assert float(text) == pytest.approx(figure.value, rel=1e-5)
            assert tab.locator("#planes tbody tr").count() == len(wanted.planes)
            assert tab.locator("#warnings li").all_inner_texts() == list(wanted.warnings)
            assert tab.evaluate("document.getElementById('plot').naturalWidth") > 300

        check(begin)
        tab.evaluate(
            """() => { for (const [id, value] of [["lens_pitch", 0.3], ["focus", 0.1]]) {
                const slider = document.getElementById("slider-" + id);
                slider.value = value; slider.dispatchEvent(new Event("input")); } }"""
        )
        tab.evaluate("plenofir.settled()")
        pitch = float(f"{0.125 * exp(0.3 * log(10)):.4g}")
        focus = float(f"{1500 * exp(0.1 * log(100)):.4g}")
        camera = camera_of(CAMERA, {"lens_pitch": pitch})
        check(design(RayModel.focused(camera, focus, camera.micro_image_size), 500.0, 5000.0))
        # A camera that cannot be focused there says so, and the page goes on.
        tab.evaluate(
            """() => { const slider = document.getElementById("slider-focus");
                slider.value = -1; slider.dispatchEvent(new Event("input")); }"""
        )
        tab.evaluate("plenofir.settled()")
        assert "nearer than the main lens can focus" in tab.locator("#message").inner_text()
        tab.locator("#reset").click()
        tab.evaluate("plenofir.settled()")
        check(begin)


def test_what_is_no_number_is_refused() -> None:
    page = design_page(design(RayModel.focused(CAMERA, 1500.0, 13), 500.0), 1500.0)
    answer = json.loads(page.parts["figures.json"](Wanted(query={"near": "x"})).content)
    assert answer == {"refused": "near: 'x' is not a number"}
