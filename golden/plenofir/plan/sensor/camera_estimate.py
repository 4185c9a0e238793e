# SPDX-License-Identifier: Apache-2.0
"""Estimated resources of a board's top level with a camera, without raster and core.

Block RAM follows the rules of Yosys, as that of the core does. Look-up tables and flip-flops are
weighted sums over the parts, fitted to nextpnr's results for the shipped scenes.
"""

from collections.abc import Iterator

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.memory import Memory
from plenofir.fpga.core.weights import usage_of_parts
from plenofir.fpga.csi import word_pixels
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family
from plenofir.plan.sensor.board_camera import PlannedCamera

# Bits of a word between the lanes' clock and the core's: flags, its last pixel.
_TOLD_BITS = 11


def camera_memories(camera: PlannedCamera, core: CoreConfiguration) -> Iterator[Memory]:
    """Memories of the receiver, and of the lines that go out as parallel video."""
    together = core.pixels_per_clock
    pixels = word_pixels(camera.board.lanes, camera.board.bits, together)
    last = max((pixels - 1).bit_length(), 1)
    width = pixels * camera.board.bits + last + _TOLD_BITS
    yield Memory("words of the lanes", camera.board.buffer_bits, width, 1)
    if camera.parallel:
        words = 2 * max(core.max_columns // together, 2)
        width = together * core.channels * core.pixel_bits + 2
        yield Memory("lines out", (words - 1).bit_length(), width, 1)


def camera_usage(camera: PlannedCamera, core: CoreConfiguration, family: Family) -> Usage:
    """Estimate the resources of receiver, registers, calibration port and output on a device.

    Block RAM exactly; the whole board's LUTs within 15 %.
    """
    parts = {
        "board": 1,
        "lane bits": 8 * camera.board.lanes,
        "registers": len(camera.board.registers),
        "raster": int(camera.raster),
    }
    memories = list(camera_memories(camera, core))
    return usage_of_parts("camera", parts, memories, family)
