# SPDX-License-Identifier: Apache-2.0
"""The viewer in Chromium and in Firefox: values, exposure, zoom, files."""

import base64
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from firefox import Tab, firefox, missing
from in_browser import pixels, served
from PIL import Image as PillowImage

from plenofir.camera.exposure import exposure
from plenofir.ground.images import Picture, bare, read_image, write_png
from plenofir.ground.project import DATA
from plenofir.refocus import best_picture, refocus
from plenofir.view import export, light_field_page, pictures_page

M = 5
TEXT = """((bytes) => {
    let text = "";
    for (let n = 0; n < bytes.length; n += 8192) {
        text += String.fromCharCode(...bytes.subarray(n, n + 8192));
    }
    return btoa(text);
})"""
BYTES = """async (make) => {
    const blob = await (await (0, eval)(make))();
    const bytes = new Uint8Array(await blob.arrayBuffer());
    return [blob.type, TEXT(bytes)];
}""".replace("TEXT", TEXT)


class ChromiumTab:
    """A tab of Playwright with the few names that both browsers share; see `Tab`."""

    def __init__(self, tab: Any) -> None:
        self.tab = tab

    def goto(self, address: str) -> None:
        self.tab.goto(address)

    def evaluate(self, expression: str, argument: Any = None) -> Any:
        return self.tab.evaluate(expression, argument)

    def press(self, key: str) -> None:
        self.tab.keyboard.press(key)

    def wheel(self, x: int, y: int, delta: int) -> None:
        self.tab.mouse.move(x, y)
        self.tab.mouse.wheel(0, delta)
        self.tab.wait_for_timeout(100)


@pytest.fixture(scope="module", params=["chromium", "firefox"])
def window(request: pytest.FixtureRequest) -> Iterator["Tab | ChromiumTab"]:
    """A window of a browser, 700 x 500."""
    if request.param == "firefox":
        if missing():
            pytest.skip(missing())
        with firefox() as tab:
            tab.resize(700, 500)
            yield tab
        return
    browser = request.getfixturevalue("browser")
    context = browser.new_context(viewport={"width": 700, "height": 500})
    context.set_default_timeout(120_000)
    yield ChromiumTab(context.new_page())
    context.close()


def opened(window: Any, address: str) -> Any:
    # The same address with other words after # is no other page.
    window.goto("about:blank")
    window.goto(address)
    window.evaluate("plenofir.ready")
    return window


def dark() -> Picture:
    """A light field of 16 bit in linear light whose brightest value is 1/1000 of white."""
    flower = read_image(DATA / "flower_detail_5x5.png")[100:190, 100:215].astype(np.float64)
    values = np.rint(10 + 55 * (flower / 255) ** 2.2).astype(np.uint16)
    return Picture(values, 65535, 1.0)


def page_of(picture: Picture, **options: Any) -> Any:
    pixels_, full_scale, gamma, *_ = picture
    return light_field_page(pixels_, M, full_scale=full_scale, gamma=gamma, title="t", **options)


def test_a_dark_file_is_exposed_as_commands_do(window: Any, tmp_path: Path) -> None:
    picture = dark()
    page, file = page_of(picture), tmp_path / "export.html"
    want = refocus(picture.pixels, M, "2/5", border="normalise")
    with served(page) as address:
        # An export in one browser, the server's page in the other.
        if isinstance(window, Tab):
            file.write_bytes(export(page, 8_000_000))
            address = file.as_uri()
        tab = opened(window, address)
        tab.evaluate("plenofir.setFocus(2 / 5)")
        look = exposure(picture, M)
        assert (pixels(tab) == look.apply(want, np.uint8)).all()
        # Most of what the screen can is used.
        assert pixels(tab).max() > 230
        tab.evaluate("plenofir.setExposure(-1.5)")
        assert (pixels(tab) == look._replace(ev=-1.5).apply(want, np.uint8)).all()
        tab.evaluate("plenofir.setLevels('stored')")
        stored = exposure(picture, M, "off")
        assert (pixels(tab) == stored.apply(want, np.uint8)).all()
        # The slider's end reaches the darkest.
        label = "document.getElementById('histogram').getAttribute('aria-label')"
        assert "of the pixels are black" in tab.evaluate(label)
        tab.press("x")
        assert tab.evaluate("plenofir.state.exposure") == {
            name: pytest.approx(value) for name, value in look._asdict().items()
        }


