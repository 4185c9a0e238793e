# SPDX-License-Identifier: Apache-2.0
"""The driver's accesses, each against a foreign counterpart, and its refusals."""

import contextlib
import io
import os
import runpy
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from plenofir.driver import Core, Memory, SerialBridge, Uio, Window, find_uio
from plenofir.driver.registers import ADDRESSES, NEEDS
from plenofir.errors import InputError
from plenofir.ground import project


class Words(dict):
    """Words that keep what is written."""

    def read(self, address: int) -> int:
        """Read what was written, or 0."""
        return self.get(address, 0)

    def write(self, address: int, value: int) -> None:
        self[address] = value


def test_uio_maps_a_file_and_waits(tmp_path: Path) -> None:
    file = tmp_path / "uio0"
    file.write_bytes(bytes(range(16)) + bytes(4080))
    device = Uio(file)
    assert device.read(4) == 0x07060504
    device.write(8, 0x12345678)
    assert file.read_bytes()[8:12] == bytes.fromhex("78563412")
    # Its interrupts: a read returns their number when one comes, and writing 1 enables the next.
    ours, kernel = socket.socketpair()
    real, device._file = device._file, ours.fileno()
    assert not device.wait(0.01)
    assert kernel.recv(8) == b"\1\0\0\0"
    kernel.send(b"\5\0\0\0")
    assert device.wait(1)
    device._file = real
    device.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(real)


def test_uio_refuses(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"uio9: cannot be opened .*must be a UIO device"):
        Uio(tmp_path / "uio9")
    (tmp_path / "short").write_bytes(b"")
    with pytest.raises(InputError, match=r"short: cannot be mapped"):
        Uio(tmp_path / "short")


