# SPDX-License-Identifier: Apache-2.0
"""Methods for depth and for pictures in focus everywhere, measured against ground truth."""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from scipy import ndimage
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

from plenofir.camera.lightfield import FocalStack, all_in_focus, sub_aperture, views
from plenofir.camera.lightfield.disparity import Disparity, search_disparity
from plenofir.camera.lightfield.matching import RIGHT
from plenofir.ground.images import eight_bits
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import SURE, TEXTURE, confidence_level, depth_index
from plenofir_studies.absolute_differences import sad_disparity
from plenofir_studies.depth_scenes import (
    HCI_BORDER,
    LENSES,
    RAMP,
    RAMP_M,
    SCENES,
    Floats,
    M,
    Truth,
    hci_folders,
    hci_truth,
    ramp,
    rendered,
)
from plenofir_studies.depth_trials import NEAR_FOCUS, SIZE, TWIGS, trials
from plenofir_studies.depth_trials import M as TRIALS_M
from plenofir_studies.report_parts import Progress, Report, machine

RAMP_TEXTURES = "gravel", "grass", "brick", "astronaut"
RAMP_NOISE = 0.0, 0.01, 0.05
RAMP_STEPS = 1, 2
"""Pixels between slices of a ramp."""
BAD = (0.01, 0.03, 0.07)
"""Errors of a above which a pixel counts as bad: those of the HCI benchmark."""
_BORDER = 8
# Additional slices of depth from focus beyond the nearest and farthest object.
_SPARE = 3
_ENDS = (np.floor, np.nanmin), (np.ceil, np.nanmax)
# Radius of the window of a depth index.
_RADIUS = 2

Way = Callable[[Truth], Floats]
"""Gives a for each micro lens; takes of the truth what a user would have."""


def _stack(truth: Truth, step: int = 1) -> tuple[tuple[int, ...], FocalStack]:
    """Slices a number of pixels apart, from the farthest to the nearest object and three beyond."""
    low, high = (round_(f(truth.a) * truth.m / step) for round_, f in _ENDS)
    shifts = tuple(step * k for k in range(int(low) - _SPARE, int(high) + _SPARE + 1))
    return shifts, FocalStack(truth.raw, truth.m, [Fraction(k, truth.m) for k in shifts])


def by_depth_index(truth: Truth) -> Floats:
    """Depth from focus as in the VHDL: the sharpest slice, windows of 5 x 5 lenses."""
    shifts, stack = _stack(truth)
    return depth_index(stack, truth.m, _RADIUS).focus(shifts, truth.m)


def by_depth_between(truth: Truth) -> Floats:
    """Depth from focus as in the VHDL, between slices."""
    shifts, stack = _stack(truth)
    return depth_index(stack, truth.m, _RADIUS, shifts=shifts).focus(shifts, truth.m)


def by_disparity(truth: Truth) -> Floats:
    """What the commands do."""
    return searched_disparity(truth).pixels_per_view


def searched_disparity(truth: Truth) -> Disparity:
    """Disparity and confidence of a scene, in the range that is found."""
    return search_disparity(truth.raw, truth.m).disparity


def by_windows(truth: Truth) -> Floats:
    """Absolute differences in whole windows, as in the thesis, over the true range."""
    images, c = views(truth.raw, truth.m), truth.m // 2
    gaps = [gap for gap in range(-c, truth.m - c) if gap]
    others = [
        *((images[c + gap, c], (float(gap), 0.0)) for gap in gaps),
        *((images[c, c + gap], (0.0, float(gap))) for gap in gaps),
    ]
    low, high = (float(round_(f(truth.a))) for round_, f in _ENDS)
    return sad_disparity(images[c, c], others, search=(low, high))


WAYS: dict[str, Way] = {
    "disparity": by_disparity,
    "absolute differences, windows of 7 x 7": by_windows,
    "focus, depth index": by_depth_index,
    "focus, depth between slices": by_depth_between,
}
PRODUCT = "disparity"
"""The way that pictures are made with."""


@dataclass(frozen=True)
class Score:
    """Errors and time of a method on a scene."""

    bad: tuple[float, ...]  # share of pixels with an error above each of `BAD`
    mse: float  # mean square error of a, x 100
    seconds: float  # of processor time


def score(estimate: Floats, truth: Truth, seconds: float = 0.0, border: int = _BORDER) -> Score:
    """Compare depth with the truth, without borders."""
    part = (slice(border, -border),) * 2
    error = np.abs(estimate - truth.a)[part][np.isfinite(truth.a[part])]
    return Score(
        tuple(float((error > bound).mean()) for bound in BAD),
        100 * float((error**2).mean()),
        seconds,
    )


