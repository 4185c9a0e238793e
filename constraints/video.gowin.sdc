# SPDX-License-Identifier: Apache-2.0
# Clock crossings of the video path, for clocks of up to 148.5 MHz: see
# docs/clock-crossings.md. Built by scripts/core_files.py.
set_max_delay -to [get_regs {*crossing_word*}] 6.734
set_max_delay -from [get_regs {*crossing_code*}] -to [get_regs {*crossing_caught*}] 6.734
set_false_path -to [get_regs {*crossing_reset*}]
