# SPDX-License-Identifier: Apache-2.0
"""The page of a camera's figures with sliders: all numbers come from `plenofir.camera.design`."""

import json
from collections.abc import Mapping
from math import inf, isfinite
from typing import Any

from plenofir.camera.design import Design, design
from plenofir.camera.rays import FIELDS, RayModel, camera_of
from plenofir.ground.errors import InputError
from plenofir.view.page import Page, Part, PartRequest

# Sliders: name, text, unit, and range relative to the given value.
_SLIDERS = (
    ("focal_length", "main lens, f_U", "mm", 10.0),
    ("exit_pupil", "exit pupil, d_A'", "mm", 10.0),
    ("pupil", "entrance pupil, diameter", "mm", 10.0),
    ("lens_focal_length", "micro lenses, f_s", "mm", 10.0),
    ("sensor_distance", "sensor from the micro lenses, b_s", "mm", 10.0),
    ("lens_pitch", "micro lenses, p_M", "mm", 10.0),
    ("pixel", "pixels, p_p", "mm", 10.0),
    ("focus", "focus distance", "mm", 100.0),
    ("near", "near end of the range", "mm", 100.0),
    ("far", "far end of the range", "mm", 100.0),
    ("disparity_error", "error of a disparity", "px", 100.0),
)


def _values(design: Design, focus_mm: float) -> dict[str, float | None]:
    """The sliders' values for a design; None where there is none."""
    camera = design.model.camera
    values = {name: getattr(getattr(camera, FIELDS[name][0]), FIELDS[name][1]) for name in FIELDS}
    return {
        **values,
        "focus": focus_mm,
        "near": design.near_mm,
        "far": design.far_mm,
        "disparity_error": design.disparity_error_px,
    }


def _number(query: Mapping[str, str], name: str) -> float:
    try:
        return float(query[name])
    except ValueError:
        raise InputError(f"{query[name]!r} is not a number", where=name) from None


def _changed(current: Design, focus_mm: float, query: Mapping[str, str]) -> Design:
    """The design for a page's sliders; M follows from the lengths if they change."""
    start = {**_values(current, focus_mm)}
    typed = {name: _number(query, name) for name, *_ in _SLIDERS if name in query}
    lengths = {name: value for name, value in typed.items() if name in FIELDS}
    camera = camera_of(current.model.camera, lengths)
    m = current.model.micro_image_size
    if {"lens_pitch", "pixel"} & lengths.keys():
        m = max(2, camera.micro_image_size)
    near, far, focus, error = (
        typed.get(name, start[name]) for name in ("near", "far", "focus", "disparity_error")
    )
    assert None not in (near, far, focus, error)
    model = RayModel.focused(camera, focus, m)  # type: ignore[arg-type]
    return design(model, near, far, disparity_error_px=error)  # type: ignore[arg-type]


def _slider(
    name: str, text: str, unit: str, times: float, value: float | None, assumed: str
) -> dict[str, Any]:
    # A slider of an infinite or unknown value has an arbitrary start, used once it is moved.
    finite = value is not None and isfinite(value)
    start = value if value is not None and finite and value > 0 else 20.0 if value is None else 1e3
    value_text = f"{value:g} {unit}" if finite else "infinity" if value == inf else "unknown"
    return {
        "name": name,
        "text": text,
        "unit": unit,
        "low": start / times,
        "high": start * times,
        "start": start,
        # Values that follow from other sliders are not sent until they are moved.
        "shown": assumed or value_text,
    }


def design_page(design: Design, focus_mm: float) -> Page:
    """A page whose sliders change the camera; figures and plots are computed here.

    `design`: the one that the page begins with. `focus_mm`: the focus distance of its camera.
    """
    from plenofir.camera.design.plots import design_plot
    from plenofir.camera.plots import encode_figure

    values = _values(design, focus_mm)
    camera = design.model.camera
    assumed = {"exit_pupil": "f_U (thin lens)"} if camera.thin_lens_note() else {}
    if camera.micro_lenses.sensor_distance_mm is None:
        values["sensor_distance"] = camera.micro_lenses.spacing_mm
        assumed["sensor_distance"] = "f_s (standard camera)"
    field = {
        "title": camera.name,
        "sliders": [
            _slider(*slider, values[slider[0]], assumed.get(slider[0], "")) for slider in _SLIDERS
        ],
    }

    def figures(request: PartRequest) -> Part:
        try:
            changed = _changed(design, focus_mm, request.query)
            texts = {f.name: [f.text, f.unit] for f in changed.figures}
            content = {**changed.content(), "texts": texts}
        except InputError as error:
            # The page shows the error of impossible lengths beside the sliders.
            content = {"refused": str(error)}
        return Part(json.dumps(content, allow_nan=False).encode(), "application/json")

    def plot(request: PartRequest) -> Part:
        drawing = design_plot(_changed(design, focus_mm, request.query))
        return Part(encode_figure(drawing, ".svg"), "image/svg+xml")

    return Page(
        "design.html", ("design.js",), field, {"figures.json": figures, "plot.svg": plot}, _packed
    )


def _packed(_: int) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
    raise InputError("this page computes as it is used and cannot be one file")
