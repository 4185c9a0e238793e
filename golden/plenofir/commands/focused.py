# SPDX-License-Identifier: Apache-2.0
"""Focused cameras in commands: their calibration, and the pictures and depth of their captures."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands import options
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.camera.calibration import Calibration
    from plenofir.camera.rays import RayModel
    from plenofir.commands.groups import CameraData
    from plenofir.ground.images import Picture

# 1 / v that a calibration has while its types are searched: on the side of Galilean cameras.
_ANY = 0.3


@dataclass(frozen=True)
class FocusedOptions:
    """Calibration of focused cameras."""

    lens_types: Annotated[
        Path | None,
        typer.Option(
            "--lens-types",
            metavar="CAPTURE",
            help="The camera is a focused one: capture of fine texture from near to far, which "
            "tells the types of micro lenses apart; the same file as the white image where there "
            "is none.",
        ),
    ] = None
    grid: Annotated[
        Path | None,
        typer.Option(
            "--grid",
            metavar="XML",
            help="Calibration of the maker (Raytrix .xml) instead: any capture stands for the "
            "white image.",
        ),
    ] = None

    @property
    def is_set(self) -> bool:
        """Whether the camera is a focused one."""
        return self.lens_types is not None or self.grid is not None

    def check(self, *, pupil: bool) -> None:
        """Refuse what cannot be combined."""
        if self.grid is not None and self.lens_types is not None:
            options.refuse_both("grid", "--lens-types")
        if pupil and self.is_set:
            options.refuse_both("reversed_lens", "--lens-types or --grid")

    def calibration(
        self,
        white: "Picture",
        where: str,
        bayer: str | None,
        camera: "CameraData",
        of_white: "Callable[[], Calibration]",
    ) -> "Calibration":
        """The calibration with its lens types; `of_white` makes one of the white image."""
        from plenofir.camera.calibration.types_of_lenses import LensTypes
        from plenofir.camera.captures.colours import grey_of, order_of_mosaic
        from plenofir.camera.captures.prepare import CaptureHints, prepared
        from plenofir.camera.focused import (
            calibration_of_gaps,
            focused_capture,
            read_vendor_grid,
            types_by_sharpness,
            types_of_camera,
        )
        from plenofir.ground.images import read_picture

        shape = white.pixels.shape[0], white.pixels.shape[1]
        if self.grid is not None:
            return read_vendor_grid(self.grid).calibration(shape)
        assert self.lens_types is not None
        model = _model(camera)
        if self.lens_types.exists() and self.lens_types.samefile(where):
            order = order_of_mosaic(white, bayer, where)
            calibration = calibration_of_gaps(grey_of(white.pixels, order, white.full_scale), where)
        else:
            calibration = of_white()
        count, sharpest = (1 if calibration.grid.layout == "rectangular" else 3), None
        if model is not None:
            sharpest = types_of_camera(model, calibration.grid.lens_pitch)
            count = len(sharpest)
        side = _ANY if sharpest is None else sum(sharpest) / count
        any_type = LensTypes(pattern=(0,), sharpest=(side,))
        ready = prepared(
            read_picture(self.lens_types, as_stored=True),
            calibration.model_copy(update={"lens_types": any_type}),
            CaptureHints(bayer),
            where=str(self.lens_types),
        )
        capture = focused_capture(ready, str(self.lens_types))
        types = types_by_sharpness(capture, sharpest, count, str(self.lens_types))
        return calibration.model_copy(update={"lens_types": types})


def _model(camera: "CameraData") -> "RayModel | None":
    """Ray model of a focused camera, if one was named."""
    from plenofir.camera.rays import RayModel, load_camera

    if camera.camera is None:
        return None
    described = load_camera(camera.camera)
    if described.micro_lenses.standard:
        raise InputError(
            "is a standard camera; give one with micro_lenses.sensor_distance_mm",
            where=camera.camera,
        )
    # M does not matter here.
    return RayModel.focused(described, camera.focus, 2)


def type_lines(calibration: "Calibration") -> list[str]:
    """Lines about a focused camera's lens types; none for a standard camera."""
    types = calibration.lens_types
    if types is None:
        return []
    depths = ", ".join(f"{1 / x:.3g}" if x else "inf" for x in types.sharpest)
    kinds = "1 type" if len(types.pattern) == 1 else f"{len(types.pattern)} types"
    return [f"micro lenses  {kinds}, sharpest at v = {depths}"]
