# SPDX-License-Identifier: Apache-2.0
"""Resolution by place: a small box where a slice is in focus, the whole one elsewhere.

A box of B samples makes sharper what is in focus, and shows a lattice of views where it is not.
Both are sums of one stream (`plenofir.refocus.operator`), so a pixel is one of two numbers:

    E[k] = E_B[k] if here[t, s] else E_M[k]     with (t, s) the micro image that pixel k lies in

E_B and E_M are rounded as each is alone. Which micro images are in focus comes from the depth index
(`plenofir.refocus.sharpness.DepthIndex.sharp_in`). Pictures to look at blend both instead
(`plenofir.camera.lightfield.all_in_focus`), so that no squares show.
"""

import numpy as np
import numpy.typing as npt

from plenofir.refocus.operator import Image


def chosen(sharp: Image, whole: Image, here: npt.NDArray[np.bool_], micro_image_size: int) -> Image:
    """Pixels of `sharp` in the micro images that are `here`, of `whole` in the others.

    `sharp`, `whole`: pictures of equal shape, (rows, columns[, 3]), and type. `here`: one value for
    each micro image that they begin, shape (t, s).
    """
    m = micro_image_size
    rows, columns = (np.arange(length) // m for length in whole.shape[:2])
    places = here[np.ix_(rows, columns)].reshape(*whole.shape[:2], *[1] * (whole.ndim - 2))
    return np.where(places, sharp, whole)
