# SPDX-License-Identifier: Apache-2.0
"""Tcl for Vivado: block designs with a scene's cores, for a Zynq-7000.

In `memory_design` a VDMA is before and after the cores; in `camera_design` a CSI-2 receiver is
before them, and a monitor shows the frames that the VDMA after them stores. One clock of the
processing system drives everything except D-PHY and monitor.
"""

from dataclasses import dataclass, field

from plenofir.fpga.hdmi.modes import VideoMode, find_mode
from plenofir.plan.configure import clock_mhz
from plenofir.plan.ip.components import Component
from plenofir.plan.ip.vivado import CATALOG, NEVER_RUN
from plenofir.plan.planned import Plan

_HEAD = """
set here [file dirname [file normalize [info script]]]

# A core of the catalog, its newest version.
proc core {vlnv name} {
  set found [get_ipdefs $vlnv:*]
  if {$found eq ""} {
    error "Vivado's catalog has no $vlnv: see the first lines of this script"
  }
  return [create_bd_cell -type ip -vlnv [lindex $found end] $name]
}

proc stream {from to} {
  connect_bd_intf_net [get_bd_intf_pins $from] [get_bd_intf_pins $to]
}

proc net {from args} {
  foreach to $args {
    connect_bd_net [get_bd_pins $from] [get_bd_pins $to]
  }
}
"""
_DIGILENT = "digilentinc.com:ip:rgb2dvi"
_RAW_BITS = (8, 10, 12, 14)
"""Bits of a pixel that the CSI-2 receiver and this script know."""


@dataclass
class _Design:
    """A block design under construction."""

    lines: list[str] = field(default_factory=list)
    clocks: list[str] = field(default_factory=list)  # pins of the common clock
    resets: list[str] = field(default_factory=list)  # active high
    resets_n: list[str] = field(default_factory=list)  # active low
    controls: list[str] = field(default_factory=list)  # AXI4-Lite slaves
    interrupts: list[str] = field(default_factory=list)
    asynchronous: list[str] = field(default_factory=list)  # resets from the processing system

    def cell(self, vlnv: str, name: str, **values: object) -> None:
        """Add a cell with its configuration."""
        self.lines.append(f"core {vlnv} {name}")
        if values:
            listed = " ".join(f"CONFIG.{key} {{{value}}}" for key, value in values.items())
            self.lines.append(f"set_property -dict [list {listed}] [get_bd_cells {name}]")

    def stream(self, *ends: str) -> None:
        """Connect interfaces in a chain: each pair is a source and its sink."""
        pairs = zip(ends[::2], ends[1::2], strict=True)
        self.lines += [f"stream {source} {sink}" for source, sink in pairs]

    def own(self, component: Component) -> None:
        """Add one of the scene's cores."""
        self.cell(f"plenofir:ip:{component.name}", component.name)
        self.clocks.append(f"{component.name}/clk")
        self.resets.append(f"{component.name}/reset")
        self.controls.append(f"{component.name}/s_axi_ctrl")
        self.interrupts.append(f"{component.name}/interrupt")

    def vdma(self, bits: int) -> None:
        """Add a VDMA that writes frames to memory and reads them, `bits` a pixel."""
        self.cell(
            *("xilinx.com:ip:axi_vdma", "vdma"),
            c_include_mm2s=1,
            c_include_s2mm=1,
            c_num_fstores=3,
            c_m_axis_mm2s_tdata_width=bits,
            c_mm2s_linebuffer_depth=2048,
            c_s2mm_linebuffer_depth=2048,
        )
        names = ("s_axi_lite", "m_axi_mm2s", "m_axis_mm2s", "m_axi_s2mm", "s_axis_s2mm")
        self.clocks += [f"vdma/{name}_aclk" for name in names]
        self.resets_n.append("vdma/axi_resetn")
        self.controls.append("vdma/S_AXI_LITE")
        self.interrupts += ["vdma/mm2s_introut", "vdma/s2mm_introut"]


