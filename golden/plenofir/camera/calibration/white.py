# SPDX-License-Identifier: Apache-2.0
"""A white image with its grid: the lenses, their light, and the measurement of their centres."""

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.centroids import (
    CORE_HALF_WIDTH,
    HALF_WIDTH,
    Image32,
    Moments,
    core_brightness,
    matched_offsets,
    matching_scale,
    reach,
    response,
    smoothed,
    windowed_moments,
)
from plenofir.camera.calibration.grid import (
    Flags,
    Floats,
    Grid,
    Indices,
)
from plenofir.camera.calibration.lattice import no_grid, primitive_vectors
from plenofir.camera.calibration.light import (
    constant,
    divide_by_light,
    fitted_light,
)
from plenofir.camera.calibration.redrawn import redrawn
from plenofir.camera.calibration.robust import robust_fit
from plenofir.camera.calibration.shading import (
    extents,
    indices_within,
    outline,
    shading_at,
    unit_positions,
)

_SLOPE_LENSES = 8000
DARK = 0.02
# Flattened micro images darker or brighter than these shares of the usual brightness are left out.
DIMMEST, _BRIGHTEST = 0.25, 1.8
# A lens beside this many unlit ones is at the border of the image circle, which cuts it off.
_UNLIT_NEIGHBOURS = 3
# In pitches: it takes noise away, and leaves gaps between micro images dark.
_SMOOTH = 0.06
# Rounds before the last one only tell where the next one looks: a random part of the lenses does.
_ENOUGH_LENSES = 4000
MANY_LENSES = 400
# Micro images of more pixels are located by their borders, unless they are spots: those have a
# share of 0.9 or more, discs up to 0.3, those with a soft or sloped middle up to 0.5. Number of
# lenses that the share is taken of.
_LARGE_PITCH, _SPOTS_FROM, _BORDERS_OF = 8.0, 0.7, 400
# Lenses below this share of the usual brightness are unlit: what they show is their neighbours'
# light.
_UNLIT = 0.1
_PROBE = 0.18
# The dark level can only be found if the brightness of lenses varies by more than this share.
_EVEN_LIGHT = 0.15
# Prior standard deviation of how much darker the gaps are in cells of e times the area, as a share
# of the brightest lens.
_WIDER = 0.5
# Centroids are divided by the response, so noise would be multiplied by 50 and more.
_WEAKEST_RESPONSE = 0.02
_EVEN_BELOW, _TOLD_BELOW = 0.85, 0.95
# Share of the clipped level from which on gaps are bright: micro images touch.
_BRIGHT_GAP = 0.5
_FEWEST_TOLD, _LEAST_TOLD = 20, 0.15
# Smallest scale of the windows where distortion makes cells smaller.
_SMALLEST_CELL = 0.8
# The light of clipped micro images is found from their width: number of rounds, factor of
# brightness by which the growth is measured, least relative growth, and the most that a round
# changes of the light's logarithm where gaps are bright: noise made corners black there.
_RELIT, _BRIGHTER, _LEAST_WIDER, _MOST_RELIT = 3, 1.05, 0.01, 0.7
# Half width in pitches of the window in which their width is measured, and the share of the usual
# brightness above which they are redrawn with the usual brightness.
_AS_WIDE, _CLIPPED_ALIKE = 0.5, 0.6
# Lenses have half the weight where redrawn and true image differ by this many times the usual
# difference (at least by this share of the light), in a window of this half width in pitches.
_MISSED_USUALLY, _LEAST_MISSED, _AROUND = 2.5, 0.01, 0.65
# Micro images have an even middle if the small window responds to shifts less than with spots, by
# this share.
_EVEN_MIDDLE = 0.6


def enough(count: int) -> slice | Indices:
    """Indices of enough lenses: all, or a random part of many (with a fixed seed)."""
    if count <= _ENOUGH_LENSES:
        return slice(None)
    return np.random.default_rng(6).permutation(count)[:_ENOUGH_LENSES]


def repeat_edges(image: Image32, margin: int) -> None:
    """Fill the border of an image with the pixels at the edge of its inner part."""
    image[:margin], image[-margin:] = image[margin], image[-margin - 1]
    image[:, :margin] = image[:, margin : margin + 1]
    image[:, -margin:] = image[:, -margin - 1 : -margin]


