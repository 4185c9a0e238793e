# SPDX-License-Identifier: Apache-2.0
"""The page of a camera's figures agrees with the command for all positions of its sliders."""

import json
import random
from collections.abc import Callable
from math import exp, inf, log
from typing import Any

import pytest
from in_browser import served
from in_process import plenofir

from plenofir.camera.design import design
from plenofir.camera.rays import RayModel, camera_of, load_camera
from plenofir.view.design import design_page
from plenofir.view.page import PartRequest

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


def drawn_camera(rng: random.Random) -> dict[str, float]:
    """Lengths of a camera near f193, as options of the command."""
    lengths = {
        "focal_length": rng.uniform(20, 200),
        "lens_focal_length": rng.uniform(0.5, 3),
        "lens_pitch": rng.uniform(0.05, 0.2),
        "pixel": rng.uniform(0.005, 0.015),
    }
    if rng.random() < 0.6:
        lengths["exit_pupil"] = rng.choice([inf, -80.0, rng.uniform(40, 300)])
    if rng.random() < 0.5:
        lengths |= {"pupil": rng.uniform(1, 20), "columns": 4008, "rows": 2672}
    return {name: float(f"{value:.4g}") for name, value in lengths.items()}


@pytest.mark.parametrize("cameras", [1, pytest.param(20, marks=pytest.mark.slow)])
def test_drawn_cameras_and_sliders_show_what_the_command_prints(
    open_page: Callable[..., Any], cameras: int
) -> None:
    seed = random.randrange(10**6)
    print(f"seed {seed}")
    rng = random.Random(seed)
    for _ in range(cameras):
        given = drawn_camera(rng)
        focus = rng.choice([inf, 10 * given["focal_length"]])
        camera = camera_of(None, given)
        model = RayModel.focused(camera, focus, max(2, camera.micro_image_size))
        near = 8 * given["focal_length"]
        with served(design_page(design(model, near), focus)) as address:
            tab = open_page(address, viewport={"width": 1100, "height": 800})
            names = rng.sample(["focal_length", "lens_pitch", "pixel", "near", "pupil"], 2)
            for name in names:
                tab.evaluate(
                    """([id, value]) => { const slider = document.getElementById("slider-" + id);
                        slider.value = value; slider.dispatchEvent(new Event("input")); }""",
                    [name, rng.uniform(-0.2, 0.2)],
                )
            tab.evaluate("plenofir.settled()")
            texts = {name: slider_text(tab, name) for name in names}
            # What the page says of its sliders, given to the command.
            words = {**given, "near": near, "focus": focus}
            words |= {name: float(text.split()[0]) for name, text in texts.items()}
            options = [
                word for name, value in words.items() for word in (option(name), f"{value!r}")
            ]
            ran = plenofir("design", *options, "--json")
            message = tab.locator("#message").inner_text()
            if ran.returncode == 2:
                assert message, (seed, options, ran.stderr)
                continue
            assert not message, (seed, options)
            content = json.loads(ran.stdout)
            found, described = shown(tab), {f.name: f.text for f in design(model, near).figures}
            for name, value in content["figures"].items():
                assert same(found[described[name]], value), (seed, options, name)
            heads = tab.locator("#planes thead th").all_inner_texts()
            rows = tab.locator("#planes tbody tr").all_inner_texts()
            assert len(rows) == len(content["planes"]), (seed, options)
            for row, plane in zip(rows, content["planes"], strict=True):
                cells = row.split("\t")
                assert len(cells) == len(heads) == len(plane)
                for cell, value in zip(cells, plane.values(), strict=True):
                    assert same(cell, value), (seed, options, plane)
            warnings = tab.locator("#warnings li").all_inner_texts()
            # The page's camera has another name once a slider was moved.
            assert len(warnings) == len(content["warnings"]), (seed, options)


def slider_text(tab: Any, name: str) -> str:
    """What stands beside a slider."""
    return str(tab.locator(f"label[for=slider-{name}] output").inner_text())


def option(name: str) -> str:
    return "--" + name.replace("_", "-")


def same(cell: str, value: object) -> bool:
    """A cell of the page against a value of the command's JSON."""
    if value is None or isinstance(value, str):
        return cell == (value or "–")
    assert isinstance(value, float | int)
    return float(cell) == pytest.approx(value, rel=1e-5)


def test_what_is_no_number_is_refused() -> None:
    page = design_page(design(RayModel.focused(CAMERA, 1500.0, 13), 500.0), 1500.0)
    answer = json.loads(page.parts["figures.json"](PartRequest(query={"near": "x"})).content)
    assert answer == {"refused": "near: 'x' is not a number"}
