# SPDX-License-Identifier: Apache-2.0
"""A core's registers without a core: constants to read, and words that keep what is written."""

from plenofir.driver.registers import ADDRESSES, IDENTIFICATION_VALUE, MAP_NUMBER


class RefocuserWords(dict[int, int]):
    """Words of a refocuser with M = 5, with constant counters and all events set.

    Each read of its status has the next slice.
    """

    shifts = (-3, -1, 0, 2)

    def __init__(self, *_: object) -> None:
        words = {
            "identification": IDENTIFICATION_VALUE,
            "version": MAP_NUMBER << 24,
            "parts": 1,
            "geometry": 1 << 24 | 8 << 19 | 1 << 17 | len(self.shifts) << 8 | 5,
            "limits": 1 << 16 | 2048,
            "interrupt_status": 7,
        }
        super().__init__({ADDRESSES[name]: word for name, word in words.items()})

    def read(self, address: int) -> int:
        if address == ADDRESSES["slice_shift"]:
            return self.shifts[self[ADDRESSES["asked_slice"]]] & 0x3FFF
        if address == ADDRESSES["status"]:
            self[address] = (self.get(address, -1) + 1) % len(self.shifts)
        return self.get(address, 0)

    def write(self, address: int, value: int) -> None:
        self[address] = value
