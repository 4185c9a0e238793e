# SPDX-License-Identifier: Apache-2.0
"""The screen of a scene: outputs besides the refocused slice, and the text over them."""

from dataclasses import dataclass, replace
from fractions import Fraction
from math import inf, isfinite, isnan
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from plenofir.camera.rays import RayModel
from plenofir.camera.rays.distances import Distances, State
from plenofir.fpga.screen.board_screen import SHADES, Screen
from plenofir.fpga.screen.overlay import Overlay
from plenofir.ground.errors import InputError
from plenofir.ground.viridis import VIRIDIS
from plenofir.plan.scene_stack import Judging, judged
from plenofir.refocus.shifts import shift_to_text

Output = Literal["refocused", "all-in-focus", "depth"]
_LETTERS: dict[Output, str] = {"refocused": "r", "all-in-focus": "a", "depth": "d"}
# From here on lengths are given in metres.
_METRE_MM = 1000.0


class SceneScreen(Judging):
    """What a board shows; with `between_slices` depth is coloured between them."""

    # Pictures that can be selected while video runs, the first one after a reset: "refocused" (the
    # selected slice), "all-in-focus", "depth" (false colours); the last two need a focal stack and
    # its depth index.
    output: Annotated[tuple[Output, ...], Field(min_length=1)] = ("refocused",)
    overlay: bool = False  # a line of text and a ruler of the slices are written over the picture

    @model_validator(mode="before")
    @classmethod
    def _list_to_tuple(cls, content: Any) -> Any:
        # TOML has lists only, and strict validation takes no list for a tuple.
        if isinstance(content, dict) and isinstance(content.get("output"), list):
            return {**content, "output": tuple(content["output"])}
        return content

    @model_validator(mode="after")
    def _each_output_once(self) -> Self:
        if len(set(self.output)) < len(self.output):
            raise ValueError("give each output once")
        if self.between_slices and "depth" not in self.output:
            raise ValueError("between_slices needs the output 'depth'")
        return self

    @property
    def outputs(self) -> tuple[str, ...]:
        """All outputs."""
        return self.output


@dataclass(frozen=True)
class Plane:
    """Distances of a slice in mm; inf at infinity, -inf beyond it, nan inside the lens."""

    centre: float
    near: float
    far: float


def _millimetres(distances: Distances) -> float:
    state = distances.state()
    if state is State.REAL:
        return float(distances.mm)
    return {State.INFINITY: inf, State.BEYOND_INFINITY: -inf}.get(state, float("nan"))


def plane_of(model: RayModel, a: Fraction) -> Plane:
    """Where a slice is in focus: distances from the micro lenses."""
    parts = (model.distance(float(a)), model.near_border(float(a)), model.far_border(float(a)))
    return Plane(*(_millimetres(part) for part in parts))


def _number(length: float) -> str:
    """About three digits; below 10 at least two decimals."""
    decimals = 3 if length < 0.1 else 2 if length < 10 else 1 if length < 100 else 0
    return f"{length:.{decimals}f}"


def _words(mm: float) -> str:
    """Words for a distance that is no number."""
    return "inf" if mm == inf else "beyond inf" if mm == -inf else "in the lens"


class Lengths:
    """Lengths of a scene as texts, all in mm or all in m."""

    def __init__(self, planes: list[Plane]) -> None:
        finite = [mm for p in planes for mm in (p.centre, p.near, p.far) if isfinite(mm)]
        self._unit, self._scale = "mm", 1.0
        if max(finite, default=0.0) >= _METRE_MM:
            self._unit, self._scale = "m", _METRE_MM

    def of(self, mm: float) -> str:
        """A distance with its unit, or words."""
        return f"{_number(mm / self._scale)} {self._unit}" if isfinite(mm) else _words(mm)

    def between(self, near: float, far: float) -> str:
        """A range; the unit once."""
        if isfinite(far):
            return f"{_number(near / self._scale)} to {self.of(far)}"
        return f"{self.of(near)} to {self.of(abs(far))}"