def _lens_spline(picture: Image, m: int) -> Floats:
    """Cubic splines through the values of micro lenses, from B-splines: taps a lens apart."""
    values = picture.astype(np.float64)
    for axis in (0, 1):
        for k in range(m):
            part = (slice(None),) * axis + (slice(k, None, m),)
            values[part] = ndimage.spline_filter1d(values[part], 3, axis, mode="mirror")
    return np.clip(values, 0, np.iinfo(picture.dtype).max)


def at_depth(truth: Truth, a: Floats, prefilter: bool = False, **how: Any) -> Floats:
    """Each pixel of the slices around its depth, blended; `how`: options of `refocus`."""
    m = truth.m
    places = [(np.arange(n * m) - (m - 1) / 2) / m for n in a.shape]
    grid = np.stack(np.meshgrid(*places, indexing="ij"))
    shifts = ndimage.map_coordinates(a, grid, order=1, mode="nearest") * m
    picture = np.zeros(truth.raw.shape)
    for k in range(int(np.floor(shifts.min())), int(np.ceil(shifts.max())) + 1):
        share = np.maximum(0, 1 - np.abs(shifts - k))
        if share.any():
            one = refocus(truth.raw, m, Fraction(k, m), border="normalise", **how)
            values = _lens_spline(one, m) if prefilter else one
            picture += share.reshape(*share.shape, *[1] * (picture.ndim - 2)) * values
    return picture


