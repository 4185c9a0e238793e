# SPDX-License-Identifier: Apache-2.0
"""The pictures of a light field, and the page that shows them."""

import base64
import html
import io
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from math import ceil, floor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plenofir.commands.last_run import Earlier, key_of
from plenofir.commands.rasters import MAPS, doubt_of_depth, unit_of
from plenofir.commands.results import save
from plenofir.ground.files import Results

if TYPE_CHECKING:
    from plenofir.camera.exposure import Exposure
    from plenofir.camera.lightfield.disparity import Disparity
    from plenofir.camera.rays import MicroscopeModel, RayModel
    from plenofir.camera.recognise import Field
    from plenofir.commands.looks import Look
    from plenofir.ground.images import Image

Show = Callable[[str, int, int], None]

# Least probability of a depth that counts.
SURE = 0.5
# Share of a step by which a depth may lie beyond the first or last picture.
_ASIDE = 0.3
# The page is mailed: servers take 10 MB, as a rule.
_VIEWER_BYTES = 8_000_000
# Pixels of an animation along its longer side, and how long a picture of it stays, in ms.
_ANIMATION_PIXELS, _STAYS = 640, 120
# Views of few micro lenses are enlarged so many times in an animation: more shows no more of them.
_VIEW_TIMES = 4
_CAPTIONS = {
    "a": "Depth in units of a; give --camera for mm or um",
    "mm": "Distance from the micro lenses",
    "um": "Height over the plane in focus",
}
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;margin:1.5rem auto;max-width:76rem;padding:0 1rem;"
    "background:#fff;color:#222}main{display:grid;gap:1rem;"
    "grid-template-columns:repeat(auto-fill,minmax(17rem,1fr))}figure{margin:0}img{width:100%}"
    "figcaption{font-size:.9rem}"
)


