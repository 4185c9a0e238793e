# SPDX-License-Identifier: Apache-2.0
"""Arrays with named axes, as readers find them: pictures, views by row and column, series.

Axes are named by letters, slowest first: v, u rows and columns of views; n a series whose meaning
is not known yet (frames, pages, elemental images); y, x rows and columns of pixels. Channels follow
without a letter.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path

import numpy as np

from plenofir.camera.recognise.source import Finding, Progress, quiet
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, read_picture, upright

RUNNING = "running number"
"""Kind of a series whose files have one number that runs through all names."""
LONGER = "longer film"
"""Kind of a series that is the beginning of a film."""
# All pictures of a series are held at once.
_MOST_BYTES = 4 << 30


@dataclass(frozen=True, eq=False)
class Stored:
    """Pixels that are read when they are asked for."""

    path: Path
    axes: str  # "yx", "nyx" or "vuyx"
    counts: tuple[int, ...]  # lengths of the axes before y
    # The picture at a place of the axes before y.
    at: Callable[[tuple[int, ...]], Picture]
    name_at: Callable[[tuple[int, ...]], str]
    findings: tuple[Finding, ...] = ()
    kind: str = ""  # what a reader knows of its kind
    whole: Picture | None = None  # all pixels, where they are in memory already

    @property
    def where(self) -> str:
        """The path, for messages."""
        return str(self.path)

    @property
    def orientation(self) -> int:
        """How a single picture is to be turned, as EXIF counts."""
        return 1 if self.whole is None else self.whole.orientation

    @cached_property
    def upright(self) -> "Stored":
        """The same pixels turned as their orientation says, which is told."""
        if self.whole is None or self.orientation == 1:
            return self
        text = f"turned as its file says (EXIF orientation {self.orientation})"
        finding = Finding("orientation", text, "told", notable=True)
        picture = upright(self.whole)
        return of_array(self.path, self.axes, picture, (finding, *self.findings))

    def places(self) -> Iterator[tuple[int, ...]]:
        """Places of all pictures, in their order."""
        return np.ndindex(*self.counts)

    def load(self, progress: Progress = quiet) -> Picture:
        """All pixels, shape (counts, y, x[, 3]); pictures of one size, type and white."""
        if self.whole is not None:
            return self.whole
        first: Picture | None = None
        for done, place in enumerate(self.places(), 1):
            picture = self.at(place)
            image = picture.pixels
            if first is None:
                if prod(self.counts) * image.nbytes > _MOST_BYTES:
                    raise InputError(
                        f"{prod(self.counts)} pictures of {image.nbytes >> 20} MiB are more than "
                        "4 GiB; use fewer or smaller ones",
                        where=self.where,
                    )
                result = np.empty((*self.counts, *image.shape), dtype=image.dtype)
                first = picture
            if image.shape != first.pixels.shape or image.dtype != result.dtype:
                unlike = self.odd()
                assert unlike is not None
                raise unlike
            if picture.full_scale != first.full_scale:
                raise InputError(
                    f"counts {picture.full_scale} as white, the first view {first.full_scale}",
                    where=self.name_at(place),
                )
            result[place] = image
            progress(done, prod(self.counts))
        if first is None:
            raise InputError("has no pictures", where=self.where)
        return first.like(result)

    def odd(self) -> InputError | None:
        """The picture that is unlike most others; None if all are alike."""
        kinds: dict[str, list[tuple[int, ...]]] = {}
        for each in self.places():
            image = self.at(each).pixels
            size = f"{image.shape[1]} x {image.shape[0]} pixels"
            colours = "RGB" if image.ndim == 3 else "grey"
            kinds.setdefault(f"{size}, {colours}, {image.dtype}", []).append(each)
        if len(kinds) == 1:
            return None
        usual = max(kinds, key=lambda kind: len(kinds[kind]))
        odd, places = min(kinds.items(), key=lambda one: len(one[1]))
        if odd == usual:  # As many of one kind as of the other.
            odd, places = next((kind, at) for kind, at in kinds.items() if kind != usual)
        more = f", as {len(places) - 1} more" if len(places) > 1 else ""
        return InputError(
            f"has {odd}{more}; the other views have {usual}", where=self.name_at(places[0])
        )


def check_sizes(stored: Stored) -> None:
    """Refuse pictures in files that have not one size, by the files' heads; names the odd one."""
    from PIL import Image as Pillow

    if stored.whole is not None:
        return
    first: tuple[int, int] | None = None
    for place in stored.places():
        try:
            with Pillow.open(stored.name_at(place)) as image:
                size = image.size
        except (OSError, ValueError, SyntaxError, Pillow.DecompressionBombError):
            continue  # Told when its pixels are read.
        first = first or size
        if size != first:
            unlike = stored.odd()
            if unlike is None:  # Some are turned by their orientation.
                return
            raise unlike


def picture_findings(picture: Picture) -> tuple[Finding, ...]:
    """Unused parts of a picture's file, for people."""
    findings = [Finding("file", note, "told", notable=True) for note in picture.notes]
    if picture.alpha:
        text = "transparency, which is not opaque everywhere, is left out"
        findings.append(Finding("alpha", text, "told", notable=True))
    return tuple(findings)


def of_array(path: Path, axes: str, picture: Picture, findings: tuple[Finding, ...] = ()) -> Stored:
    """An array that is in memory; `picture` has its pixels and their meaning."""
    counts = picture.pixels.shape[: len(axes) - 2]
    return Stored(
        path,
        axes,
        counts,
        lambda place: picture._replace(pixels=picture.pixels[place]),
        lambda place: f"{path} {place}",
        findings,
        whole=picture,
    )


def of_files(
    path: Path,
    axes: str,
    files: dict[tuple[int, ...], Path],
    findings: tuple[Finding, ...] = (),
    kind: str = "",
) -> Stored:
    """Pictures in files by their places, which fill the axes before y."""
    counts = tuple(max(place[axis] for place in files) + 1 for axis in range(len(axes) - 2))
    return Stored(
        path,
        axes,
        counts,
        lambda place: read_picture(files[place], drop_alpha=True),
        lambda place: str(files[place]),
        findings,
        kind,
    )
