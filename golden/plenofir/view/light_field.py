# SPDX-License-Identifier: Apache-2.0
"""The page of a light field: its views, depth and distances for the browser."""

import base64
import zlib
from collections.abc import Callable, Mapping
from functools import cached_property
from math import ceil, floor
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from plenofir.camera.exposure import Exposure, exposure
from plenofir.camera.lightfield.any_field import is_rectangle
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture
from plenofir.view.mosaic import packed_views
from plenofir.view.page import Page, Part, Wanted

if TYPE_CHECKING:
    from plenofir.camera.lightfield.disparity import Disparity
    from plenofir.camera.rays import RayModel
    from plenofir.view.live import Live

Floats = npt.NDArray[np.float64]

# Most samples to send to a browser.
_LARGEST_BYTES = 1 << 30
# Most micro lenses of a depth map: a finer one takes long and shows no more.
_LENSES = 500_000
# Entries of the table of distances for each step of the grid.
_FINE = 8
_MAX_ENTRIES = 4000
# Default focus settings of the slider, and of the table of distances.
_RANGE, _TABLE = (-1.0, 2.0), (-2.0, 4.0)
# Guaranteed by WebGL 2.
_LEAST_GPU_TEXTURE, _LEAST_GPU_LAYERS = 2048, 256

_SCRIPTS = (
    "shaders.js",
    "renderer.js",
    "planes.js",
    "bench.js",
    "tone.js",
    "panel.js",
    "source.js",
    "state.js",
    "pane.js",
    "film.js",
    "controls.js",
    "main.js",
)