class Album:
    """Makes and writes the pictures of a light field; keeps their names and captions."""

    # Whether `viewer` writes one.
    by_hand = True

    def __init__(
        self,
        results: Results,
        field: "Field",
        model: "RayModel | MicroscopeModel | None",
        look: "Look",
        show: Show,
        earlier: Earlier,
        mark: str,
    ) -> None:
        self.results, self.field, self.model = results, field, model
        self.look, self.show = look, show
        self.earlier, self.mark = earlier, mark
        self.disparity: Disparity | None = None  # once it was searched
        self.in_focus: Image | None = None  # values of the field, once it was made
        self.facts: tuple[object, ...] = ()  # what it alone is made from
        # Each picture's name, its caption, and what the page shows.
        self.shown: list[tuple[str, str, str]] = []
        self.films: set[str] = set()

    def make(self, most: int, how: dict[str, Any]) -> list[str]:
        """All of them, at most so many refocused ones; lines for the summary.

        `how`: aperture, tilt and box, as `plenofir.refocus.best_picture` takes them.
        """
        import numpy as np

        from plenofir.camera.lightfield.any_field import (
            central_view,
            is_rectangle,
            pictures_of,
            search_depth,
            sharp_everywhere,
            view_at,
        )
        from plenofir.camera.lightfield.enlarged import enlarged_view
        from plenofir.camera.lightfield.small_boxes import refocused_by_place
        from plenofir.camera.recognise.source import quiet
        from plenofir.refocus import setting_names

        pixels, m = self.field.picture.pixels, self.field.micro_image_size
        counts, large = (m, m), m
        source = self.look.source
        if is_rectangle(pixels):
            counts, large = pixels.shape[:2], 1
        central = central_view(pixels, m)
        self.add(
            "central_view.png",
            lambda: enlarged_view(self.look(central_view(source, m)).pixels, large),
            "The view in the middle",
        )
        searched = search_depth(
            pixels, m, progress=lambda done, total: self.show("searching depth", done, total)
        )
        self.disparity = searched.disparity
        low, high = _range(searched.disparity, central)
        settings = _settings(low, high, m, most)
        through, box = tuple(how.values()), how["box"]
        self.facts = (box,)

        def refocused(a: Fraction) -> "Image":
            if box is not None:
                return self.look(refocused_by_place(source, m, a, box, searched.disparity)).pixels
            return self.look(next(iter(pictures_of(source, m, [a], quiet, **how)))).pixels

        frames = []
        for number, (a, name) in enumerate(zip(settings, setting_names(settings, m), strict=True)):
            self.show("refocusing", number, len(settings))
            make, caption = partial(refocused, a), f"a = {a}{self.height(a)}"
            frames.append(self.add(f"refocused_{name}.png", make, caption, a, *through))
        nearest = searched.disparity.limited(low, high)
        self.show("all in focus", 0, 0)

        def sharp() -> "Image":
            image = sharp_everywhere(source, m, nearest, box=box)
            self.in_focus = np.rint(image / self.look.unit).astype(pixels.dtype)
            return self.look(image).pixels

        self.add("all_in_focus.png", sharp, "Sharp everywhere", None, *self.facts)
        self.through_focus(frames, settings, *through)
        self.animation(
            "views",
            lambda: [
                _small(self.look(view_at(source, m, v, u)).pixels, _VIEW_TIMES)
                for v, u in _around(*counts)
            ],
            "Around the lens",
        )
        lines = [
            f"range: a = {settings[0]} to {settings[-1]} by its own depths, {len(settings)} "
            "pictures",
            *self.depth(searched.disparity),
        ]
        if not self.films:
            lines.append("no WebM: OpenCV writes it: pip install opencv-python-headless")
        return lines

    def height(self, a: Fraction) -> str:
        """Where a plane lies in a microscope, for its caption."""
        from plenofir.camera.rays import MicroscopeModel

        if not isinstance(self.model, MicroscopeModel):
            return ""
        return f", z = {float(self.model.height_um(float(a))):.4g} um"

    def depth(self, disparity: "Disparity") -> list[str]:
        """The map of depths, in mm or um where the camera is known; lines for the summary."""
        import numpy as np

        from plenofir.camera.depth_picture import depth_picture
        from plenofir.camera.lightfield.disparity import sure_distances

        save(self.results, "disparity.npy", disparity.pixels_per_view)
        sure = disparity.confidence >= SURE
        unit = unit_of(self.model)
        if self.model is None:
            values = np.where(sure, disparity.pixels_per_view, np.nan)
        else:
            values = sure_distances(disparity, self.model, SURE)
            save(self.results, f"{MAPS[unit]}.npy", values)
        self.add("depth.png", lambda: depth_picture(values, unit), _CAPTIONS[unit])
        share = float(sure.mean())
        text = f"depth: known of {100 * share:.0f} % of the micro lenses"
        return [line for line in (text, doubt_of_depth(share, self.field)) if line]

    def viewer(self, title: str, exposed: "Exposure") -> None:
        """The viewer with the light field in it, one file."""
        from plenofir.view import export, light_field_page

        self.show("making the viewer", 0, 1)
        if self.reused("viewer.html", *self.facts):
            return
        picture = self.field.picture
        page = light_field_page(
            picture.pixels,
            self.field.micro_image_size,
            full_scale=picture.full_scale,
            title=title,
            model=self.model,
            gamma=picture.gamma,
            look=exposed,
            disparity=self.disparity,
            in_focus=self.in_focus,
        )
        self.results.write("viewer.html", export(page, _VIEWER_BYTES))

    def reused(self, name: str, *facts: object) -> bool:
        """Whether a file is that of an earlier run; facts: what it alone is made from."""
        kind = name.partition("_")[0], Path(name).suffix
        return self.earlier.take(name, key_of(self.mark, kind, facts), self.results)

    def add(
        self,
        name: str,
        make: "Callable[[], Image]",
        caption: str,
        a: Fraction | None = None,
        *facts: object,
    ) -> "Image":
        """A picture as it is shown; result: a small one."""
        from plenofir.camera.description import description_of
        from plenofir.ground.images import bare, read_image

        if self.reused(name, a, *facts):
            image = read_image(self.results.path(name))
        else:
            image = make()
            about = description_of(self.field.micro_image_size, a, self.model)
            save(self.results, name, bare(image)._replace(xmp=about))
        small = _small(image)
        self.shown.append((name, caption, _data_uri(small)))
        return small

    def through_focus(self, frames: "list[Image]", *facts: object) -> None:
        """An animation of refocused pictures."""
        # There and back, both ends once: the film runs in a loop.
        self.animation("focus", lambda: frames + frames[-2:0:-1], "Through the focus", *facts)

    def animation(
        self, name: str, make: "Callable[[], list[Image]]", caption: str, *facts: object
    ) -> None:
        """An endless GIF, and a WebM if OpenCV is installed."""
        from PIL import Image as Pillow

        from plenofir.ground.films import write_webm

        film = f"{name}.webm"
        there = [self.reused(f"{name}.gif", *facts), self.reused(film, *facts)]
        frames = [] if all(there) else make()
        if not there[0]:
            first, *others = [Pillow.fromarray(frame) for frame in frames]
            content = io.BytesIO()
            first.save(content, "GIF", save_all=True, append_images=others, duration=_STAYS, loop=0)
            self.results.write(f"{name}.gif", content.getvalue())
        self.show("animating", 1, 2)
        if there[1] or write_webm(self.results.path(film), frames, 1000 / _STAYS):
            self.films.add(film)
        else:
            # A film that is not there must not count as made.
            del self.earlier.keys[film]
        self.shown.append((f"{name}.gif", caption, f"{name}.gif"))


