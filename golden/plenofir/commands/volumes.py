# SPDX-License-Identifier: Apache-2.0
"""Volumes: stacks of slices, of one light field or of a film, as one file with micrometres."""

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.commands import options
from plenofir.commands.console import note
from plenofir.commands.rasters import check_aligned, model_of
from plenofir.ground.errors import InputError
from plenofir.ground.films import FILMS, film_frames
from plenofir.ground.images import SCREEN_GAMMA, Image, Picture, encode_png, read_picture, upright
from plenofir.ground.pages import Pages, has_pages
from plenofir.ground.volumes import Voxel, write_volume

if TYPE_CHECKING:
    from plenofir.camera.rays import MicroscopeModel
    from plenofir.camera.recognise import Hints

Show = Callable[[int, int], None]
# Slices that are this near to equal steps, as shares of one, have them.
_EQUAL = 1e-6


class Slices(NamedTuple):
    """The slices of a volume."""

    settings: tuple[Fraction, ...]
    voxel: Voxel | None  # in um, with a microscope

    def words(self, count: int, shape: tuple[int, ...], dtype: np.dtype[Any]) -> str:
        """The volume, for people."""
        frames = f"{count} frames of " if count > 1 else ""
        text = f"{frames}{len(self.settings)} slices of {shape[1]} x {shape[0]} pixels"
        text += f", {8 * dtype.itemsize} bit"
        if self.voxel is None:
            return f"{text}; without --camera MICROSCOPE no micrometres"
        across, along, first, _ = self.voxel
        if len(self.settings) < 2:
            return f"{text}; pixels of {across:.4g} um, z = {first:.4g} um"
        last = first + (len(self.settings) - 1) * along
        sizes = f"voxels of {across:.4g} x {across:.4g} x {along:.4g} um"
        return f"{text}; {sizes}, z = {first:.4g} to {last:.4g} um"

    def about(self) -> str:
        """The volume, for its file."""
        steps = ", ".join(f"{float(a):.6g}" for a in self.settings[:2])
        text = f"plenofir: focus settings a = {steps}"
        if len(self.settings) > 2:
            text += f", ... {float(self.settings[-1]):.6g}"
        if self.voxel is None:
            return text
        return f"{text}; first slice at z = {self.voxel.first:.6g} um over the plane in focus"


def slices_of_volume(
    a: list[str] | None, heights: list[str] | None, camera: str | None, focus: float, m: int
) -> Slices:
    """Slices of the options -a or --z, and their voxels where --camera is a microscope."""
    model = _microscope(camera, focus, m)
    if heights and a:
        options.refuse_both("z", "-a")
    if heights:
        if model is None:
            raise InputError(f"{options.typed('z')} requires a microscope as --camera")
        places = options.focus_settings(heights, 1, rounded=False, where="z")
        settings = tuple(z / Fraction(model.um_per_a) for z in places)
    else:
        settings = options.focus_settings(a or ["0:1"], m, rounded=False)
    if model is None:
        return Slices(settings, None)
    if not rise_in_equal_steps(settings):
        raise InputError(
            "slices of a volume in um rise in equal steps; give FIRST:LAST:STEP",
            where="z" if heights else "a",
        )
    if words := model.micro_image_note():
        note(words)
    first = float(settings[0])
    step = float(settings[1]) - first if settings[1:] else 0.0
    return Slices(
        settings, Voxel(model.pixel_um, step * model.um_per_a, float(model.height_um(first)))
    )


def rise_in_equal_steps(places: "Sequence[Fraction] | npt.NDArray[np.float64]") -> bool:
    """Whether places of slices, any number, have the one step that files of volumes hold."""
    steps = np.diff(np.asarray(places, dtype=np.float64))
    return not steps.size or bool(steps[0] > 0 and np.ptp(steps) <= _EQUAL * steps[0])


def _microscope(camera: str | None, focus: float, m: int) -> "MicroscopeModel | None":
    from plenofir.camera.rays import RayModel

    model = model_of(camera, focus, m)
    if isinstance(model, RayModel):
        raise InputError(
            "is no microscope, whose slices lie in equal steps of um; leave it out for a volume "
            "without sizes, or write a folder",
            where=str(camera),
        )
    return model


def deepened(pixels: Image) -> Image:
    """Pixels of 8 bits in 16, times 257, so that means of views keep what they gain."""
    return pixels.astype(np.uint16) * np.uint16(257) if pixels.dtype == np.uint8 else pixels


