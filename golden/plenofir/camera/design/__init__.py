# SPDX-License-Identifier: Apache-2.0
"""Design a plenoptic camera: every figure that follows from lens, micro lenses, sensor and focus.

`design` computes them, `plots.design_plot` draws them. All lengths are in mm, angles in degrees;
distances count from the micro lenses.
"""

from plenofir.camera.design.figures import Design, Figure, PlaneFigures, design

__all__ = [
    "Design",
    "Figure",
    "PlaneFigures",
    "design",
]
