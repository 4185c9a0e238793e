# SPDX-License-Identifier: Apache-2.0
"""What a worker of a batch does: it reads frames, refocuses them and writes their pictures."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from hashlib import sha256
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from uuid import uuid4

from plenofir.ground.errors import InputError
from plenofir.ground.files import write_flushed
from plenofir.ground.images import Picture, encode_png, read_picture
from plenofir.refocus import Image, check_raw, first_calls
from plenofir.refocus.batch_record import Content
from plenofir.refocus.settings import checked

if TYPE_CHECKING:
    from plenofir.refocus.batch import Settings


class Made(NamedTuple):
    """What a worker made of a frame."""

    results: tuple[tuple[Path, Content], ...] = ()  # in the order of the focus settings
    failure: str = ""  # what is wrong with the frame
    stop: OSError | None = None  # a failure to write that would stop every frame
    notes: tuple[str, ...] = ()  # why no GPU made the pictures


def refocus_frames(sources: Sequence[Path], settings: "Settings", folder: Path) -> list[Made]:
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
    frames: Iterator[tuple[Path, Picture]], settings: "Settings", tell: Tell
) -> Refocused:
    """The pictures of each frame."""
    for source, frame in frames:
        yield source, (frame.like(settings.refocused(frame.pixels, a)) for a in settings.a)


class _Job(NamedTuple):
    """A frame, and the focus settings that one kernel takes."""

    source: Path
    frame: Picture
    a: tuple[Fraction, ...]


def _by_gpu(frames: Iterator[tuple[Path, Picture]], settings: "Settings", tell: Tell) -> Refocused:
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
    made = gpu_slices(jobs, work_of, tell)
    for source, of_frame in groupby(made, lambda each: each[0].source):
        yield source, pictures(of_frame)
