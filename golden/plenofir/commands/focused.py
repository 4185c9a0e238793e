# SPDX-License-Identifier: Apache-2.0
"""Focused cameras in commands: their calibration, and the pictures and depth of their captures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from plenofir.commands import options
from plenofir.commands.console import note, print_lines, progress_bar
from plenofir.commands.rasters import MAPS
from plenofir.commands.results import publish, save
from plenofir.ground.errors import InputError
from plenofir.ground.files import Results, check_folder

if TYPE_CHECKING:
    from plenofir.camera.calibration import Calibration
    from plenofir.camera.captures.prepare import Prepared
    from plenofir.camera.focused import DepthScale, FocusedCapture, FocusedDepth
    from plenofir.camera.rays import RayModel
    from plenofir.camera.recognise import Hints
    from plenofir.commands.groups import CameraData
    from plenofir.commands.looks import Look
    from plenofir.commands.results import Floats
    from plenofir.ground.images import Image, Picture
    from plenofir.view import Page

Show = Callable[[int, int], None]
# Least probability of a depth that counts, and percentiles of the depths that are shown, from - to.
_SURE, _SHARE = 0.5, (3, 97)
# Planes this near in pixels of parallax between micro images look the same; most of them in a page.
_ALIKE, _PLANES = 0.15, 9
STANDARD = "is not for a capture of a focused camera"
# 1 / v that a calibration has while its types are searched: on the side of Galilean cameras.
_ANY = 0.3
# Virtual depth of the picture that the exposure is taken from where types are sharp at infinity.
_MIDDLE = 4.0


CalibOfCapture = Annotated[
    str | None,
    typer.Option(help="Calibration file (plenofir calibrate); the picture is then a raw capture."),
]


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
            DepthScale,
            calibration_of_gaps,
            focused_capture,
            moved_to_agree,
            read_vendor_grid,
            types_by_sharpness,
        )
        from plenofir.ground.images import read_picture

        def captured(scene: "Picture", name: str, known: "Calibration") -> "FocusedCapture":
            ready = prepared(scene, known, CaptureHints(bayer, "off"), where=name)
            return focused_capture(ready, name)

        if self.grid is not None:
            shape = white.pixels.shape[0], white.pixels.shape[1]
            calibration = read_vendor_grid(self.grid).calibration(shape)
            calibration, (down, right) = moved_to_agree(
                calibration, partial(captured, white, where)
            )
            if down or right:
                note(
                    f"{where}: micro images agree where the grid of {self.grid} lies {down:.2f} "
                    f"pixels lower and {right:.2f} to the right: moved there"
                )
            return calibration
        assert self.lens_types is not None
        model = _model(camera)
        # One file for both: without a white image, gaps between micro images give the grid.
        if self.lens_types.exists() and self.lens_types.samefile(where):
            order = order_of_mosaic(white, bayer, where)
            calibration = calibration_of_gaps(grey_of(white.pixels, order, white.full_scale), where)
        else:
            calibration = of_white()
        # Hexagonal grids have three types, as far as cameras are known; one that is named tells.
        count, sharpest = (1 if calibration.grid.layout == "rectangular" else 3), None
        if model is not None:
            sharpest = DepthScale(model).sharpest()
            count = len(sharpest)
        side = _ANY if sharpest is None else sum(sharpest) / count
        any_type = LensTypes(pattern=(0,), sharpest=(side,))
        capture = captured(
            read_picture(self.lens_types, as_stored=True),
            str(self.lens_types),
            calibration.model_copy(update={"lens_types": any_type}),
        )
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
    headings = "micro lenses", ""
    texts = types.described(calibration.grid.lens_pitch)
    return [f"{name:<13} {text}" for name, text in zip(headings, texts, strict=True)]


def decoded_focused(
    ready: "Prepared", micro_image: int | None, where: str
) -> "tuple[Picture, Image, int]":
    """The aligned raw image of a focused camera, types of its samples' lenses, and M."""
    from plenofir.camera.focused import focused_capture, focused_raster

    raster = focused_raster(focused_capture(ready, where), micro_image)
    picture = ready.picture._replace(pixels=raster.pixels, mosaic=None, neutral=None)
    gamma = ready.picture.gamma or 1.0
    return picture._replace(gamma=gamma, orientation=1), raster.lenses, raster.m


