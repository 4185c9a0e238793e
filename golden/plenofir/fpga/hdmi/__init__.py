"""HDMI input and output: video modes, TMDS coding, EDID, PLL settings, board files."""
