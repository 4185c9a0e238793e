# SPDX-License-Identifier: Apache-2.0
"""The FPGA side: cores and what they are built for, simulation, synthesis, bitstreams, HDMI."""
