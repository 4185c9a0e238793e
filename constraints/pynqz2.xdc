# SPDX-License-Identifier: Apache-2.0
# TUL PYNQ-Z2: pins of pynqz2_top, see docs/boards/pynq-z2.md.
# plenofir project adds the clock of the HDMI input, which is that of the build's range, and the crossings.

# Oscillator of 125 MHz (the Ethernet transceiver's); reset: pin 7 of PMODA, low while joined to ground.
set_property -dict {PACKAGE_PIN H16 IOSTANDARD LVCMOS33} [get_ports clk_125]
create_clock -period 8.000 [get_ports clk_125]
set_property -dict {PACKAGE_PIN U18 IOSTANDARD LVCMOS33 PULLTYPE PULLUP} [get_ports reset_n]

# HDMI in.
set_property -dict {PACKAGE_PIN N18 IOSTANDARD TMDS_33} [get_ports in_clk_p]
set_property -dict {PACKAGE_PIN P19 IOSTANDARD TMDS_33} [get_ports in_clk_n]
set_property -dict {PACKAGE_PIN V20 IOSTANDARD TMDS_33} [get_ports {in_data_p[0]}]
set_property -dict {PACKAGE_PIN W20 IOSTANDARD TMDS_33} [get_ports {in_data_n[0]}]
set_property -dict {PACKAGE_PIN T20 IOSTANDARD TMDS_33} [get_ports {in_data_p[1]}]
set_property -dict {PACKAGE_PIN U20 IOSTANDARD TMDS_33} [get_ports {in_data_n[1]}]
set_property -dict {PACKAGE_PIN N20 IOSTANDARD TMDS_33} [get_ports {in_data_p[2]}]
set_property -dict {PACKAGE_PIN P20 IOSTANDARD TMDS_33} [get_ports {in_data_n[2]}]
set_property -dict {PACKAGE_PIN U14 IOSTANDARD LVCMOS33 PULLTYPE PULLUP} [get_ports in_scl]
set_property -dict {PACKAGE_PIN U15 IOSTANDARD LVCMOS33 PULLTYPE PULLUP} [get_ports in_sda]
set_property -dict {PACKAGE_PIN T19 IOSTANDARD LVCMOS33} [get_ports in_hot_plug]

# HDMI out.
set_property -dict {PACKAGE_PIN L16 IOSTANDARD TMDS_33} [get_ports out_clk_p]
set_property -dict {PACKAGE_PIN L17 IOSTANDARD TMDS_33} [get_ports out_clk_n]
set_property -dict {PACKAGE_PIN K17 IOSTANDARD TMDS_33} [get_ports {out_data_p[0]}]
set_property -dict {PACKAGE_PIN K18 IOSTANDARD TMDS_33} [get_ports {out_data_n[0]}]
set_property -dict {PACKAGE_PIN K19 IOSTANDARD TMDS_33} [get_ports {out_data_p[1]}]
set_property -dict {PACKAGE_PIN J19 IOSTANDARD TMDS_33} [get_ports {out_data_n[1]}]
set_property -dict {PACKAGE_PIN J18 IOSTANDARD TMDS_33} [get_ports {out_data_p[2]}]
set_property -dict {PACKAGE_PIN H18 IOSTANDARD TMDS_33} [get_ports {out_data_n[2]}]

# Serial port: a Pmod USBUART in the upper row of PMODA (pin 2 to the adapter, pin 3 from it).
set_property -dict {PACKAGE_PIN Y19 IOSTANDARD LVCMOS33} [get_ports uart_tx]
set_property -dict {PACKAGE_PIN Y16 IOSTANDARD LVCMOS33 PULLTYPE PULLUP} [get_ports uart_rx]

# Buttons BTN0 to BTN2; switches SW0, SW1; BTN3 in the place of a third switch.
set_property -dict {PACKAGE_PIN D19 IOSTANDARD LVCMOS33} [get_ports button_up]
set_property -dict {PACKAGE_PIN D20 IOSTANDARD LVCMOS33} [get_ports button_down]
set_property -dict {PACKAGE_PIN L20 IOSTANDARD LVCMOS33} [get_ports button_clear]
set_property -dict {PACKAGE_PIN M20 IOSTANDARD LVCMOS33} [get_ports switch_pattern]
set_property -dict {PACKAGE_PIN M19 IOSTANDARD LVCMOS33} [get_ports switch_sweep]
set_property -dict {PACKAGE_PIN L19 IOSTANDARD LVCMOS33} [get_ports switch_pass]

# LEDs: LD0 to LD3, LD4 green, LD5 red, LD4 blue, LD5 blue.
set_property -dict {PACKAGE_PIN R14 IOSTANDARD LVCMOS33} [get_ports {led[0]}]
set_property -dict {PACKAGE_PIN P14 IOSTANDARD LVCMOS33} [get_ports {led[1]}]
set_property -dict {PACKAGE_PIN N16 IOSTANDARD LVCMOS33} [get_ports {led[2]}]
set_property -dict {PACKAGE_PIN M14 IOSTANDARD LVCMOS33} [get_ports {led[3]}]
set_property -dict {PACKAGE_PIN G17 IOSTANDARD LVCMOS33} [get_ports {led[4]}]
set_property -dict {PACKAGE_PIN M15 IOSTANDARD LVCMOS33} [get_ports {led[5]}]
set_property -dict {PACKAGE_PIN L15 IOSTANDARD LVCMOS33} [get_ports {led[6]}]
set_property -dict {PACKAGE_PIN G14 IOSTANDARD LVCMOS33} [get_ports {led[7]}]

# Of the MMCM's two inputs the HDMI clock is the faster one, so it alone is timed: both at once would be timed against
# each other, which never run at once.
set_case_analysis 1 [get_pins pixel_clocks_of_both/mmcm/CLKINSEL]