def test_zoom_keeps_the_place_and_changes_no_pixel(window: Any) -> None:
    picture = bare(read_image(DATA / "flower_detail_5x5.png")[:120, :150])
    with served(page_of(picture)) as address:
        tab = opened(window, address)
        before = pixels(tab)
        tab.evaluate("plenofir.setZoom(4, 0.5, 0.5)")
        place = "plenofir.placeOf(0.45, 0.52)"
        x, y = (round(n) for n in tab.evaluate(place))
        tab.wheel(x, y, -300)
        # Firefox counts what a wheel turns in pixels of its own.
        assert 4.2 < tab.evaluate("plenofir.state.zoom") < 12
        assert tab.evaluate(place) == pytest.approx([x, y], abs=2)
        assert (pixels(tab) == before).all()
        for key in "ljki":
            tab.press(key)
        tab.press("q")
        tab.press("f")
        assert tab.evaluate("plenofir.state.zoom") == 1


SCREEN = """async () => {
    const gl = document.getElementById("picture").getContext("webgl2");
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const found = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, found);
    return [height, width, TEXT(found)];
}""".replace("TEXT", TEXT)


def screen(tab: Any) -> np.ndarray:
    rows, columns, text = tab.evaluate(SCREEN)
    return np.frombuffer(base64.b64decode(text), np.uint8).reshape(rows, columns, 4)[::-1, :, :3]


def test_the_screen_shows_pixels_or_what_lies_between_micro_lenses(window: Any) -> None:
    # Fills the screen by a whole number: each pixel of the picture is 5 x 5 of it.
    rng = np.random.default_rng(2)
    raw = rng.integers(0, 256, (60, 70, 3), dtype=np.uint8)
    with served(page_of(bare(raw))) as address:
        tab = opened(window, address)
        scale = "([zoom, x, y]) => plenofir.setZoom(zoom, x, y)"
        left, right = (tab.evaluate(f"plenofir.placeOf({x}, 0)")[0] for x in (0, 1))
        tab.evaluate(scale, [8 * 70 / (right - left), 0.5, 0.5])
        tab.evaluate("plenofir.setSmooth(false)")
        x, y = (round(n) for n in tab.evaluate("plenofir.placeOf(30 / 70, 25 / 60)"))
        shown = screen(tab)[y : y + 80, x : x + 80]
        want = refocus(raw, M, 0, border="normalise")[25:35, 30:40]
        assert (shown[4::8, 4::8] == want).all()
        # Or, as the commands make it, what lies between micro lenses, sharpened.
        tab.evaluate("plenofir.setSmooth(true)")
        # Settings between multiples of 1/M, too.
        for a in (0, 0.27, -0.47):
            tab.evaluate(f"plenofir.setFocus({a})")
            smooth = screen(tab)[y : y + 80, x : x + 80][4::8, 4::8].astype(int)
            off = np.abs(smooth - best_picture(raw, M, a)[25:35, 30:40])
            # Pixels of the screen lie 1/16 of a pixel beside the middle of the picture's.
            assert (off.max() <= 4, off.mean() < 1) == (True, True)


