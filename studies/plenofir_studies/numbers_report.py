# SPDX-License-Identifier: Apache-2.0
"""The report of numbers that the thesis asks for or claims: Markdown with figures."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image
from plenofir_studies import centres, noise
from plenofir_studies import resolution as detail
from plenofir_studies.noise import Noise
from plenofir_studies.report_parts import Progress, Report, machine

_SETTINGS = ((3, 1), (3, 3), (3, 4), (5, 1), (5, 5), (5, 6), (5, 10), (5, 11))


def _panels(pictures: Mapping[str, Image], columns: int, width: float = 9.0) -> Figure:
    """Pictures side by side with their names, pixels not smoothed."""
    rows = -(-len(pictures) // columns)
    first = next(iter(pictures.values()))
    height = width / columns * first.shape[0] / first.shape[1] + 0.25
    figure, axes = plt.subplots(
        rows, columns, figsize=(width, rows * height), constrained_layout=True, squeeze=False
    )
    for place in axes.flat:
        place.set_axis_off()
    for place, (name, picture) in zip(axes.flat, pictures.items(), strict=False):
        place.imshow(picture, cmap="gray", interpolation="nearest")
        place.set_title(name, fontsize=8)
    return figure


def _noise_picture(results: Sequence[Noise]) -> Figure:
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), constrained_layout=True)
    exact = [r for r in results if r.arithmetic == "exact" and r.order == 0]
    left.loglog([r.m for r in exact], [r.measured / r.raw for r in exact], "o", label="exact")
    coarse = [r for r in results if r.arithmetic == "F = 0, G = 0"]
    left.loglog([r.m for r in coarse], [r.measured / r.raw for r in coarse], "s", label="F = G = 0")
    sizes = np.array(noise.SIZES)
    left.loglog(sizes, 1 / sizes**2, "-", color="0.5", label="1 / M²")
    left.set_xticks(sizes, [str(m) for m in sizes])
    left.minorticks_off()
    left.set(xlabel="M", ylabel="variance, refocused over raw")
    left.legend(fontsize=8)
    for shift in (2, 5):
        right.plot(noise.neighbours_alike(5, shift), "o-", label=f"M = 5, a' = {shift}")
    right.set(xlabel="pixels apart in a row", ylabel="correlation of the noise")
    right.legend(fontsize=8)
    return figure


def _noise(report: Report) -> None:
    results = noise.measure_all(report.step)
    off = {r: abs(r.measured / r.derived - 1) for r in results}
    worst = max(results, key=lambda r: off[r])
    rest = max(value for r, value in off.items() if r != worst)
    gains = ", ".join(
        f"{10 * np.log10(r.raw / r.measured):.1f} dB for M = {r.m}"
        for r in results
        if r.arithmetic == "exact" and r.order == 0 and r.shift == 2
    )
    report.say(
        "## Noise",
        "The thesis expects refocused pictures to have little noise, because they are means of "
        "pixels. They are: an output pixel is the mean of M x M pixels, whatever a is, so "
        "1 / M² of the variance is left. "
        f"With exact arithmetic that is {gains} (a' = 2). Rounding adds to it: 1/12 at the end, "
        "and with stored products the remainders of 2 M products "
        "(the formulas are in `plenofir_studies.noise`). Even frames with normal noise of "
        f"{noise.NOISE:g} grey levels, eight for each line; measured and derived variances differ "
        f"by {100 * rest:.1f} % at most, but for M = {worst.m}, {worst.arithmetic}: "
        f"{100 * off[worst]:.0f} %. There a step of a product, {worst.m} grey levels, is wider "
        f"than the noise behind the rows, {noise.NOISE / worst.m**0.5:.1f}; the remainders of "
        "neighbouring rows agree and do not average out.",
        "Neighbouring pixels share sources, so what noise is left is as coarse as a micro image: "
        "the right half of the figure. Averaging M x M neighbours lowers it no further.",
    )
    report.picture(
        "noise", _noise_picture(results), "Variance against M; correlation of neighbours"
    )
    names = {order: name for name, order in detail.INTERPOLATIONS.items()}
    report.table_of(
        results,
        {
            "M": "{.m}",
            "a": "{.a}",
            "arithmetic": "{.arithmetic}",
            "interpolation": lambda r: names[r.order],
            "raw": "{.raw:.2f}",
            "measured": "{.measured:.3f}",
            "derived": "{.derived:.3f}",
            "share": lambda r: f"{r.measured / r.raw:.5f}",
            "1/M²": lambda r: f"{1 / r.m**2:.5f}",
        },
    )


def _stages_picture() -> Figure:
    raw = read_image(project.DATA / "planes_5x5.png")
    side = min(raw.shape[:2]) // 2 // 5 * 5
    five = raw[:side, :side]
    three = detail.central_directions(five, 5, 3)
    pictures = {}
    for shift in (0, 5):
        text = f"a = {shift}/3"
        pictures[f"M = 3, {text}, rows alone"] = detail.row_stage(three, 3, shift)
        pictures[f"M = 3, {text}"] = refocus(three, 3, Fraction(shift, 3))
    for a in (Fraction(0), Fraction(8, 5)):
        pictures[f"M = 5, a = {a}, linear"] = refocus(five, 5, a, interpolation="linear")
    return _panels(pictures, 3)


def _crops_picture() -> Figure:
    raw = read_image(project.DATA / "planes_5x5.png")
    pictures = {}
    for text in ("5/5", "6/5"):
        picture = refocus(raw, 5, Fraction(text))
        rows, columns = picture.shape[0] * 55 // 100, picture.shape[1] * 60 // 100
        pictures[f"a = {text}"] = picture[rows : rows + 120, columns : columns + 150]
    return _panels(pictures, 2)


def _transfer_picture(details: Sequence[detail.Detail]) -> Figure:
    figure, axes = plt.subplots(figsize=(7, 3.5), constrained_layout=True)
    for part in details:
        if part.m == 5 and part.shift in (1, 5, 6, 10, 11):
            style = "--" if part.shift % part.m == 0 else "-"
            axes.plot(
                part.transfer.frequency,
                part.transfer.contrast,
                style,
                label=f"a = {part.shift}/5, alias {part.alias:.2g}",
            )
    axes.axvline(0.5, color="0.6", linestyle=":")
    axes.set(xlabel="cycles a micro lens", ylabel="contrast", ylim=(0, 1.05))
    axes.legend(fontsize=8)
    return figure


def _resolution(report: Report) -> None:
    details = []
    for m, shift in _SETTINGS:
        details.append(detail.edge_detail(m, shift))
        report.step()
    both = {}
    for name, order in detail.INTERPOLATIONS.items():
        both[name] = [detail.before_and_after(5, shift, order) for shift in (5, 6)]
        report.step()
    report.say(
        "## Resolution",
        "Fig. 6.12 again: what leaves the row stage alone, the refocused picture, and linear "
        "interpolation with M = 5.",
    )
    report.picture(
        "stages", _stages_picture(), "Row stage alone, both stages, linear interpolation"
    )
    report.say(
        "Fig. 6.13 (f) and (g) again: one raw image, nearest neighbour, a = 5/5 and a = 6/5."
    )
    report.picture("crops", _crops_picture(), "a = 5/5 and a = 6/5")
    whole, between = (next(d for d in details if (d.m, d.shift) == (5, s)) for s in (5, 6))
    report.say(
        "The thesis sees more resolution at 6/5 than at 5/5, because neighbouring pixels differ. "
        "They do: of the neighbours inside a micro image "
        f"{100 * between.differing:.0f} % differ at 6/5 and none at 5/5. But contrast does not "
        "grow. A slanted edge that is in focus at the setting has half of its contrast left at "
        f"{whole.transfer.half:.3f} cycles a micro lens for 5/5, at {between.transfer.half:.3f} "
        "for 6/5. What goes away is aliasing. For integer a all views sample the object at the "
        "same places, one for each micro lens; otherwise they sample M places. Stripes of 0.7 "
        "cycles a micro lens come out as stripes of 0.3 with "
        f"{whole.alias:.1f} times their own contrast at 5/5, and with {between.alias:.3f} times "
        "at 6/5.",
    )
    report.picture("transfer", _transfer_picture(details), "Contrast over frequency")
    report.step()
    report.table_of(
        details,
        {
            "M": "{.m}",
            "a": "{0.shift}/{0.m}",
            "neighbours that differ": lambda d: f"{100 * d.differing:.0f} %",
            "half contrast at, cycles a lens": "{.transfer.half:.3f}",
            "jagged, lenses": "{.jaggedness:.4f}",
            "alias of 0.7 cycles": "{.alias:.3f}",
        },
    )
    report.say(
        "Fig. 6.13 (a) to (e): micro images interpolated before refocusing, against one value for "
        "each micro lens and the picture interpolated afterwards (M = 5). For integer a the two "
        "are the same, as the thesis says. For other a interpolating first keeps more, also with "
        "nearest neighbour. Largest difference in grey levels of 255; half contrast in cycles a "
        "micro lens.",
    )
    cells = ("{0.difference:.2g}", "{0.before:.3f}", "{0.after:.3f}")
    heads = [
        f"a = {a}: {stage}" for a in ("5/5", "6/5") for stage in ("difference", "before", "after")
    ]
    report.table(
        ["interpolation", *heads],
        [[name, *(c.format(r) for r in pair for c in cells)] for name, pair in both.items()],
    )


def _centres(report: Report) -> None:
    ways, rounded = centres.compare()
    report.step()
    report.say(
        "## Rounded centres",
        "Fig. 4.12 again: the central view of a slanted edge, decoded by the nearest pixel, which "
        "rounds micro image centres, and by interpolation. Pitch 14.27 pixels, rotated by 0.3 "
        f"degree, M = {centres.M}, the edge in focus at a = {centres.FOCUS}.",
    )
    views = {str(w.way): w.view[8:28, 8:28] for w in ways}
    report.picture("centres", _panels(views, 3), "Nearest, bilinear, cubic")
    report.say(
        f"Rounding should move lines by {rounded:.3f} micro lenses (root mean square). It is seen "
        "in full in a view. A refocused picture averages M x M views with roundings of their own "
        "and keeps less. Bilinear interpolation should leave 4/9 = 0.444 of independent noise: "
        "that it lowers noise, as the thesis says, is true, and the nearest pixel leaves all.",
    )
    report.table_of(
        ways,
        {
            "interpolation": "{.way}",
            "view: jagged, lenses": "{.jaggedness:.3f}",
            "refocused: the same": "{.refocused:.3f}",
            "view: half contrast at, cycles a lens": "{.half:.3f}",
            "noise variance left": "{.noise:.3f}",
        },
    )


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Measure everything and write ``numbers.md`` with its figures."""
    steps = len(list(noise.cases())) + len(_SETTINGS) + len(detail.INTERPOLATIONS) + 2
    report = Report(folder, "numbers.md", steps, progress)
    report.say(
        "# Numbers that the thesis asks for",
        "Written by `plenofir report numbers`: what the thesis expects or claims of refocused "
        "pictures without numbers, measured, and derived where that can be. "
        "Ways to depth and energy have reports of their own, `plenofir report depth` and "
        "`plenofir report energy`.",
        f"Measured on: {machine()}. Times depend on that, and last digits of floating point "
        "results.",
    )
    _noise(report)
    _resolution(report)
    _centres(report)
    return report.write()
