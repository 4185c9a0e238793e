# SPDX-License-Identifier: Apache-2.0
"""Sources of HDMI."""

import itertools
from collections.abc import Callable, Sequence

from plenofir.fpga.hdmi.link import Frame, Packed
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir_tb.hdmi import packets
from plenofir_tb.hdmi.islands import encode_hdmi
from plenofir_tb.hdmi.packets import AviInfo, ColourSpace
from plenofir_tb.video import MODE_720

# Room for an island between the lines.
MODE_HDMI = MODE_720.model_copy(
    update={"h_active": 24, "h_front": 8, "h_sync": 12, "h_back": 44, "v_active": 12}
)

Source = Callable[[VideoMode, Sequence[Frame]], Packed]


def hdmi_source(info: AviInfo) -> Source:
    """Source of HDMI with packets of all kinds."""
    sent = itertools.cycle(
        [
            info.packet(),
            packets.audio_clock_packet(6144, 74250),
            packets.audio_sample_packet([(1, 2), (3, 4)]),
            packets.general_control_packet(mute=False),
            packets.audio_info_packet(),
            packets.NULL_PACKET,
        ]
    )
    return lambda mode, frames: encode_hdmi(mode, frames, sent)


RGB = AviInfo()
# As of a player that does not ask the EDID.
LIMITED_YCBCR = AviInfo(ColourSpace.YCBCR_444, format_code=4)