def _begin(name: str, part: str, what: str, needs: str) -> list[str]:
    return [
        f"{NEVER_RUN}#\n# {what}\n# vivado -source {name}.tcl, behind package_ip.tcl.",
        f"{needs}{_HEAD}",
        f"create_project -force {name} $here/build/{name} -part {part}",
    ]


def _end(design: _Design, name: str, mhz: float, more_clocks: str = "") -> list[str]:
    """Processing system, control, memory, clock and resets, around the cells of a design."""
    second: dict[str, object] = {"PCW_EN_CLK1_PORT": 1, "PCW_FPGA1_PERIPHERAL_FREQMHZ": 200}
    controls, interrupts = len(design.controls), len(design.interrupts)
    design.cell(
        "xilinx.com:ip:processing_system7",
        "ps",
        PCW_USE_S_AXI_HP0=1,
        PCW_USE_FABRIC_INTERRUPT=1,
        PCW_IRQ_F2P_INTR=1,
        PCW_FPGA0_PERIPHERAL_FREQMHZ=f"{mhz:g}",
        **(second if more_clocks else {}),
    )
    design.lines.append(
        "apply_bd_automation -rule xilinx.com:bd_rule:processing_system7 "
        '-config {make_external "FIXED_IO, DDR"} [get_bd_cells ps]'
    )
    design.cell("xilinx.com:ip:smartconnect", "control", NUM_SI=1, NUM_MI=controls)
    design.cell("xilinx.com:ip:smartconnect", "memory", NUM_SI=2, NUM_MI=1)
    design.cell("xilinx.com:ip:proc_sys_reset", "resets")
    design.cell("xilinx.com:ip:xlconcat", "interrupts", NUM_PORTS=interrupts)
    design.stream("ps/M_AXI_GP0", "control/S00_AXI", "memory/M00_AXI", "ps/S_AXI_HP0")
    design.stream("vdma/M_AXI_MM2S", "memory/S00_AXI", "vdma/M_AXI_S2MM", "memory/S01_AXI")
    for number, pin in enumerate(design.controls):
        design.stream(f"control/M{number:02}_AXI", pin)
    design.lines += [
        f"net {pin} interrupts/In{number}" for number, pin in enumerate(design.interrupts)
    ]
    clocks = ["ps/M_AXI_GP0_ACLK", "ps/S_AXI_HP0_ACLK", "control/aclk", "memory/aclk"]
    clocks += ["resets/slowest_sync_clk", *design.clocks]
    resets_n = ["control/aresetn", "memory/aresetn", *design.resets_n]
    design.lines += [
        "net interrupts/dout ps/IRQ_F2P",
        f"net ps/FCLK_CLK0 {' '.join(clocks)}",
        *([f"net ps/FCLK_CLK1 {more_clocks}"] if more_clocks else []),
        f"net ps/FCLK_RESET0_N {' '.join(['resets/ext_reset_in', *design.asynchronous])}",
        f"net resets/peripheral_aresetn {' '.join(resets_n)}",
        f"net resets/peripheral_reset {' '.join(design.resets)}",
        "assign_bd_address",
        "regenerate_bd_layout",
        "validate_bd_design",
        "save_bd_design",
        f"add_files -norecurse [make_wrapper -files [get_files {name}.bd] -top]",
        f"set_property top {name}_wrapper [current_fileset]",
        "",
    ]
    return design.lines


def _clock(plan: Plan) -> float:
    """Clock of the processing system in MHz: 100, or what the scene needs."""
    return max(100.0, clock_mhz(plan))


def _cores(design: _Design, components: dict[str, Component]) -> list[Component]:
    """Add the scene's cores with registers, from the raw frame to the refocused one."""
    chain = [components[name] for name in ("sensor_axi", "refocuser_axi") if name in components]
    for component in chain:
        design.own(component)
    return chain


def _chained(source: str, chain: list[Component], sink: str) -> list[str]:
    ends = [source]
    for component in chain:
        ends += [f"{component.name}/s_axis", f"{component.name}/m_axis"]
    return [*ends, sink]


