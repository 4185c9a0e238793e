# SPDX-License-Identifier: Apache-2.0
"""The folder of a scene's components: VHDL, IP-XACT, and for Xilinx parts Vivado's Tcl."""

import shutil
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

from plenofir.fpga import hdl
from plenofir.ground.files import publish_files
from plenofir.plan.configure import configure, needed_sources, refuse_board
from plenofir.plan.ip.components import Component, components, entity_text
from plenofir.plan.ip.ipxact import component_xml
from plenofir.plan.ip.vivado import scripts
from plenofir.plan.plan import Plan
from plenofir.plan.scene_top import TOP


def write_components(plan: Plan, out: Path) -> list[str]:
    """Write the components of a scene, all or nothing; returns the files' names, VHDL left out."""
    refuse_board(plan)
    parts = components(plan)
    release = version("plenofir")
    with TemporaryDirectory(prefix="plenofir-") as work, TemporaryDirectory() as configured:
        folder = Path(work)
        files: dict[str, list[str]] = {}
        for component in parts:
            text = entity_text(component)
            # The scene's top is written for it; the other cores are the library's.
            if component.core == TOP:
                sources = configure(plan, Path(configured))
            else:
                sources = needed_sources(text, component.entity, hdl.all_sources())
            for source in sources:
                shutil.copy(source, folder / source.name)
            (folder / f"{component.entity}.vhd").write_text(text, encoding="utf-8")
            names = [*(source.name for source in sources), f"{component.entity}.vhd"]
            files[component.name] = names
            xml = component_xml(component, release, names)
            (folder / f"{component.name}.xml").write_text(xml, encoding="utf-8")
        of_vivado = scripts(plan, parts, files, release)
        for name, text in {**of_vivado, "README": _readme(plan, parts, of_vivado)}.items():
            (folder / name).write_text(text, encoding="utf-8")
        publish_files(folder, out)
        return sorted(path.name for path in folder.iterdir() if path.suffix != ".vhd")


def _readme(plan: Plan, parts: Sequence[Component], of_vivado: Mapping[str, str]) -> str:
    listed = "".join(f"  {c.name}.xml: {c.title} (entity {c.entity})\n" for c in parts)
    text = (
        f"The cores of {plan.scene} as components, IP-XACT of IEEE 1685-2014.\n\n{listed}\n"
        f"Planned for {plan.built_mhz:g} MHz on {plan.part}.\n\n"
        "Ports have fixed widths, those of the scene; the generics of the core inside are listed\n"
        "as parameters. Another size or another set of slices is another scene. Bus definitions\n"
        "are those of Vivado's catalog: axis, aximm (AXI4-Lite), clock, reset (active high),\n"
        "interrupt.\n\n"
        "Checked: the XML by the schema of the standard, the ports by elaboration in GHDL.\n"
    )
    if not of_vivado:
        return f"{text}Vivado's scripts come with a device of the 7 series or UltraScale+.\n"
    text += (
        "\nVivado reads IP-XACT of 2009 with additions of its own, so it packages by itself:\n"
        "  vivado -mode batch -source package_ip.tcl\n"
    )
    if "block_design.tcl" not in of_vivado:
        return (
            f"{text}Block designs come with a Zynq, such as --device xc7z020, and one slice at a "
            "time.\n"
        )
    return (
        f"{text}and then makes a block design, an example to start from; its first lines say what\n"
        "it has and needs, -tclargs camera gives it a camera:\n"
        "  vivado -source block_design.tcl\n"
        "None of the scripts was ever run in Vivado.\n"
    )
