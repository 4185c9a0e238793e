# SPDX-License-Identifier: Apache-2.0
"""A sensor whose raw frames the chip resamples itself: scene, hardware, calibration, simulation."""
