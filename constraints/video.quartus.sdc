# SPDX-License-Identifier: Apache-2.0
# Clock crossings of the video path, for clocks of up to 148.5 MHz: see
# docs/clock-crossings.md. Built by scripts/core_files.py.
set_net_delay -from [get_keepers -nowarn {*crossing_memory*}] -to [get_keepers -nowarn {*crossing_word*}] -max -get_value_from_clock_period min_clock_period -value_multiplier 0.8
set_max_delay -from [get_keepers -nowarn {*crossing_memory*}] -to [get_keepers -nowarn {*crossing_word*}] 100
set_min_delay -from [get_keepers -nowarn {*crossing_memory*}] -to [get_keepers -nowarn {*crossing_word*}] -100
set_max_skew -from [get_keepers -nowarn {*crossing_code*}] -to [get_keepers -nowarn {*crossing_caught*}] -get_skew_value_from_clock_period min_clock_period -skew_value_multiplier 0.8
set_net_delay -from [get_keepers -nowarn {*crossing_code*}] -to [get_keepers -nowarn {*crossing_caught*}] -max -get_value_from_clock_period min_clock_period -value_multiplier 0.8
set_max_delay -from [get_keepers -nowarn {*crossing_code*}] -to [get_keepers -nowarn {*crossing_caught*}] 100
set_min_delay -from [get_keepers -nowarn {*crossing_code*}] -to [get_keepers -nowarn {*crossing_caught*}] -100
set_false_path -to [get_pins -compatibility_mode -nowarn {*crossing_reset*|clrn}]
set_false_path -to [get_pins -compatibility_mode -nowarn {*crossing_reset*|aclr}]