def memory_design(plan: Plan, components: dict[str, Component], part: str) -> str:
    """Frames from memory through the cores into memory."""
    name = "block_design_memory"
    design = _Design()
    design.lines = _begin(
        *(name, part, "Frames from memory through the cores into memory, by a VDMA."), ""
    )
    design.lines += _catalog("")
    design.lines.append(f"create_bd_design {name}")
    chain = _cores(design, components)
    design.vdma(chain[0].interface("s_axis").ports["TDATA"].bits)
    design.stream(*_chained("vdma/M_AXIS_MM2S", chain, "vdma/S_AXIS_S2MM"))
    return "\n".join(_end(design, name, _clock(plan)))


def _catalog(more: str) -> list[str]:
    return [
        f"set_property ip_repo_paths [list $here/{CATALOG}{more}] [current_project]",
        "update_ip_catalog",
    ]


def camera_design(plan: Plan, components: dict[str, Component], part: str) -> str | None:
    """A camera with CSI-2, the cores, and a monitor; None if no such camera fits the scene."""
    core, sensor = plan.core, plan.sensor
    mosaic = sensor is not None and sensor.mosaic is not None
    demosaic = core.channels == 3 and not mosaic
    if core.pixels_per_clock > 1 or core.pixel_bits not in _RAW_BITS[: 3 if demosaic else 4]:
        return None
    if demosaic and sensor is not None:
        return None
    name = "block_design_camera"
    mode = _monitor(plan)
    needs = "# Lanes, their rate and their pins are the board's: set them in the cell csi.\n"
    if mode is not None:
        needs += "# rgb2dvi is Digilent's: their vivado-library has to lie beside this script.\n"
    design = _Design()
    what = "A camera by CSI-2, the cores, their frames in memory"
    what += "." if mode is None else f", and a monitor that shows them ({mode.name})."
    design.lines = _begin(name, part, what, needs)
    design.lines += _catalog(" $here/vivado-library/ip" if mode else "")
    design.lines.append(f"create_bd_design {name}")
    chain = _cores(design, components)
    last = chain[-1].interface("m_axis").ports["TDATA"].bits
    design.vdma(last)
    design.cell(
        *("xilinx.com:ip:mipi_csi2_rx_subsystem", "csi"),
        CMN_NUM_LANES=2,
        C_DPHY_LANES=2,
        CMN_NUM_PIXELS=1,
        CMN_PXL_FORMAT=f"RAW{core.pixel_bits}",
        SupportLevel=1,
    )
    design.clocks += ["csi/lite_aclk", "csi/video_aclk"]
    design.resets_n += ["csi/lite_aresetn", "csi/video_aresetn"]
    design.controls.append("csi/csirxss_s_axi")
    design.interrupts.append("csi/csirxss_csi_irq")
    design.lines.append("make_bd_intf_pins_external [get_bd_intf_pins csi/mipi_phy_if]")
    source = "csi/video_out"
    if demosaic:
        design.cell(
            *("xilinx.com:ip:v_demosaic", "demosaic"),
            SAMPLES_PER_CLOCK=1,
            MAX_DATA_WIDTH=core.pixel_bits,
            MAX_COLS=plan.columns,
            MAX_ROWS=plan.rows,
        )
        design.clocks.append("demosaic/ap_clk")
        design.resets_n.append("demosaic/ap_rst_n")
        design.controls.append("demosaic/s_axi_CTRL")
        design.interrupts.append("demosaic/interrupt")
        design.stream(source, "demosaic/s_axis_video")
        source = "demosaic/m_axis_video"
    design.stream(*_chained(source, chain, "vdma/S_AXIS_S2MM"))
    if mode is not None:
        _add_monitor(design, mode, _clock(plan), grey=core.channels == 1)
    return "\n".join(_end(design, name, _clock(plan), "csi/dphy_clk_200M"))


