# SPDX-License-Identifier: Apache-2.0
"""What the scripts for Vivado, ``package_ip.tcl`` and ``block_design.tcl``, know of a scene."""

import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

from plenofir.fpga.hdmi.modes import VideoMode, find_mode
from plenofir.plan.ip.components import REGISTERS_BYTES, Component, registers
from plenofir.plan.ip.ipxact import BUS_VENDOR, BUSES
from plenofir.plan.plan import Plan

SCENE = "scene.tcl"
_RAW_BITS = (8, 10, 12, 14)
"""Bits of a pixel that the CSI-2 receiver and the script know; 14 not behind its demosaic."""


def scripts(
    plan: Plan, components: Sequence[Component], files: Mapping[str, Sequence[str]], version: str
) -> dict[str, str]:
    """Tcl for a scene's components by file names; `files` are the VHDL of each, in order."""
    device = plan.chip
    if device.family not in ("series7", "usplus"):
        return {}
    names = ["package_ip.tcl"]
    # A block design shows one slice at a time, beside the processing system of a Zynq.
    if device.name.startswith("xc7z") and not plan.screen.needs_stack:
        names.append("block_design.tcl")
    facts = {
        # Vivado's versions have two numbers, and a revision.
        "version": ".".join(version.split(".")[:2]),
        "part": device.part,
        "components": {c.name: _component(c, files[c.name]) for c in components},
        "registers_bytes": REGISTERS_BYTES,
        "registers": {r.name: (r.address, r.description) for r in registers()},
        **(_block_design(plan, components) if "block_design.tcl" in names else {}),
    }
    lines = [f"# The scene {plan.scene} for the scripts beside this file.", ""]
    lines += [f"set {name} {tcl(value)}" for name, value in facts.items()]
    texts = {name: Path(__file__).with_name(name).read_text(encoding="utf-8") for name in names}
    return {SCENE: "\n".join([*lines, ""]), **texts}


def tcl(value: object) -> str:
    """A value as a word of Tcl: a text or number, a list, or a mapping as a list of pairs."""
    if isinstance(value, Mapping):
        pairs = "".join(f"{tcl(key)} {tcl(part)}\n" for key, part in value.items())
        return f"{{\n{textwrap.indent(pairs, '  ')}}}"
    if isinstance(value, (list, tuple)):
        return f"{{{' '.join(tcl(part) for part in value)}}}"
    text = f"{value:g}" if isinstance(value, float) else str(value)
    if re.fullmatch(r"[\w./:+-]+", text):
        return text
    escaped = "".join(f"\\{c}" if c in '\\"$[]{}' else c for c in text)
    return f'"{escaped}"'


def _component(component: Component, files: Sequence[str]) -> dict[str, object]:
    interfaces = {}
    for interface in component.interfaces:
        library, name = BUSES[interface.bus]
        bus = f"{BUS_VENDOR}:{library}:{name}"
        ports = [word for logical, port in interface.ports.items() for word in (logical, port.name)]
        parameters = [word for pair in interface.parameters.items() for word in pair]
        interfaces[interface.name] = (interface.mode, bus, ports, parameters)
    return {
        "entity": component.entity,
        "title": component.title,
        "files": list(files),
        "interfaces": interfaces,
    }


def _block_design(plan: Plan, components: Sequence[Component]) -> dict[str, object]:
    """Clock in MHz, cores with registers in the order of the stream, its ends, camera, monitor."""
    by_name = {component.name: component for component in components}
    chain = [name for name in ("sensor_axi", "refocuser_axi") if name in by_name]
    widths = {
        f"bits_{side}": by_name[name].interface(stream).ports["TDATA"].bits
        for side, name, stream in (("in", chain[0], "s_axis"), ("out", chain[-1], "m_axis"))
    }
    return {
        "clock_mhz": plan.built_mhz,
        "chain": chain,
        **widths,
        # A VDMA's side to the memory is 32, 64, 128 ... bits wide, and no narrower than its stream.
        **{
            name.replace("bits", "memory_bits"): max(64, 1 << (bits - 1).bit_length())
            for name, bits in widths.items()
        },
        "camera": _camera(plan),
        "monitor": _monitor(plan),
    }


def _camera(plan: Plan) -> dict[str, object] | str:
    """What a CSI-2 receiver has to deliver; empty if none delivers the pixels of the scene."""
    core, sensor = plan.core, plan.sensor
    mosaic = sensor is not None and sensor.mosaic is not None
    demosaic = core.channels == 3 and not mosaic
    if core.pixels_per_clock > 1 or core.pixel_bits not in _RAW_BITS[: 3 if demosaic else 4]:
        return ""
    if demosaic and sensor is not None:
        return ""
    return {
        "raw_bits": core.pixel_bits,
        "demosaic": int(demosaic),
        "columns": plan.columns,
        "rows": plan.rows,
    }


def _monitor(plan: Plan) -> dict[str, object] | str:
    """Video mode of a monitor that shows a scene's frames as they are; empty if there is none."""
    # A still picture is shown at the rate that every monitor takes.
    rate = 60.0 if plan.clock_mhz is None else 1e6 * plan.clock_mhz / plan.frame_clocks
    mode = find_mode(plan.columns, plan.rows, rate)
    if mode is None or plan.core.pixel_bits != 8:
        return ""
    return {
        "grey": int(plan.core.channels == 1),
        "pixel_mhz": mode.pixel_clock / 1000,
        "timing": _timing(mode),
    }


def _timing(mode: VideoMode) -> dict[str, object]:
    """Timing of a mode for the timing controller, which counts lines from the last active one."""
    polarity = {True: "High", False: "Low"}
    last = mode.v_active + mode.v_front - 1
    places = ("F0_VBLANK_HSTART", "F0_VBLANK_HEND", "F0_VSYNC_HSTART", "F0_VSYNC_HEND")
    values: dict[str, object] = {
        "HACTIVE_SIZE": mode.h_active,
        "HSYNC_START": mode.h_active + mode.h_front,
        "HSYNC_END": mode.h_active + mode.h_front + mode.h_sync,
        "HFRAME_SIZE": mode.h_total,
        "VACTIVE_SIZE": mode.v_active,
        "F0_VSYNC_VSTART": last,
        "F0_VSYNC_VEND": last + mode.v_sync,
        "F0_VFRAME_SIZE": mode.v_total,
        **dict.fromkeys(places, mode.h_active),
        "HSYNC_POLARITY": polarity[mode.h_positive],
        "VSYNC_POLARITY": polarity[mode.v_positive],
    }
    return {f"GEN_{name}": value for name, value in values.items()}
