# SPDX-License-Identifier: Apache-2.0
# A block design for a Zynq-7000 with the cores of a scene (scene.tcl), behind package_ip.tcl:
#
#   vivado -source block_design.tcl                   frames from memory through the cores into memory, by a VDMA
#   vivado -source block_design.tcl -tclargs camera   a camera by CSI-2, the cores, their frames in memory, and a
#                                                     monitor that shows them if they have the size of a video mode
#
# One clock of the processing system drives everything except D-PHY and monitor. Lanes of a camera, their rate and
# their pins are the board's: set them in the cell csi. For a monitor Digilent's vivado-library (rgb2dvi) has to lie
# beside this script.
#
# This script was never run in Vivado. It is checked with stubs of Vivado's commands: syntax, commands and their
# options, every name of the cores' ports, and that everything that must be connected is connected once.

set here [file dirname [file normalize [info script]]]
source $here/scene.tcl
set kind [expr {[info exists argv] && [llength $argv] > 0 ? [lindex $argv 0] : "memory"}]
if {$kind ni {memory camera}} {
  error "-tclargs takes memory or camera, not $kind"
}
set with_camera [expr {$kind eq "camera"}]
if {$with_camera && $camera eq ""} {
  error "no CSI-2 receiver gives the pixels of this scene: one a clock, 8 to 14 bits, a sensor with one plane"
}
set name block_design_$kind
set with_monitor [expr {$with_camera && $monitor ne ""}]

# Pins of all cells that the processing system serves, collected while cells are made.
set clocks {ps/M_AXI_GP0_ACLK ps/S_AXI_HP0_ACLK control/aclk memory/aclk resets/slowest_sync_clk}
set resets {}
set resets_n {control/aresetn memory/aresetn}
set controls {}
set interrupts {}
# Resets that follow the processing system itself.
set system_resets {resets/ext_reset_in}

# A cell with the newest version of a core in the catalog, and its configuration.
proc cell {vlnv name args} {
  set definitions [get_ipdefs $vlnv:*]
  if {$definitions eq ""} {
    error "Vivado's catalog has no $vlnv: see the first lines of this script"
  }
  create_bd_cell -type ip -vlnv [lindex $definitions end] $name
  set configuration {}
  foreach {key value} $args {
    lappend configuration CONFIG.$key $value
  }
  if {$configuration ne ""} {
    set_property -dict $configuration [get_bd_cells $name]
  }
}

proc stream {from to} {
  connect_bd_intf_net [get_bd_intf_pins $from] [get_bd_intf_pins $to]
}

proc net {from args} {
  foreach to $args {
    connect_bd_net [get_bd_pins $from] [get_bd_pins $to]
  }
}

# The scene's cores one behind the other, between a source and a sink.
proc through_cores {from to} {
  foreach core $::chain {
    stream $from $core/s_axis
    set from $core/m_axis
  }
  stream $from $to
}

create_project -force $name $here/build/$name -part $part
set catalog [list $here/ip]
if {$with_monitor} {
  lappend catalog $here/vivado-library/ip
}
set_property ip_repo_paths $catalog [current_project]
update_ip_catalog
create_bd_design $name

foreach core $chain {
  cell plenofir:ip:$core $core
  lappend clocks $core/clk
  lappend resets $core/reset
  lappend controls $core/s_axi_ctrl
  lappend interrupts $core/interrupt
}

# The VDMA reads the pixels that the first core takes, or those that the monitor shows.
cell xilinx.com:ip:axi_vdma vdma c_include_mm2s 1 c_include_s2mm 1 c_num_fstores 3 \
  c_m_axis_mm2s_tdata_width [expr {$with_camera ? $bits_out : $bits_in}] \
  c_m_axi_mm2s_data_width [expr {$with_camera ? $memory_bits_out : $memory_bits_in}] \
  c_m_axi_s2mm_data_width $memory_bits_out \
  c_mm2s_linebuffer_depth 2048 c_s2mm_linebuffer_depth 2048
foreach side {s_axi_lite m_axi_mm2s m_axis_mm2s m_axi_s2mm s_axis_s2mm} {
  lappend clocks vdma/${side}_aclk
}
lappend resets_n vdma/axi_resetn
lappend controls vdma/S_AXI_LITE
lappend interrupts vdma/mm2s_introut vdma/s2mm_introut

