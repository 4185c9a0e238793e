# SPDX-License-Identifier: Apache-2.0
"""A component as IEEE 1685-2014 (IP-XACT) has it."""

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from plenofir.plan.ip.components import (
    LIBRARY,
    REGISTERS,
    REGISTERS_BYTES,
    VENDOR,
    Bus,
    Component,
    Interface,
    Port,
    Register,
    registers,
)

NAMESPACE = "http://www.accellera.org/XMLSchema/IPXACT/1685-2014"
# Bus definitions of Vivado's catalog; other tools map the same names of signals to definitions of
# their own.
BUSES: dict[Bus, tuple[str, str]] = {
    "axis": ("interface", "axis"),
    "aximm": ("interface", "aximm"),
    "clock": ("signal", "clock"),
    "reset": ("signal", "reset"),
    "interrupt": ("signal", "interrupt"),
}
"""Library and name of each bus."""
BUS_VENDOR, BUS_VERSION = "xilinx.com", "1.0"
_ACCESS = {"r": "read-only", "r_w": "read-write", "wpulse": "write-only", "r_wpulse": "read-write"}
_CLEARED = ("errors", "interrupt_status")
"""Registers whose bits a written 1 clears."""


def _add(parent: Element, tag: str, text: object = None, **attributes: str) -> Element:
    child = ElementTree.SubElement(parent, f"{{{NAMESPACE}}}{tag}", attributes)
    if text is not None:
        child.text = str(text).lower() if isinstance(text, bool) else str(text)
    return child


def _named(parent: Element, tag: str, text: str, description: str = "") -> Element:
    child = _add(parent, tag)
    _add(child, "name", text)
    if description:
        _add(child, "description", description)
    return child


def _interface(parent: Element, interface: Interface) -> None:
    element = _named(parent, "busInterface", interface.name)
    library, name = BUSES[interface.bus]
    reference = {"vendor": BUS_VENDOR, "library": library, "version": BUS_VERSION}
    _add(element, "busType", name=name, **reference)
    abstraction = _add(_add(element, "abstractionTypes"), "abstractionType")
    _add(abstraction, "abstractionRef", name=f"{name}_rtl", **reference)
    maps = _add(abstraction, "portMaps")
    for logical, port in interface.ports.items():
        link = _add(maps, "portMap")
        _named(link, "logicalPort", logical)
        _named(link, "physicalPort", port.name)
    mode = _add(element, interface.mode)
    if interface.bus == "aximm":
        _add(mode, "memoryMapRef", memoryMapRef=interface.name)
    if interface.parameters:
        several = _add(element, "parameters")
        for key, value in interface.parameters.items():
            number = f"{interface.name}.{key}"
            parameter = _add(several, "parameter", parameterId=number, type="string")
            _add(parameter, "name", key)
            _add(parameter, "value", value)


def _register(parent: Element, register: Register) -> None:
    element = _named(parent, "register", register.name, register.description)
    _add(element, "addressOffset", f"'h{register.address:x}")
    _add(element, "size", 32)
    # Registers that software alone changes are read back as they were written.
    _add(element, "volatile", register.mode != "r_w")
    _add(element, "access", _ACCESS[register.mode])
    for part in register.fields:
        field = _named(element, "field", part.name, part.description)
        _add(field, "bitOffset", part.first_bit)
        _add(field, "bitWidth", part.bits)
        _add(field, "access", _ACCESS[register.mode])
        if register.name in _CLEARED:
            _add(field, "modifiedWriteValue", "oneToClear")


def _port(parent: Element, port: Port) -> None:
    wire = _add(_named(parent, "port", port.name), "wire")
    _add(wire, "direction", port.mode)
    if port.bits:
        vector = _add(_add(wire, "vectors"), "vector")
        _add(vector, "left", port.bits - 1)
        _add(vector, "right", 0)
    definition = _add(_add(wire, "wireTypeDefs"), "wireTypeDef")
    _add(definition, "typeName", "std_logic_vector" if port.bits else "std_logic")
    _add(definition, "typeDefinition", "ieee.std_logic_1164.all")
    _add(definition, "viewRef", "rtl")


def component_xml(component: Component, version: str, files: Sequence[str]) -> str:
    """The XML of a component; `files` are its VHDL in order of analysis."""
    ElementTree.register_namespace("ipxact", NAMESPACE)
    root = Element(f"{{{NAMESPACE}}}component")
    for name, text in zip(
        ("vendor", "library", "name", "version"),
        (VENDOR, LIBRARY, component.name, version),
        strict=True,
    ):
        _add(root, name, text)
    interfaces = _add(root, "busInterfaces")
    for interface in component.interfaces:
        _interface(interfaces, interface)
    for interface in component.interfaces:
        if interface.bus == "aximm":
            space = _named(_add(root, "memoryMaps"), "memoryMap", interface.name)
            block = _named(space, "addressBlock", REGISTERS)
            _add(block, "baseAddress", 0)
            _add(block, "range", REGISTERS_BYTES)
            _add(block, "width", 32)
            _add(block, "usage", "register")
            for register in registers():
                _register(block, register)
            _add(space, "addressUnitBits", 8)
    model = _add(root, "model")
    view = _named(_add(model, "views"), "view", "rtl")
    _add(view, "envIdentifier", ":*Synthesis:")
    _add(view, "envIdentifier", ":*Simulation:")
    _add(view, "componentInstantiationRef", "vhdl")
    inside = _named(_add(model, "instantiations"), "componentInstantiation", "vhdl")
    _add(inside, "language", "vhdl")
    _add(inside, "libraryName", "work")
    _add(inside, "moduleName", component.entity)
    _add(inside, "architectureName", "rtl")
    _add(_add(inside, "fileSetRef"), "localName", "vhdl")
    ports = _add(model, "ports")
    for port in component.ports:
        _port(ports, port)
    sources = _named(_add(root, "fileSets"), "fileSet", "vhdl")
    for file in files:
        source = _add(sources, "file")
        _add(source, "name", file)
        _add(source, "fileType", "vhdlSource-93")
        _add(source, "logicalName", "work")
    _add(root, "description", component.title)
    if component.generics:
        parameters = _add(root, "parameters")
        for name, value in component.generics.items():
            # The standard has the types of SystemVerilog.
            kind = {bool: "bit", int: "longint"}.get(type(value), "string")
            parameter = _add(parameters, "parameter", parameterId=name, type=kind)
            _add(parameter, "name", name)
            _add(parameter, "description", f"Generic of {component.core}, fixed by the scene.")
            _add(parameter, "value", int(value) if isinstance(value, bool) else value)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'
