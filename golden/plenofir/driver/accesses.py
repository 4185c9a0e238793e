# SPDX-License-Identifier: Apache-2.0
"""Ways to the words of a core: Linux UIO, physical memory, a serial bridge, a window into a bus.

PYNQ's ``MMIO`` and ``DefaultIP``, and LiteX's ``RemoteClient`` behind a `Window`, are such ways as
they are.
"""

import mmap
import os
import select
from pathlib import Path
from typing import Protocol

from plenofir.driver.registers import Access
from plenofir.ground.errors import InputError

_UIO = Path("/sys/class/uio")
# The kernel maps whole pages; the registers fill a part of one.
_BYTES = 4096
# Commands of LiteX's UARTBone: one word each.
_WRITE, _READ = b"\x01\x01", b"\x02\x01"


class Window:
    """Access to the words from an address on, such as those of a core on a bus."""

    def __init__(self, access: Access, base: int) -> None:
        self._access = access
        self._base = base

    def read(self, address: int) -> int:
        """Read the word at an address."""
        return self._access.read(self._base + address)

    def write(self, address: int, value: int) -> None:
        """Write the word at an address."""
        self._access.write(self._base + address, value)


class _Mapped:
    """The page of a file from a place on, as words of 32 bits."""

    def __init__(self, file: str | Path, place: int, wanted: str) -> None:
        def fail(why: str) -> InputError:
            return InputError(f"cannot be {why}; it must be {wanted}", where=str(file))

        try:
            self._file = os.open(file, os.O_RDWR | os.O_SYNC)
        except OSError as error:
            raise fail(f"opened ({error.strerror})") from None
        try:
            self._memory = mmap.mmap(self._file, _BYTES, offset=place)
        except (OSError, ValueError, OverflowError) as error:
            os.close(self._file)
            raise fail(f"mapped at {place:#x} ({error})") from None
        # One access of 32 bits each: slices of bytes would be several.
        self._words = memoryview(self._memory).cast("I")

    def read(self, address: int) -> int:
        """Read the word at an address."""
        return self._words[address // 4]

    def write(self, address: int, value: int) -> None:
        """Write the word at an address."""
        self._words[address // 4] = value

    def close(self) -> None:
        """Give the file back."""
        self._words.release()
        self._memory.close()
        os.close(self._file)


class Memory(_Mapped):
    """A core at a physical address, a multiple of 4096, through ``/dev/mem``; without interrupt.

    Only root may open that file. InputError if it cannot be opened or mapped.
    """

    def __init__(self, base: int, device: str | Path = "/dev/mem") -> None:
        if base < 0 or base % _BYTES:
            raise InputError(
                f"{base:#x} is no multiple of {_BYTES:#x}", where="address of the core"
            )
        super().__init__(device, base, "the memory of a processor, opened as root")


class Uio(_Mapped):
    """A core as a device of Linux' userspace I/O, ``/dev/uioN``: its registers and its interrupt.

    `device` is its file. InputError if it cannot be opened and mapped.
    """

    def __init__(self, device: str | Path) -> None:
        super().__init__(device, 0, "a UIO device")

    def wait(self, timeout_s: float) -> bool:
        """Wait for an interrupt; whether one came. The kernel masks it, so it is let through."""
        os.write(self._file, (1).to_bytes(4, "little"))
        if not select.select([self._file], [], [], timeout_s)[0]:
            return False
        os.read(self._file, 4)
        return True


def find_uio(name: str = "plenofir", classes: Path = _UIO) -> Path:
    """Find the one UIO device whose name (that of its node in the device tree) holds a text.

    InputError if there is none or more than one.
    """
    entries = sorted(classes.glob("uio*/name"))
    devices = {file.parent.name: file.read_text(encoding="utf-8").strip() for file in entries}
    fitting = [device for device, text in devices.items() if name in text]
    if len(fitting) == 1:
        return Path("/dev") / fitting[0]
    listed = ", ".join(f"{device} ({text})" for device, text in devices.items()) or "none"
    raise InputError(
        f"{len(fitting)} UIO devices are named {name!r}, of {listed}; name one of "
        "them, or see the device tree in docs/registers.md"
    )


class SerialPort(Protocol):
    """Used part of a serial port (pyserial), which has a time-out."""

    def write(self, data: bytes, /) -> object:
        """Send bytes."""

    def read(self, size: int, /) -> bytes:
        """Read so many bytes, or what came until the time-out."""


class SerialBridge:
    """A bus behind a serial port, in the protocol of LiteX's UARTBone: words of 32 bits.

    `base` is the address of the core on that bus, in bytes. Writes are not answered.
    """

    def __init__(self, port: SerialPort, base: int = 0) -> None:
        self._port = port
        self._base = base

    def read(self, address: int) -> int:
        """Read the word at an address; InputError if no answer comes."""
        self._port.write(_READ + self._place(address))
        answer = self._port.read(4)
        if len(answer) < 4:
            raise InputError(
                f"only {len(answer)} of 4 bytes came for the word at "
                f"{self._base + address:#x}; is a UARTBone behind the port, at this speed?",
                where="serial bridge",
            )
        return int.from_bytes(answer, "big")

    def write(self, address: int, value: int) -> None:
        """Write the word at an address."""
        self._port.write(_WRITE + self._place(address) + value.to_bytes(4, "big"))

    def _place(self, address: int) -> bytes:
        return ((self._base + address) // 4).to_bytes(4, "big")