@dataclass(frozen=True)
class OfCapture:
    """A raw capture instead of an aligned raw image."""

    calib: CalibOfCapture = None

    def opened(
        self, path: str, hints: "Hints", camera: "CameraData", exposed: str, gamma: float | None
    ) -> "FocusedField | None":
        """The capture of a focused camera; None for any other picture."""
        return opened(Path(path), hints._replace(calib=self.calib), camera, exposed, gamma)


@dataclass(frozen=True)
class AtDepth(OfCapture):
    """A raw capture, and planes of a focused camera."""

    virtual_depth: Annotated[
        list[str] | None,
        typer.Option(
            "--virtual-depth",
            "-v",
            metavar="V",
            help="Focused cameras: virtual depth of the plane (stack: planes, FIRST:LAST:STEP) "
            "instead of -a.",
        ),
    ] = None


@dataclass(frozen=True, eq=False)
class FocusedField:
    """A capture of a focused camera, and how its pictures are shown."""

    capture: "FocusedCapture"
    scale: "DepthScale"
    look: "Look"
    notes: tuple[str, ...]

    def upright(self, inverse: "Floats | float", unit: int) -> "Image":
        """The picture at 1 / v, one or one for each place; `unit` as `refocused` has it."""
        from plenofir.ground.images import upright

        image = self.capture.refocused(inverse, unit)
        return upright(self.capture.picture._replace(pixels=image, mosaic=None)).pixels

    def shown(self, inverse: "Floats | float") -> "Picture":
        """The picture at 1 / v, one or one for each place, as it is looked at."""
        return self.look(self.upright(inverse, self.look.unit))

    def planes(self, texts: list[str] | None) -> "list[tuple[float, float]]":
        """Virtual depths of an option, and 1 / v between micro images."""
        if not texts:
            raise InputError(
                "is missing; a focused camera's planes are given by it", where="virtual_depth"
            )
        depths = options.focus_settings(texts, 1, rounded=False, where="virtual_depth")
        return [(float(v), self.scale.inverse(float(v))) for v in depths]

    def about(self, inverse: float | None = None) -> bytes:
        """XMP of a picture."""
        from plenofir.camera.description import description_of

        pitch = self.capture.pitch
        a = None if inverse is None else Fraction(1 / (inverse * pitch)).limit_denominator(10**6)
        return description_of(round(pitch), a, self.scale.model)

    def place(self, depth: float, inverse: float) -> str:
        """A plane, for people."""
        from plenofir.camera.rays import State

        distances = self.scale.distances(inverse)
        if distances is None or distances.state() != State.REAL:
            return f"v = {depth:.4g}"
        return f"v = {depth:.4g}, {float(distances.mm):.0f} mm"


def opened(
    path: Path, hints: "Hints", camera: "CameraData", exposed: str, gamma: float | None
) -> FocusedField | None:
    """The capture of a focused camera by its calibration; None for any other picture."""
    if hints.calib is None:
        return None
    from plenofir.camera.calibration import load_calibration

    calibration = load_calibration(hints.calib)
    if calibration.lens_types is None:
        return None
    from plenofir.camera.captures.prepare import CaptureHints, prepared
    from plenofir.camera.exposure import exposure
    from plenofir.camera.focused import DepthScale, focused_capture
    from plenofir.commands.looks import look_of
    from plenofir.ground.images import read_picture

    if hints.crop is not None:
        raise InputError("is not for captures of focused cameras", where="crop")
    scale = DepthScale(_model(camera))
    ready = prepared(
        read_picture(path, as_stored=True),
        calibration,
        CaptureHints(hints.bayer, hints.white_balance, hints.roi),
        dark=read_picture(hints.dark, as_stored=True) if hints.dark else None,
        where=str(path),
    )
    capture = focused_capture(ready, str(path))
    middle = sum(calibration.lens_types.sharpest) / len(calibration.lens_types.sharpest)
    # Bright and dark are those of any plane.
    soft = capture.refocused(middle or 1 / _MIDDLE, step=capture.pitch / 2)
    gamma_of = capture.picture.gamma or 1.0
    field = capture.picture._replace(pixels=soft, gamma=gamma_of, mosaic=None, neutral=None)
    asked = None if exposed == "off" and gamma is None else exposure(field, 1, exposed, gamma)
    return FocusedField(capture, scale, look_of(field, asked), ready.notes)


