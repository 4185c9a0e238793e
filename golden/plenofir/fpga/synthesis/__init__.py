# SPDX-License-Identifier: Apache-2.0
"""Synthesis with open tools: GHDL to Verilog, Yosys to a netlist, nextpnr to a bitstream."""
