# SPDX-License-Identifier: Apache-2.0
"""Names of options: by the variables of make, and by the fields and arguments they give."""

VARIABLES = {
    "RAW": "raw",
    "CALIB": "calib",
    "BAYER": "bayer",
    "M": "micro_image",
    "A": "a",
    "SWEEP": "a",
    "STACK": "a",
    "RADIUS": "radius",
    "IOTA": "parallel_rows",
    "ENGINE": "engine",
    "ANY_ROWS": "any_rows",
    "PIXELS": "pixels",
    "INTERPOLATION": "interpolation",
    "SHARPEN": "sharpen",
    "BOX": "box",
    "BORDER": "border",
    "ARITH": "arith",
    "FRACTION": "fraction",
    "GUARD": "guard",
    "MAX_COLUMNS": "max_columns",
    "SIM": "simulator",
    "CHAIN": "chain",
    "LANES": "lanes",
    "RAW_BITS": "raw_bits",
    "BOARD": "board",
    "DEVICE": "device",
    "BEYOND_DATA_SHEET": "beyond_data_sheet",
    "WAVES": "waves",
    "WAVES_DEPTH": "waves_depth",
    "STALLS": "stalls",
    "SCENE": "scene",
    "OUT": "out",
    "ISE": "ise",
}
"""Option that each variable of make stands for."""

FIELDS = {
    "micro_image_size": "micro_image",
    "shifts": "a",
    "order": "interpolation",
    "pixels_per_clock": "pixels",
    "arithmetic": "arith",
    "sharpening": "sharpen",
    "boxes": "box",
    "fraction_bits": "fraction",
    "guard_bits": "guard",
}
"""Option of a field of the core or an argument of a function, where the names differ."""