def test_memory_is_the_page_at_an_address(tmp_path: Path) -> None:
    file = tmp_path / "mem"
    file.write_bytes(bytes(4096) + bytes(range(16)) + bytes(4080))
    core = Memory(0x1000, file)
    assert core.read(4) == 0x07060504
    core.write(8, 0x12345678)
    core.close()
    assert file.read_bytes()[0x1008:0x100C] == bytes.fromhex("78563412")
    with pytest.raises(InputError, match=r"address of the core: 0x1001 is no multiple of 0x1000"):
        Memory(0x1001, file)
    with pytest.raises(InputError, match=r"mem: cannot be mapped at 0x9000 .*opened as root"):
        Memory(0x9000, file)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "cannot be opened"),
        (["--address", "0x43C00001"], "is no multiple of 0x1000"),
        (["--overlay", "plenofir.bit"], "an overlay needs the core's address"),
        (["--focus", "near"], "argument --focus: invalid Fraction value: 'near'"),
    ],
)
def test_the_example_refuses_in_one_line(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = project.root() / "examples" / "linux" / "refocus.py"
    monkeypatch.setattr("plenofir.driver.find_uio", lambda: tmp_path / "uio9")
    main, errors = runpy.run_path(str(file))["main"], io.StringIO()
    with contextlib.redirect_stderr(errors):
        try:
            code = main(["1280", "720", *words])
        except SystemExit as stopped:
            code = stopped.code
    assert code == 2
    assert said in errors.getvalue().splitlines()[-1]


def test_find_uio(tmp_path: Path) -> None:
    for number, name in enumerate(("axi-gpio", "plenofir", "other")):
        (tmp_path / f"uio{number}").mkdir()
        (tmp_path / f"uio{number}" / "name").write_text(f"{name}\n")
    assert find_uio(classes=tmp_path) == Path("/dev/uio1")
    with pytest.raises(InputError, match=r"0 UIO devices are named 'sensor', of uio0"):
        find_uio("sensor", tmp_path)
    with pytest.raises(InputError, match=r"3 UIO devices"):
        find_uio("", tmp_path)


def test_window() -> None:
    words = Words({0x1000: 5})
    window = Window(words, 0x1000)
    assert window.read(0) == 5
    window.write(4, 7)
    assert words[0x1004] == 7


def test_serial_bridge_against_litex() -> None:
    """LiteX's own bridge, simulated, is the other end."""
    migen = pytest.importorskip("migen", reason="LiteX is not installed (scripts/setup.sh tests)")
    uart = pytest.importorskip("litex.soc.cores.uart")
    words = Words({0x100: 0xCAFE0001, 0x104: 5})

    class Port:
        """A serial port with LiteX's bridge behind it: it gets all bytes so far at each read."""

        def __init__(self) -> None:
            self.sent = b""
            self.done = 0

        def write(self, data: bytes) -> None:
            self.sent += data

        def read(self, size: int) -> bytes:
            bridge = uart.Stream2Wishbone(clk_freq=1_000_000)
            answers = bytearray()

            def feed():
                for byte in self.sent[self.done :]:
                    yield bridge.sink.data.eq(byte)
                    yield bridge.sink.valid.eq(1)
                    yield
                    while not (yield bridge.sink.ready):
                        yield
                yield bridge.sink.valid.eq(0)
                for _ in range(60):
                    yield

            def listen():
                yield bridge.source.ready.eq(1)
                for _ in range(40 * len(self.sent) + 60):
                    if (yield bridge.source.valid):
                        answers.append((yield bridge.source.data))
                    yield

            def serve():
                bus = bridge.wishbone
                for _ in range(40 * len(self.sent) + 60):
                    if (yield bus.cyc) and (yield bus.stb) and not (yield bus.ack):
                        address = 4 * (yield bus.adr)
                        if (yield bus.we):
                            words.write(address, (yield bus.dat_w))
                        yield bus.dat_r.eq(words.read(address))
                        yield bus.ack.eq(1)
                    else:
                        yield bus.ack.eq(0)
                    yield

            migen.run_simulation(bridge, [feed(), listen(), serve()])
            self.done = len(self.sent)
            return bytes(answers[:size])

    bridge = SerialBridge(Port(), 0x100)
    assert bridge.read(0) == 0xCAFE0001
    bridge.write(8, 0x89ABCDEF)
    bridge.write(4, 6)
    assert bridge.read(4) == 6
    assert words[0x108] == 0x89ABCDEF
    bridge._port.read = lambda _: b""
    with pytest.raises(InputError, match="only 0 of 4 bytes came for the word at 0x10c"):
        bridge.read(12)


def test_what_is_no_core_is_refused() -> None:
    with pytest.raises(InputError, match="reads as 0x00000000, not 0x506c6e66"):
        Core(Words())
    with pytest.raises(
        InputError, match=r"register map 9, this driver knows 1; take the driver of plenofir 0\.3"
    ):
        Core(Words({0: 0x506C6E66, 4: 0x09000300}))


def test_registers_that_are_not_there_are_not_touched() -> None:
    """They might hang a processor."""
    for parts in (1, 2, 6, 8, 24):
        touched = set()

        class Watched(Words):
            def read(self, address: int) -> int:
                touched.add(address)  # noqa: B023
                return self.get(address, 0)

            def write(self, address: int, value: int) -> None:
                touched.add(address)  # noqa: B023
                self[address] = value

        core = Core(Watched({0: 0x506C6E66, 4: 1 << 24, 8: parts, 0x10: 100, 0x0C: 1 << 8}))
        core.set_frame_size(20, 10, timeout_s=0.01)
        core.enable()
        core.counters()
        core.errors(clear=True)
        core.wait("error", 0)
        for call in (
            lambda: core.set_slice(0),  # noqa: B023
            core.sweep,
            lambda: core.shown_slice,  # noqa: B023
            lambda: core.raster_size,  # noqa: B023
            lambda: core.load_words([(0, 0, 0)]),  # noqa: B023
        ):
            with contextlib.suppress(InputError):
                call()
        absent = {ADDRESSES[name] for name, mask in NEEDS.items() if not mask & parts}
        assert not touched & absent


def test_it_needs_pythons_own_library_alone() -> None:
    """So that it runs on a small processor, without the package's dependencies."""
    code = (
        "import sys; import plenofir.driver;"
        "print([m for m in sys.modules if m.split('.')[0] in ('numpy', 'scipy', 'pydantic')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_what_is_built_from_the_map_is_fresh() -> None:
    pytest.importorskip("hdl_registers", reason="hdl-registers: scripts/setup.sh registers")
    script = project.root() / "scripts" / "build_registers.py"
    done = subprocess.run(
        [sys.executable, script, "--check"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
