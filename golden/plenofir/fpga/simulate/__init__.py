"""Simulation of the VHDL core beside the golden model."""
