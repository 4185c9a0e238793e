# SPDX-License-Identifier: Apache-2.0
"""A camera's packets as the bench's model of its wires reads them."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt


def wire_words(
    packets: Sequence[bytes], wait_bits: int = 0, starts: Sequence[int] = ()
) -> npt.NDArray[np.int32]:
    """Words for ``tb/file_bench/dphy_camera.vhd``: packets, each with the bits to wait after it.

    `starts` are the bits since the start at which packets begin.
    """
    words: list[int] = []
    for number, packet in enumerate(packets):
        words += [-1, starts[number]] if starts else []
        words += [len(packet), *packet]
        words += [0, wait_bits] if wait_bits else []
    return np.array(words, "<i4")
