# SPDX-License-Identifier: Apache-2.0
"""Commands about shipped optics: cameras, lens."""

from typing import Annotated

import typer

from plenofir.commands import options
from plenofir.commands.console import print_json, print_table

app = typer.Typer()

_SYMBOLS = (
    ("f_U", "focal length of the main lens"),
    ("f_s", "focal length of a micro lens; of each type where there are several"),
    ("b_s", "sensor from the micro lenses: f_s in a standard camera"),
    ("p_M", "pitch of the micro lenses"),
    ("p_p", "pitch of the sensor's pixels"),
)


@app.command()
def cameras(as_json: options.AsJson = False) -> None:
    """List the shipped cameras and microscopes."""
    from plenofir.camera.rays import Microscope, camera_names, load_instrument, microscope_names

    shipped = [load_instrument(name) for name in (*camera_names(), *microscope_names())]
    if as_json:
        print_json([camera.model_dump() for camera in shipped])
        return
    microscopes = [one for one in shipped if isinstance(one, Microscope)]
    rows = [
        [
            camera.name,
            f"{camera.main_lens.focal_length_mm:.7g}",
            ", ".join(f"{f:.5g}" for f in camera.micro_lenses.focal_lengths_mm),
            f"{camera.micro_lenses.spacing_mm:.5g}",
            f"{camera.micro_lenses.pitch_mm:.5g}",
            str(camera.sensor.pixel_pitch_mm),
        ]
        for camera in shipped
        if not isinstance(camera, Microscope)
    ]
    print_table(["name", *(symbol for symbol, _ in _SYMBOLS)], rows, title="shipped cameras, mm")
    for symbol, meaning in _SYMBOLS:
        typer.echo(f"{symbol}: {meaning}")
    rows = [
        [
            one.name,
            f"{one.objective.real_magnification:g}x / {one.objective.numerical_aperture:g}",
            f"{one.objective.immersion_index:g}",
            str(one.micro_lenses.focal_length_mm),
            str(one.micro_lenses.pitch_mm),
            f"{one.sensor.pixel_pitch_mm:.5g}",
        ]
        for one in microscopes
    ]
    print_table(["name", "V / NA", "n", "f_s", "p_M", "p_p"], rows, title="microscopes, mm")
    typer.echo("V: magnification; NA: numerical aperture; n: index of immersion")


@app.command()
def lens(
    prescription: Annotated[
        str, typer.Argument(help="Lens prescription, a CSV file or the name of a shipped one.")
    ],
    wavelength: Annotated[float, options.number("--wavelength", "Wavelength in nm.")] = 550.0,
    as_json: options.AsJson = False,
) -> None:
    """Cardinal points and pupils of a main lens from its prescription."""
    from plenofir.camera.optics.paraxial import paraxial_properties
    from plenofir.camera.optics.prescription import load_prescription

    main_lens = load_prescription(prescription)
    content = paraxial_properties(main_lens, wavelength)
    if as_json:
        print_json({"lens": main_lens.name, "wavelength_nm": wavelength, **content})
        return
    rows = [[name, "none" if v is None else f"{v:.4f}"] for name, v in content.items()]
    print_table(["property", "mm"], rows, title=f"{main_lens.name}, {wavelength:g} nm")
