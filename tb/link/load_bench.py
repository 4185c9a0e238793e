# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``load_port`` on the board's serial line."""

import os
import pty
import re
import subprocess
import sys
import time
import tty
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir.camera.calibration import load_calibration
from plenofir.plan.sensor.board_load import calibration_loads, described
from plenofir_tb.case import read_case

CASE = read_case()
BIT = CASE["bit_clocks"]
# The command ``plenofir`` with patience for a board that is simulated on a busy machine.
HOST = "from plenofir.commands import app, board; board._TIMEOUT_S = 120.0; app.main()"


class Line:
    """Serial line of ``load_ports`` or another entity, and the words from its load port.

    `alone`: the words are ports, and nothing else drives the clock.
    """

    def __init__(self, dut: Any, *, alone: bool = True) -> None:
        self.dut = dut
        self.words: list[tuple[int, int, int]] = []
        self.slices: list[int] = []
        self.answers = bytearray()
        if alone:
            Clock(dut.clk, 10, "ns").start()
            cocotb.start_soon(self._watch())
        cocotb.start_soon(self._listen())

    async def reset(self) -> None:
        self.dut.line_in.value = 1
        self.dut.busy.value = 0
        self.dut.reset.value = 1
        await ClockCycles(self.dut.clk, 4)
        self.dut.reset.value = 0
        await ClockCycles(self.dut.clk, 4 * BIT)

    async def _watch(self) -> None:
        dut = self.dut
        while True:
            await RisingEdge(dut.load_write)
            await FallingEdge(dut.clk)
            ports = dut.load_kind, dut.load_address, dut.load_data
            self.words.append(tuple(int(port.value) for port in ports))  # type: ignore[arg-type]

    async def _listen(self) -> None:
        dut = self.dut
        while True:
            await FallingEdge(dut.line_out)
            await ClockCycles(dut.clk, BIT // 2)
            byte = 0
            for bit in range(8):
                await ClockCycles(dut.clk, BIT)
                byte |= int(dut.line_out.value) << bit
            await ClockCycles(dut.clk, BIT)
            self.answers.append(byte)

    async def send(self, data: bytes) -> None:
        for byte in data:
            for level in (0, *(byte >> bit & 1 for bit in range(8)), 1):
                self.dut.line_in.value = level
                await ClockCycles(self.dut.clk, BIT)

    async def ask(self, line: str) -> str:
        """Send a line, return its answer."""
        self.answers.clear()
        await self.send(line.encode() + b"\r")
        for _ in range(2000):
            if self.answers.endswith(b"\n"):
                break
            await ClockCycles(self.dut.clk, 10 * BIT)
        return self.answers.decode().strip()


class Terminal:
    """A pseudo terminal whose other end is the board's serial line."""

    def __init__(self, line: Line) -> None:
        self.line = line
        self.here, there = pty.openpty()
        tty.setraw(there)
        os.set_blocking(self.here, False)
        self.path = os.ttyname(there)

    async def load(self, calib: str) -> tuple[int, str, str]:
        """Run ``plenofir board load``: its exit code, standard output, error without progress."""
        line, clk = self.line, self.line.dut.clk
        command = [sys.executable, "-c", HOST, "board", "load", calib, "--port", self.path]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as host:
            while host.poll() is None:
                try:
                    data = os.read(self.here, 64)
                except BlockingIOError:
                    data = b""
                await line.send(data)
                if line.answers.endswith(b"\n"):
                    os.write(self.here, bytes(line.answers))
                    line.answers.clear()
                elif data or line.answers:
                    await ClockCycles(clk, 10 * BIT)
                else:
                    # The line is idle: let a little simulated time pass while the host waits.
                    await ClockCycles(clk, BIT)
                    time.sleep(0.005)
            assert host.stdout is not None
            assert host.stderr is not None
            # A simulated board may take so long that the command tells how far it is.
            errors = re.sub(r"^ *\d+ s  .*\n", "", host.stderr.read(), flags=re.M)
            return host.returncode, host.stdout.read(), errors


@cocotb.test()
async def calibration_through_a_pseudo_terminal(dut: Any) -> None:
    """The command ``plenofir board load``, as it talks to a board."""
    line = Line(dut)
    await line.reset()
    terminal = Terminal(line)
    for calib, code in ((CASE["other"], 2), (CASE["calib"], 0)):
        # An unfinished line.
        await line.send(b"l 0000")
        line.answers.clear()
        returned, out, err = await terminal.load(calib)
        assert returned == code, err
        if code:
            assert "has hexagonal True, the resampler False" in err
            assert err.count("\n") == 1
            assert not line.words
    assert "the next frame uses it" in out
    core = described(CASE["description"], where="board")
    assert line.words == calibration_loads(core, load_calibration(CASE["calib"]), where="board")


@cocotb.test()
async def commands_behind_the_load_port(dut: Any) -> None:
    """A command ends with a byte that is valid, whatever the bus shows between bytes."""
    line = Line(dut)
    await line.reset()
    assert await line.ask("s 2") == "ok"
    assert await line.ask("s 3") == "error"


@cocotb.test()
async def lines_that_load_nothing(dut: Any) -> None:
    """A word has sixteen digits and a kind, a question one mark; any other line is an error."""
    line = Line(dut)
    await line.reset()
    word = "123456789abcdeF0"
    wrong = [word[1:], word + "0", word + word, "5" + word[1:], word[:8] + "g" + word[9:]]
    for text in (*wrong, "??", "?" + word, word + "?", "", word[:8] + "-" + word[8:]):
        assert await line.ask(f"l{text}") == "error", text
        assert not line.words, text
    dut.busy.value = 1
    assert await line.ask(f"l{word}") == "error"
    assert await line.ask("l?") == CASE["description"].rstrip(".")
    assert not line.words
    dut.busy.value = 0
    assert await line.ask(f" l {word[:4]} {word[4:]} ") == "ok"
    digits = int(word, 16)
    assert line.words == [(digits >> 60, digits >> 40 & 0xFFFFF, digits & 0xFFFFFFFFFF)]
