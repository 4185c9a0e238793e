"""Measurements and comparisons: precision, validation, experiments, the tables of the thesis."""
