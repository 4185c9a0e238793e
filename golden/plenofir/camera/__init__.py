# SPDX-License-Identifier: Apache-2.0
"""The camera side: optics, ray model, calibration, light fields."""
