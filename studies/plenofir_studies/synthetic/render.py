# SPDX-License-Identifier: Apache-2.0
"""A synthetic plenoptic camera: textured planes in front of a camera of the ray model.

Each pixel looks along the chief ray from its place in the micro image through the centre of its
micro lens and the main lens (Eqs. 3.21-3.28). A plane's texture is averaged beforehand over what
a pixel sees of it: the pixel's width and the micro lens's width, each thrown onto the plane, which
in the paraxial model is the same everywhere. Nearer planes cover farther ones.

Micro image centres are true to the exit pupil: rays leave it, so the micro images' pitch is the
micro lenses' times 1 + b_s / d_A'.

Of a focused camera each type of micro lens throws its own width onto the plane, by the thin lens
equation: a ray through its rim is bent by 1 / b_s - 1 / f_s times the rim's height.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.grid import Floats, Grid, Indices, Layout
from plenofir.camera.calibration.shading import pixel_positions
from plenofir.camera.calibration.types_of_lenses import usual_order
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image
from plenofir_studies.synthetic.pattern import Form, aperture, regular_grid

# Rays of a block are held for each layer and view; whole pictures would need gigabytes.
_BLOCK_PIXELS = 1 << 19


@dataclass(frozen=True)
class TexturedPlane:
    """A flat picture in front of the camera, facing it.

    Attributes
    ----------
    texture
        Shape (rows, columns) or (rows, columns, 3), uint8 or floats from 0 to 1.
    distance_mm
        From the micro lenses.
    width_mm
        Width; the height follows.
    centre_mm
        (y, x) of its middle from the optical axis, y down, x to the right in the picture.
    tilt
        (y, x): by how many mm it is farther away for each mm down and to the right.
    coverage
        Share of each of the texture's pixels that is there, (rows, columns), from 0 to 1; None for
        all of it.
    """

    texture: Image | Floats
    distance_mm: float
    width_mm: float
    centre_mm: tuple[float, float] = (0.0, 0.0)
    tilt: tuple[float, float] = (0.0, 0.0)
    coverage: Floats | None = None


@dataclass(frozen=True)
class Capture:
    """What the synthetic camera gives.

    Attributes
    ----------
    raw
        Raw capture, uint8 or uint16.
    white
        White image of the same camera, grey.
    dark
        Dark frame.
    grid
        True micro image centres.
    """

    raw: Image
    white: Image
    dark: Image
    grid: Grid
    model: RayModel


def micro_image_pitch(model: RayModel) -> float:
    """Pitch of the micro images in pixels: p_M (1 + b_s / d_A') / p_p.

    Result in pixels.
    """
    pitch = model.camera.micro_lenses.pitch_mm
    return float(model.micro_image_centre(pitch)) / model.camera.sensor.pixel_pitch_mm


def with_pitch(model: RayModel, pitch_px: float) -> RayModel:
    """The same camera with a sensor that gives micro images another pitch.

    `pitch_px`: pitch of the micro images in pixels. Result: the camera with another pixel pitch,
    which changes where its refocused planes lie. Raises `InputError` if it is not positive.
    """
    if not 0 < pitch_px < np.inf:
        raise InputError(f"a pitch of {pitch_px} pixels is not possible; it must be positive")
    old = model.camera.sensor.pixel_pitch_mm
    sensor = model.camera.sensor.model_copy(
        update={"pixel_pitch_mm": old * micro_image_pitch(model) / pitch_px}
    )
    camera = model.camera.model_copy(update={"sensor": sensor})
    return RayModel(camera, model.extension, model.micro_image_size)


def field_of_view(model: RayModel, distance_mm: float, lenses: float) -> float:
    """Width of what some micro lenses see in the central view at a distance.

    `distance_mm`: from the micro lenses. Result in mm.
    """
    scale, _ = _plane_scales(model, distance_mm)
    return abs(scale) * lenses * model.camera.micro_lenses.pitch_mm


def _plane_scales(model: RayModel, distance_mm: float) -> tuple[float, float]:
    """Position on a plane for each mm of micro lens position and for each pixel of offset."""
    from_lens = model.image_distance_mm + model.camera.main_lens.principal_plane_separation_mm
    z = distance_mm - from_lens
    slope_s, height_s = model.object_ray(0.0, 1.0)
    slope_i, height_i = model.object_ray(1.0, 0.0)
    return float(slope_s * z + height_s), float(slope_i * z + height_i)


def box_kernel(width: float) -> Floats:
    """Weights of a moving mean over a width that need not be a whole number."""
    if width <= 1:
        return np.ones(1)
    side = int(np.ceil((width - 1) / 2))
    kernel = np.ones(2 * side + 1)
    kernel[[0, -1]] = (width - (2 * side - 1)) / 2
    return np.asarray(kernel / kernel.sum())


class _Layer:
    """A plane ready to be looked at."""

    # `blur`: side of what is averaged in mm on the micro lenses; a pixel's view of it if None.
    def __init__(self, model: RayModel, plane: TexturedPlane, blur: float | None = None) -> None:
        texture = np.asarray(plane.texture)
        if texture.ndim not in (2, 3) or 0 in texture.shape:
            raise InputError(
                f"a texture has shape (rows, columns) or (rows, columns, 3), not {texture.shape}"
            )
        colours = texture.astype(np.float64)
        if texture.dtype.kind == "u":
            colours *= 1 / ((1 << 8 * texture.itemsize) - 1)
        colours = colours[:, :, np.newaxis] if colours.ndim == 2 else colours
        self.scale_s, self.scale_i = _plane_scales(model, plane.distance_mm)
        self.slope_s, self.slope_i = (float(model.object_ray(*one)[0]) for one in ((0, 1), (1, 0)))
        self.plane = plane
        self.step = plane.width_mm / texture.shape[1]
        lens = model.camera.main_lens
        z = plane.distance_mm - model.image_distance_mm - lens.principal_plane_separation_mm
        if z <= 0 or plane.width_mm <= 0:
            raise InputError(
                f"a plane at {plane.distance_mm} mm, {plane.width_mm} mm wide, cannot be "
                "seen; it must lie in front of the main lens and have a width"
            )
        # Where the ray hits if its place on the micro lens changes, and its slope by what a micro
        # lens bends it that is not focused at infinity.
        array = model.camera.micro_lenses
        bent = 1 / array.spacing_mm - 1 / np.array(array.focal_lengths_mm)
        across = 1 - z / lens.focal_length_mm - bent * self.scale_i / model.pixel_slope
        widths = [
            (abs(one) * array.pitch_mm / self.step, abs(self.scale_i) / self.step) for one in across
        ]
        if blur is not None:
            widths = [(abs(self.scale_s) * blur / self.step, 0.0)]
        margin = int(np.ceil(max(map(sum, widths)))) + 2
        coverage = np.ones(texture.shape[:2]) if plane.coverage is None else plane.coverage
        if coverage.shape != texture.shape[:2]:
            raise InputError(
                f"the coverage has shape {coverage.shape}, its texture {texture.shape[:2]}"
            )
        canvas = np.dstack([colours * coverage[..., np.newaxis], coverage])
        canvas = np.pad(canvas, ((margin, margin), (margin, margin), (0, 0)))
        self.canvases = [_averaged(canvas, pair) for pair in widths]
        middle = (np.array(texture.shape[:2]) - 1) / 2 + margin
        self.origin = middle - np.array(plane.centre_mm) / self.step

    def hit(self, position_mm: Floats, offset_px: Floats) -> tuple[Floats, Floats]:
        """Where rays meet the plane: (y, x) in mm as the picture has it, and the distance."""
        # The main lens inverts the picture, so the texture is inverted too.
        flat = -(self.scale_s * position_mm + self.scale_i * offset_px)
        tilt, middle = np.array(self.plane.tilt), np.array(self.plane.centre_mm)
        if not tilt.any():
            return flat, np.full(flat.shape[:-1], self.plane.distance_mm)
        slope = -(self.slope_s * position_mm + self.slope_i * offset_px)
        deeper = ((flat - middle) @ tilt) / (1 - slope @ tilt)
        return flat + slope * deeper[..., np.newaxis], self.plane.distance_mm + deeper

    def texture_at(self, place_mm: Floats, lens_type: Indices | int = 0) -> Floats:
        """Colours times coverage, and coverage, at places; shape (..., channels + 1).

        `lens_type`: of the micro lens that sees each place, shape (...).
        """
        points = np.moveaxis(place_mm / self.step + self.origin, -1, 0)
        types = np.broadcast_to(lens_type, points.shape[1:])
        picture = np.empty((*types.shape, self.canvases[0].shape[2]))
        for number, canvas in enumerate(self.canvases):
            chosen = types == number
            for k in range(canvas.shape[2]):
                picture[chosen, k] = ndimage.map_coordinates(
                    canvas[:, :, k], points[:, chosen], order=1, mode="constant"
                )
        return picture


def _averaged(canvas: Floats, widths: tuple[float, float]) -> Floats:
    """A canvas averaged over squares of two widths in pixels."""
    for width in widths:
        for axis in (0, 1):
            canvas = ndimage.convolve1d(canvas, box_kernel(width), axis=axis, mode="constant")
    return canvas


def render(
    model: RayModel,
    planes: list[TexturedPlane],
    lenses: tuple[int, int],
    *,
    grid: Grid | None = None,
    rotation_degrees: float = 0.0,
    layout: Layout = "rectangular",
    offset: tuple[float, float] = (0.0, 0.0),
    form: Form = "disc",
    radius: float = 0.5,
    softness: float = 0.5,
    shading: float = 0.0,
    level: float = 0.9,
    noise: float = 0.0,
    dark_level: float = 0.0,
    bits: int = 16,
    seed: int = 0,
) -> Capture:
    """Take a picture with the synthetic camera.

    Parameters
    ----------
    model
        The camera (`with_pitch` for micro images of another pitch).
    planes
        Objects in front of it.
    lenses
        Rows and columns of micro lenses that the sensor covers.
    grid
        Micro image centres; regular ones of the camera's pitch if None. Its pitch should be the
        camera's.
    rotation_degrees, layout, offset
        Of that regular grid, see `plenofir_studies.synthetic.pattern.regular_grid`.
    form, radius, softness
        Shape of a micro image, radius in pitches, see `aperture` of `pattern`;
        a square of radius 0.5 or more fills the sensor.
    shading
        Share of light lost in the corners besides cos^4.
    level
        Level of white as a share of full scale.
    noise
        Standard deviation of the noise as a share of white.
    dark_level
        Level without light as a share of full scale.
    bits
        8 or 16.
    """
    pitch = micro_image_pitch(model)
    shape = int(np.ceil(lenses[0] * pitch)), int(np.ceil(lenses[1] * pitch))
    if grid is None:
        # An even number of lenses is centred between two of them.
        half = tuple(0.0 if n % 2 else pitch / 2 for n in lenses)
        grid = regular_grid(
            shape,
            pitch,
            rotation_degrees=rotation_degrees,
            layout=layout,
            offset=(half[0] + offset[0], half[1] + offset[1]),
        )
    layers = [_Layer(model, p) for p in sorted(planes, key=lambda p: -p.distance_mm)]
    channels = max((layer.canvases[0].shape[2] - 1 for layer in layers), default=1)
    rng = np.random.default_rng(seed)
    pixel = model.camera.sensor.pixel_pitch_mm
    stretch = 1 + model.camera.micro_lenses.spacing_mm / model.exit_pupil_mm
    middle = (np.array(shape) - 1) / 2
    raw = np.empty((*shape, channels))
    white = np.empty(shape)
    block = max(1, _BLOCK_PIXELS // shape[1])
    for start in range(0, shape[0], block):
        part = slice(start, min(start + block, shape[0]))
        places = pixel_positions(part, shape[1])
        t, s, from_centre = grid.nearest(places)
        types = usual_order(grid, t, s, len(model.camera.micro_lenses.focal_lengths_mm))
        position = (places - from_centre - middle) * pixel / stretch
        slope = model.chief_ray_slope(from_centre, position)
        light = aperture(from_centre, radius * pitch, form, softness)
        light /= (1 + (slope**2).sum(axis=-1)) ** 2
        light *= 1 - shading * (((places - middle) / middle) ** 2).sum(axis=-1) / 2
        picture = np.zeros((*light.shape, channels))
        for layer in layers:
            layer_picture = layer.texture_at(layer.hit(position, from_centre)[0], types)
            picture = layer_picture[..., :-1] + (1 - layer_picture[..., -1:]) * picture
        raw[part] = picture * light[..., np.newaxis]
        white[part] = light

    full = (1 << bits) - 1

    def exposed(values: Floats) -> Image:
        values = values + rng.normal(0, noise, values.shape) if noise else values
        levels = np.rint((values * level + dark_level) * full)
        return np.clip(levels, 0, full).astype(np.uint8 if bits == 8 else np.uint16)

    return Capture(
        raw=exposed(raw if channels > 1 else raw[:, :, 0]),
        white=exposed(white),
        dark=exposed(np.zeros(shape)),
        grid=grid,
        model=model,
    )


def pinhole_view(
    model: RayModel, planes: list[TexturedPlane], lenses: tuple[int, int], samples: int = 1
) -> tuple[Floats, Floats]:
    """What a pinhole in the middle of the main lens sees: the truth behind a `render`ed capture.

    `samples` for each micro lens in each dimension: 1 for its central view, M for all that its
    pixels could tell. Result: colours from 0 to 1, all of it in focus, shape (rows, columns[, 3]),
    and distances in mm from the micro lenses, nan where there is nothing.
    """
    step = model.camera.micro_lenses.pitch_mm / samples
    layers = [_Layer(model, p, step) for p in sorted(planes, key=lambda p: -p.distance_mm)]
    places = [(np.arange(n * samples) - (n * samples - 1) / 2) * step for n in lenses]
    position = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1)
    channels = max((layer.canvases[0].shape[2] - 1 for layer in layers), default=1)
    picture = np.zeros((*position.shape[:2], channels))
    distance = np.full(position.shape[:2], np.nan)
    for layer in layers:
        place, mm = layer.hit(position, np.zeros_like(position))
        layer_picture = layer.texture_at(place)
        picture = layer_picture[..., :-1] + (1 - layer_picture[..., -1:]) * picture
        distance = np.where(layer_picture[..., -1] > 0.5, mm, distance)
    return picture if channels > 1 else picture[..., 0], distance
