# SPDX-License-Identifier: Apache-2.0
"""How errors of a camera's data grow in the distance of a plane: relative condition numbers."""

from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal, localcontext
from fractions import Fraction
from math import inf, isnan

from plenofir.camera.rays.model import Border, RayModel, plane_coefficients
from plenofir.camera.rays.precise import exact

INPUTS = ("a", "f_U", "b_U", "H1H2", "d_A'", "f_s", "p_M", "p_p")
"""What a distance depends on, in the thesis's symbols."""
# Relative step of the differences, far below the resolution of a double, and digits for them.
_STEP = Decimal("1e-400")
_CONTEXT = Context(prec=1000, Emin=MIN_EMIN, Emax=MAX_EMAX)


def condition_numbers(
    model: RayModel, a: float | Fraction, border: Border = "centre"
) -> dict[str, float]:
    """Relative condition numbers |x/d dd/dx| of the distance of a plane.

    An input x with a relative error of r puts the distance d off by r times its number. Beside
    `INPUTS` "all" has their sum: what happens if all inputs are off by as much in the worst way.
    f_U is off with the same extension e; a main lens that stands elsewhere (b_U) takes its pupil
    with it. In a focused camera b_s stands in the place of f_s, on which no distance depends. All
    are inf for planes at infinity.

    `a`: focus setting. `border`: the plane itself, or a border of its depth of field.
    """
    lengths = {**model.lengths, "a": exact(float(a))}
    edges = next(e for first, last, e in model.edges(border) if first <= float(a) <= last)
    standard = model.camera.micro_lenses.standard

    def distance(inputs: dict[str, Decimal]) -> Decimal:
        """Infinite, or not a number, for planes at infinity."""
        lines = plane_coefficients(inputs, model.micro_image_size, border, edges)
        top, bottom = (constant + factor * inputs["a"] for constant, factor in lines)
        return top / bottom

    numbers: dict[str, float] = {}
    with localcontext(_CONTEXT) as context:
        context.clear_traps()
        middle = distance(lengths)
        for name in INPUTS:
            changed = dict(lengths)
            if name == "b_U":
                moved = (lengths["f_U"] + lengths["e"]) * _STEP
                changed["e"] += moved
                changed["1/d_A'"] /= 1 + moved * lengths["1/d_A'"]
            else:
                place = {"d_A'": "1/d_A'", "f_s": "b_s"}.get(name, name)
                changed[place] += lengths[place] * _STEP
            number = float(abs((distance(changed) - middle) / (middle * _STEP)))
            shown_as = "b_s" if name == "f_s" and not standard else name
            numbers[shown_as] = inf if isnan(number) else number
    numbers["all"] = sum(numbers.values())
    return numbers
