"""The camera side: optics, ray model, calibration, light fields, a synthetic camera."""
