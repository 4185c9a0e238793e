# SPDX-License-Identifier: Apache-2.0
"""Measurements and comparisons: precision, validation, experiments, the tables of the thesis."""
