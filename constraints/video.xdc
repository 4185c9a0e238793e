# SPDX-License-Identifier: Apache-2.0
# Clock crossings of the video path, for clocks of up to 148.5 MHz: see
# docs/clock-crossings.md. Built by scripts/core_files.py.
set_max_delay -quiet -datapath_only -from [get_cells -quiet -hierarchical -filter {NAME =~ *crossing_memory_reg*}] -to [get_cells -quiet -hierarchical -filter {NAME =~ *crossing_word_reg*}] 6.734
set_max_delay -datapath_only -from [get_cells -hierarchical -filter {NAME =~ *crossing_code_reg*}] -to [get_cells -hierarchical -filter {NAME =~ *crossing_caught_reg*}] 6.734
set_bus_skew -from [get_cells -hierarchical -filter {NAME =~ *crossing_code_reg*}] -to [get_cells -hierarchical -filter {NAME =~ *crossing_caught_reg*}] 6.734
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *crossing_reset_reg*/PRE}]
