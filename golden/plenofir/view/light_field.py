# SPDX-License-Identifier: Apache-2.0
"""The page of a light field: its views, depth and distances for the browser."""

import json
import zlib
from collections.abc import Callable, Mapping
from functools import cached_property
from math import ceil, floor
from threading import Lock
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from plenofir.camera.exposure import Exposure, exposure
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture
from plenofir.ground.viridis import VIRIDIS_BASE64
from plenofir.view.mosaic import packed_views
from plenofir.view.page import Page, Part, PartRequest
from plenofir.view.views_and_depth import (
    LEAST_GPU_LAYERS,
    LEAST_GPU_TEXTURE,
    Depth,
    LightField,
    reduced,
)

if TYPE_CHECKING:
    from plenofir.camera.lightfield.disparity import Disparity
    from plenofir.camera.rays import MicroscopeModel, RayModel
    from plenofir.view.live import Live


# Entries of the table of distances for each step of the grid.
_FINE = 8
# The table is JSON within the page: a wide range with a large M would make it huge.
_MAX_ENTRIES = 4000
# Default focus settings of the slider, and of the table of distances.
_RANGE, _TABLE = (-1.0, 2.0), (-2.0, 4.0)
# Share of an export for the picture in focus everywhere.
_IN_FOCUS = 0.2

_SCRIPTS = (
    "shaders.js",
    "renderer.js",
    "planes.js",
    "bench.js",
    "tone.js",
    "panel.js",
    "source.js",
    "state.js",
    "tilt.js",
    "pane.js",
    "film.js",
    "controls.js",
    "main.js",
)


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


def _planes(model: "RayModel | MicroscopeModel", search: tuple[float, float]) -> Mapping[str, Any]:
    """Where planes lie, for JSON: a table of distances, or heights of a microscope."""
    from plenofir.camera.rays import MicroscopeModel

    if not isinstance(model, MicroscopeModel):
        return {
            "table": plane_table(model, search),
            "text": f"{model.camera.name}, extension {model.extension_mm:.4f} mm; "
            "distances from the micro lenses, by the ray model.",
        }
    ends = np.array([0.0, 1.0])
    far, near = model.depth_of_field_um(ends)
    heights = {"centre": model.height_um(ends), "near": near, "far": far}
    # Heights grow evenly with a; a single pixel has no end.
    lines = {
        name: [float(z[0]), float(z[1] - z[0])] if np.isfinite(z).all() else None
        for name, z in heights.items()
    }
    text = f"{model.microscope.name}; heights over the plane in focus, towards the objective."
    return {"heights": lines, "text": text}


def exposures(
    picture: Picture, micro_image_size: int, look: Exposure | None = None
) -> dict[str, Any]:
    """Exposures for JSON: initial, auto, and as stored; with the largest value."""
    auto = exposure(picture, micro_image_size)
    stored = exposure(picture, micro_image_size, "off")
    settings: dict[str, Any] = {"start": look or auto, "auto": auto, "stored": stored}
    described = {name: each._asdict() for name, each in settings.items()}
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
        in_focus: Image | None,
    ) -> None:
        self.field, self.search, self.progress = field, search, progress
        self.disparity, self._in_focus = disparity, in_focus
        # Several requests come at once.
        self._lock = Lock()

    def views(self, request: PartRequest) -> Part:
        """See `views_part`."""
        return views_part(self.field, request.binning)

    @cached_property
    def _depth_values(self) -> Depth:
        return self.field.depth(self.search, self.progress, self.disparity)

    @cached_property
    def _depth(self) -> Part:
        low, high = self._depth_values.range
        depth = self._depth_values.settings
        if not self.field.is_rectangle:
            depth = self._depth_values.in_pictures(self.field.micro_image_size)
        values = np.rint((depth - low) / (high - low) * 65535).astype("<u2")
        # The last bit tells which are sure.
        values = values & ~np.uint16(1) | self._depth_values.sure
        facts = {"size": "x".join(str(n) for n in values.shape), "range": f"{low:.6f},{high:.6f}"}
        return Part(zlib.compress(values.tobytes(), 6), "application/octet-stream", facts)

    def depth(self, _: PartRequest) -> Part:
        """Depth map: 16 bit from the first to the last focus setting of its range, deflated.

        Odd values are sure.
        """
        with self._lock:
            return self._depth

    def in_focus(self, binning: int) -> Image:
        """The picture that is in focus everywhere, at the scale of pages."""
        with self._lock:
            if self._in_focus is None:
                self._in_focus = self.field.in_focus(self._depth_values)
        return reduced(self._in_focus, binning)

    def everywhere(self, request: PartRequest) -> Part:
        """`in_focus`, samples of 16 bit with the low byte first."""
        picture = self.in_focus(request.binning * self.field.least_binning())
        content = picture.astype(picture.dtype.newbyteorder("<"), copy=False).tobytes()
        size = "x".join(str(n) for n in picture.shape[:2])
        return Part(content, "application/octet-stream", {"size": size})


def _described(
    field: LightField,
    picture: Picture,
    title: str,
    search: tuple[float, float] | None,
    model: "RayModel | MicroscopeModel | None",
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
        "colours": VIRIDIS_BASE64,
        "planes": None,
        "notes": notes,
    }
    if model is not None:
        described["planes"] = _planes(model, search or _TABLE)
    return described


