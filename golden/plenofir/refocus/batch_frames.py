# SPDX-License-Identifier: Apache-2.0
"""What is done to the frames of a batch, and the worker that does it, from file to files."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

from plenofir.ground.errors import InputError
from plenofir.ground.files import write_flushed
from plenofir.ground.images import Picture, encode_png, read_picture
from plenofir.refocus import (
    Aperture,
    Image,
    Sharpen,
    best_picture,
    check_raw,
    first_calls,
    focus_to_shift,
    interpolation_order,
    refocus,
    sharpening_units,
)
from plenofir.refocus.batch_record import Content
from plenofir.refocus.checks import whole_number
from plenofir.refocus.operator import box_size, least_box
from plenofir.refocus.pictures import WEIGHT
from plenofir.refocus.settings import check_pixel_for_each_lens, checked


@dataclass(frozen=True)
class Settings:
    """What is done to every frame."""

    micro_image_size: int  # M in pixels
    a: tuple[Fraction, ...]  # focus settings
    order: int = 0  # order of the interpolation
    upsample: bool = True  # see `plenofir.refocus.refocus`
    sharpen: Sharpen = "off"  # see `plenofir.refocus.refocus`
    best: bool = False  # pictures as of `plenofir.refocus.best_picture` instead
    aperture: Aperture | None = None  # of these, as its tilt
    tilt: tuple[float, float] = (0.0, 0.0)
    box: int | None = None  # of either
    gpu: bool = False  # whether a GPU makes the operator's pictures, where there is one

    def check(self) -> None:
        """Refuse settings that `plenofir.refocus.refocus` would refuse for every frame."""
        whole_number(self.micro_image_size, "M", 1)
        interpolation_order(self.order)
        if not self.a:
            raise InputError("no focus settings were given; give one or more")
        least_box(self.micro_image_size, 1, self.box)
        if self.best:
            return
        for a, units in zip(self.a, self.weights(), strict=True):
            shift = focus_to_shift(a, self.micro_image_size)
            box_size(self.micro_image_size, shift, self.box)
            if not self.upsample:
                check_pixel_for_each_lens(
                    self.micro_image_size, shift, self.order, units, self.sharpen
                )

    def refocused(self, raw: Image, a: Fraction) -> Image:
        """One of the pictures of a frame, by one thread."""
        m = self.micro_image_size
        if self.best:
            return best_picture(
                raw, m, a, aperture=self.aperture, tilt=self.tilt, box=self.box, threads=1
            )
        return refocus(raw, threads=1, **self.operator(a))

    def operator(self, a: Fraction) -> dict[str, Any]:
        """What `plenofir.refocus.refocus` takes for a focus setting."""
        return {
            "M": self.micro_image_size,
            "a": a,
            "interpolation": self.order,
            "sharpen": self.sharpen,
            "upsample": self.upsample,
            "box": self.box,
        }

    def weights(self) -> list[int]:
        """Sharpening of each focus setting, see `plenofir.refocus.sharpening`."""
        m = self.micro_image_size
        shifts = [focus_to_shift(a, m) for a in self.a]
        return [
            sharpening_units(self.sharpen, m, shift, self.order, box=self.box) for shift in shifts
        ]

    def signature(self) -> str:
        """Text that is equal for equal settings."""
        focus = " ".join(str(a) for a in self.a)
        # Old records, which have neither sharpening nor boxes, stay valid.
        box = "" if self.box is None else f" box={self.box}"
        if self.best:
            return f"M={self.micro_image_size} a={focus} {WEIGHT} {self.aperture} {self.tilt}{box}"
        text = f"M={self.micro_image_size} a={focus} order={self.order} upsample={self.upsample}"
        weights = self.weights()
        sharpen = f" sharpen={' '.join(map(str, weights))}" if any(weights) else ""
        return f"{text}{sharpen}{box}"


class Made(NamedTuple):
    """What a worker made of a frame."""

    results: tuple[tuple[Path, Content], ...] = ()  # in the order of the focus settings
    failure: str = ""  # what is wrong with the frame
    stop: OSError | None = None  # a failure to write that would stop every frame
    notes: tuple[str, ...] = ()  # why no GPU made the pictures


def refocus_frames(sources: Sequence[Path], settings: Settings, folder: Path) -> list[Made]:
    """Refocus frames and write their results into a folder, under names of their own."""
    # Many frames follow, and workers end when the last one is written.
    first_calls.patient = True
    made: dict[Path, Made] = {}
    notes: list[str] = []

    def readable() -> Iterator[tuple[Path, Picture]]:
        for source in sources:
            try:
                picture = read_picture(source)
                check_raw(picture.pixels, settings.micro_image_size, where=str(source))
            except InputError as error:
                made[source] = Made(failure=str(error))
            except MemoryError:
                made[source] = _too_large(source)
            else:
                yield source, picture

    refocused = _by_gpu if settings.gpu else _by_processor
    for source, pictures in refocused(readable(), settings, notes.append):
        try:
            made[source] = _written(pictures, folder)
        except InputError as error:
            made[source] = Made(failure=str(error))
        except MemoryError:
            made[source] = _too_large(source)
    return [made[source]._replace(notes=tuple(notes)) for source in sources]


def _too_large(source: Path) -> Made:
    return Made(failure=f"{source}: too large for the memory; use smaller frames")


def _written(pictures: Iterable[Picture], folder: Path) -> Made:
    """Write pictures as they come."""
    results: list[tuple[Path, Content]] = []
    for picture in pictures:
        content = encode_png(picture)
        # Workers share the folder; the run itself gives results their names.
        path = folder / uuid4().hex
        try:
            write_flushed(path, content)
        except OSError as error:
            return Made(tuple(results), stop=error)
        digest = sha256(content).hexdigest()
        results.append((path, Content(size=len(content), sha256=digest)))
    return Made(tuple(results))


Tell = Callable[[str], None]
Refocused = Iterator[tuple[Path, Iterable[Picture]]]


def _by_processor(
    frames: Iterator[tuple[Path, Picture]], settings: Settings, tell: Tell
) -> Refocused:
    """The pictures of each frame."""
    for source, frame in frames:
        yield source, (frame.like(settings.refocused(frame.pixels, a)) for a in settings.a)


class _Job(NamedTuple):
    """A frame, and the focus settings that one kernel takes."""

    source: Path
    frame: Picture
    a: tuple[Fraction, ...]


def _by_gpu(frames: Iterator[tuple[Path, Picture]], settings: Settings, tell: Tell) -> Refocused:
    """The same by a GPU, which works on frames while others are read and written."""
    from plenofir.refocus.gpu.frames import Work, gpu_slices
    from plenofir.refocus.gpu.program import MOST_SLICES

    parts = [settings.a[n : n + MOST_SLICES] for n in range(0, len(settings.a), MOST_SLICES)]

    def work_of(job: _Job) -> Work:
        raw = job.frame.pixels
        return Work(raw, [checked(raw, **settings.operator(a))[1] for a in job.a])

    def pictures(made: Iterable[tuple[_Job, Image | None]]) -> Iterator[Picture]:
        for job, slices in made:
            by_processor = (settings.refocused(job.frame.pixels, a) for a in job.a)
            yield from map(job.frame.like, by_processor if slices is None else slices)

    jobs = (_Job(*frame, part) for frame in frames for part in parts)
    by_job = gpu_slices(jobs, work_of, tell)
    for source, of_frame in groupby(by_job, lambda each: each[0].source):
        yield source, pictures(of_frame)
