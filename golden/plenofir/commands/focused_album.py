# SPDX-License-Identifier: Apache-2.0
"""The pictures of a focused camera's capture for `plenofir develop`."""

from functools import partial
from typing import TYPE_CHECKING, Any

from plenofir.commands.album import SURE, Album
from plenofir.commands.focused import FocusedField, maps_of, sharp, slices_between
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.camera.exposure import Exposure
    from plenofir.camera.recognise import Field
    from plenofir.ground.images import Image


def field_of(focal: FocusedField) -> "Field":
    """What a page says about a capture, in place of an aligned raw image."""
    from plenofir.camera.recognise import Field, Finding

    calibration = focal.capture.calibration
    text = f"focused camera, {calibration.grid.layout}, {focal.capture.pitch:.3f} pixels a lens"
    lines = [Finding("calibrated", text, "told")]
    if calibration.lens_types is not None:
        texts = calibration.lens_types.described(focal.capture.pitch)
        lines += [Finding("micro lenses", one) for one in texts]
    lines += [Finding("calibration", note, notable=True) for note in focal.notes]
    return Field(focal.look.field, round(focal.capture.pitch), tuple(lines))


class FocusedAlbum(Album):
    """Makes and writes the pictures of a focused camera's capture."""

    by_hand = False
    focal: FocusedField

    def make(self, most: int, how: dict[str, Any]) -> list[str]:
        """All of them, at most so many refocused ones; lines for the summary."""
        from plenofir.camera.focused import search_depth

        if how != {"aperture": None, "tilt": (0.0, 0.0), "box": None}:
            raise InputError(
                "--aperture, --tilt and --box are not for a capture of a focused camera; leave "
                "them out"
            )
        focal = self.focal
        depth = search_depth(
            focal.capture, progress=lambda done, total: self.show("searching depth", done, total)
        )
        maps = maps_of(focal, depth, SURE)
        self.show("all in focus", 0, 0)
        self.add("all_in_focus.png", lambda: sharp(focal, depth).pixels, "Sharp everywhere")
        planes = slices_between(focal, depth, most)
        count = len(planes)
        frames = []
        for number, inverse in enumerate(planes):
            self.show("refocusing", number, count)
            v = float(focal.scale.depth(inverse))
            name = f"refocused_{number + 1:0{len(str(count))}}_v{v:.3f}.png"
            frames.append(
                self.add(name, partial(self._refocused, inverse), focal.place(v, inverse))
            )
        self.through_focus(frames, *planes)
        maps.save(self.results)
        caption = "Virtual depth; give --camera for mm"
        if maps.mm is not None:
            caption = "Distance from the micro lenses"
        self.add("depth.png", maps.picture, caption)
        first, last = sorted(float(focal.scale.depth(end)) for end in (planes[0], planes[-1]))
        return [f"range: v = {first:.3f} to {last:.3f}, {count} pictures", maps.words()]

    def _refocused(self, inverse: float) -> "Image":
        return self.focal.shown(inverse).pixels

    def viewer(self, title: str, exposed: "Exposure") -> None:
        """None: `plenofir view` refocuses the capture itself."""