def _central_view(truth: Truth, _: Floats) -> Floats:
    m = truth.m
    view = sub_aperture(truth.raw, m, m // 2, m // 2).astype(np.float64)
    factors = (m, m, 1)[: view.ndim]
    return np.asarray(ndimage.zoom(view, factors, order=3, mode="nearest", grid_mode=True))


def _sharpest(truth: Truth, a: Floats) -> Image:
    shifts = range(int(np.floor(a.min() * truth.m)), int(np.ceil(a.max() * truth.m)) + 1)
    settings = [Fraction(k, truth.m) for k in shifts]
    stack = FocalStack(truth.raw, truth.m, settings, border="normalise")
    return depth_index(stack, truth.m).image


def _slices(interpolation: str | int, sharpen: str, prefilter: bool = False) -> "Sharp":
    return lambda truth, a: at_depth(
        truth, a, prefilter, interpolation=interpolation, sharpen=sharpen
    )


Sharp = Callable[[Truth, Floats], Floats | Image]
"""Makes a picture that is sharp everywhere, given a of each micro lens."""

PICTURES: dict[str, Sharp] = {
    "central view, cubic splines": _central_view,
    "sharpest of whole slices, as in VHDL": _sharpest,
    "slices at their depth, nearest, auto": _slices("nearest", "auto"),
    "linear": _slices("linear", "off"),
    "linear, b = 1/8": _slices("linear", "1/8"),
    "linear, b = 3/16": _slices("linear", "3/16"),
    "cubic, prefiltered, b = 1/8": _slices(3, "1/8", prefilter=True),
    "linear, b = 3/16, with the central view (taken)": lambda truth, a: all_in_focus(
        truth.raw, truth.m, a
    ),
}


@dataclass(frozen=True)
class Likeness:
    """Similarity of a picture to the truth."""

    psnr: float  # dB
    ssim: float
    detail: float  # mean gradient over that of the truth
    seconds: float  # of processor time, without the depth


def likeness(picture: Floats | Image, truth: Truth, seconds: float = 0.0) -> Likeness:
    """Compare a picture with the truth at full resolution, without borders."""
    if truth.picture is None:
        raise ValueError("no true picture")
    part = (slice(_BORDER * truth.m, -_BORDER * truth.m),) * 2
    light = np.clip(picture[part] / float(np.iinfo(truth.raw.dtype).max), 0, 1)
    want = truth.picture[part]

    def gradient(values: Floats) -> float:
        grey = values if values.ndim == 2 else values.mean(axis=2)
        return float(np.hypot(*np.gradient(grey)).mean())

    ssim = structural_similarity(  # type: ignore[no-untyped-call]
        want,
        light,
        data_range=1,
        channel_axis=2 if want.ndim == 3 else None,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
    )
    psnr = peak_signal_noise_ratio(want, light, data_range=1)  # type: ignore[no-untyped-call]
    return Likeness(float(psnr), float(ssim), gradient(light) / gradient(want), seconds)


def _timed(work: Callable[..., Any], *words: Any) -> tuple[Any, float]:
    """A result and its processor time in seconds."""
    start = time.process_time()
    result = work(*words)
    return result, time.process_time() - start


def _maps_picture(rows: Iterable[tuple[Truth, Floats]]) -> Figure:
    """Central view, truth and results of the scenes, in two columns."""
    maps = list(rows)
    lines = -(-len(maps) // 2)
    figure, axes = plt.subplots(
        lines, 6, figsize=(11, 1.65 * lines), constrained_layout=True, squeeze=False
    )
    for axis in axes.flat:
        axis.set_axis_off()
    for k, (truth, estimate) in enumerate(maps):
        low, high = np.nanmin(truth.a), np.nanmax(truth.a)
        places = axes[k % lines, 3 * (k // lines) : 3 * (k // lines) + 3]
        m = truth.m
        view = eight_bits(sub_aperture(truth.raw, m, m // 2, m // 2))
        for place, values in zip(places, (view, truth.a, estimate), strict=True):
            place.imshow(values, cmap="gray" if values is view else "viridis", vmin=low, vmax=high)
        places[0].images[0].set_clim(0, 255)
        places[0].set_title(f"{truth.name}: view", fontsize=8)
        places[1].set_title(f"truth, a {low:.2g} to {high:.2g}", fontsize=8)
        places[2].set_title("found", fontsize=8)
    return figure


def _means(report: Report, scores: Mapping[str, list[Score]]) -> None:
    rows = []
    for name, of_way in scores.items():
        shares = np.mean([s.bad for s in of_way], axis=0)
        mse, seconds = np.mean([(s.mse, s.seconds) for s in of_way], axis=0)
        rows.append([name, *(f"{100 * share:.1f} %" for share in shares), f"{mse:.2f}"])
        rows[-1].append(f"{seconds:.2f}")
    heads = [f"off by more than {BAD[0]:g}", *(f"{bound:g}" for bound in BAD[1:])]
    report.table(["way", *heads, "mean square error x 100", "processor s"], rows)


def _say_depth(report: Report, names: list[str], scores: Mapping[str, list[Score]]) -> None:
    _means(report, scores)
    report.say(f"Off by more than {BAD[-1]:g}, and mean square error x 100, by scene:")
    rows = [
        [name, *(f"{100 * s.bad[-1]:.1f} %, {s.mse:.2f}" for s in of_way)]
        for name, of_way in scores.items()
    ]
    report.table(["way", *names], rows)


def ramp_errors(truth: Truth, step: int) -> list[Floats]:
    """Errors of a on a ramp in units of the slices' step: index alone, weighted, between slices.

    Of micro images with texture (`SURE`) whose depth lies between the slices.
    """
    m = truth.m
    shifts, stack = _stack(truth, step)
    level = confidence_level(TEXTURE, m, _RADIUS, 1 if truth.raw.ndim == 2 else 3)
    alone = depth_index(stack, m, _RADIUS)
    index = depth_index(stack, m, _RADIUS, confidence=level, vote_radius=1, shifts=shifts)
    assert index.confidence is not None
    part = (slice(_BORDER, -_BORDER),) * 2
    judged = (np.isfinite(truth.a) & (index.confidence >= SURE))[part]
    weighed = np.array(shifts)[index.index] / m
    maps = alone.focus(shifts, m), weighed, index.focus(shifts, m)
    return [np.abs(a - truth.a)[part][judged] * m / step for a in maps]


def _say_ramps(report: Report) -> None:
    report.say(
        "### Depth between slices, on ramps",
        f"A plane with a texture whose a grows evenly from {RAMP[0]:g} to {RAMP[1]:g}, M = "
        f"{RAMP_M}, 8 bit, windows of 5 x 5 lenses. Errors of a in steps between slices, median "
        "and root mean square, of micro images with texture (confidence of 16 or more; their "
        "share). *Index*: the sharpest slice; *weighed*: with slices of whole a counted less; "
        "*between*: depth between slices.",
    )
    rows = []
    for texture in RAMP_TEXTURES:
        for noise in RAMP_NOISE:
            truth = ramp(texture, noise)
            inside = np.isfinite(truth.a)[_BORDER:-_BORDER, _BORDER:-_BORDER].sum()
            for step in RAMP_STEPS:
                errors = ramp_errors(truth, step)
                cells = [
                    f"{np.median(e):.2f}, {np.sqrt(np.mean(e**2)):.2f}" if e.size else "-"
                    for e in errors
                ]
                share = f"{errors[0].size / inside:.0%}"
                rows.append([texture, f"{noise:.0%}", f"{step}/{RAMP_M}", share, *cells])
    report.table(["texture", "noise", "step", "share", "index", "weighed", "between"], rows)


def rightness(disparity: Disparity, truth: Truth, border: int = _BORDER) -> tuple[Floats, Floats]:
    """Confidence of each pixel with truth, and 1 where it is right, 0 elsewhere."""
    part = (slice(border, -border),) * 2
    judged = np.isfinite(truth.a[part])
    right = np.abs(disparity.pixels_per_view - truth.a)[part][judged] <= RIGHT
    return disparity.confidence[part][judged], right.astype(np.float64)


def _say_trials(report: Report) -> list[tuple[Floats, Floats]]:
    """Hard light fields; result as of `rightness`."""
    report.say(
        "### Hard light fields",
        f"Drawn without the ray model, {SIZE} x {SIZE} micro lenses, M = {TRIALS_M}, 16 bit "
        "(`plenofir_studies.depth_trials`). *Planes*, *bars* (3 to 8 lenses wide): textured. "
        "*Ramp*: weak texture, a from -0.5 to 0.5. *Twigs*: four, three lenses wide, at a = "
        f"{', '.join(map(str, TWIGS))} before a wall at -0.3. *Tiles*: even squares of 8 lenses. "
        f"*In focus*: share of the pixels with |a| < {NEAR_FOCUS:g} that are off by more than "
        f"{BAD[-1]:g}. *Sure*: pixels with a confidence of 0.9; of these, those that are off by "
        "as much. *Windows*: absolute differences in windows of 7 x 7 lenses, over the true range.",
    )
    rows, sure = [], []
    for _, _, truth in trials():
        disparity, seconds = _timed(searched_disparity, truth)
        here, plain = score(disparity.pixels_per_view, truth), score(by_windows(truth), truth)
        confidence, right = rightness(disparity, truth)
        sure.append((confidence, right))
        part = (slice(_BORDER, -_BORDER),) * 2
        focused = np.abs(truth.a[part]).ravel() < NEAR_FOCUS
        certain = confidence >= 0.9
        rows.append(
            [
                truth.name,
                *(f"{100 * share:.1f} %" for share in here.bad),
                f"{here.mse:.2f}",
                f"{100 * (1 - right[focused].mean()):.1f} %" if focused.any() else "",
                f"{certain.mean():.0%}, {100 * (1 - right[certain].mean()):.1f} %",
                f"{seconds:.2f}",
                f"{100 * plain.bad[-1]:.1f} %, {plain.mse:.2f}",
            ]
        )
    heads = ["scene, noise", f"off by more than {BAD[0]:g}", *(f"{bound:g}" for bound in BAD[1:])]
    heads += ["mean square error x 100", "in focus", "sure, off", "processor s"]
    report.table([*heads, f"windows: {BAD[-1]:g}, mean square error"], rows)
    return sure


def reliability(sure: Iterable[tuple[Floats, Floats]]) -> list[tuple[float, float, float]]:
    """For each tenth of confidence its mean, the share that is right, and the share of pixels."""
    confidence, right = (np.concatenate(values) for values in zip(*sure, strict=True))
    tenth = np.minimum((10 * confidence).astype(int), 9)
    return [
        (float(confidence[here].mean()), float(right[here].mean()), float(here.mean()))
        for here in (tenth == k for k in range(10))
        if here.any()
    ]


def _say_reliability(report: Report, sure: Iterable[tuple[Floats, Floats]]) -> None:
    report.say(
        "### Confidence",
        f"Of all scenes above: share of the pixels that are off by {RIGHT:g} at most, over the "
        "confidence (a probability).",
    )
    rows = reliability(sure)
    figure, axis = plt.subplots(figsize=(4.5, 4), constrained_layout=True)
    axis.plot([0, 1], [0, 1], color="0.7")
    axis.plot([row[0] for row in rows], [row[1] for row in rows], "o-")
    axis.set(xlabel="confidence", ylabel="share that is right", xlim=(0, 1), ylim=(0, 1))
    report.picture("reliability", figure, "Share of right pixels over the confidence")
    heads = ["confidence", "right", "of the pixels"]
    report.table(heads, [[f"{a:.2f}", f"{b:.2f}", f"{100 * share:.1f} %"] for a, b, share in rows])


def _say_sharp(report: Report, names: list[str], likenesses: Mapping[str, list[Likeness]]) -> None:
    report.say(
        "## All in focus",
        "Pictures made with the depth of *disparity*, against the truth at full "
        f"resolution ({M * LENSES[1]} x {M * LENSES[0]}); detail is the mean gradient over the "
        "truth's. *Slices at their depth*: each pixel blended of the slices before and behind it.",
    )
    columns = ("psnr", "ssim", "detail", "seconds")
    formats = ("{:.2f}", "{:.3f}", "{:.2f}", "{:.2f}")
    rows = []
    for name, values in likenesses.items():
        means = [np.mean([getattr(v, column) for v in values]) for column in columns]
        rows.append([name, *(f.format(mean) for f, mean in zip(formats, means, strict=True))])
    report.table(["picture", "PSNR / dB", "SSIM", "detail", "processor s"], rows)
    report.say("PSNR in dB and detail by scene:")
    rows = [
        [name, *(f"{v.psnr:.1f}, {v.detail:.2f}" for v in values)]
        for name, values in likenesses.items()
    ]
    report.table(["picture", *names], rows)


def write_report(folder: Path, hci: Path | None, progress: Progress | None = None) -> Path:
    """Measure all ways and write ``depth.md`` with its figure; `hci`: scenes of the benchmark."""
    kinds: list[str | Path] = [*(SCENES if hci is None else hci_folders(hci))]
    report = Report(folder, "depth.md", 2 * len(kinds), progress)
    scores = {name: list[Score]() for name in WAYS}
    pictures = {name: list[Likeness]() for name in PICTURES}
    maps = list[tuple[Truth, Floats]]()
    sure = list[tuple[Floats, Floats]]()  # confidence, and whether it is right
    for kind in kinds:
        truth = hci_truth(kind) if isinstance(kind, Path) else rendered(kind)
        border = HCI_BORDER if isinstance(kind, Path) else _BORDER
        if not maps:
            # Compiles kernels beforehand.
            small = truth.raw[: 9 * truth.m, : 9 * truth.m]
            refocus(small, truth.m, 0, interpolation="linear", border="normalise")
            depth_index(FocalStack(small, truth.m, [0, 1]), truth.m)
        estimates = dict[str, Floats]()
        for name, way in WAYS.items():
            estimates[name], seconds = _timed(way, truth)
            scores[name].append(score(estimates[name], truth, seconds, border))
        maps.append((truth, estimates[PRODUCT]))
        sure.append(rightness(searched_disparity(truth), truth, border))
        report.step()
        if truth.picture is not None:
            for name, sharp in PICTURES.items():
                picture, seconds = _timed(sharp, truth, estimates[PRODUCT])
                pictures[name].append(likeness(picture, truth, seconds))
        report.step()
    names = [truth.name for truth, _ in maps]
    report.say(
        "# Depth from focus, depth from disparity",
        "Written by `plenofir report depth`: shares of pixels whose a is off by more than the "
        "bounds of the HCI benchmark, mean square error, processor time; means of scenes.",
        f"{len(names)} rendered scenes of {LENSES[1]} x {LENSES[0]} micro lenses, M = {M}, 16 bit, "
        f"1 % noise (faint: 0.5 %, noisy: 5 %), {_BORDER} lenses at each border left out."
        if hci is None
        else f"Scenes of the HCI 4D benchmark, {HCI_BORDER} pixels at each border left out. No "
        "rank is claimed: the benchmark gives ranks over all of its scenes.",
        f"Measured on: {machine()}. Times depend on that.",
        "*Disparity*: `plenofir depth-map`, which finds the range itself. *Absolute differences*: "
        "sums over whole windows, as in section 5.3.3 of the thesis, over the true range. "
        "*Focus, depth index*: the sharpest of whole slices, as the VHDL finds it, in windows of "
        "5 x 5 lenses, over the true range; slices are 1/M apart. *Depth between slices*: with "
        "the vertex of the parabola through it and its neighbours.",
    )
    report.picture("depth", _maps_picture(maps), "Central views, truth, what is found")
    _say_depth(report, names, scores)
    if hci is None:
        sure += _say_trials(report)
    _say_reliability(report, sure)
    if hci is None:
        _say_ramps(report)
        _say_sharp(report, names, pictures)
    return report.write()