INSIDE = """id => {
    const { top, bottom, height } = document.getElementById(id).getBoundingClientRect();
    return height > 0 && top >= 0 && bottom <= innerHeight;
}"""


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_the_picture_and_its_files_stay_on_show(browser: Any, size: tuple[int, int]) -> None:
    context = browser.new_context(viewport={"width": size[0], "height": size[1]})
    tab = context.new_page()
    with served(page_of(bare(read_image(DATA / "flower_detail_5x5.png")[:120, :150]))) as address:
        opened(tab, address)
        for name in ("save", "film-focus", "film-view", "keys", "tilt"):
            assert tab.evaluate(INSIDE, name), name
        assert tab.evaluate(INSIDE, "picture")
        tab.evaluate("scrollTo(0, document.body.scrollHeight)")
        assert tab.evaluate(INSIDE, "picture")
    context.close()


def test_pictures_and_films_are_saved(window: Any, tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2")
    raw = np.ascontiguousarray(read_image(DATA / "planes_5x5.png")[100:250, 150:385])
    with served(page_of(bare(raw))) as address:
        tab = opened(window, address)
        tab.evaluate("plenofir.depth")
        tab.evaluate("plenofir.setSmooth(false)")
        kind, text = tab.evaluate(BYTES, "plenofir.picture")
        found = np.asarray(PillowImage.open(io.BytesIO(base64.b64decode(text))))
        assert kind == "image/png"
        assert (found[..., :3] == refocus(raw, M, 0, border="normalise")).all()
        # What a film shows is the same in both browsers, how it is recorded is not.
        film = "focus" if isinstance(window, Tab) else "view"
        kind, text = tab.evaluate(BYTES, f"() => plenofir.film('{film}')")
        file = tmp_path / f"{film}.{kind.split('/')[1]}"
        file.write_bytes(base64.b64decode(text))
        video, frames = cv2.VideoCapture(str(file)), []
        while (read := video.read())[0]:
            frames.append(read[1])
        assert len(frames) >= 10
        assert frames[0].shape == (150, 236, 3)
        # It moves, and comes back.
        apart = [np.abs(frame.astype(int) - frames[0]).mean() for frame in frames]
        assert max(apart) > 2 * apart[-1]
        assert np.median([frame.mean() for frame in frames]) == pytest.approx(raw.mean(), 0.2)


def test_dark_pictures_of_a_folder_are_exposed_and_compared_to_the_bit(
    window: Any, tmp_path: Path
) -> None:
    picture = dark()
    golden = refocus(picture.pixels, M, 0)
    other = golden.copy()
    other[3, 4] += 1
    write_png(tmp_path / "golden.png", picture.like(golden))
    write_png(tmp_path / "refocused.png", picture.like(other))
    with served(pictures_page(tmp_path)) as address:
        tab = opened(window, address)
        found = tab.evaluate("plenofir.compared")
        assert found == {"largest": 1, "differ": 1, "pixels": golden.shape[0] * golden.shape[1]}
        look = exposure(picture.like(other), 1)
        assert (pixels(tab) == look.apply(other, np.uint8)).all()
        tab.evaluate("plenofir.setExposure(0, 'stored')")
        stored = exposure(picture.like(other), 1, "off")
        assert (pixels(tab) == stored.apply(other, np.uint8)).all()
        tab.evaluate("plenofir.setExposure(0, 'auto')")
        tab.press("e")
        tab.press("f")


def test_a_reader_of_the_screen_is_told(window: Any) -> None:
    raw = read_image(DATA / "flower_detail_5x5.png")[:60, :60]
    with served(page_of(bare(raw))) as address:
        tab = opened(window, address)
        tab.evaluate("plenofir.setFocus(0.4)")
        unnamed = """[...document.querySelectorAll("button, input, select, canvas, [role=img]")]
            .filter((one) => !one.labels?.length && !one.textContent.trim())
            .filter((one) => !one.getAttribute("aria-label"))
            .map((one) => one.id)"""
        assert tab.evaluate(unnamed) == []
        read = "document.getElementById('{}').getAttribute('{}')"
        assert tab.evaluate(read.format("focus", "aria-valuetext")) == "a = 0.4 = 2/5"
        assert tab.evaluate(read.format("picture", "aria-label")) == "Refocused to a = 0.4 = 2/5"
