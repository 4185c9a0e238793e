# SPDX-License-Identifier: Apache-2.0
"""A scene's components: ports, interfaces, registers, and the VHDL around a core."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import Generics
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.tools.simulators import generic_text
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.plan.plan import Plan
from plenofir.plan.scene_top import TOP, has_choice, sensor_generics
from plenofir.refocus.arithmetic import ExactArithmetic

Bus = Literal["axis", "aximm", "clock", "reset", "interrupt"]
VENDOR, LIBRARY = "plenofir", "ip"
REGISTERS = "registers"
# AXI gives each slave at least 4 KB of addresses; the map takes less.
REGISTERS_BYTES = 4096
_INDEX_BITS = 8


@dataclass(frozen=True)
class Port:
    """A port of a component."""

    name: str
    mode: Literal["in", "out"]
    bits: int = 0  # of a vector; 0: a single std_logic
    core_bits: int | None = None  # bits of the core's port, if narrower; zeros above

    @property
    def type_name(self) -> str:
        return f"std_logic_vector({self.bits - 1} downto 0)" if self.bits else "std_logic"


@dataclass(frozen=True)
class Interface:
    """Ports that a tool connects together."""

    name: str
    bus: Bus
    mode: Literal["master", "slave"]
    ports: dict[str, Port]  # by their names in the definition of the bus
    parameters: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Component:
    """A component: a core with the generics of a scene."""

    name: str
    title: str
    core: str  # entity in it
    generics: Generics
    interfaces: tuple[Interface, ...]
    others: tuple[Port, ...] = ()  # ports of no interface

    @property
    def entity(self) -> str:
        """Name of the VHDL entity around the core."""
        return f"{self.name}_ip"

    @property
    def ports(self) -> list[Port]:
        return [port for i in self.interfaces for port in i.ports.values()] + [*self.others]

    def interface(self, name: str) -> Interface:
        return next(interface for interface in self.interfaces if interface.name == name)


@dataclass(frozen=True)
class Field:
    """A field of a register."""

    name: str
    description: str
    first_bit: int
    bits: int


@dataclass(frozen=True)
class Register:
    """A register of 32 bits."""

    name: str
    description: str
    address: int
    mode: str  # as in the map
    fields: tuple[Field, ...]


def registers() -> Iterator[Register]:
    """All registers of the map, ``hdl/axi/registers.toml``, in the order of their addresses."""
    content: dict[str, dict[str, Any]] = tomllib.loads(
        (project.root() / "hdl" / "axi" / "registers.toml").read_text(encoding="utf-8")
    )
    # Constants of the map are values in the VHDL, without an address.
    found = {name: r for name, r in content.items() if r.get("type") != "constant"}
    for number, (name, register) in enumerate(found.items()):
        fields, first = [], 0
        for part, about in register.items():
            if isinstance(about, dict):
                bits = int(about.get("width", 1))
                fields.append(Field(part, _plain(about["description"]), first, bits))
                first += bits
        about = _plain(register["description"])
        yield Register(name, about, 4 * number, register["mode"], tuple(fields))


def _plain(text: str) -> str:
    return text.replace("``", "")


def _stream(name: str, data: Port, identity: bool = False) -> Interface:
    """An AXI4-Stream of video."""
    mode: Literal["master", "slave"] = "slave" if data.mode == "in" else "master"
    back: Literal["in", "out"] = "out" if data.mode == "in" else "in"
    ports = {
        "TVALID": Port(f"{name}_tvalid", data.mode),
        "TREADY": Port(f"{name}_tready", back),
        "TDATA": data,
        "TUSER": Port(f"{name}_tuser", data.mode, 1),
        "TLAST": Port(f"{name}_tlast", data.mode),
    }
    if identity:
        ports["TID"] = Port(f"{name}_tid", data.mode, 8)
    return Interface(name, "axis", mode, ports)


def _bus() -> Interface:
    """AXI4-Lite of the registers."""
    channels: tuple[tuple[str, Literal["in", "out"], tuple[tuple[str, int], ...]], ...] = (
        ("AW", "in", (("ADDR", 12), ("PROT", 3))),
        ("W", "in", (("DATA", 32), ("STRB", 4))),
        ("B", "out", (("RESP", 2),)),
        ("AR", "in", (("ADDR", 12), ("PROT", 3))),
        ("R", "out", (("DATA", 32), ("RESP", 2))),
    )
    ports: dict[str, Port] = {}
    for channel, mode, signals in channels:
        back: Literal["in", "out"] = "out" if mode == "in" else "in"
        for name, bits in signals:
            ports[f"{channel}{name}"] = Port(f"s_axi_ctrl_{channel}{name}".lower(), mode, bits)
        ports[f"{channel}VALID"] = Port(f"s_axi_ctrl_{channel}VALID".lower(), mode)
        ports[f"{channel}READY"] = Port(f"s_axi_ctrl_{channel}READY".lower(), back)
    return Interface("s_axi_ctrl", "aximm", "slave", ports, {"PROTOCOL": "AXI4LITE"})


def _clocked(*interfaces: Interface) -> tuple[Interface, ...]:
    """Interfaces with their clock and reset in front."""
    names = ":".join(i.name for i in interfaces if i.bus in ("axis", "aximm"))
    clock = {"ASSOCIATED_BUSIF": names, "ASSOCIATED_RESET": "reset"}
    return (
        Interface("clk", "clock", "slave", {"CLK": Port("clk", "in")}, clock),
        Interface(
            *("reset", "reset", "slave", {"RST": Port("reset", "in")}),
            {"POLARITY": "ACTIVE_HIGH"},
        ),
        *interfaces,
    )


def _interrupt() -> Interface:
    ports = {"INTERRUPT": Port("interrupt", "out")}
    return Interface("interrupt", "interrupt", "master", ports, {"SENSITIVITY": "LEVEL_HIGH"})


def _data(name: str, mode: Literal["in", "out"], bits: int) -> Port:
    """Data of a stream, in whole bytes."""
    return Port(name, mode, -(-bits // 8) * 8, bits)


def _behind_registers(
    name: str, title: str, generics: Generics, raw: int, new: int, *, identity: bool = False
) -> Component:
    return Component(
        name,
        title,
        name,
        generics,
        _clocked(
            _bus(),
            _stream("s_axis", Port("s_axis_tdata", "in", -(-raw // 8) * 8)),
            _stream("m_axis", Port("m_axis_tdata", "out", -(-new // 8) * 8), identity),
            _interrupt(),
        ),
    )


def components(plan: Plan) -> list[Component]:
    """The components of a scene: its core alone, and the cores with registers that it has."""
    core, sensor = plan.core, plan.sensor
    pixel = core.channels * core.pixel_bits
    data = core.pixels_per_clock * pixel
    several, all_slices = has_choice(plan), plan.screen.needs_stack
    out = core.pixels_per_clock * plan.screen.stack_pixel_bits(core) if all_slices else data
    raw = data if sensor is None or sensor.mosaic is None else core.pixel_bits
    others: list[Port] = []
    # A core of one slice has no ports that choose one.
    if several:
        others += [Port("slice", "in", 8), Port("sweep", "in"), Port("sweep_frames", "in", 8)]
    if sensor is not None:
        if not sensor.calibrated:
            others += [Port("columns", "in", 16), Port("rows", "in", 16), Port("load_write", "in")]
            others += [Port("load_kind", "in", 2), Port("load_address", "in", 20)]
            others += [Port("load_data", "in", 40)]
        others.append(Port("sensor_flags", "out", 6))
    others += [Port("error_flags", "out", 5), Port("error_clear", "in")]
    inside = " and ".join(["sensor_raster"] * (sensor is not None) + [core.engine.ENTITY])
    found = [
        Component(
            name="refocuser",
            title=f"Refocuser of the scene {plan.scene}: {inside}",
            core=TOP,
            generics={},
            interfaces=_clocked(
                _stream("s_axis", _data("s_axis_tdata", "in", raw)),
                _stream("m_axis", _data("m_axis_tdata", "out", out), several),
            ),
            others=tuple(others),
        )
    ]
    if not all_slices:
        title = f"Refocuser of the scene {plan.scene}, with registers"
        found.append(
            _behind_registers("refocuser_axi", title, core.generics(), data, data, identity=True)
        )
    if sensor is not None:
        title = f"Sensor of the scene {plan.scene}, with registers"
        found.append(_behind_registers("sensor_axi", title, sensor_generics(sensor), raw, pixel))
    title = f"Slices and depth of the scene {plan.scene}, with registers"
    if all_slices:
        if (stack := _scene_stack_generics(plan)) is not None:
            found.append(_behind_registers("stack_axi", title, stack, data, out))
    elif (stack := _stack_generics(core)) is not None:
        found.append(_behind_registers("stack_axi", title, stack, pixel, pixel + _INDEX_BITS))
    return found


def _scene_stack_generics(plan: Plan) -> Generics | None:
    """Generics of a scene's own stack behind registers; None for what these do not have."""
    generics = plan.core.generics()
    if not plan.screen.needs_index:
        return generics
    index = plan.screen.index(plan.core)
    # Behind registers an index always has the picture, and never depth between slices.
    if not index.picture or index.shifts:
        return None
    judged, names = index.generics(), ("RADIUS", "CONFIDENCE", "VOTE_RADIUS", "SHARP_TOO")
    judging = {name: judged[name] for name in names if name in judged}
    return {**generics, "DEPTH_INDEX": True, **judging}


