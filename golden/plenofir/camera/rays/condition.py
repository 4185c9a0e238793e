# SPDX-License-Identifier: Apache-2.0
"""How errors of a camera's data grow in the distance of a plane: relative condition numbers."""

from decimal import Context, Decimal, localcontext
from fractions import Fraction
from math import inf

from plenofir.camera.rays.model import Border, RayModel, plane_coefficients
from plenofir.camera.rays.precise import exact

INPUTS = ("a", "f_U", "b_U", "H1H2", "d_A'", "f_s", "p_M", "p_p")
"""What a distance depends on, in the thesis's symbols."""
# Relative step of the differences, far below the resolution of a double, and enough digits for
# them.
_STEP = Decimal("1e-400")
_CONTEXT = Context(prec=1000, Emin=-999999, Emax=999999)


def condition_numbers(
    model: RayModel, a: float | Fraction, border: Border = "centre"
) -> dict[str, float]:
    """Relative condition numbers |x/d dd/dx| of the distance of a plane.

    An input x with a relative error of r puts the distance d off by r times its number. Beside
    `INPUTS` "all" has their sum: what happens if all inputs are off by as much in the worst way.
    f_U is off with the same extension e; a main lens that stands elsewhere (b_U) takes its pupil
    with it. All are inf for planes at infinity.

    `a`: focus setting. `border`: the plane itself, or a border of its depth of field.
    """
    lengths, weight = model.lengths, model.pupil_weight
    setting = exact(float(a))

    def distance(name: str, step: Decimal) -> Decimal | None:
        changed, there = dict(lengths), setting
        if name == "a":
            there *= 1 + step
        elif name == "b_U":
            moved = (changed["f_U"] + changed["e"]) * step
            changed["e"] += moved
            changed["d_A'"] += weight * moved
        elif name:
            changed[name] *= 1 + step
        top, bottom = plane_coefficients(changed, weight, model.micro_image_size, border)
        vergence = bottom[0] + bottom[1] * there
        return (top[0] + top[1] * there) / vergence if vergence else None

    found: dict[str, float] = {}
    with localcontext(_CONTEXT):
        middle = distance("", Decimal(0))
        for name in INPUTS:
            ends = distance(name, _STEP), distance(name, -_STEP)
            if middle and ends[0] is not None and ends[1] is not None:
                found[name] = float(abs((ends[0] - ends[1]) / (2 * _STEP * middle)))
            else:
                found[name] = inf
    found["all"] = sum(found.values())
    return found
