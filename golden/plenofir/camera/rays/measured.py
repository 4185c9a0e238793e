# SPDX-License-Identifier: Apache-2.0
"""Pupils measured by the pitch of micro images (section 5.3.1).

Chief rays leave the exit pupil, so micro images are farther apart than micro lenses. With Eqs. 3.20
and 3.21, a pitch of n pixels of width p_p puts the pupil at

    d = b_s / (n p_p / p_M - 1)

from the micro lenses; b_s, their distance from the sensor, is f_s in a standard camera. With the
main lens reversed the pupil is the entrance pupil. The excess n p_p / p_M - 1 is a few percent, so
relative errors of the three pitches count 1 / excess times.
"""

from dataclasses import dataclass
from math import hypot, inf, sqrt

from plenofir.camera.rays.camera import Camera
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError

# Largest relative difference of the pitches; beyond it the white image is another camera's.
_SAME_CAMERA = 0.2
# Distances agree within this many standard errors plus this share of them, the error that a
# slightly misaligned micro lens array caused in the thesis's measurement.
_ERRORS, _SHARE = 3.0, 0.025


@dataclass(frozen=True)
class MeasuredPupil:
    """A pupil as a white image and as the camera's data have it."""

    # From the micro lenses to the pupil; inf where the micro images are as far apart as the micro
    # lenses, negative where they are nearer to each other: then it lies behind the sensor.
    distance_mm: float
    error_mm: float  # standard error of that distance, from the pitch of the micro images alone
    predicted_mm: float  # the same distance from the camera's data
    micro_lens_pitch_mm: float  # pitch of the micro lenses that would make both distances equal
    agrees: bool  # whether both distances agree to three standard errors and 2.5 %

    @property
    def deviation_percent(self) -> float:
        """By how much the measured distance exceeds the predicted one."""
        return 100 * (self.distance_mm / self.predicted_mm - 1)


def measure_pupil(model: RayModel, pitch_px: float, error_px: float) -> MeasuredPupil:
    """Measure the distance of the exit pupil by the pitch of the micro images.

    `model`: the camera as it was focused. For a white image that was taken with the main lens
    reversed, that of `Camera.reversed`; the result is the entrance pupil then. `pitch_px`: distance
    of neighbouring micro images in pixels. `error_px`: its standard error. Result: beside what the
    camera's data say. Raises `InputError` if the white image cannot be that camera's.
    """
    array, pixel = model.camera.micro_lenses, model.camera.sensor.pixel_pitch_mm
    predicted = model.exit_pupil_mm
    usual = array.pitch_mm * (1 + array.spacing_mm / predicted) / pixel
    if not abs(pitch_px - usual) <= _SAME_CAMERA * usual:
        raise InputError(
            f"the micro images are {pitch_px:.2f} pixels apart, those of "
            f"{model.camera.name} are {usual:.2f} apart; name the camera of the white "
            "image",
            where="camera",
        )
    excess = pitch_px * pixel / array.pitch_mm - 1
    expected = array.spacing_mm / predicted
    unsure = error_px * pixel / array.pitch_mm
    distance = array.spacing_mm / excess if excess else inf
    return MeasuredPupil(
        distance_mm=distance,
        error_mm=distance**2 * unsure / array.spacing_mm,
        predicted_mm=predicted,
        micro_lens_pitch_mm=pitch_px * pixel / (1 + expected),
        agrees=abs(excess - expected) <= _ERRORS * unsure + _SHARE * abs(expected),
    )


def measured_focal_length(
    model: RayModel,
    pupil: MeasuredPupil,
    reversed_model: RayModel,
    reversed_pupil: MeasuredPupil,
) -> tuple[float, float]:
    """Focal length of the main lens from both of its pupils, by Newton's equation.

    The pupils are images of each other, so their distances from the focal points multiply to f_U^2.

    `model`, `pupil`: the camera, and its exit pupil as measured. `reversed_model`,
    `reversed_pupil`: the same with the main lens reversed: its entrance pupil. Result: f_U and its
    standard error in mm; nan where the pupils cannot belong to one lens.
    """
    exit_mm = pupil.distance_mm - model.extension_mm
    entrance_mm = reversed_pupil.distance_mm - reversed_model.extension_mm
    square = exit_mm * entrance_mm
    if not 0 < square < inf:
        return float("nan"), float("nan")
    share = hypot(pupil.error_mm / exit_mm, reversed_pupil.error_mm / entrance_mm)
    return sqrt(square), sqrt(square) * share / 2


def extension_of_infinity(camera: Camera, a: float) -> float:
    """Extension of a main lens that has infinity in slice a.

    `a`: slice in which infinity is sharp (`RayModel.focus_setting` of infinity). Result: e = b_U -
    f_U in mm: positive where the main lens is too far from the micro lenses, focused nearer than
    infinity. nan where no extension has infinity there.
    """
    # d' = e of plane a, with d_A' = P + e: kappa e^2 + kappa P e + a p_M P = 0.
    slope = camera.sensor.pixel_pitch_mm / camera.micro_lenses.spacing_mm
    pupil, shift = camera.main_lens.exit_pupil_mm, a * camera.micro_lenses.pitch_mm
    square = 1 - 4 * shift / (slope * pupil)
    return float("nan") if square < 0 else -2 * shift / slope / (1 + sqrt(square))