def refocus_to(
    field: FocusedField, texts: list[str] | None, path: Path, used: Mapping[str, object]
) -> None:
    """Write the picture at a virtual depth; `used` are options of standard cameras."""
    options.refuse_used(used, STANDARD)
    planes = field.planes(texts)
    if len(planes) > 1:
        raise InputError(f"takes one plane, not {len(planes)}", where="virtual_depth")
    ((depth, inverse),) = planes
    with progress_bar("refocusing"):
        picture = field.shown(inverse)
    publish({path.name: picture._replace(xmp=field.about(inverse))}, path.parent)
    rows, columns = picture.pixels.shape[:2]
    text = f"{path}: {field.place(depth, inverse)}, {columns} x {rows} pixels"
    print_lines(*field.notes, text, field.look.words())


def sweep(
    field: FocusedField,
    texts: list[str] | None,
    folder: Path,
    used: Mapping[str, object],
    *,
    everywhere: bool,
) -> None:
    """Write the pictures at virtual depths, and one that is sharp everywhere.

    `used`: options of standard cameras.
    """
    from plenofir.camera.focused import search_depth

    options.refuse_used(used, STANDARD)
    check_folder(folder, str(folder))
    planes = field.planes(texts)
    with progress_bar("refocusing") as show, Results(folder) as results:
        for number, (depth, inverse) in enumerate(planes, 1):
            picture = field.shown(inverse)._replace(xmp=field.about(inverse))
            save(results, f"refocused_{number:0{len(str(len(planes)))}}_v{depth:.6g}.png", picture)
            show(number, len(planes))
        if everywhere:
            depths = search_depth(field.capture, progress=show)
            save(results, "all_in_focus.png", sharp(field, depths))
    print_lines(*field.notes, f"{folder}: {len(planes)} slices", field.look.words())


def sharp(field: FocusedField, depth: "FocusedDepth") -> "Picture":
    """The picture that takes each place at its own depth, from the types that are sharp there."""
    from plenofir.camera.focused.capture import STEP

    inverse = depth.at(field.capture.shape(), STEP)
    return field.shown(inverse)._replace(xmp=field.about())


class Maps(NamedTuple):
    """Depth of a capture, upright."""

    virtual: "Floats"  # nan where it is not sure
    mm: "Floats | None"  # nan also where it is no distance; None without a camera
    confidence: "Floats"

    def picture(self) -> "Image":
        """Depth in colours, in mm where the camera is known."""
        from plenofir.camera.depth_picture import depth_picture

        return depth_picture(self.virtual, "v") if self.mm is None else depth_picture(self.mm, "mm")

    def save(self, results: Results) -> None:
        """Write the maps."""
        import numpy as np

        save(results, "virtual_depth.npy", self.virtual)
        if self.mm is not None:
            save(results, f"{MAPS['mm']}.npy", self.mm)
        save(results, "confidence.png", np.rint(255 * self.confidence).astype(np.uint8))
        save(results, "depth.png", self.picture())

    def words(self) -> str:
        """How much is known, and from where to where, for people."""
        import numpy as np

        sure = ~np.isnan(self.virtual)
        text = f"depth of {100 * sure.mean():.1f} % of the places"
        if sure.any():
            # A few wrong matches would stretch the range.
            first, last = np.percentile(self.virtual[sure], [5, 95])
            text += f", v = {first:.2f} to {last:.2f}"
            if self.mm is not None and np.isfinite(self.mm).any():
                first, last = np.nanpercentile(self.mm, [5, 95])
                text += f", {first:.0f} to {last:.0f} mm"
        return text


