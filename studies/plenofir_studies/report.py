# SPDX-License-Identifier: Apache-2.0
"""``plenofir report``: an entry point of the group ``plenofir.commands`` (pyproject.toml)."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from plenofir.commands.console import progress_bar, steps_bar
from plenofir.commands.options import OutFolder

app = typer.Typer(no_args_is_help=True, help="Write reports.")

# Name of a report to its module, and what it is.
REPORTS = {
    "rays": (
        "ray_report",
        "Validation and numerical stability of the ray model: Markdown with figures.",
    ),
    "pictures": (
        "lens_pictures",
        "Distances and baselines from pictures by real rays through lenses: Markdown, JSON.",
    ),
    "precision": (
        "precision_report",
        "Error against run time of every way to refocus: Markdown with figures.",
    ),
    "sharpening": (
        "sharpening_report",
        "Weights of sharpening, nearness to the object, noise and harm: Markdown with pictures.",
    ),
    "boxes": (
        "box_report",
        "Boxes of fewer samples than M: nearness to the object, noise, resolution: Markdown.",
    ),
    "stability": (
        "refocus_stability",
        "Extreme inputs, and how errors of floating point grow: Markdown with figures.",
    ),
    "numbers": (
        "numbers_report",
        "Noise, resolution, rounded centres: Markdown with figures.",
    ),
    "depth": (
        "depth_methods",
        "Ways to depth and to all in focus, on rendered scenes with truth: Markdown, figure.",
    ),
    "energy": (
        "energy",
        "Energy of a pixel, estimated from what switches in netlists: Markdown; takes an hour.",
    ),
    "growth": (
        "growth",
        "How time, memory, logic and energy grow, with laws and their ends: Markdown, figure.",
    ),
    "gpu": (
        "gpu_report",
        "Time of a frame on a GPU, share of its bandwidth, beside the CPU: Markdown.",
    ),
    "peers": (
        "peers",
        "Pictures, depth, centres and times beside other open software: Markdown.",
    ),
    "resampling": (
        "resampling_report",
        "The chip's resampler beside decode, over bits, pitch, rotation: Markdown.",
    ),
    "calibration": (
        "calibration_report",
        "Accuracy and time of the calibration, and section 5.3's experiments: Markdown, figures.",
    ),
}


def _write(name: str, *words: Any) -> None:
    # Loaded when needed, as the studies take seconds to load.
    from plenofir.refocus import first_calls

    # Times are those of compiled code.
    first_calls.patient = True
    writer = import_module(f"plenofir_studies.{REPORTS[name][0]}").write_report
    # The report of the ray model names its steps.
    with steps_bar("report") if name == "rays" else progress_bar("measuring") as show:
        path = writer(*words, show)
    typer.echo(f"report: {path}")


def _command(name: str) -> Callable[[str], None]:
    def command(out: OutFolder = f"build/report-{name}") -> None:
        _write(name, Path(out))

    return command


for _name, (_, _text) in REPORTS.items():
    if _name not in ("calibration", "depth", "peers"):
        app.command(_name, help=_text)(_command(_name))


@app.command(help=REPORTS["calibration"][1])
def calibration(
    out: OutFolder = "build/report-calibration",
    spots: Annotated[
        Path | None,
        typer.Option(help="Folder of other spot images NAME.png with centres NAME.txt (y x)."),
    ] = None,
) -> None:
    _write("calibration", Path(out), spots)


@app.command(help=REPORTS["depth"][1])
def depth(
    out: OutFolder = "build/report-depth",
    hci: Annotated[
        Path | None,
        typer.Option(help="Folder of scenes of the HCI 4D benchmark, measured instead."),
    ] = None,
) -> None:
    _write("depth", Path(out), hci)


@app.command(help=REPORTS["peers"][1])
def peers(
    python: Annotated[
        Path,
        typer.Option(help="Interpreter with plenopticam, plenpy and pyolaf (docs/studies.md)."),
    ],
    out: OutFolder = "build/report-peers",
) -> None:
    _write("peers", Path(out), python)