def _cut(raw: Image, m: int) -> Image:
    """Views of a raw image, shape (v, u, t, s[, 3]); 0 beyond its edges, for cut micro images."""
    rows, columns = (-(-n // m) for n in raw.shape[:2])
    if raw.shape[:2] != (rows * m, columns * m):
        whole = np.zeros((rows * m, columns * m, *raw.shape[2:]), raw.dtype)
        whole[: raw.shape[0], : raw.shape[1]] = raw
        raw = whole
    return np.asarray(np.moveaxis(raw.reshape(rows, m, columns, m, *raw.shape[2:]), (1, 3), (0, 1)))


class LightField:
    """A raw image (rows, columns[, 3]) cut into views, or views that are no square."""

    def __init__(self, pixels: Image, micro_image_size: int) -> None:
        self.micro_image_size = m = micro_image_size
        self.is_rectangle = is_rectangle(pixels)
        self._views = pixels if self.is_rectangle else _cut(pixels, m)
        # Rows and columns of views; first row and column of M x M, those in the middle.
        self.counts = self._views.shape[:2]
        self.first = tuple((m - count) // 2 for count in self.counts)
        self.lens_rows, self.lens_columns = self._views.shape[2:4]
        self.channels = self._views.shape[4] if self._views.ndim == 5 else 1
        # Of the picture, in pixels.
        self.size = pixels.shape[:2]
        if self.is_rectangle:
            self.size = self.lens_rows * m, self.lens_columns * m
        self.dtype, self.nbytes = pixels.dtype, pixels.nbytes

    def least_binning(self) -> int:
        """Least binning of micro lenses, in each direction, that keeps the data below the limit."""
        binning = 1
        while self.nbytes / binning**2 > _LARGEST_BYTES:
            binning += 1
        return binning

    def views(self, binning: int = 1) -> Image:
        """Views of (binned) micro lenses, shape (v, u, t, s[, 3]); 0 beyond the edges."""
        if binning == 1:
            return self._views
        rows, columns = (-(-n // binning) for n in (self.lens_rows, self.lens_columns))
        channels = self._views.shape[4:]
        found = np.zeros((*self.counts, rows, columns, *channels), self.dtype)
        # One after the other, to save memory for large images.
        for v, u in np.ndindex(*self.counts):
            view = self._views[v, u]
            whole = np.zeros((rows * binning, columns * binning, *channels), view.dtype)
            whole[: view.shape[0], : view.shape[1]] = view
            sums = np.zeros(found.shape[2:], np.uint32)
            for down, right in np.ndindex(binning, binning):
                sums += whole[down::binning, right::binning]
            found[v, u] = (sums + binning**2 // 2) // binning**2
        return found

    def depth(
        self,
        search: tuple[float, float] | None = None,
        progress: Callable[[int, int], None] | None = None,
        disparity: "Disparity | None" = None,
    ) -> tuple[Floats, tuple[float, float]]:
        """Focus setting of what each micro lens sees, shape (t, s) or coarser, and its range.

        By disparity, in a range that fits the picture if none is given; or by one that is there
        already. Where it is improbable, that of the surroundings, as in
        `plenofir.camera.lightfield.all_in_focus`.
        """
        from plenofir.camera.lightfield.disparity import search_views

        binning = max(1, ceil((self.lens_rows * self.lens_columns / _LENSES) ** 0.5))
        # The map is a texture too, whose size is limited.
        binning = max(binning, -(-max(self.lens_rows, self.lens_columns) // _LEAST_GPU_TEXTURE))
        if disparity is None:
            low, high = (None, None) if search is None else (end / binning for end in search)
            found = search_views(self.views(binning), smallest=low, largest=high, progress=progress)
            settings = found.disparity.settled() * binning
            search = found.search[0] * binning, found.search[1] * binning
        else:
            settings = disparity.settled()[::binning, ::binning]
        low, high = search or (float(settings.min()), float(settings.max()))
        return np.asarray(np.clip(settings, low, high)), (low, max(high, low + 1e-3))


def plane_table(model: "RayModel", search: tuple[float, float]) -> dict[str, Any]:
    """Distances over the focus setting, for JSON: numbers in mm, None without one, states.

    Entries lie on the grid of a = a'/M and evenly between its points.
    """
    m = model.micro_image_size
    step = 1 / (m * _FINE)
    while (search[1] - search[0]) / step > _MAX_ENTRIES:
        step *= 2
    first = floor(search[0] / step + 1e-9) * step
    a = first + step * np.arange(ceil((search[1] - first) / step - 1e-9) + 1)
    planes = model.planes(a)
    table: dict[str, Any] = {"first": first, "step": step}
    for name in ("centre", "near", "far"):
        distances = getattr(planes, name)
        mm = [None if np.isnan(x) else round(float(x), 4) for x in distances.mm]
        table[name] = {"mm": mm, "state": distances.states.tolist()}
    alpha = np.asarray(model.alpha(a))
    table["alpha"] = [float(x) if np.isfinite(x) else 0.0 for x in alpha]
    return table


def exposures(
    picture: Picture, micro_image_size: int, look: Exposure | None = None
) -> dict[str, Any]:
    """Exposures for JSON: initial, auto, and as stored; with the largest value."""
    auto = exposure(picture, micro_image_size)
    stored = exposure(picture, micro_image_size, "off")
    found: dict[str, Any] = {"start": look or auto, "auto": auto, "stored": stored}
    described = {name: each._asdict() for name, each in found.items()}
    return {**described, "largest": int(picture.pixels.max(initial=0))}


def views_part(
    field: LightField, binning: int, facts: Mapping[str, str] = MappingProxyType({})
) -> Part:
    """Views one after the other, samples of 16 bit with the low byte first."""
    views = field.views(binning * field.least_binning())
    content = views.astype(views.dtype.newbyteorder("<"), copy=False).tobytes()
    return Part(content, "application/octet-stream", facts)


class _Content:
    """Parts that the page of a light field requests."""

    def __init__(
        self,
        field: LightField,
        search: tuple[float, float] | None,
        progress: Callable[[int, int], None] | None,
        disparity: "Disparity | None",
    ) -> None:
        self.field, self.search, self.progress = field, search, progress
        self.disparity = disparity

    def views(self, wanted: Wanted) -> Part:
        """See `views_part`."""
        return views_part(self.field, wanted.binning)

    @cached_property
    def _depth(self) -> Part:
        depth, (low, high) = self.field.depth(self.search, self.progress, self.disparity)
        values = np.rint((depth - low) / (high - low) * 65535).astype("<u2")
        facts = {"size": "x".join(str(n) for n in values.shape), "range": f"{low:.6f},{high:.6f}"}
        return Part(zlib.compress(values.tobytes(), 6), "application/octet-stream", facts)

    def depth(self, _: Wanted) -> Part:
        """Depth map: 16 bit from the first to the last focus setting of its range, deflated."""
        return self._depth


def _colours() -> str:
    """The perceptually uniform colour map of depths: 256 RGB values in base64."""
    from matplotlib import colormaps

    rgba = colormaps["viridis"](np.arange(256), bytes=True)
    return base64.b64encode(np.ascontiguousarray(rgba[:, :3]).tobytes()).decode()


def _described(
    field: LightField,
    picture: Picture,
    title: str,
    search: tuple[float, float] | None,
    model: "RayModel | None",
    look: Exposure | None,
) -> dict[str, Any]:
    """Description of the page of a light field."""
    micro_image_size = field.micro_image_size
    low, high = search or _RANGE
    most = max(field.lens_rows, field.lens_columns)
    if not -most <= low < high <= most:
        raise InputError(f"{low:g} to {high:g} must rise, within -{most} to {most}", where="a")
    least = field.least_binning()
    rows, columns = field.size
    bits = 8 * field.dtype.itemsize
    notes = [f"{columns} x {rows} pixels, M = {micro_image_size}, {bits} bit."]
    if field.is_rectangle:
        notes = [
            f"{field.counts[1]} x {field.counts[0]} views of {field.lens_columns} x "
            f"{field.lens_rows} pixels, {bits} bit."
        ]
    if least > 1:
        notes.append(f"Scaled down: {least} x {least} micro lenses are one.")
    described: dict[str, Any] = {
        "title": title,
        "micro_image_size": micro_image_size,
        "rows": -(-rows // least),
        "columns": -(-columns // least),
        "lens_rows": -(-field.lens_rows // least),
        "lens_columns": -(-field.lens_columns // least),
        "channels": field.channels,
        "view_rows": field.counts[0],
        "view_columns": field.counts[1],
        "first_view": [field.first[1], field.first[0]],
        "bits": bits,
        "full_scale": picture.full_scale,
        "exposure": exposures(picture, micro_image_size, look),
        "scale": least,
        "range": [low, high],
        "has_depth": max(field.counts) > 1,
        "colours": _colours(),
        "planes": None,
        "notes": notes,
    }
    if model is not None:
        described["planes"] = {
            "table": plane_table(model, search or _TABLE),
            "text": f"{model.camera.name}, extension {model.extension_mm:.4f} mm; "
            "distances from the micro lenses, by the ray model.",
        }
    return described


def light_field_page(
    raw: Image,
    micro_image_size: int,
    *,
    full_scale: int,
    title: str,
    search: tuple[float, float] | None = None,
    model: "RayModel | None" = None,
    progress: Callable[[int, int], None] | None = None,
    gamma: float | None = None,
    look: Exposure | None = None,
    disparity: "Disparity | None" = None,
) -> Page:
    """Make the page of a light field, from a raw image (rows, columns[, 3]), uint8 or uint16.

    Views that are no square come as they are, shape (v, u, t, s[, 3]); M is the larger number.
    `full_scale` is the value of white, `gamma` that of the values, as in `Picture`; `look` is the
    exposure that the page starts with, auto if none is given. `search` is the first and last focus
    setting of the slider and of the search for depth; without it the slider goes from -1 to 2, and
    the search as far as it needs. `disparity`: one that is there already. Without a
    camera's model, focused as it was, there are no distances. `progress` is called with the numbers
    of depth candidates done and of all.
    """
    field = LightField(raw, micro_image_size)
    picture = Picture(raw, full_scale, gamma)
    described = _described(field, picture, title, search, model, look)
    content = _Content(field, search, progress, disparity)
    parts: dict[str, Callable[[Wanted], Part]] = {"views": content.views}
    if described["has_depth"]:
        parts["depth"] = content.depth

    def packed(limit: int) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
        return _packed(field, described, content, limit)

    return Page("light_field.html", _SCRIPTS, described, parts, packed)


def live_page(
    live: "Live",
    *,
    title: str,
    search: tuple[float, float] | None = None,
    model: "RayModel | None" = None,
    look: Exposure | None = None,
) -> Page:
    """Make the page of a source of frames; there is no depth, and nothing to export.

    The others are as in `light_field_page`.
    """
    first = live.first
    field = LightField(first.picture.pixels, live.micro_image_size)
    described = _described(field, first.picture, title, search, model, look)
    described |= {"has_depth": False, "live": True}

    def views(wanted: Wanted) -> Part:
        return views_part(field, wanted.binning)

    def frame(wanted: Wanted) -> Part:
        found = live.newest(wanted.after)
        if found is None:
            ended = {"ended": "1"} if live.ended else {}
            return Part(b"", "application/octet-stream", ended)
        facts = {"number": str(found.number), "captured": f"{1000 * found.captured:.0f}"}
        auto = exposure(found.picture, live.micro_image_size)
        facts["levels"] = f"{auto.black:.3f},{auto.white:.3f},{auto.shoulder:.3f}"
        field = LightField(found.picture.pixels, live.micro_image_size)
        return views_part(field, wanted.binning, facts)

    def packed(_: int) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
        raise InputError("--export cannot be combined with --source; it is for a picture")

    return Page("light_field.html", _SCRIPTS, described, {"views": views, "frame": frame}, packed)


def _packed(
    field: LightField, described: Mapping[str, Any], content: _Content, limit: int
) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
    """Data of an export: views that fit every GPU with WebGL 2, within a size."""
    made = {"depth": content.depth(Wanted())} if described["has_depth"] else {}
    room = limit - sum(len(part.content) for part in made.values())
    binning = described["scale"]
    while not _fits_every_gpu(field, binning):
        binning += 1
    while True:
        views = field.views(binning)
        found = packed_views(views, room)
        if found is not None:
            break
        if min(views.shape[2:4]) == 1:
            raise InputError("the light field does not fit; take a larger limit", where="limit")
        binning += 1
    rows, columns = field.size
    notes = [described["notes"][0], found.words]
    if binning > 1:
        notes.append(f"Scaled down: {binning} x {binning} micro lenses are one.")
    changed = {
        "rows": -(-rows // binning),
        "columns": -(-columns // binning),
        "lens_rows": views.shape[2],
        "lens_columns": views.shape[3],
        "codes": found.codes,
        "scale": binning,
        "notes": notes,
    }
    return {**described, **changed}, {"views": found.part, **made}


def _fits_every_gpu(field: LightField, binning: int) -> bool:
    rows, columns = (-(-n // binning) for n in (field.lens_rows, field.lens_columns))
    tiles = _LEAST_GPU_TEXTURE // columns
    if tiles < 1 or rows > _LEAST_GPU_TEXTURE:
        return False
    return bool(-(-(field.counts[0] * field.counts[1]) // tiles) <= _LEAST_GPU_LAYERS)