def maps_of(field: FocusedField, depth: "FocusedDepth", least: float) -> Maps:
    """Maps of depth, unknown where it is less sure than `least`."""
    import numpy as np

    from plenofir.ground.orientation import turned

    way = field.capture.picture.orientation
    confidence = turned(depth.confidence, way)
    inverse = np.where(confidence >= least, turned(depth.inverse, way), np.nan)
    distances = field.scale.distances(inverse)
    return Maps(field.scale.depth(inverse), None if distances is None else distances.mm, confidence)


def depth_maps(
    field: FocusedField,
    ends: tuple[float | None, float | None],
    least: float,
    folder: Path,
    used: Mapping[str, object],
) -> None:
    """Write maps of depth, unknown where it is less sure than `least`.

    `ends`: virtual depths to search from - to; `used`: options of standard cameras.
    """
    from plenofir.camera.focused import search_depth

    options.refuse_used(used, STANDARD)
    search = None
    if ends != (None, None):
        near, far = ends
        if near is None or far is None:
            raise InputError("give both of --near and --far for a focused camera")
        first, last = sorted((field.scale.inverse(near, "near"), field.scale.inverse(far, "far")))
        if first * last < 0 or first == last:
            raise InputError("--near and --far must lie apart on one side of the micro lenses")
        search = first, last
    with progress_bar("matching") as show:
        maps = maps_of(field, search_depth(field.capture, search, show), least)
    with Results(folder) as results:
        maps.save(results)
    print_lines(*field.notes, f"{folder}: {maps.words()}")


def slices_between(field: FocusedField, depth: "FocusedDepth", most: int) -> list[float]:
    """1 / v of planes over the depths of a capture, from far to near, at most so many."""
    import numpy as np

    sure = depth.inverse[depth.confidence >= _SURE]
    # A capture without texture gets a picture as well.
    low, high = np.percentile(sure if sure.size else depth.inverse, _SHARE)
    count = int(min(most, max(1, (high - low) * field.capture.pitch // _ALIKE)))
    if count == 1:
        return [float(low + high) / 2]
    return [float(one) for one in np.linspace(low, high, count)]


def page_of(field: FocusedField, title: str) -> "Page":
    """The page on which a slider refocuses a capture; depth is searched when it is first needed."""
    from plenofir.camera.focused import search_depth
    from plenofir.ground.images import eight_bits
    from plenofir.view import focused_page

    depth = cache(lambda: search_depth(field.capture))
    return focused_page(
        field.capture,
        field.scale,
        field.look.field,
        title=title,
        look=field.look.exposure,
        pictures={
            "sharp": lambda: eight_bits(sharp(field, depth()).pixels),
            "depth": lambda: maps_of(field, depth(), _SURE).picture(),
        },
    )


def picture_folder(field: FocusedField, folder: Path, show: Show) -> None:
    """Write planes, the picture that is sharp everywhere, and depth, to be looked at."""
    from plenofir.camera.focused import search_depth
    from plenofir.ground.images import eight_bits

    depth = search_depth(field.capture, progress=show)
    with Results(folder) as results:
        save(results, "all_in_focus.png", eight_bits(sharp(field, depth).pixels))
        for number, inverse in enumerate(slices_between(field, depth, _PLANES), 1):
            v = float(field.scale.depth(inverse))
            save(
                results, f"refocused_{number}_v{v:.3f}.png", eight_bits(field.shown(inverse).pixels)
            )
        save(results, "depth.png", maps_of(field, depth, _SURE).picture())
