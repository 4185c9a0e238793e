# SPDX-License-Identifier: Apache-2.0
"""The cases of the record: small white images, and single steps of the calibration."""

import numpy as np
from distorted_white import distorted_white
from recorded import Case
from recorded_drawn import (
    bent,
    calibrated,
    clipping,
    drawn_small,
    fading,
    inspected,
    mixed,
    scattered,
    step,
    striped,
    white,
    with_dark,
    without,
)
from recorded_pictures import (
    drawn_spots,
    focus_steps,
    frame_steps,
    picture_steps,
    pixel_steps,
    resampled,
    spot_steps,
    thesis_steps,
)
from recorded_steps import (
    bent_lenses,
    check_steps,
    corrected_steps,
    enough_steps,
    guessed,
    lattice_steps,
    light_steps,
    lit_steps,
    model_steps,
    place_steps,
    redrawn_steps,
    robust_steps,
    window_steps,
)

from plenofir.camera.synthetic import regular_grid, white_image
from plenofir.camera.synthetic.drawn import drawn_white

CASES: dict[str, Case] = {
    "steps: checks": step(check_steps),
    "steps: lit": step(lit_steps),
    "steps: corrected": step(corrected_steps),
    "steps: numbers": step(enough_steps),
    "steps: lattices": step(lattice_steps),
    "steps: light": step(light_steps),
    "steps: windows": step(window_steps),
    "steps: redrawn": step(redrawn_steps),
    "steps: robust": step(robust_steps),
    "steps: places": step(place_steps),
    "steps: models": step(model_steps),
    "steps: spots": step(spot_steps),
    "steps: frames": step(frame_steps),
    "steps: pictures": Case(lambda: [mixed(0.42), mixed(0.4, "hexagonal-rows")], picture_steps),
    "steps: pixels": Case(drawn_small, pixel_steps),
    "steps: resampled": step(resampled),
    "steps: focus": Case(drawn_spots, focus_steps),
    "steps: thesis": Case(
        lambda: white_image((90, 100), regular_grid((90, 100), 9.3, rotation_degrees=1.0)),
        thesis_steps,
    ),
    "bent: even": step(lambda: bent_lenses(8, 9)),
    "bent: all": step(lambda: bent_lenses(14, 13, tilt=(0.02, -0.03), bend=0.015)),
    "bent: pulled": step(lambda: bent_lenses(12, 15, bend=-0.02, pulled=True, pitch=4.0)),
    "bent: few": step(lambda: bent_lenses(5, 6, tilt=(0.02, 0.0))),
    "bent: order 3": step(lambda: bent_lenses(11, 12, order=3, layout="hexagonal-rows")),
    "bent: order 2": step(lambda: bent_lenses(7, 7, order=2, tilt=(0.03, 0.02))),
    "bent: many": step(lambda: bent_lenses(64, 64, bend=0.003, noise=0.1)),
    "lattices: rectangular": Case(lambda: mixed(0.42), guessed),
    "lattices: hexagonal": Case(lambda: mixed(0.42, "hexagonal-columns"), guessed),
    "lattices: long": Case(
        lambda: white_image((28, 1100), regular_grid((28, 1100), 5.3, rotation_degrees=0.4)),
        guessed,
    ),
    "lattices: overlapping": Case(lambda: mixed(0.62), guessed),
    "inspected: gaps": Case(lambda: mixed(0.36), inspected),
    "inspected: touching": Case(lambda: mixed(0.5, "hexagonal-rows"), inspected),
    "inspected: overlapping": Case(lambda: mixed(0.8), inspected),
    "inspected: uneven": white((90, 90), 9.3, 1.0, change=without(0.3, 0.8)),
    "refused: overlaps": Case(lambda: mixed(0.6), calibrated),
    "hexagonal rows": white((90, 92), 9.1, -2.0, "hexagonal-rows", shading=0.8),
    "hexagonal columns": white((80, 92), 8.4, 3.0, "hexagonal-columns", noise=0.05),
    "pitch 4, hexagonal": white((84, 90), 4.0, 0.0, "hexagonal-rows", radius=0.4),
    "pitch 18": white((120, 130), 18.2, 1.0, noise=0.02),
    "pitch 20, hexagonal": white((130, 150), 20.3, 1.0, "hexagonal-columns", shading=0.7),
    "pitch 18, spots": white((110, 120), 18.4, 0.3, form="spot", radius=0.1),
    "barrel": bent((90, 150), 9.3, bend=-0.02, rotation_degrees=0.6, offset=(0.7, 2.1)),
    "tilt": bent((90, 100), 8.3, tilt=(0.03, 0.01), rotation_degrees=1.0),
    "order 2": white((84, 92), 8.3, 1.0, options={"order": 2}),
    "as hexagonal": white((84, 92), 8.3, 1.0, options={"layout": "hexagonal-rows"}),
    "few": white((60, 60), 10.4, 2.0),
    "missing, grey ground": white(
        (90, 99), 9.0, 0.4, level=0.7, change=lambda image: without(0.2)(image) + np.uint16(4000)
    ),
    "missing": white((90, 99), 9.0, 0.4, change=without(0.2)),
    "dark rows": white((90, 99), 9.0, 0.0, change=striped(9, 0.3)),
    "fading": white((70, 140), 7.3, 0.5, change=fading(0.0)),
    "clipped": white((90, 100), 8.8, 1.0, shading=0.7, change=clipping(1.5)),
    "dark frame and colours": white((80, 90), 9.3, 1.0, change=with_dark),
    "eight bits": white((80, 90), 8.3, 1.0, bits=8, level=0.3, noise=0.1),
    "scattered by 6 %": scattered(0.06, 84),
    "scattered by 10 %": scattered(0.1, 84),
    "scattered by 13 %": scattered(0.13, 84),
    "few, scattered by 2 %": scattered(0.02, 58, 1),
    "few, scattered by 3 %": scattered(0.03, 58, 1),
    "noise": Case(
        lambda: np.random.default_rng(0).integers(0, 255, (80, 80)).astype(np.uint8), calibrated
    ),
    "pitch 2.6": white((80, 90), 2.6, 0.3),
    "strip": white((32, 110), 9.3, 0.3),
}
for seed in (2, 5, 8, 10, 16):
    CASES[f"drawn {seed}"] = Case(lambda seed=seed: drawn_white(seed, 12000).image, calibrated)
for seed in (3, 5, 9, 16):
    CASES[f"distorted {seed}"] = Case(
        lambda seed=seed: distorted_white(seed, 12000).image, calibrated
    )
