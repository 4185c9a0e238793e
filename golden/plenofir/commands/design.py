# SPDX-License-Identifier: Apache-2.0
"""The command ``design``: every figure that follows from a camera's data, at once."""

from dataclasses import asdict, dataclass
from math import inf
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plenofir.commands import options
from plenofir.commands.console import print_json, print_table
from plenofir.commands.groups import Output, grouped
from plenofir.commands.rasters import focused
from plenofir.commands.results import check_plot_and_csv, write_plot_and_csv
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from plenofir.camera.design import Design
    from plenofir.camera.rays import Camera

app = typer.Typer()


def _length(flag: str, text: str) -> Any:
    return typer.Option(
        flag,
        help=f"{text} in mm, or with a unit: 50mm, 3m.",
        parser=options.length_mm,
        metavar="LENGTH",
    )


def _camera(name: str | None, lengths: dict[str, float | int | None]) -> "Camera":
    """A known camera with some of its lengths changed, or one from its lengths alone."""
    from plenofir.camera.rays import camera_of, load_camera

    lengths_given = {key: value for key, value in lengths.items() if value is not None}
    if name is None:
        needed = ("focal_length", "lens_focal_length", "lens_pitch", "pixel")
        missing = [options.typed(key) for key in needed if key not in lengths_given]
        if missing:
            raise InputError(
                f"give --camera, or {', '.join(missing)} too: a camera needs these lengths"
            )
    base = None if name is None else load_camera(name)
    return camera_of(base, lengths_given)


def _print(result: "Design") -> None:
    model = result.model
    rows = [[f.text, f"{f.value:.6g}", f.unit] for f in result.figures if f.value is not None]
    print_table(
        ["figure", "", "unit"],
        rows,
        title=f"{model.camera.name}, M = {model.micro_image_size}",
        left=("figure", "unit"),
        width=90,
    )
    heads = ["a", "distance", "near", "far", "micro lens", "pixel / M", "disparity", "error"]
    cells = [
        [
            str(p.a),
            *(f"{value:.5g}" for value in (p.distance_mm, p.near_mm, p.far_mm)),
            *(f"{value:.4g}" for value in (p.lens_sample_mm, p.pixel_sample_mm)),
            f"{round(p.disparity_px, 9) + 0.0:.4g}",
            f"{p.depth_error_mm:.4g}",
        ]
        for p in result.planes
    ]
    far = "infinity" if result.far_mm == inf else f"{result.far_mm:g} mm"
    print_table(
        heads,
        cells,
        title=f"slices from {result.near_mm:g} mm to {far}; mm, disparity in pixels for G = "
        f"{result.gap}, error of the distance for {result.disparity_error_px:g} pixels",
        width=100,
    )
    focused_planes = [(p.a, p.focused) for p in result.planes if p.focused is not None]
    if focused_planes:
        print_table(
            ["a", "v", "B", "lens type", "blur / px", "resolved / mm"],
            [[str(a), *(f"{v:.4g}" for v in asdict(p).values())] for a, p in focused_planes],
            title="virtual depth v, box of B samples, the sharpest type of micro lens, its blur on "
            "the sensor, width on the object of what the slice resolves",
        )
    unknown = len(result.figures) - len(rows)
    if unknown:
        camera = model.camera
        facts = {
            "pupil": camera.main_lens.entrance_pupil_diameter_mm,
            "columns": camera.sensor.columns,
            "rows": camera.sensor.rows,
        }
        needed = ", ".join(options.typed(name) for name, value in facts.items() if value is None)
        typer.echo(f"left out: {unknown} figures, which follow from {needed}")
    for near, far_end in result.gaps_mm:
        typer.echo(f"not covered: {near:.1f} to {far_end:.1f} mm")
    for warning in result.warnings:
        typer.echo(f"note: {warning}")


@dataclass(frozen=True)
class _Lenses:
    """Lengths that take the place of the camera's."""

    focal_length: Annotated[float | None, _length("--focal-length", "Main lens, f_U")] = None
    exit_pupil: Annotated[
        float | None,
        _length(
            "--exit-pupil",
            "Exit pupil from the micro lenses (inf if telecentric)",
        ),
    ] = None
    pupil: Annotated[float | None, _length("--pupil", "Diameter of the entrance pupil")] = None
    lens_focal_length: Annotated[
        float | None, _length("--lens-focal-length", "Micro lenses, f_s")
    ] = None
    sensor_distance: Annotated[
        float | None,
        _length(
            "--sensor-distance",
            "Sensor from the micro lenses, b_s; f_s if not given, any other makes a focused camera",
        ),
    ] = None
    lens_pitch: Annotated[float | None, _length("--lens-pitch", "Micro lenses, p_M")] = None
    pixel: Annotated[float | None, _length("--pixel", "Pixel pitch, p_p")] = None
    columns: Annotated[int | None, typer.Option(help="Columns of the sensor.", min=1)] = None
    rows: Annotated[int | None, typer.Option(help="Rows of the sensor.", min=1)] = None


@dataclass(frozen=True)
class _Served:
    """The page with sliders."""

    page: Annotated[
        bool, typer.Option("--page", help="Open a page with sliders in the browser.")
    ] = False
    port: Annotated[
        int, typer.Option(help="TCP port of the page; 0 for any free one.", min=0, max=65535)
    ] = 0
    browser: Annotated[
        bool,
        typer.Option("--browser/--no-browser", help="Open the browser, or only print the address."),
    ] = True

    def check(self, output: Output) -> None:
        """Refuse options of the page without it, and others beside it."""
        for name, value in (
            ("json", output.as_json),
            ("csv", output.csv_file),
            ("plot", output.plot),
        ):
            if self.page and value:
                options.refuse_both("page", options.typed(name), "the page shows numbers and plots")
        options.require("port", "page", self.port > 0 and not self.page)
        options.require("no-browser", "page", not self.browser and not self.page)


@app.command()
@grouped
def design(
    *,
    camera: options.CameraIfGiven = None,
    near: Annotated[
        float | None,
        options.distance(
            "--near", "Nearest distance that matters in mm; that of the plane a = 2 if not given."
        ),
    ] = None,
    far: Annotated[
        float, options.distance("--far", "Farthest distance that matters in mm, or inf.")
    ] = inf,
    focus: options.Focus = inf,
    micro_image: options.MicroImageIfGiven = None,
    lenses: _Lenses,
    disparity_error: Annotated[
        float,
        options.number("--disparity-error", "Error of a disparity in pixels of the views."),
    ] = 0.1,
    output: Output,
    served: _Served,
) -> None:
    """Design a camera: everything that follows from its lenses, sensor and focus.

    Lengths that are given take the place of the camera's.
    """
    from plenofir.camera.design import design as design_of

    served.check(output)
    model = focused(_camera(camera, asdict(lenses)), focus, micro_image)
    check_plot_and_csv(output.plot, output.csv_file, *filter(None, [camera]))
    result = design_of(model, near, far, disparity_error_px=disparity_error)
    if served.page:
        from plenofir.commands.view import serve_page
        from plenofir.view.design import design_page

        serve_page(design_page(result, focus), served.port, served.browser)
        return

    def plot() -> "Figure":
        from plenofir.camera.design.plots import design_plot

        return design_plot(result)

    rows = [plane.row() for plane in result.planes]
    write_plot_and_csv(output.plot, plot, output.csv_file, rows)
    if output.as_json:
        print_json(result.content())
        return
    _print(result)