class WhiteImage:
    """A white image and the grid of its lenses, as far as it is known."""

    def __init__(self, image: Image32, grid: Grid, clipped: float | None = None) -> None:
        self.image = image
        # Level at which many pixels clip.
        self.clipped = clipped
        self.shape = image.shape[0], image.shape[1]
        # The last pixel along y and x.
        self.end = np.array(self.shape) - 1.0
        self.grid = grid
        self.shading: Floats | None = None
        self.unsure_light: Floats = np.empty(0)  # Covariance of `shading`.
        # Level without light.
        self.dark = 0.0
        # Usual level of the gaps between lenses in the flattened image; 0 if they are dark.
        self.gap = 0.0
        # Whether micro images have an even middle with borders; None as long as it is not known.
        self.bordered: bool | None = None
        # By how many pixels a slope of the light of 1 a pixel moves places of small ones.
        self.spread: Floats = np.zeros(2)
        self._smooth: Image32 | None = None
        self._kept: dict[tuple[bool, float], Image32] = {}  # See `_smoothed`.
        # Relative standard errors of the grid's scale along y and x, from the inner slopes.
        self.stretch: Floats = np.zeros(2)
        # By axis: places without and with the correction for inner slopes.
        self._sloped: dict[int, tuple[Floats, Floats]] = {}
        # Windows of lenses at the border reach beyond it, where the edge pixels are repeated.
        self.margin = int(reach(1.1 * max(extents(grid)))) + 2
        self.raw = np.pad(image, self.margin, mode="edge")
        # Cache of `lenses` for one grid.
        self._listed_for = grid
        self._listed: dict[tuple[tuple[float, ...], ...], tuple[Indices, Indices, Floats]] = {}
        self.padded = self.raw
        # The flattened image drawn again, and the grid that it was drawn from.
        self.redrawn = self.raw
        self.drawn_grid: Grid | None = None
        self.missed = self.raw

    def windows(self) -> tuple[float, float]:
        """Pitch along y and x for windows, from the smallest cell of the image."""
        down, right = extents(self.grid)
        if self.grid.order > 1:
            corners = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]) * self.end
            cells = np.abs(np.linalg.det(self.grid.jacobian(self.grid.inverse(corners))))
            share = float(np.sqrt(cells.min() / abs(np.linalg.det(self.grid.vectors))))
            share = min(1.0, max(_SMALLEST_CELL, share))
            down, right = share * down, share * right
        return down, right

    def lenses(self, radius: float, margin: float) -> tuple[Indices, Indices, Floats]:
        """Lenses in a box of this half width around the middle, at least margin from the border."""
        middle = self.end / 2
        low = np.maximum(middle - radius, margin)
        high = np.minimum(middle + radius, self.end - margin)
        if (low >= high).any():
            raise no_grid("image too small for its micro images")
        box = tuple(low), tuple(high)
        if self._listed_for is not self.grid:
            self._listed_for, self._listed = self.grid, {}
        if box not in self._listed:
            t, s = indices_within(self.grid, outline(low, high))
            centres = self.grid.centres(t, s)
            inside = ((centres >= low) & (centres <= high)).all(axis=-1)
            self._listed[box] = t[inside], s[inside], centres[inside]
        return self._listed[box]

    def whole_lenses(self, radius: float) -> tuple[Indices, Indices, Floats]:
        """Lenses with whole micro images; if they are few, also those close to the border."""
        pitch = max(extents(self.grid))
        lenses = self.lenses(radius, 0.5 * pitch)
        if len(lenses[0]) > MANY_LENSES:
            lenses = self.lenses(radius, 0.65 * pitch + 1)
        return lenses

    def core(self, centres: Floats) -> Floats:
        """Brightness of the middle of micro images."""
        return core_brightness(self.padded, centres + self.margin, extents(self.grid))

    def measure(self, image: Image32, centres: Floats, share: float = 1.0) -> Floats:
        """Places of micro images around expected centres, in pixels, in a share of the window."""
        pitch = self.windows()
        places = centres + self.margin
        if self.large:
            smooth = self._smoothed(image, matching_scale(pitch))
            return centres + matched_offsets(smooth, places, pitch, share)
        moments = windowed_moments(image, places, pitch, share * HALF_WIDTH)
        factors = response(image, places, pitch, share * HALF_WIDTH)
        if factors.min() < _WEAKEST_RESPONSE:
            raise no_grid("nothing that repeats like micro images")
        offsets = moments.offsets
        if image is self.padded and share == 1.0:
            self.spread = np.median(moments.variances, axis=0) / factors
        if self.shading is not None:
            slope, unsure = self.inner_slope(image, centres, moments, factors)
            offsets = offsets - slope * moments.variances
            self.stretch = unsure / (self.end / 2)
        largest = np.array(pitch) / 2
        return centres + np.clip(offsets / factors, -largest, largest)

    def _smoothed(self, image: Image32, scale: float) -> Image32:
        """The padded or the redrawn image smoothed, kept until the light changes."""
        key = image is self.padded, scale
        if key not in self._kept:
            self._kept[key] = smoothed(image, scale)
        return self._kept[key]

    @property
    def large(self) -> bool:
        """Whether micro images have borders, and are large enough to be located by them."""
        return bool(self.bordered) and min(extents(self.grid)) > _LARGE_PITCH

    def _has_borders(self, centres: Floats) -> bool:
        """Whether micro images have borders, which a small window over their middle misses."""
        few = np.random.default_rng(2).permutation(len(centres))[:_BORDERS_OF]
        places, pitch = centres[few] + self.margin, self.windows()
        # Both windows see the same share of a spot's shift; the small one sees little of a disc's.
        spreads, factors = [], []
        for width in (HALF_WIDTH, CORE_HALF_WIDTH):
            moments = windowed_moments(self.padded, places, pitch, width)
            spreads.append(np.median(moments.variances, axis=0))
            factors.append(response(self.padded, places, pitch, width))
        share = factors[1] * spreads[0] / (factors[0] * spreads[1])
        return bool(share.max() < _SPOTS_FROM)

    def inner_slope(
        self, image: Image32, centres: Floats, moments: Moments, factors: Floats
    ) -> tuple[Floats, Floats]:
        """Slope of the light within micro images that the shading does not account for.

        Result: the slope in each micro image along y and x, and the standard error in pixels that
        the correction adds to places at the border of the image.
        """
        # Light falls off with the angle to the axis, so micro images far from the middle are a
        # little brighter on one side, which moves their centroids but not their borders. A small
        # window over the middle, which does not reach the borders, measures the slope. It is radial
        # from the axis, so the slope along y depends on y only, and along x on x. It cannot be
        # measured on spots, which have no even middle.
        pitch = self.windows()
        few = np.random.default_rng(2).permutation(len(centres))[:_SLOPE_LENSES]
        places = centres[few] + self.margin
        core = windowed_moments(image, places, pitch, CORE_HALF_WIDTH)
        core_factors = response(image, places, pitch, CORE_HALF_WIDTH)
        # The place d and the slope g show in both windows: offset = factor d + variance g.
        spread, core_spread = (np.median(m.variances, axis=0) for m in (moments, core))
        difference = factors * core_spread - core_factors * spread
        result, errors = np.zeros_like(centres), self.stretch * self.end / 2
        if image is self.padded:
            self._sloped, errors = {}, np.zeros(2)
        far = unit_positions(centres, self.shape)
        for axis in (0, 1):
            if difference[axis] < _EVEN_MIDDLE * factors[axis] * core_spread[axis]:
                continue
            slope = (
                factors[axis] * core.offsets[:, axis]
                - core_factors[axis] * (moments.offsets[few, axis])
            )
            slope = (slope / difference[axis])[:, np.newaxis]
            terms = np.stack([far[few, axis], np.ones(len(slope))], axis=1)
            coefficients, weights, _ = robust_fit(terms, slope, 1e-9)
            # Drop the constant term: on the axis the slope is 0; a constant is a sampling artefact.
            result[:, axis] = far[:, axis] * coefficients[0, 0]
            # The correction is measured on noisy pixels, so it adds to the scatter of centroids.
            place = moments.offsets[few, axis, np.newaxis] / factors[axis]
            moved = place - slope * spread[axis] / factors[axis]
            if image is self.padded:
                self._sloped[axis] = place, moved
            elif axis in self._sloped:
                # Only the scatter that redrawn micro images do not have.
                place, moved = (
                    a - b for a, b in zip((place, moved), self._sloped[axis], strict=True)
                )
            alone, both = (robust_fit(terms, part, 1e-9)[2] for part in (place, moved))
            inverse = np.linalg.pinv((terms * weights[:, np.newaxis]).T @ terms)
            errors[axis] = np.sqrt(max(0.0, both**2 - alone**2) * inverse[0, 0])
        return result, errors

    def lit(self, t: Indices, s: Indices, centres: Floats) -> Flags:
        """Lenses whose centroids are worth measuring."""
        level = self.core(centres)
        if self.shading is None:
            return np.asarray(level > DARK * float(np.percentile(level, 95)))
        usual = float(np.median(level[level > DIMMEST * float(np.percentile(level, 80))]))
        lit = (level > DIMMEST * usual) & (level < _BRIGHTEST * usual)
        # Count unlit neighbours; lenses beyond the image count as lit.
        states = np.ones(np.array([np.ptp(t), np.ptp(s)]) + 3)
        places = t - t.min() + 1, s - s.min() + 1
        states[places] = level > DIMMEST * usual
        unlit = 8 - (ndimage.uniform_filter(states, 3, mode="nearest") * 9 - states)[places]
        inner = lit & (unlit < _UNLIT_NEIGHBOURS - 0.5)
        return np.asarray(inner if inner.sum() >= max(25, 0.4 * lit.sum()) else lit)

    def flatten(self) -> None:
        """Fit the smooth part of the brightness, and divide the image by it."""
        _, _, centres = self.whole_lenses(max(self.shape))
        centres = centres[enough(len(centres))]
        self.dark = self.base()
        places, probes = centres, np.zeros(len(centres))
        pitch = extents(self.grid)
        width = CORE_HALF_WIDTH
        if self.large:
            # In large micro images the slope of the light is measured too.
            moves = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) * _PROBE * min(pitch)
            places = (centres[:, np.newaxis] + moves).reshape(-1, 2)
            probes = np.tile([0.0, 1.0, 1.0, 1.0, 1.0], len(centres))
            width = _PROBE
        level = core_brightness(self.raw, places + self.margin, pitch, width) - self.dark
        lit = level > DARK * np.percentile(level, 95)
        if not lit.any():
            raise no_grid("micro images no brighter than the gaps between them")
        bright = places[lit]
        if self.clipped is not None:
            # The light cannot be measured on clipped ones.
            unclipped = lit & (level < _TOLD_BELOW * (self.clipped - self.dark))
            lit = unclipped if unclipped.sum() > max(_FEWEST_TOLD, _LEAST_TOLD * lit.sum()) else lit
        self.shading, self.unsure_light = fitted_light(
            places[lit], level[lit], probes[lit], self.shape
        )
        self.divide(bright)
        if self.bordered is None:
            self.bordered = self._has_borders(centres)
        if self.clipped is not None:
            for _ in range(_RELIT):
                self.relight(centres)

    def divide(self, places: Floats) -> None:
        """Divide the image by its light, which is 1 at the brightest of some places."""
        if self.shading is None:
            return
        self.shading = self.shading - constant(np.log(self.light(places).max()), self.shading)
        if self.padded is self.raw:
            self.padded = np.empty_like(self.raw)
        self._kept = {}
        inner = self.padded[self.margin : -self.margin, self.margin : -self.margin]
        divide_by_light(self.image, self.dark, self.shading, inner)
        if self.clipped is not None:
            # Clipped micro images are flat; divided by the light they would be sloped. Cut off at a
            # lower level, all are flat again, those that were not clipped included.
            gap = (self._between(places) - self.dark) / np.maximum(self.light(places), DARK)
            top, usual = self.clipped - self.dark, float(np.median(gap))
            self.gap = min(usual, top) if usual > _BRIGHT_GAP * top else 0.0
            np.minimum(inner, self.cut, out=inner)
        repeat_edges(self.padded, self.margin)
        self.redraw()

    @property
    def cut(self) -> np.float32:
        """Level at which the flattened image is cut off where many pixels clip."""
        top = np.inf if self.clipped is None else self.clipped - self.dark
        # Above the gaps, which are bright where micro images touch.
        return np.float32(self.gap + _EVEN_BELOW * (top - self.gap))

    def _between(self, centres: Floats) -> Floats:
        """Brightness of the gaps beside lenses."""
        part = 2 if self.grid.layout == "rectangular" else 3
        places = centres + primitive_vectors(self.grid).sum(axis=0) / part
        smooth = self.smooth()
        return np.asarray(ndimage.map_coordinates(smooth, places.T, order=1, mode="nearest"))

    def light(self, centres: Floats) -> Floats:
        """Smooth part of the brightness as it was fitted."""
        return (
            np.ones(len(centres))
            if self.shading is None
            else shading_at(self.shading, centres, self.shape)
        )

    def relight(self, centres: Floats) -> None:
        """Correct the light by the width of clipped micro images, which grows with their light."""
        if self.shading is None:
            return
        centres = centres[self.core(centres) > DIMMEST * self.cut]
        brighter = np.minimum(np.float32(_BRIGHTER) * self.padded, self.cut)
        measured, drawn, more = (
            np.log(np.maximum(level, DARK * self.cut))
            for level in (
                core_brightness(image, centres + self.margin, extents(self.grid), _AS_WIDE)
                for image in (self.padded, self.redrawn, brighter)
            )
        )
        wider = float(np.median(more - measured)) / np.log(_BRIGHTER)
        if len(centres) < _FEWEST_TOLD or wider < _LEAST_WIDER:
            return
        before = self.light(centres)
        level = before * np.exp((measured - drawn) / wider)
        shading, unsure = fitted_light(centres, level, np.zeros(len(centres)), self.shape)
        change = float(np.ptp(np.log(shading_at(shading, centres, self.shape) / before)))
        if self.gap == 0 or change < _MOST_RELIT:
            self.shading, self.unsure_light = shading, unsure
            self.divide(centres)

    def redraw(self) -> None:
        """Draw the flattened image again at the centres found."""
        from scipy.spatial import cKDTree

        pitch = max(extents(self.grid))
        t, s = indices_within(self.grid, outline(np.full(2, -pitch), self.end + pitch))
        centres = self.grid.centres(t, s).reshape(-1, 2)
        centres = centres[((centres > -pitch) & (centres < self.end + pitch)).all(axis=1)]
        inside = ((centres >= 0) & (centres <= self.end)).all(axis=1)
        level = self.core(centres[inside])
        level = level / float(np.median(level[level > DIMMEST * np.percentile(level, 80)]))
        level = np.where(level > _UNLIT, np.minimum(level, _BRIGHTEST), 0.0)
        if self.clipped is not None:  # the brightness of clipped pixels is unknown
            level = np.where(level > _CLIPPED_ALIKE, 1.0, level)
        # Lenses beyond the border get the brightness of the nearest.
        level = level[cKDTree(centres[inside]).query(centres)[1]]
        inner = ((centres > pitch / 2) & (centres < self.end - pitch / 2)).all(axis=1)
        self.redrawn = redrawn(
            self.padded, centres + self.margin, level, inner & (level > DIMMEST), pitch
        )
        np.minimum(self.redrawn, self.cut, out=self.redrawn)
        repeat_edges(self.redrawn, self.margin)
        self.missed = np.abs(self.padded - self.redrawn)
        self.drawn_grid = self.grid

    def as_drawn(self, centres: Floats) -> Floats:
        """Weights of lenses: lower if they or their neighbours look different from the redrawn."""
        around, light = (
            core_brightness(image, centres + self.margin, extents(self.grid), _AROUND)
            for image in (self.missed, self.redrawn)
        )
        usual = max(_MISSED_USUALLY * float(np.median(around)), _LEAST_MISSED * float(light.max()))
        return np.asarray(1 / (1 + (around / usual) ** 4))

    def smooth(self) -> Image32:
        """The image smoothed a little against noise."""
        if self._smooth is None:
            self._smooth = smoothed(self.image, _SMOOTH * min(extents(self.grid)))
        return self._smooth

    def base(self) -> float:
        """Dark level: brightness of the gaps, extrapolated to lenses without light."""
        t, s, centres = self.whole_lenses(max(self.shape))
        few = enough(len(centres))
        t, s, centres = t[few], s[few], centres[few]
        core = ndimage.map_coordinates(self.smooth(), centres.T, order=1, mode="nearest")
        gap = self._between(centres)
        low, middle, high = np.percentile(core, [10, 50, 90])
        if high - low < _EVEN_LIGHT * middle:
            return 0.0
        # If gaps are wider where lenses are darker, that must not be taken for a dark level.
        cells = np.abs(np.linalg.det(self.grid.jacobian(self.grid.lattice(t, s))))
        wider = np.log(cells / np.median(cells))
        share = core / high
        terms = np.stack([np.ones_like(core), share, share * wider], axis=-1).astype(np.float64)
        _, weights, scatter = robust_fit(terms, gap[:, np.newaxis], 1e-6 * float(high))
        precisions = np.diag([0.0, 0.0, (scatter / (_WIDER * float(high))) ** 2])
        weighted = terms * weights[:, np.newaxis]
        level = np.linalg.lstsq(weighted.T @ terms + precisions, weighted.T @ gap, rcond=None)[0]
        # The gap between lenses is at most as bright as an unlit lens.
        darkest = min(float(np.percentile(gap, 5)), float(core.min()))
        return float(np.clip(level[0], 0.0, max(0.0, darkest)))
