# SPDX-License-Identifier: Apache-2.0
"""What speaks for a grid."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

_Number = Annotated[float, Field(allow_inf_nan=False)]


class Evidence(BaseModel):
    """What speaks for a grid.

    Attributes
    ----------
    missing_share
        Share of the lenses in the lit part of the image that are not lit.
    scatter_share
        Scatter of single centroids as a share of the pitch.
    centre_error_px
        Standard error in pixels of the centre that is known worst: the root mean square of its
        distance from the true one. It takes in the tilt and the distortion that the lenses cannot
        tell.
    mean_error_px
        The same of all centres: root mean square over them. None in files that do not have it.
    periodicity
        How much more the image looks like itself when it is moved by whole lenses than by parts of
        them: 1 for a perfect white image.
    next_periodicity
        The same of the next best lattice, 0 if there is none.
    layout_margin
        By how much the other layout (square or hexagonal) fits the lenses worse, in pitches.
    cell_margin
        1 minus the relative brightness of a second spot in the mean cell of the grid.
    order_gains_px
        For the orders 2, 3 of the grid's polynomial: by how many pixels (root mean square) lenses
        left out of the fit were predicted better than by the best lower order, negative if worse.
        Empty if the order was given.
    untried_orders
        Orders of the grid's polynomial of which only tilt and radial distortion could be tried, for
        want of lenses.
    pitch_error_px
        Standard error of the distance of neighbouring micro images (`Grid.lens_pitch`) in pixels;
        None in files that do not have it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    missing_share: _Number
    scatter_share: _Number
    centre_error_px: _Number
    periodicity: _Number
    next_periodicity: _Number
    layout_margin: _Number
    cell_margin: _Number
    order_gains_px: tuple[_Number, ...] = ()
    untried_orders: tuple[int, ...] = ()
    pitch_error_px: _Number | None = None
    mean_error_px: _Number | None = None

    def lines(self) -> list[str]:
        """The evidence in words.

        Result: lines with a heading of 14 characters.
        """
        gains = [f"order {n}: {gain:.4f}" for n, gain in enumerate(self.order_gains_px, 2)]
        orders = " and ".join(map(str, self.untried_orders))
        untried = f"of order {orders} only tilt and radial distortion were tried: too few lenses"
        return [
            f"missing       {100 * self.missing_share:.1f} % of the lit lenses",
            f"evidence      scatter {100 * self.scatter_share:.2f} % of the pitch, centres within "
            f"{self.centre_error_px:.4f} pixels (standard error)",
            f"              periodicity {self.periodicity:.2f}, of the next best lattice "
            f"{self.next_periodicity:.2f}; the other layout {self.layout_margin:.2f} pitches off",
            "              pixels gained at lenses left out of the fit by "
            + (", ".join(gains) or "higher orders: not tried"),
            *([f"note          {untried}"] if orders else []),
        ]
