# SPDX-License-Identifier: Apache-2.0
"""HDMI input and output: video modes, TMDS coding, EDID, PLL settings, board files."""
