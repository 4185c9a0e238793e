# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``load_port`` on the board's serial line."""

import os
import pty
import subprocess
import sys
import time
import tty
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir.camera.calibration import load_calibration
from plenofir.plan.sensor.board_load import calibration_loads, described
from plenofir_tb.case import read_case

CASE = read_case()
BIT = CASE["bit_clocks"]
PLENOFIR = str(Path(sys.executable).parent / "plenofir")


class Line:
    """Serial line of ``load_ports`` or another entity, and the words that leave its load port.

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
        """Reset the board."""
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
        """Send bytes."""
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
        """Type ``plenofir board load``: its exit code, what it says and complains of."""
        line, clk = self.line, self.line.dut.clk
        command = [PLENOFIR, "board", "load", calib, "--port", self.path]
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
                    # Nothing happens on the line: time passes for the host, a little here.
                    await ClockCycles(clk, BIT)
                    time.sleep(0.005)
            assert host.stdout is not None
            assert host.stderr is not None
            return host.returncode, host.stdout.read(), host.stderr.read()


@cocotb.test()
async def lines_and_their_answers(dut: Any) -> None:
    """Words, the question, wrong lines; all others go on to the command line."""
    line = Line(dut)
    await line.reset()
    assert described(await line.ask("l ?"), where="board").core.lines == CASE["lines"]
    assert await line.ask("l 2ABCDE0123456789") == "ok"
    assert await line.ask("l3 fffff FEDCBA9876") == "ok"
    assert line.words == [(2, 0xABCDE, 0x0123456789), (3, 0xFFFFF, 0xFEDCBA9876)]
    for wrong in (
        "l 4000000000000000",
        "l 200000000000000",
        "l 20000000000000000",
        "l 2g000000000000000",
        "l",
        "l ?1",
        "l ??",
        "lx",
    ):
        assert await line.ask(wrong) == "error", wrong
    assert len(line.words) == 2
    # Blanks in front of a line, and lines of them, do not count.
    assert await line.ask("  l2ABCDE 0123456789 ") == "ok"
    assert await line.ask("  \r \r l ?") == CASE["description"]
    assert line.words.pop() == (2, 0xABCDE, 0x0123456789)
    # An l inside a line is no word; the command line has its own answers.
    assert await line.ask("s l2ABCDE0123456789") == "error"
    assert await line.ask("s 2") == "ok"
    assert await line.ask("?") == "slices=3"
    # The resampler has not taken the word before.
    dut.busy.value = 1
    assert await line.ask("l 0000010000000006") == "error"
    dut.busy.value = 0
    assert await line.ask("l 0000010000000007") == "ok"
    assert line.words[2:] == [(0, 1, 7)]


@cocotb.test()
async def resets_in_lines(dut: Any) -> None:
    """Behind a reset anywhere a line begins; no answer goes on, no word is written."""
    line = Line(dut)
    await line.reset()
    for part in (b"s 1", b"l 2ABCDE01", b"l ?\r", b"s 2\r", b"l 2ABCDE0123456789\r"):
        await line.send(part)
        await ClockCycles(dut.clk, 13 * BIT)
        await line.reset()
        await ClockCycles(dut.clk, 20 * BIT)
        assert described(await line.ask("l ?"), where="board").core.lines == CASE["lines"], part
    assert line.words == [(2, 0xABCDE, 0x0123456789)]
    # The clock in which a word goes out, and resets around it.
    write = 0
    for place in (None, -1, 0, 1):
        await line.send(b"l 2ABCDE0123456789")
        line.words.clear()
        sending = cocotb.start_soon(line.send(b"\r"))
        if place is None:
            while not int(dut.load_write.value):
                await FallingEdge(dut.clk)
                write += 1
        else:
            for _ in range(write - 1 + place):
                await FallingEdge(dut.clk)
            dut.reset.value = 1
            await FallingEdge(dut.clk)
            dut.reset.value = 0
        await sending
        await ClockCycles(dut.clk, 4 * BIT)
        # The last reset comes behind the word.
        assert len(line.words) == int(place in (None, 1)), f"reset {place} clocks from the word"
        await line.reset()
        await ClockCycles(dut.clk, 20 * BIT)


@cocotb.test()
async def calibration_through_a_pseudo_terminal(dut: Any) -> None:
    """The command ``plenofir board load``, as it talks to a board."""
    line = Line(dut)
    await line.reset()
    terminal = Terminal(line)
    for calib, code in ((CASE["other"], 2), (CASE["calib"], 0)):
        # A line that was broken off.
        await line.send(b"l 0000")
        line.answers.clear()
        returned, out, err = await terminal.load(calib)
        assert returned == code, err
        if code:
            assert "hexagonal True; expected False" in err
            assert err.count("\n") == 1
            assert not line.words
    assert "the next frame uses it" in out
    core = described(CASE["description"], where="board")
    assert line.words == calibration_loads(core, load_calibration(CASE["calib"]), where="board")
