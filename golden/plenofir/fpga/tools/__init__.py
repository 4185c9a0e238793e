# SPDX-License-Identifier: Apache-2.0
"""The programs that read VHDL and Verilog: simulators, GHDL's synthesis, Yosys."""
