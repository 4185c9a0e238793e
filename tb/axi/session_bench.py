# SPDX-License-Identifier: Apache-2.0
"""The sessions in docs/registers.md, word for word, and the example, against the VHDL."""

import contextlib
import io
import os
import random
import re
import runpy
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import cocotb
import cocotbpynq
from cocotb.clock import Clock
from cocotb.task import bridge, resume
from cocotb.triggers import ClockCycles, First, RisingEdge

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.ground import project
from plenofir_tb.axi_lite import Master
from plenofir_tb.axi_video import AxiVideoSink, AxiVideoSource, Beat, frame_beats
from plenofir_tb.case import read_case
from plenofir_tb.frames import make_frame

CASE = read_case()
CORE = CoreConfiguration.model_validate(CASE["core"])
COLUMNS, ROWS = CORE.max_columns, 2 * CORE.micro_image_size
PAGE = (project.root() / "docs" / "registers.md").read_text()
LINUX, PYNQ = (
    block.replace("1280, 720", f"{COLUMNS}, {ROWS}")
    for block in re.findall(r"^```python\n(.*?)^```", PAGE, re.S | re.M)
)
EXAMPLE = project.root() / "examples" / "linux" / "refocus.py"
BASE = 0x43C0_0000


class Camera:
    """Sends frames endlessly, and collects the core's output."""

    def __init__(self, dut: Any) -> None:
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.source = AxiVideoSource(dut, "s_axis", dut.clk)
        self.sink = AxiVideoSink(dut, "m_axis", dut.clk, reset=dut.reset)
        self.sent: list[Any] = []
        self.came: list[list[Beat]] = []
        self.sink.add_callback(self._take)

    def _take(self, beat: Beat) -> None:
        if beat.start_of_frame:
            self.came.append([])
        self.came[-1].append(beat)

    async def run(self) -> None:
        """Send one frame after the other."""
        while True:
            frame = make_frame("random", ROWS, COLUMNS, 1, CORE.pixel_bits, self.rng)
            self.sent.append(frame)
            await self.source.send(frame_beats(frame, CORE.pixel_bits))

    def check(self) -> list[int]:
        """Compare each whole frame with the golden model; their slices, in order.

        The frames before the core was switched on are missing, and no others.
        """
        whole = [frame for frame in self.came if len(frame) == COLUMNS * ROWS]
        assert len(whole) >= len(self.came) - 1
        m, shifts = CORE.micro_image_size, CORE.shifts

        def golden(sent: Any, slice_: int) -> list[int]:
            image = CORE.arithmetic.refocus(sent, m, shift=shifts[slice_])
            return [beat.data for beat in frame_beats(image, CORE.pixel_bits)]

        data = [[beat.data for beat in frame] for frame in whole]
        slices = [frame[0].slice for frame in whole]
        dropped = next(n for n, f in enumerate(self.sent) if golden(f, slices[0]) == data[0])
        for sent, slice_, got in zip(self.sent[dropped:], slices, data, strict=False):
            assert got == golden(sent, slice_)
        return slices


class Words:
    """The simulated core as the page's `Uio` gives it, with its interrupt."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.master = Master(dut)

    @resume
    async def wait(self, _timeout_s: float) -> bool:
        """Wait for the interrupt, four frames at most."""
        if not int(self.dut.interrupt.value):
            late = ClockCycles(self.dut.clk, 4 * COLUMNS * ROWS)
            await First(RisingEdge(self.dut.interrupt), late)
        return bool(int(self.dut.interrupt.value))

    def close(self) -> None:
        """The simulated bus stays."""

    @resume
    async def read(self, address: int) -> int:
        return await self.master.read(address)

    @resume
    async def write(self, address: int, value: int) -> None:
        await self.master.write(address, value)


async def session(code: str) -> dict[str, Any]:
    """Run the page's code, which waits for the bus; result: its variables."""
    names: dict[str, Any] = {}

    def run() -> None:
        exec(code, names)

    await bridge(run)()
    return names