def _monitor(plan: Plan) -> VideoMode | None:
    """Video mode of a monitor that shows a scene's frames as they are; None if there is none."""
    if plan.core.pixel_bits != 8:
        return None
    rate = 60.0 if plan.clock_mhz is None else 1e6 * plan.clock_mhz / plan.frame_clocks
    return find_mode(plan.columns, plan.rows, rate)


def _add_monitor(design: _Design, mode: VideoMode, mhz: float, *, grey: bool) -> None:
    """From the VDMA to a monitor: its timing, its clock, TMDS."""
    source = "vdma/M_AXIS_MM2S"
    if grey:
        design.cell(
            *("xilinx.com:ip:axis_subset_converter", "grey"),
            S_TDATA_NUM_BYTES=1,
            M_TDATA_NUM_BYTES=3,
            TDATA_REMAP="tdata[7:0],tdata[7:0],tdata[7:0]",
        )
        design.clocks.append("grey/aclk")
        design.resets_n.append("grey/aresetn")
        design.stream(source, "grey/S_AXIS")
        source = "grey/M_AXIS"
    design.cell(
        *("xilinx.com:ip:clk_wiz", "pixel_clock"),
        PRIM_IN_FREQ=f"{mhz:g}",
        PRIM_SOURCE="Global_buffer",
        CLKOUT1_REQUESTED_OUT_FREQ=f"{mode.pixel_clock / 1000:g}",
        RESET_TYPE="ACTIVE_LOW",
        RESET_PORT="resetn",
    )
    design.cell(
        "xilinx.com:ip:v_tc",
        "timing",
        HAS_AXI4_LITE="false",
        enable_detection="false",
        VIDEO_MODE="Custom",
        **_timing(mode),
    )
    design.cell("xilinx.com:ip:v_axi4s_vid_out", "video", C_HAS_ASYNC_CLK=1)
    design.cell(_DIGILENT, "tmds", kRstActiveHigh="false")
    design.cell("xilinx.com:ip:proc_sys_reset", "pixel_resets")
    design.clocks += ["pixel_clock/clk_in1", "video/aclk"]
    design.resets_n += ["pixel_clock/resetn", "video/aresetn"]
    design.asynchronous.append("pixel_resets/ext_reset_in")
    design.stream(source, "video/video_in", "timing/vtiming_out", "video/vtiming_in")
    design.stream("video/vid_io_out", "tmds/RGB")
    design.lines += [
        "net pixel_clock/clk_out1 timing/clk video/vid_io_out_clk tmds/PixelClk "
        "pixel_resets/slowest_sync_clk",
        "net pixel_clock/locked pixel_resets/dcm_locked",
        "net pixel_resets/peripheral_aresetn timing/resetn tmds/aRst_n",
        "net pixel_resets/peripheral_reset video/vid_io_out_reset",
        "net video/vtg_ce timing/gen_clken",
        "make_bd_intf_pins_external [get_bd_intf_pins tmds/TMDS]",
    ]


def _timing(mode: VideoMode) -> dict[str, object]:
    """Timing of a mode for the timing controller, which counts lines from the last active one."""
    polarity = {True: "High", False: "Low"}
    last = mode.v_active + mode.v_front - 1
    ends = {"F0_VBLANK_HSTART", "F0_VBLANK_HEND", "F0_VSYNC_HSTART", "F0_VSYNC_HEND"}
    values: dict[str, object] = {
        "HACTIVE_SIZE": mode.h_active,
        "HSYNC_START": mode.h_active + mode.h_front,
        "HSYNC_END": mode.h_active + mode.h_front + mode.h_sync,
        "HFRAME_SIZE": mode.h_total,
        "VACTIVE_SIZE": mode.v_active,
        "F0_VSYNC_VSTART": last,
        "F0_VSYNC_VEND": last + mode.v_sync,
        "F0_VFRAME_SIZE": mode.v_total,
        **dict.fromkeys(sorted(ends), mode.h_active),
        "HSYNC_POLARITY": polarity[mode.h_positive],
        "VSYNC_POLARITY": polarity[mode.v_positive],
    }
    return {f"GEN_{name}": value for name, value in values.items()}