def _range(disparity: "Disparity", view: "Image") -> tuple[float, float]:
    """Range of depths that has the middle 96 % of what a view shows.

    What has no contrast counts little: noise can be matched at any depth.
    """
    import numpy as np
    from scipy import ndimage

    from plenofir.camera.calibration.frames import grey

    values = disparity.pixels_per_view.ravel()
    contrast = ndimage.gaussian_gradient_magnitude(grey(view).astype(np.float64), 1.0).ravel() ** 2
    weights = contrast * (disparity.confidence.ravel() >= SURE)
    if not weights.any():
        weights = np.ones(len(values))
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    first, last = np.searchsorted(below, np.array([0.02, 0.98]) * below[-1])
    return float(values[order][first]), float(values[order][last])


def _settings(low: float, high: float, m: int, most: int) -> list[Fraction]:
    """Focus settings over a range of depths: multiples of 1/M, evenly apart."""
    first, last = floor(low * m + _ASIDE), ceil(high * m - _ASIDE)
    if most == 1:
        first = last = (first + last) // 2
    step = max(1, ceil((last - first) / max(most - 1, 1)))
    return [Fraction(shift, m) for shift in range(first, last + 1, step)]


def _around(rows: int, columns: int) -> list[tuple[int, int]]:
    """Views on an ellipse about the middle one, (v, u), once around."""
    from math import cos, pi, sin

    down, right = (rows - 1) / 2, (columns - 1) / 2
    # Views at the rim of the pupil are dim, so the ellipse is 0.8 as wide; 24 of them take three
    # seconds.
    turns = [2 * pi * n / 24 for n in range(24)]
    places = [
        (round(down + 0.8 * down * sin(t)), round(right + 0.8 * right * cos(t))) for t in turns
    ]
    return [place for n, place in enumerate(places) if place != places[n - 1]] or places[:1]


def _small(image: "Image", times: int = 1 << 16) -> "Image":
    """A frame of an animation: 8 bit, its longer side always the same, or so many times its own."""
    import numpy as np
    from PIL import Image as Pillow

    from plenofir.ground.images import eight_bits

    eight = eight_bits(image)
    rows, columns = image.shape[:2]
    scale = min(times, _ANIMATION_PIXELS / max(rows, columns))
    size = max(1, round(columns * scale)), max(1, round(rows * scale))
    return np.asarray(Pillow.fromarray(eight).resize(size, Pillow.Resampling.BICUBIC))


def _data_uri(image: "Image") -> str:
    """A small picture within a page."""
    from plenofir.ground.images import encode_picture

    return "data:image/jpeg;base64," + base64.b64encode(encode_picture(".jpg", image)).decode()


def page(title: str, pictures: Album, lines: Sequence[str]) -> str:
    """A page of the pictures, which lie beside it."""

    def figure(name: str, caption: str, small: str) -> str:
        film = f"{Path(name).stem}.webm"
        also = f' (<a href="{film}">WebM</a>)' if film in pictures.films else ""
        return (
            f'<figure><a href="{name}"><img src="{small}" alt="{caption}"></a>'
            f"<figcaption>{caption}{also}</figcaption></figure>"
        )

    # Slices last: they are many.
    order = sorted(pictures.shown, key=lambda one: one[0].startswith("refocused"))
    figures = "\n".join(figure(*map(html.escape, one)) for one in order)
    said = "\n".join(f"<li>{html.escape(line)}</li>" for line in lines)
    viewer = '<p><a href="viewer.html">Refocus it by hand</a></p>\n' if pictures.by_hand else ""
    return (
        f'<!doctype html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n<h1>{html.escape(title)}</h1>\n"
        f"{viewer}<ul>\n{said}\n</ul>\n<main>\n{figures}\n</main>\n</body>\n</html>\n"
    )
