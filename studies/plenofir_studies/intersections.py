# SPDX-License-Identifier: Apache-2.0
"""The thesis's ways to compute a refocusing distance, for comparison with the closed form.

They intersect two rays, on the image side or in object space, and invert the lens equation. They
are easy to follow, but slower, and lose digits where `RayModel` does not: at infinity they give inf
or a meaningless number.
"""

from math import inf

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.model import RayModel
from plenofir.camera.rays.precise import Values


def _pair(model: RayModel, a: Values, border: int) -> tuple[Values, Values, Values, Values]:
    """Slopes and heights at the micro lenses of the two rays that meet on a plane."""
    # `border` is 1 for the near border (inner rays through the outer edges of the micro lenses), 0
    # for the plane, -1 for the far border (outer rays through the inner edges).
    c = (model.micro_image_size - 1) / 2
    pitch = model.camera.micro_lenses.pitch_mm
    first = a * c * pitch
    second = first - a * (model.micro_image_size - 1) * pitch
    pixel = c - border / 2
    slope_first = model.chief_ray_slope(-pixel, first)
    slope_second = model.chief_ray_slope(pixel, second)
    return slope_first, first + border * pitch / 2, slope_second, second - border * pitch / 2


def image_side_distance(model: RayModel, a: npt.ArrayLike, border: int = 0) -> Values:
    """Distance by intersection behind the micro lenses (Eqs. 3.31-3.34, 3.39-3.43).

    `a`: focus settings, any shape. `border`: 1 for the near border of the depth of field, 0 for the
    plane, -1 for the far border. Result: d_a from the micro lenses in mm, same shape.
    """
    slope1, height1, slope2, height2 = _pair(model, np.asarray(a, dtype=np.float64), border)
    lens = model.camera.main_lens
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        meeting = (height2 - height1) / (slope1 - slope2)
        image_distance = model.image_distance_mm - meeting
        object_distance = 1 / (1 / lens.focal_length_mm - 1 / image_distance)
    return np.asarray(
        model.image_distance_mm + lens.principal_plane_separation_mm + object_distance
    )


def object_side_distance(model: RayModel, a: npt.ArrayLike, border: int = 0) -> Values:
    """Distance by intersection in object space (Eqs. 3.25-3.30).

    Parameters and result as `image_side_distance`.
    """
    slope1, height1, slope2, height2 = _pair(model, np.asarray(a, dtype=np.float64), border)
    lens = model.camera.main_lens
    f, image_distance = lens.focal_length_mm, model.image_distance_mm
    # Heights at the principal plane, and slopes behind the focal plane (Eqs. 3.25-3.27).
    plane1, plane2 = slope1 * image_distance + height1, slope2 * image_distance + height2
    object1, object2 = (slope1 * f - plane1) / f, (slope2 * f - plane2) / f
    with np.errstate(divide="ignore", invalid="ignore"):
        object_distance = (plane2 - plane1) / (object1 - object2)
    return np.asarray(image_distance + lens.principal_plane_separation_mm + object_distance)


def iterated_image_distance(
    focal_length_mm: float,
    principal_plane_separation_mm: float,
    focus_mm: float,
    *,
    tolerance: float = 1e-12,
    limit: int = 100_000,
) -> tuple[float, int]:
    """Image distance b_U by the thesis's fixed-point iteration of Eq. (5.16).

    `focal_length_mm`, `principal_plane_separation_mm`, `focus_mm`: f_U, H1H2, d_f. `tolerance`:
    relative change at which it stops. `limit`: largest number of steps. Result: b_U in mm and the
    number of steps; the limit where it has not settled.
    """
    if focus_mm == inf:
        return focal_length_mm, 0
    image_distance = focal_length_mm
    for step in range(1, limit + 1):
        object_distance = focus_mm - image_distance - principal_plane_separation_mm
        following = 1 / (1 / focal_length_mm - 1 / object_distance)
        if abs(following - image_distance) <= tolerance * abs(following):
            return following, step
        image_distance = following
    return image_distance, limit
