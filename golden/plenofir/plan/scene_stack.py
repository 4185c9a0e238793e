# SPDX-License-Identifier: Apache-2.0
"""The focal stack of a scene: what comes out of it, and how its sharpest slices are found."""

from abc import abstractmethod
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from plenofir.fpga.screen.board_screen import Screen
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import least_box
from plenofir.refocus.sharpness import (
    MAX_SHARPNESS_RADIUS,
    MAX_VOTE_RADIUS,
    TEXTURE,
    confidence_level,
    has_order,
)

_GREY_LEVELS = 255


class Judging(BaseModel):
    """How the sharpest slice of each micro image is found."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    # Sharpness is judged in a window of (2 radius + 1)^2 micro images.
    radius: Annotated[int, Field(ge=0, le=MAX_SHARPNESS_RADIUS)] = 1
    # Texture that a micro image has at least, in grey levels; those with less take their
    # neighbours' slice, see `plenofir.refocus.sharpness.confidence_level`.
    confidence: Annotated[float, Field(ge=0, le=_GREY_LEVELS)] = TEXTURE
    # Neighbours are those in a window of (2 vote_radius + 1)^2 micro images; 0: every micro image
    # keeps its own slice.
    vote_radius: Annotated[int, Field(ge=0, le=MAX_VOTE_RADIUS)] = 1
    # Whether depth between slices is found, of which there are three or more, going up or down.
    between_slices: bool = False
    # Samples of the box, less than M, from which pixels come where a slice is in focus.
    sharp_box: Annotated[int, Field(ge=1)] | None = None

    @property
    @abstractmethod
    def outputs(self) -> tuple[str, ...]:
        """Names of what comes out."""

    @property
    def judges(self) -> bool:
        """Whether the sharpest slice is asked for."""
        return bool({"all-in-focus", "depth"} & set(self.outputs))

    @model_validator(mode="after")
    def _something_is_judged(self) -> Self:
        named = set(Judging.model_fields) & self.model_fields_set
        if named and not self.judges:
            raise ValueError(f"{min(named)} needs the output 'all-in-focus' or 'depth'")
        if self.sharp_box is not None and "all-in-focus" not in self.outputs:
            raise ValueError("sharp_box needs the output 'all-in-focus'")
        return self


class SceneStack(Judging):
    """All slices in one pass, for a core without a screen."""

    # "slices": all of them, side by side; "all-in-focus": of each pixel that of its sharpest slice,
    # and the number of this slice; "depth": the number alone, so that no pixel has to wait for it.
    output: Literal["slices", "all-in-focus", "depth"] = "slices"

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output."""
        return (self.output,)


_LETTERS = {"slices": "s", "all-in-focus": "ai", "depth": "i"}


def judged(
    part: Judging,
    outputs: str,
    shifts: tuple[int, ...],
    micro_image_size: int,
    pixel: tuple[int, int],
    *,
    where: str,
) -> Screen:
    """Outputs for which the sharpest slices are found.

    `pixel` is channels and their bits, `where` the part of the scene's file for messages.
    InputError if the slices cannot be told apart, or none has a box between `sharp_box` and M.
    """
    m, box = micro_image_size, part.sharp_box
    if box is not None and not any(box <= m and least_box(m, s, box) < m for s in shifts):
        raise InputError(
            f"no slice of M = {m} has a box of {box} samples or more that is smaller than M; "
            "use a smaller one, or leave it out",
            where=f"{where}.sharp_box",
        )
    if len(shifts) < 2 or m < 2:
        raise InputError(
            "all-in-focus and depth need M of 2 or more and at least two slices, not "
            f"{len(shifts)} of M = {m}",
            where=f"{where}.output",
        )
    if part.between_slices and not (len(shifts) > 2 and has_order(shifts)):
        raise InputError(
            f"depth between slices needs three or more, going up or down, not {len(shifts)} of "
            f"a' = {' '.join(map(str, shifts))}",
            where=f"{where}.between_slices",
        )
    weighs = part.vote_radius or part.between_slices or box is not None
    level = confidence_level(part.confidence, m, part.radius, *pixel)
    return Screen(
        outputs=outputs,
        radius=part.radius,
        confidence=level if weighs else 0,
        vote_radius=part.vote_radius,
        between=part.between_slices,
        sharp_box=box,
    )


def stack_of(
    part: SceneStack,
    shifts: tuple[int, ...],
    micro_image_size: int,
    pixel: tuple[int, int],
    *,
    where: str,
) -> Screen:
    """What comes out of a scene's focal stack; see `judged`."""
    outputs = _LETTERS[part.output]
    if not part.judges:
        return Screen(outputs=outputs)
    return judged(part, outputs, shifts, micro_image_size, pixel, where=f"{where}: stack")