if {!$with_camera} {
  through_cores vdma/M_AXIS_MM2S vdma/S_AXIS_S2MM
} else {
  cell xilinx.com:ip:mipi_csi2_rx_subsystem csi CMN_NUM_LANES 2 C_DPHY_LANES 2 CMN_NUM_PIXELS 1 \
    CMN_PXL_FORMAT RAW[dict get $camera raw_bits] SupportLevel 1
  lappend clocks csi/lite_aclk csi/video_aclk
  lappend resets_n csi/lite_aresetn csi/video_aresetn
  lappend controls csi/csirxss_s_axi
  lappend interrupts csi/csirxss_csi_irq
  make_bd_intf_pins_external [get_bd_intf_pins csi/mipi_phy_if]
  if {[dict get $camera demosaic]} {
    # Three planes of a sensor with a mosaic, for a core without a resampler.
    cell xilinx.com:ip:v_demosaic demosaic SAMPLES_PER_CLOCK 1 MAX_DATA_WIDTH [dict get $camera raw_bits] \
      MAX_COLS [dict get $camera columns] MAX_ROWS [dict get $camera rows]
    lappend clocks demosaic/ap_clk
    lappend resets_n demosaic/ap_rst_n
    lappend controls demosaic/s_axi_CTRL
    lappend interrupts demosaic/interrupt
    stream csi/video_out demosaic/s_axis_video
    through_cores demosaic/m_axis_video vdma/S_AXIS_S2MM
  } else {
    through_cores csi/video_out vdma/S_AXIS_S2MM
  }
}

if {$with_monitor} {
  set shown vdma/M_AXIS_MM2S
  if {[dict get $monitor grey]} {
    cell xilinx.com:ip:axis_subset_converter grey S_TDATA_NUM_BYTES 1 M_TDATA_NUM_BYTES 3 \
      TDATA_REMAP {tdata[7:0],tdata[7:0],tdata[7:0]}
    lappend clocks grey/aclk
    lappend resets_n grey/aresetn
    stream $shown grey/S_AXIS
    set shown grey/M_AXIS
  }
  cell xilinx.com:ip:clk_wiz pixel_clock PRIM_IN_FREQ $clock_mhz PRIM_SOURCE Global_buffer \
    CLKOUT1_REQUESTED_OUT_FREQ [dict get $monitor pixel_mhz] RESET_TYPE ACTIVE_LOW RESET_PORT resetn
  cell xilinx.com:ip:v_tc timing HAS_AXI4_LITE false enable_detection false VIDEO_MODE Custom \
    {*}[dict get $monitor timing]
  cell xilinx.com:ip:v_axi4s_vid_out video C_HAS_ASYNC_CLK 1
  cell digilentinc.com:ip:rgb2dvi tmds kRstActiveHigh false
  cell xilinx.com:ip:proc_sys_reset pixel_resets
  lappend clocks pixel_clock/clk_in1 video/aclk
  lappend resets_n pixel_clock/resetn video/aresetn
  lappend system_resets pixel_resets/ext_reset_in
  stream $shown video/video_in
  stream timing/vtiming_out video/vtiming_in
  stream video/vid_io_out tmds/RGB
  net pixel_clock/clk_out1 timing/clk video/vid_io_out_clk tmds/PixelClk pixel_resets/slowest_sync_clk
  net pixel_clock/locked pixel_resets/dcm_locked
  net pixel_resets/peripheral_aresetn timing/resetn tmds/aRst_n
  net pixel_resets/peripheral_reset video/vid_io_out_reset
  net video/vtg_ce timing/gen_clken
  make_bd_intf_pins_external [get_bd_intf_pins tmds/TMDS]
}

# Around the cells: processing system, control, memory, interrupts, clocks and resets.
set second_clock [expr {$with_camera ? {PCW_EN_CLK1_PORT 1 PCW_FPGA1_PERIPHERAL_FREQMHZ 200} : {}}]
cell xilinx.com:ip:processing_system7 ps PCW_USE_S_AXI_HP0 1 PCW_USE_FABRIC_INTERRUPT 1 PCW_IRQ_F2P_INTR 1 \
  PCW_FPGA0_PERIPHERAL_FREQMHZ $clock_mhz {*}$second_clock
apply_bd_automation -rule xilinx.com:bd_rule:processing_system7 -config {make_external "FIXED_IO, DDR"} \
  [get_bd_cells ps]
cell xilinx.com:ip:smartconnect control NUM_SI 1 NUM_MI [llength $controls]
cell xilinx.com:ip:smartconnect memory NUM_SI 2 NUM_MI 1
cell xilinx.com:ip:proc_sys_reset resets
cell xilinx.com:ip:xlconcat interrupts NUM_PORTS [llength $interrupts]
stream ps/M_AXI_GP0 control/S00_AXI
stream memory/M00_AXI ps/S_AXI_HP0
stream vdma/M_AXI_MM2S memory/S00_AXI
stream vdma/M_AXI_S2MM memory/S01_AXI
for {set i 0} {$i < [llength $controls]} {incr i} {
  stream control/M[format %02d $i]_AXI [lindex $controls $i]
}
for {set i 0} {$i < [llength $interrupts]} {incr i} {
  net [lindex $interrupts $i] interrupts/In$i
}
net interrupts/dout ps/IRQ_F2P
net ps/FCLK_CLK0 {*}$clocks
if {$with_camera} {
  net ps/FCLK_CLK1 csi/dphy_clk_200M
}
net ps/FCLK_RESET0_N {*}$system_resets
net resets/peripheral_aresetn {*}$resets_n
net resets/peripheral_reset {*}$resets

assign_bd_address
regenerate_bd_layout
validate_bd_design
save_bd_design
add_files -norecurse [make_wrapper -files [get_files $name.bd] -top]
set_property top ${name}_wrapper [current_fileset]