def _label(mm: float) -> str:
    """A distance on the ruler, in mm."""
    if isfinite(mm):
        return f"{mm:.0f} mm" if mm >= 100 else f"{mm:.1f} mm"
    return "> inf" if mm == -inf else _words(mm)


def slice_colours(shifts: tuple[int, ...], shades: int = 1) -> tuple[tuple[int, int, int], ...]:
    """Red, green, blue of each slice in a picture of depth: viridis, from far (dark) to near.

    With several shades of each slice, colours for depth between slices in ascending or descending
    order.
    """
    order = np.argsort(np.argsort(shifts))
    places = order / max(len(shifts) - 1, 1)
    if shades > 1:
        # Shades of a slice range from the middle of the interval before it to the middle of the
        # next.
        off = ((np.arange(shades) + 0.5) / shades - 0.5) * (places[-1] - places[0])
        places = np.add.outer(places, off / (len(shifts) - 1)).ravel().clip(0, 1)
    table = VIRIDIS[np.minimum(256 * places, 255).astype(int)]
    return tuple((int(r), int(g), int(b)) for r, g, b in table)


def scene_overlay(
    shifts: tuple[int, ...],
    micro_image_size: int,
    model: RayModel | None = None,
    colours: tuple[tuple[int, int, int], ...] = (),
) -> Overlay:
    """Texts and labels of slices; without a focused camera the texts have only a, no distances."""
    names = [shift_to_text(shift, micro_image_size) for shift in shifts]
    texts, labels, reach = [f"a = {name}" for name in names], names, ""
    if model is not None:
        planes = [plane_of(model, Fraction(shift, micro_image_size)) for shift in shifts]
        lengths = Lengths(planes)
        texts = [
            f"{text}   {lengths.of(plane.centre)}   {lengths.between(plane.near, plane.far)}"
            if isfinite(plane.near) and not isnan(plane.far)
            else f"{text}   {lengths.of(plane.centre)}"
            for text, plane in zip(texts, planes, strict=True)
        ]
        labels = [_label(plane.centre) for plane in planes]
        near = [plane.near for plane in planes if isfinite(plane.near)]
        far = [abs(plane.far) for plane in planes if not isnan(plane.far)]
        if near and far:
            reach = f"   {lengths.between(min(near), max(far))}"
    more = (f"all in focus{reach}", f"depth{reach}", "input as it is")
    return Overlay((*texts, *more), tuple(labels), colours)


def screen_of(
    part: SceneScreen | None,
    shifts: tuple[int, ...],
    micro_image_size: int,
    model: RayModel | None,
    size: tuple[int, int],
    *,
    where: str,
) -> Screen:
    """The board's screen for a scene.

    A scene without a screen has the refocused slice only, without text. `size` is rows and columns
    of the picture, `where` the scene's file for messages. InputError if slices have the same label,
    or the text is larger than the picture.
    """
    if part is None:
        return Screen()
    outputs = "".join(_LETTERS[name] for name in part.output)
    screen = Screen(outputs=outputs)
    if part.judges:
        screen = judged(part, outputs, shifts, micro_image_size, (3, 8), where=f"{where}: screen")
    shades = SHADES if part.between_slices else 1
    colours = slice_colours(shifts, shades) if "depth" in part.output else ()
    overlay = None
    if part.overlay:
        overlay = scene_overlay(shifts, micro_image_size, model, colours)
        if any(needed > there for needed, there in zip(overlay.size, size, strict=True)):
            raise InputError(
                f"a text of {overlay.size[1]} x {overlay.size[0]} pixels does not fit on a "
                f"picture of {size[1]} x {size[0]}; use fewer slices, or a larger frame",
                where=f"{where}: screen.overlay",
            )
    return replace(screen, colours=colours, overlay=overlay)
