# SPDX-License-Identifier: Apache-2.0
"""Simulation of the VHDL core beside the golden model."""