def light_field_page(
    raw: Image,
    micro_image_size: int,
    *,
    full_scale: int,
    title: str,
    search: tuple[float, float] | None = None,
    model: "RayModel | MicroscopeModel | None" = None,
    progress: Callable[[int, int], None] | None = None,
    gamma: float | None = None,
    look: Exposure | None = None,
    disparity: "Disparity | None" = None,
    in_focus: Image | None = None,
) -> Page:
    """Make the page of a light field, from a raw image (rows, columns[, 3]), uint8 or uint16.

    Views that are no square come as they are, shape (v, u, t, s[, 3]); M is the larger number.
    `full_scale` is the value of white, `gamma` that of the values, as in `Picture`; `look` is the
    exposure that the page starts with, auto if none is given. `search` is the first and last focus
    setting of the slider and of the search for depth; without it the slider goes from -1 to 2, and
    the search as far as it needs. `disparity`, `in_focus`: a
    map, and the picture sharp everywhere (values of `raw`), that are there already. Without a
    camera's model, focused as it was, there are no distances. `progress` is called with the numbers
    of depth candidates done and of all.
    """
    field = LightField(raw, micro_image_size)
    picture = Picture(raw, full_scale, gamma)
    described = _described(field, picture, title, search, model, look)
    content = _Content(field, search, progress, disparity, in_focus)
    parts: dict[str, Callable[[PartRequest], Part]] = {"views": content.views}
    if described["has_depth"]:
        parts |= {"depth": content.depth, "everywhere": content.everywhere}

    def packed(limit: int) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
        return _packed(field, described, content, limit)

    return Page("light_field.html", _SCRIPTS, described, parts, packed)


def live_page(
    live: "Live",
    *,
    title: str,
    search: tuple[float, float] | None = None,
    model: "RayModel | MicroscopeModel | None" = None,
    look: Exposure | None = None,
) -> Page:
    """Make the page of a source of frames; there is no depth, and nothing to export.

    The others are as in `light_field_page`.
    """
    first = live.first
    field = LightField(first.picture.pixels, live.micro_image_size)
    described = _described(field, first.picture, title, search, model, look)
    described |= {"has_depth": False, "live": True}

    def views(request: PartRequest) -> Part:
        return views_part(field, request.binning)

    def frame(request: PartRequest) -> Part:
        newest = live.newest(request.after)
        if newest is None:
            ended = {"ended": "1"} if live.ended else {}
            return Part(b"", "application/octet-stream", ended)
        facts = {"number": str(newest.number), "captured": f"{1000 * newest.captured:.0f}"}
        auto = exposure(newest.picture, live.micro_image_size)
        facts["levels"] = f"{auto.black:.3f},{auto.white:.3f},{auto.shoulder:.3f}"
        field = LightField(newest.picture.pixels, live.micro_image_size)
        return views_part(field, request.binning, facts)

    def packed(_: int) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
        raise InputError("--export cannot be combined with --source; it is for a picture")

    return Page("light_field.html", _SCRIPTS, described, {"views": views, "frame": frame}, packed)


def _packed(
    field: LightField, described: Mapping[str, Any], content: _Content, limit: int
) -> tuple[Mapping[str, Any], Mapping[str, Part]]:
    """Data of an export: views that fit every GPU with WebGL 2, within a size."""
    parts = {}
    binning = described["scale"]
    if described["has_depth"]:
        parts["depth"] = content.depth(PartRequest())
        share = int(_IN_FOCUS * (limit - len(parts["depth"].content)))
        parts["everywhere"] = _packed_picture(content, binning, share)
    room = limit - sum(len(part.content) for part in parts.values())
    while not _fits_every_gpu(field, binning):
        binning += 1
    while True:
        views = field.views(binning)
        mosaic = packed_views(views, room)
        if mosaic is not None:
            break
        if min(views.shape[2:4]) == 1:
            raise InputError("the light field does not fit; take a larger limit", where="limit")
        binning += 1
    rows, columns = field.size
    notes = [described["notes"][0], mosaic.words]
    if binning > 1:
        notes.append(f"Scaled down: {binning} x {binning} micro lenses are one.")
    changed = {
        "rows": -(-rows // binning),
        "columns": -(-columns // binning),
        "lens_rows": views.shape[2],
        "lens_columns": views.shape[3],
        "codes": mosaic.codes,
        "scale": binning,
        "notes": notes,
    }
    return {**described, **changed}, {"views": mosaic.part, **parts}


def _packed_picture(content: _Content, binning: int, limit: int) -> Part:
    """The picture in focus everywhere, scaled down until it fits."""
    picture = content.in_focus(binning)
    step = -(-max(picture.shape[:2]) // LEAST_GPU_TEXTURE)
    while (mosaic := packed_views(reduced(picture, step)[np.newaxis, np.newaxis], limit)) is None:
        if step >= min(picture.shape[:2]):
            raise InputError("the light field does not fit; take a larger limit", where="limit")
        step *= 2
    codes = {"codes": json.dumps(mosaic.codes)} if mosaic.codes else {}
    return mosaic.part._replace(facts={**mosaic.part.facts, **codes})


def _fits_every_gpu(field: LightField, binning: int) -> bool:
    rows, columns = (-(-n // binning) for n in (field.lens_rows, field.lens_columns))
    tiles = LEAST_GPU_TEXTURE // columns
    if tiles < 1 or rows > LEAST_GPU_TEXTURE:
        return False
    return bool(-(-(field.counts[0] * field.counts[1]) // tiles) <= LEAST_GPU_LAYERS)