@cocotb.test()
async def on_linux(dut: Any) -> None:
    """The first session, with the simulated bus in place of the UIO device."""
    Clock(dut.clk, 10, "ns").start()
    words = Words(dut)
    camera = Camera(dut)
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    dut.reset.value = 0
    await RisingEdge(dut.clk)
    cocotb.start_soon(camera.run())
    with (
        mock.patch("plenofir.driver.find_uio", return_value="/dev/uio0"),
        mock.patch("plenofir.driver.Uio", return_value=words),
    ):
        names = await session(LINUX)
    slices = camera.check()
    assert names["shown"] == set(range(len(CORE.shifts)))
    # First a = -3/5, then that of the distance, then a sweep with two frames each; at last 0.
    assert slices[0] == CORE.shifts.index(-3)
    assert CORE.shifts.index(2) in slices
    assert slices[-1] == 0

    def state() -> tuple[set[str], Any]:
        return names["core"].errors(), names["core"].counters()

    errors, counters = await bridge(state)()
    assert errors == set()
    assert counters.lines_in == counters.lines_out == ROWS * len(slices)


@cocotb.test()
async def by_the_example(dut: Any) -> None:
    """The example for Linux sweeps: each frame's slice is printed and comes out."""
    Clock(dut.clk, 10, "ns").start()
    camera = Camera(dut)
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    dut.reset.value = 0
    await RisingEdge(dut.clk)
    cocotb.start_soon(camera.run())
    main, said = runpy.run_path(str(EXAMPLE))["main"], io.StringIO()
    sizes = [str(COLUMNS), str(ROWS)]

    def run() -> int:
        with contextlib.redirect_stdout(said):
            return main([*sizes, "--address", hex(BASE), "--sweep", "1", "--frames", "4"])

    with mock.patch("plenofir.driver.Memory", return_value=Words(dut)) as opened:
        assert await bridge(run)() == 0
    # The last frame whose beginning was seen.
    await ClockCycles(dut.clk, 2 * COLUMNS * ROWS)
    opened.assert_called_once_with(BASE)
    printed = re.findall(r"^slice (\d+)$", said.getvalue(), re.M)
    assert [int(number) for number in printed] == camera.check()[:4]
    assert said.getvalue().endswith("no faults\n")


@cocotb.test()
async def on_pynq(dut: Any) -> None:
    """The second session, with cocotbpynq instead of PYNQ, which drives clock and reset."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "plenofir.hwh").write_text(handoff(dut))
        # Until it resets the design.
        dut.reset.value = 1
        camera = Camera(dut)
        cocotb.start_soon(camera.run())
        with (
            mock.patch.object(cocotb, "top", dut),
            mock.patch.dict(sys.modules, {"pynq": cocotbpynq}),
            mock.patch.dict(os.environ, {"HWH_LOCATION_DIR": folder}),
        ):
            names = await session(PYNQ)
    await ClockCycles(dut.clk, 3 * COLUMNS * ROWS)
    assert names["core"].description.shifts == CORE.shifts
    assert set(camera.check()) == {1}


def handoff(dut: Any) -> str:
    """Vivado's hardware handoff of a core at a Zynq, as far as cocotbpynq reads it."""
    names: Callable[[str], list[str]] = lambda prefix: [  # noqa: E731
        f'<PORTMAP LOGICAL="{n.upper()}" PHYSICAL="{prefix}{n}"/>'
        for n in (
            *("awaddr", "awvalid", "awready", "wdata", "wstrb", "wvalid", "wready"),
            *("bresp", "bvalid", "bready"),
            *("araddr", "arvalid", "arready", "rdata", "rresp", "rvalid", "rready"),
        )
    ]
    core = 'INSTANCE="plenofir_0" FULLNAME="/plenofir_0" VLNV="plenofir:ip:refocuser_axi:1.0"'
    return f"""<EDKSYSTEM><MODULES>
<MODULE MODTYPE="{dut._name}" {core}>
<PORTS><PORT NAME="clk" SIGIS="clk"/><PORT NAME="reset" SIGIS="rst" POLARITY="ACTIVE_HIGH"/></PORTS>
<BUSINTERFACES><BUSINTERFACE NAME="s_axi_ctrl" BUSNAME="axi"><PORTMAPS>
{"".join(names("s_axi_ctrl_"))}
</PORTMAPS></BUSINTERFACE></BUSINTERFACES></MODULE>
<MODULE MODTYPE="processing_system7" INSTANCE="ps" FULLNAME="/ps" VLNV="xilinx.com:ip:ps7:5.5">
<MEMORYMAP><MEMRANGE INSTANCE="plenofir_0" SLAVEBUSINTERFACE="s_axi_ctrl"
BASEVALUE="{BASE:#x}" HIGHVALUE="{BASE + 0x1000:#x}"/></MEMORYMAP></MODULE>
</MODULES></EDKSYSTEM>"""
