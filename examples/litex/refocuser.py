# SPDX-License-Identifier: Apache-2.0
"""A LiteX module around the core of a scene: streams in and out, registers to choose the slice.

It needs LiteX and the folder that ``plenofir configure SCENE --verilog --out FOLDER`` writes, and
nothing else of plenofir: copy it into a project.
"""

import json
from pathlib import Path
from typing import Any

from litex.gen import LiteXModule
from litex.soc.interconnect.axi import AXIStreamInterface
from litex.soc.interconnect.csr import CSRConstant, CSRField, CSRStatus, CSRStorage
from migen import ClockSignal, If, Instance, ResetSignal, Signal

TOP = "scene_top"
ERROR_FLAGS = 5


class Refocuser(LiteXModule):
    """The core of a scene in LiteX, in the clock domain ``sys``.

    Streams are AXI4-Stream video: ``user`` is the start of a frame, ``last`` the end of a line,
    channel 0 (red or grey) lies in the low bits of ``data``.

    Parameters
    ----------
    platform
        LiteX platform; gets the Verilog as a source.
    folder
        What ``plenofir configure --verilog`` wrote.

    Attributes
    ----------
    sink
        Raw frames, micro images of M x M pixels.
    source
        Refocused frames; ``id`` is the slice.
    control
        Register: slice, sweep, frames of each slice of a sweep, and a bit that clears the errors.
    status
        Register: the core's error flags, and the slice of the frame that comes out.
    frames
        Register: frames that came out, modulo 2**32.
    """

    def __init__(self, platform: Any, folder: str | Path) -> None:
        plan = json.loads((Path(folder) / "plan.json").read_text())
        if plan["path"] != "core":
            raise ValueError(f'{folder}: a scene with path = "{plan["path"]}"; expected "core"')
        core = plan["core"]
        bits = core["channels"] * core["pixel_bits"]
        slices = len(core["shifts"])
        self.sink = sink = AXIStreamInterface(data_width=bits, keep_width=0, user_width=1)
        self.source = source = AXIStreamInterface(
            data_width=bits, keep_width=0, user_width=1, id_width=8
        )
        self.control = control = CSRStorage(
            fields=[
                CSRField("slice", size=8, offset=0, description="Slice, from the next frame on."),
                CSRField("sweep", size=1, offset=8, description="Step through the slices."),
                CSRField("sweep_frames", size=8, offset=16, description="Frames of each slice."),
                CSRField("error_clear", size=1, offset=24, pulse=True),
            ]
        )
        self.status = status = CSRStatus(
            fields=[
                CSRField("errors", size=ERROR_FLAGS, offset=0, description="Broken frames."),
                CSRField("slice", size=8, offset=8, description="Slice that comes out."),
            ]
        )
        self.frames = frames = CSRStatus(32, description="Frames that came out.")
        for name in ("columns", "rows"):
            setattr(self, name, CSRConstant(plan[name], name=name))
        self.slices = CSRConstant(slices, name="slices")

        # # #

        errors = Signal(ERROR_FLAGS)
        choice: dict[str, Any] = {}
        if slices > 1:
            choice = {
                "i_slice": control.fields.slice,
                "i_sweep": control.fields.sweep,
                "i_sweep_frames": control.fields.sweep_frames,
                "o_m_axis_tid": source.id,
            }
        self.specials += Instance(
            TOP,
            name="core",
            i_clk=ClockSignal("sys"),
            i_reset=ResetSignal("sys"),
            i_s_axis_tvalid=sink.valid,
            o_s_axis_tready=sink.ready,
            i_s_axis_tdata=sink.data,
            i_s_axis_tuser=sink.user,
            i_s_axis_tlast=sink.last,
            o_m_axis_tvalid=source.valid,
            i_m_axis_tready=source.ready,
            o_m_axis_tdata=source.data,
            o_m_axis_tuser=source.user,
            o_m_axis_tlast=source.last,
            o_error_flags=errors,
            i_error_clear=control.fields.error_clear,
            **choice,
        )
        self.comb += status.fields.errors.eq(errors)
        self.sync += If(
            source.valid & source.ready & source.user,
            status.fields.slice.eq(source.id),
            frames.status.eq(frames.status + 1),
        )
        platform.add_source(str(Path(folder).resolve() / f"{TOP}.v"))
