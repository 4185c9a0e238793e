# SPDX-License-Identifier: Apache-2.0
"""Answers for views, for views side by side in one picture, and for rasters: axes put right."""

from collections.abc import Callable

import numpy as np

from plenofir.camera.lightfield.indexing import views as views_of
from plenofir.camera.recognise.axes import find_axes
from plenofir.camera.recognise.source import (
    Field,
    Finding,
    Hints,
    Kind,
    LightFieldSource,
    Progress,
)
from plenofir.camera.recognise.storage import Stored
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture
from plenofir.refocus import check_raw


def views_source(
    kind: Kind,
    stored: Stored,
    hints: Hints,
    counts: tuple[int, int],
    findings: tuple[Finding, ...] = (),
    advice: tuple[str, ...] = (),
    *,
    view: Callable[[int, int], Picture] | None = None,
    load: Callable[[Progress], Picture] | None = None,
) -> LightFieldSource:
    """The answer for views of any origin, their axes put right.

    `counts`: rows and columns as stored. `view`: one of them, by row and column; `load`: all of
    them, shape (v, u, t, s[, 3]); by default those of `stored`, whose axes are "vuyx".
    """
    at = view or (lambda v, u: stored.at((v, u)))
    axes = find_axes(at, counts, hints)
    loaded = load or stored.load
    rows, columns = axes.counts(counts)
    return LightFieldSource(
        kind,
        (*stored.findings, *findings, *axes.findings()),
        advice,
        rows if rows == columns else None,
        counts=(rows, columns),
        where=stored.where,
        views=lambda progress: axes.put_right(loaded(progress)),
    )


def mosaic_source(
    stored: Stored,
    hints: Hints,
    counts: tuple[int, int],
    findings: tuple[Finding, ...] = (),
    advice: tuple[str, ...] = (),
) -> LightFieldSource:
    """Views side by side in one picture, rows and columns of them."""
    picture = stored.load()
    rows, columns = picture.pixels.shape[:2]
    down, right = counts
    if rows % down or columns % right:
        raise InputError(
            f"{columns} x {rows} pixels are no multiple of {right if rows % down == 0 else down}, "
            f"as {right} x {down} views would be",
            where=stored.where,
        )
    tiles = picture.pixels.reshape(
        down, rows // down, right, columns // right, *picture.pixels.shape[2:]
    )
    images = np.moveaxis(tiles, 2, 1)
    text = f"{right} x {down} views of {columns // right} x {rows // down} pixels"
    return views_source(
        "mosaic of views",
        stored,
        hints,
        counts,
        (*findings, Finding("mosaic", text)),
        advice,
        view=lambda v, u: picture._replace(pixels=images[v, u]),
        load=lambda progress: picture._replace(pixels=images),
    )


def raster_source(
    stored: Stored, hints: Hints, m: int, *findings: Finding, advice: tuple[str, ...] = ()
) -> LightFieldSource:
    """Micro images of M x M pixels, their axes put right."""
    picture = stored.load()
    raw = check_raw(picture.pixels, m, where=stored.where)
    images: Image = views_of(raw, m)
    axes = find_axes(lambda v, u: picture._replace(pixels=images[v, u]), (m, m), hints, named=False)

    def field(progress: Progress) -> Field:
        if axes.as_stored():
            return Field(picture.like(raw), m)
        return Field(picture.like(axes.raster(raw, m)), m)

    return LightFieldSource(
        "aligned raster",
        (*stored.findings, *findings, *axes.findings()),
        advice,
        m,
        counts=(m, m),
        where=stored.where,
        raster=field,
    )