class Film:
    """Frames of files one after the other: pictures, films, and pages of TIFF files."""

    def __init__(self, sources: Sequence[Path], hints: "Hints") -> None:
        self._sources, self._hints = sources, hints

    def __len__(self) -> int:
        """Number of frames; those of videos are counted by reading them."""
        return sum(map(_count, self._sources))

    def aligned(self) -> tuple[Iterator[Picture], int]:
        """Aligned raw images of the frames, each read when it is needed, and their M."""
        from plenofir.camera.recognise.request import as_asked

        frames = (one for source in self._sources for one in pictures_of_file(source))
        # The first frame decides for all: M, the calibration, the size.
        first, where = next(frames)
        hints = self._hints
        if hints.calib is None and hints.white is None:
            if hints.micro_image is None:
                raise InputError("give -M for aligned raw images, or --white or --calib")
            m = hints.micro_image
            self._check(first, where, m)

            def asked(picture: Picture, name: str) -> Picture:
                return as_asked(upright(picture), m, hints, name)

            return self._prepared(first, where, frames, asked), m
        from plenofir.camera.calibration import load_calibration
        from plenofir.camera.captures.prepare import CaptureHints, prepared
        from plenofir.camera.recognise.captures import calibration_of

        hinted = CaptureHints(hints.bayer, hints.white_balance, hints.roi)
        if hints.calib is not None:
            calibration = load_calibration(hints.calib)
        else:
            assert hints.white is not None
            calibration = calibration_of(hints.white, hints.dark, hints.bayer)
        dark = read_picture(hints.dark, as_stored=True) if hints.dark else None
        ready = prepared(first, calibration, hinted, dark=dark, where=where)
        for text in ready.notes:
            note(f"{where}: {text}")
        _, m = ready.decoded(hints.micro_image, where)

        def decoded(picture: Picture, name: str) -> Picture:
            aligned = ready.of(picture).decoded(m, name)[0]
            return as_asked(aligned, m, hints._replace(white_balance="auto"), name)

        return self._prepared(first, where, frames, decoded), m

    def _prepared(
        self,
        first: Picture,
        where: str,
        others: Iterator[tuple[Picture, str]],
        prepare: Callable[[Picture, str], Picture],
    ) -> Iterator[Picture]:
        yield prepare(first, where)
        shape, dtype = first.pixels.shape, first.pixels.dtype
        for picture, name in others:
            if (picture.pixels.shape, picture.pixels.dtype) != (shape, dtype):
                raise InputError("has another size or type than the first frame", where=name)
            yield prepare(picture, name)

    def _check(self, first: Picture, where: str, m: int) -> None:
        from plenofir.refocus import check_raw

        check_raw(upright(first).pixels, m, where=where)
        for text in first.notes:
            note(f"{where}: {text}")
        source = self._sources[0]
        # Checks of aligned raw images take files.
        with TemporaryDirectory(prefix="plenofir-") as folder:
            frame = Path(folder) / f"{source.stem}.png"
            frame.write_bytes(encode_png(first))
            try:
                check_aligned(frame, self._hints)
            except InputError as error:
                text = error.problem.replace(str(frame), str(source))
                raise InputError(text, where=where) from None


def _is_film(source: Path) -> bool:
    return source.suffix.lower() in FILMS


def _count(source: Path) -> int:
    if _is_film(source):
        return sum(1 for _ in film_frames(source))
    return len(Pages(source)) if has_pages(source) else 1


def pictures_of_file(source: Path) -> Iterator[tuple[Picture, str]]:
    """Pictures of a file as stored, and the name of each in messages."""
    if _is_film(source):
        for number, frame in enumerate(film_frames(source), 1):
            yield Picture(frame, 255, SCREEN_GAMMA), f"{source}, frame {number}"
    elif has_pages(source):
        pages = Pages(source)
        if pages.left_out:
            note(f"{source}: {pages.left_out_text}")
        for number, picture in enumerate(pages, 1):
            yield picture, f"{source}, page {number}"
    else:
        yield read_picture(source, as_stored=True), str(source)


def volume_of_film(
    film: Film, slices: Callable[[int], Slices], path: Path, show: Show, **how: Any
) -> str:
    """Write the volume of a film; what was written, for people. `how`: see `best_picture`."""
    from plenofir.refocus import best_picture

    count = len(film)
    frames, m = film.aligned()
    chosen = slices(m)

    def stacks() -> Iterator[Iterator[Image]]:
        for number, picture in enumerate(frames, 1):
            raw = deepened(picture.pixels)
            # Slices are made while they are written, so one is in memory at a time.
            yield (best_picture(raw, m, a, **how) for a in chosen.settings)
            show(number, count)

    total = len(chosen.settings)
    shape = write_volume(path, stacks(), count, total, voxel=chosen.voxel, about=chosen.about())
    return f"{path}: {chosen.words(count, shape[3:], np.dtype(np.uint16))}"
