# SPDX-License-Identifier: Apache-2.0
"""What virtual depth is counted in: between micro images, or with a camera between micro lenses."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.camera.focused.capture import LEAST, MOST
from plenofir.camera.rays import (
    Distances,
    RayModel,
    setting_of_virtual_depth,
    sharpest_inverse,
    virtual_depth,
)
from plenofir.ground.errors import InputError

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class DepthScale:
    """Virtual depths as people give and get them, and 1 / v between micro images.

    `model`: the camera; None if it is not known, and virtual depth is that between micro images.
    """

    model: RayModel | None = None

    @property
    def _pitch(self) -> float:
        """Pitch of the camera's micro images in its pixels."""
        assert self.model is not None
        camera = self.model.camera
        place = self.model.micro_image_centre(camera.micro_lenses.pitch_mm)
        return float(place) / camera.sensor.pixel_pitch_mm

    def inverse(self, depth: float, where: str = "virtual_depth") -> float:
        """1 / v between micro images; `where` names the depth in the refusal of one too small."""
        if not LEAST <= abs(depth) <= MOST:
            raise InputError(
                f"{depth:g} is no virtual depth; from {LEAST:g} to {MOST:g} on either side micro "
                "images show planes",
                where=where,
            )
        if self.model is None:
            return 1 / depth
        return 1 / (float(setting_of_virtual_depth(self.model, depth)) * self._pitch)

    def depth_at(self, mm: float) -> float:
        """Virtual depth of the plane at a distance from the micro lenses in mm; needs a camera."""
        assert self.model is not None
        return float(virtual_depth(self.model, self.model.focus_setting(mm)))

    def depth(self, inverse: npt.ArrayLike) -> Floats:
        """Virtual depth of 1 / v between micro images, any shape."""
        values = np.asarray(inverse, dtype=np.float64)
        with np.errstate(divide="ignore"):
            if self.model is None:
                return np.asarray(1 / values)
            return np.asarray(virtual_depth(self.model, 1 / (values * self._pitch)))

    def distances(self, inverse: npt.ArrayLike) -> Distances | None:
        """Distances from the micro lenses, nan of nan; None without a camera."""
        if self.model is None:
            return None
        values = np.asarray(inverse, dtype=np.float64)
        unknown = np.isnan(values)
        planes = self.model.distance(1 / (np.where(unknown, 1.0, values) * self._pitch))
        return Distances(np.where(unknown, np.nan, planes.mm), planes.states)

    def sharpest(self) -> tuple[float, ...]:
        """1 / v between micro images at which each type of the camera's lenses is sharpest."""
        assert self.model is not None
        return tuple(float(x) for x in sharpest_inverse(self.model) / self._pitch)