def _stack_generics(core: CoreConfiguration) -> Generics | None:
    """Generics of a focal stack of the same slices and a depth index; None if there is none."""
    nearest = isinstance(core.arithmetic, ExactArithmetic) and core.order == 0
    # What `stack_axi` has not: several pixels a clock, sharpening, rounded products, interpolation.
    if len(core.shifts) == 1 or core.pixels_per_clock > 1 or core.sharpens or not nearest:
        return None
    stack = core.model_copy(update={"engine": StackEngine()})
    index = DepthIndexConfiguration(
        micro_image_size=core.micro_image_size,
        slices=len(core.shifts),
        max_columns=core.max_columns,
        channels=core.channels,
        pixel_bits=core.pixel_bits,
    )
    try:
        stack.check_limits()
        index.check_limits()
    except InputError:
        return None
    return {**stack.generics(), "DEPTH_INDEX": True}


def _value(value: int | bool | str) -> str:
    return f'"{value}"' if isinstance(value, str) else generic_text(value)


def entity_text(component: Component) -> str:
    """VHDL-93 of the entity around a core."""
    ports = component.ports
    width = max(len(port.name) for port in ports)
    declared = [f"    {port.name:{width}} : {port.mode:<5} {port.type_name}" for port in ports]
    generics = [f"      {name} => {_value(value)}" for name, value in component.generics.items()]
    # Catalogs connect streams of whole bytes; the core takes its own bits of them.
    narrower = [p for p in ports if p.core_bits is not None and p.core_bits < p.bits]
    linked = []
    for port in ports:
        part = f"({port.core_bits - 1} downto 0)" if port in narrower and port.core_bits else ""
        linked.append(f"      {port.name:{width}} => {port.name}{part}")
    zeros = [
        f"  {port.name}({port.bits - 1} downto {port.core_bits}) <= (others => '0');"
        for port in narrower
        if port.mode == "out"
    ]
    return "\n".join(
        [
            f"-- {component.title}; written by plenofir project.",
            f"-- The entity {component.core} with ports of fixed widths, for catalogs.",
            "",
            "library ieee;",
            "use ieee.std_logic_1164.all;",
            "",
            f"entity {component.entity} is",
            "  port (",
            ";\n".join(declared),
            "  );",
            f"end entity {component.entity};",
            "",
            f"architecture rtl of {component.entity} is",
            "",
            "begin",
            "",
            f"  core : entity work.{component.core}",
            *(["    generic map (", ",\n".join(generics), "    )"] if generics else []),
            "    port map (",
            ",\n".join(linked),
            "    );",
            "",
            *([*zeros, ""] if zeros else []),
            "end architecture rtl;",
            "",
        ]
    )
