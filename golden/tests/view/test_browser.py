# SPDX-License-Identifier: Apache-2.0
"""The viewer in a real browser: its pictures equal those of `refocus`."""

import base64
import io
import re
import signal
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from in_browser import pixels, served
from PIL import Image

from plenofir.camera.lightfield import all_in_focus, compose
from plenofir.camera.rays import MicroscopeModel, RayModel, load_camera, load_instrument
from plenofir.commands.looks import aperture_of, tilt_of
from plenofir.ground.images import eight_bits, read_image, write_png
from plenofir.ground.project import DATA
from plenofir.refocus import best_picture, output_offset, real_focus, refocus
from plenofir.view import (
    export,
    light_field_page,
)
from plenofir.view.views_and_depth import LightField

SAVED = """async () => {
    const bytes = new Uint8Array(await (await plenofir.picture()).arrayBuffer());
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
}"""
DESK = {"width": 900, "height": 700}
DETAIL = DATA / "flower_detail_5x5.png"


def cut(rows: int, columns: int) -> npt.NDArray[np.uint8]:
    return np.ascontiguousarray(read_image(DETAIL)[100 : 100 + rows, 100 : 100 + columns])


def coloured(raw: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return raw if raw.ndim == 3 else np.repeat(raw[..., None], 3, axis=2)


def page_of(raw: npt.NDArray[Any], m: int, **options: Any) -> Any:
    full_scale = int(np.iinfo(raw.dtype).max)
    return light_field_page(raw, m, full_scale=full_scale, title="test", **options)


def sums_of_views(
    raw: npt.NDArray[Any], m: int, a: float, weights: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Mean of views that move by the nearest whole pixels, of those that reach a pixel."""
    whole, shape = int(np.floor(a * m)), raw.shape[:2]
    rest = a * m - whole
    start = output_offset(m, whole, "centred")
    more = output_offset(m, whole + 1, "centred") - start
    total, reached = np.zeros((*shape, 3)), np.zeros((*shape, 1))
    for v, u in np.ndindex(m, m):
        places = []
        for i, length in zip((v, u), shape, strict=True):
            k = np.arange(length) + start - i * whole + int(np.floor(rest * (more - i) + 0.5))
            k = m * (k // m) + i
            places.append((np.clip(k, 0, length - 1), (k >= 0) & (k < length)))
        (rows, in_rows), (columns, in_columns) = places
        weight = weights[v, u] * np.outer(in_rows, in_columns)[..., None]
        total += weight * coloured(raw)[np.ix_(rows, columns)]
        reached += weight
    return total / np.maximum(reached, 1e-9)


def test_the_command_shows_what_refocus_computes(open_page: Any, tmp_path: Path) -> None:
    m, file = 5, tmp_path / "detail.png"
    # No multiple of M.
    raw = cut(83, 121)
    write_png(file, raw)
    words = ["view", str(file), "-M", str(m), "--camera", "f193-mla2", "--focus", "3000"]
    with subprocess.Popen(
        [sys.executable, "-m", "plenofir", *words, "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    ) as command:
        try:
            assert command.stdout is not None
            address = command.stdout.readline().split()[0]
            tab = open_page(address)
            for shift in (0, -3, 5, 12):
                tab.evaluate("a => plenofir.setFocus(a)", shift / m)
                found = pixels(tab)
                want = refocus(raw, m, Fraction(shift, m), border="normalise")
                assert (found == want).all(), shift
            _check_controls(tab, raw, m)
            _check_pointer(tab, m)
            _check_address(tab, open_page)
        finally:
            command.send_signal(signal.SIGINT)
        assert command.wait(60) == 0


def _check_controls(tab: Any, raw: npt.NDArray[Any], m: int) -> None:
    everything = np.ones((m, m))
    tab.evaluate("plenofir.setFocus(-0.47)")
    want = np.floor(sums_of_views(raw, m, -0.47, everything) + 0.5)
    assert (pixels(tab) == want).all()
    # The slider and its key: a step of the page, not of the control.
    tab.locator("#focus").fill("0.6")
    tab.locator("#picture").press("ArrowRight")
    assert tab.evaluate("plenofir.state.focus") == pytest.approx(0.8)
    assert "a = 0.8 = 4/5" in tab.locator("#focus-text").inner_text()
    # Typed: a fraction, a decimal, and what is no number.
    typed = tab.locator("#typed")
    assert typed.input_value() == "4/5"
    for text, a in (("-1/3", -1 / 3), (".2062", 0.2062), ("3 / -4", -0.75)):
        typed.fill(text)
        typed.press("Enter")
        assert tab.evaluate("plenofir.state.focus") == pytest.approx(a)
    for text in ("1/0", "", "1/2/3", "0x10", "1e9", "101", "much"):
        typed.fill(text)
        typed.press("Enter")
        assert "a is a number such as" in tab.locator("#message").inner_text(), text
        assert tab.evaluate("plenofir.state.focus") == -0.75
    typed.fill("0.8")
    typed.press("Enter")
    assert not tab.locator("#message").inner_text()
    # One view, and a place between two.
    tab.evaluate("Promise.all([plenofir.setAperture(0.001), plenofir.setView(1, 3)])")
    weights = np.zeros((m, m))
    weights[3, 1] = 1
    assert (pixels(tab) == sums_of_views(raw, m, 0.8, weights)).all()
    tab.evaluate("plenofir.setView(1.25, 3)")
    weights[3, 1:3] = 0.75, 0.25
    mixed = sums_of_views(raw, m, 0.8, weights)
    assert np.abs(pixels(tab) - mixed).max() <= 0.501
    # Light of twice as much.
    tab.evaluate("Promise.all([plenofir.setView(1, 3), plenofir.setExposure(1)])")
    weights[3] = 0, 1, 0, 0, 0
    brighter = np.minimum(sums_of_views(raw, m, 0.8, weights) * 2 ** (1 / 2.2), 255)
    assert np.abs(pixels(tab) - brighter).max() <= 0.501
    tab.keyboard.press("0")
    assert tab.evaluate("plenofir.state") == {
        "focus": 0,
        "tilt": [0, 0],
        "aperture": 1,
        "view": [2, 2],
        "exposure": {"black": 0, "white": 255, "gamma": 1, "ev": 0, "shoulder": 1},
        "smooth": True,
        "mode": "refocused",
        "zoom": 1,
        "centre": [0.5, 0.5],
    }
    with pytest.raises(Exception, match="not a number"):
        tab.evaluate("plenofir.setFocus('near')")


def _check_pointer(tab: Any, m: int) -> None:
    tab.evaluate("plenofir.depth")
    x, y = tab.evaluate("plenofir.placeOf(0.6, 0.4)")
    depth = tab.evaluate("plenofir.depthAt(0.6, 0.4)")
    # The flower.
    assert -0.8 < depth < -0.3
    tab.mouse.click(x, y)
    assert tab.evaluate("plenofir.state.focus") == pytest.approx(depth)
    model = RayModel.focused(load_camera("f193-mla2"), 3000, m)
    tab.evaluate("plenofir.setFocus(0.4)")
    tab.mouse.move(x + 1, y)
    for place, border in (("#plane", "distance"), ("#depth-of-field", "near_border")):
        mm = float(getattr(model, border)(0.4).mm)
        text = tab.locator(place).inner_text().replace("\u202f", "")
        assert text.startswith(f"{mm:.1f} "), text
    assert f"a = {depth:.2f}, beyond infinity" in tab.locator("#pointed").inner_text()
    assert tab.locator("#bench .plane").count() == tab.locator("#bench .pointed").count() == 1
    # A drag looks around, through a smaller aperture.
    tab.mouse.down()
    tab.mouse.move(x + 40, y, steps=2)
    tab.mouse.up()
    state = tab.evaluate("plenofir.state")
    assert state["view"][0] > 2
    assert state["aperture"] < 0.5
    assert state["focus"] == 0.4


def _check_address(tab: Any, open_page: Any) -> None:
    tab.evaluate("plenofir.setMode('depth')")
    shown = pixels(tab)
    assert len(np.unique(shown.reshape(-1, 3), axis=0)) > 4
    assert "show=depth" in tab.url
    state = tab.evaluate("plenofir.state")
    # A telephone, and a finger.
    small = {"width": 360, "height": 640}
    other = open_page(tab.url, viewport=small, has_touch=True, is_mobile=True)
    other.evaluate("plenofir.depth")
    again = other.evaluate("plenofir.state")
    assert again == {**state, "view": pytest.approx(state["view"], abs=1e-4)} | {
        "aperture": pytest.approx(state["aperture"], abs=1e-4)
    }
    assert (pixels(other) == shown).all()
    assert other.evaluate("document.documentElement.scrollWidth") <= 360
    other.locator("#picture").tap()
    assert other.evaluate("plenofir.state.focus") != state["focus"]
    assert other.evaluate("plenofir.state.mode") == "refocused"


def test_two_fingers_zoom_and_a_zoomed_picture_is_dragged(open_page: Any) -> None:
    m, raw = 5, cut(80, 120)
    phone = {"viewport": {"width": 360, "height": 640}, "has_touch": True, "is_mobile": True}
    with served(page_of(raw, m)) as address:
        tab = open_page(address, **phone)
        x, y = tab.evaluate("plenofir.placeOf(0.5, 0.5)")
        fingers = tab.context.new_cdp_session(tab)

        def touch(kind: str, *places: float) -> None:
            points = [{"x": at, "y": y, "id": n} for n, at in enumerate(places)]
            fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        touch("touchStart", x - 20)
        touch("touchStart", x - 20, x + 20)
        for step in range(1, 6):
            touch("touchMove", x - 20 - 8 * step, x + 20 + 8 * step)
        touch("touchEnd")
        assert tab.evaluate("plenofir.state.zoom") == pytest.approx(3, rel=0.1)
        # The place between the fingers stays, and nothing else has changed.
        assert tab.evaluate("plenofir.placeOf(0.5, 0.5)") == pytest.approx([x, y], abs=6)
        assert tab.evaluate("plenofir.state.view") == [2, 2]
        touch("touchStart", x)
        for step in range(1, 6):
            touch("touchMove", x + 8 * step)
        touch("touchEnd")
        moved = tab.evaluate("plenofir.placeOf(0.5, 0.5)")
        assert moved[0] - x == pytest.approx(40, abs=8)
        assert tab.evaluate("plenofir.state.view") == [2, 2]
        tab.wait_for_function("() => location.hash.includes('zoom=')")


def test_16_bit_and_a_lost_context(open_page: Any) -> None:
    m = 3
    raw = np.random.default_rng(5).integers(0, 65536, (31, 44, 3), dtype=np.uint16)
    with served(page_of(raw, m)) as address:
        tab = open_page(address)
        tab.evaluate("plenofir.setFocus(-2 / 3)")
        found = pixels(tab)
        want = eight_bits(refocus(raw, m, "-2/3", border="normalise"))
        assert (found == want).all()
        tab.evaluate("""() => new Promise((done) => {
            const gl = document.getElementById("picture").getContext("webgl2");
            const lost = gl.getExtension("WEBGL_lose_context");
            const wait = (name, then) => gl.canvas.addEventListener(name, () => setTimeout(then));
            wait("webglcontextlost", () => lost.restoreContext());
            wait("webglcontextrestored", done);
            lost.loseContext();
        })""")
        assert (pixels(tab) == found).all()


def test_an_image_too_large_for_the_gpu_is_scaled_down_and_said_so(open_page: Any) -> None:
    m, columns = 2, 16404
    raw = np.random.default_rng(6).integers(0, 256, (8, columns), dtype=np.uint8)
    with served(page_of(raw, m)) as address:
        tab = open_page(address)
        bin_ = int(re.findall(r"(\d+) x \1 micro lenses are drawn as one", tab.content())[0])
        tab.evaluate("plenofir.depth")
        tab.evaluate("a => plenofir.setFocus(a)", 3 / m * bin_)
        found = pixels(tab)
    assert bin_ > 1
    # Shifts are those of the micro lenses that were made one.
    binned = compose(LightField(raw, m).views(bin_))
    want = refocus(binned, m, Fraction(3, m), border="normalise")[
        : found.shape[0], : found.shape[1]
    ]
    assert found.shape[1] == -(-columns // bin_)
    assert (found == coloured(want)).all()


def test_an_export_opens_from_a_file_without_a_network(open_page: Any, tmp_path: Path) -> None:
    m, raw = 5, cut(80, 80)
    model = RayModel.focused(load_camera("f193-mla2"), 3000, m)
    # Characters with a meaning in HTML.
    page = light_field_page(raw, m, full_scale=255, title="</script><b>", model=model)
    file = tmp_path / "export.html"
    file.write_bytes(export(page, 220_000))
    assert file.stat().st_size <= 220_000
    tab = open_page(file.as_uri(), offline=True)
    assert tab.locator("#title").inner_text() == "</script><b>"
    tab.evaluate("plenofir.setFocus(0.6)")
    assert "Views without loss." in tab.locator("#notes").inner_text()
    assert (pixels(tab) == refocus(raw, m, "3/5", border="normalise")).all()
    assert "mm" in tab.locator("#plane").inner_text()
    assert tab.evaluate("plenofir.depthAt(0.5, 0.5)") < -0.3
    # Less room: with losses.
    limit = file.stat().st_size - 4000
    file.write_bytes(export(page, limit))
    assert file.stat().st_size <= limit
    tab.reload()
    assert "WEBP" in tab.locator("#notes").inner_text()
    want = refocus(raw, m, "3/5", border="normalise")
    error = np.abs(pixels(tab).astype(int) - want).mean()
    assert 0 < error < 5


def saved(tab: Any) -> npt.NDArray[np.float64]:
    """The picture as the button saves it: smooth."""
    png = base64.b64decode(tab.evaluate(SAVED))
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), np.float64)


def options_shown(tab: Any) -> dict[str, Any]:
    """The command line of the page, as the commands read it."""
    words = tab.locator("#command").inner_text().split()
    told = dict(zip(words[::2], words[1::2], strict=True))
    return {
        "a": real_focus(told["-a"]),
        "aperture": aperture_of(told.get("--aperture")),
        "tilt": tilt_of(told.get("--tilt")),
    }


@pytest.mark.parametrize("m", [4, 5])
def test_smooth_pictures_are_those_of_the_commands(open_page: Any, m: int) -> None:
    """Apertures of any size and place, tilts and even M: with the options that the page shows."""
    raw = cut(19 * m + 2, 23 * m + 3)
    with served(page_of(raw, m)) as address:
        tab = open_page(address)
        tab.evaluate("plenofir.setLevels('stored')")
        for share, view, a, tilt in (
            (1, (2, 2), 0.6, (0, 0)),
            (1, (2, 2), -0.37, (0, 0)),
            (0.3, (1.3, 2.1), -0.4, (0, 0)),
            (0.001, (0, 3), 0.31, (0, 0)),
            (0.5, (m / 2 - 0.5,) * 2, 0.1, (-0.7, 0.4)),
            (1, (2, 2), -0.2, (0.3, 0)),
        ):
            steps = (
                f"setAperture({share})",
                f"setView({view[0]}, {view[1]})",
                f"setFocus({a})",
                f"setTilt({tilt[0]}, {tilt[1]})",
            )
            tab.evaluate(f"Promise.all([{', '.join(f'plenofir.{step}' for step in steps)}])")
            told = options_shown(tab)
            assert (float(told["a"]), told["tilt"]) == (pytest.approx(a), tilt)
            assert (told["aperture"] is None) == (share == 1)
            want = best_picture(raw, m, **told)
            # Lines and columns near the border have no pixels a lens away; `best_picture` rounds
            # the pictures of all views to 8 bits before it sharpens them.
            off = np.abs(saved(tab) - coloured(want))[m:-m, m:-m]
            assert (off.max() <= (3 if told["aperture"] is None else 1), off.mean() < 0.4) == (
                True,
                True,
            ), (share, view, a, tilt, off.max(), off.mean())


def test_a_plane_is_tilted_through_three_points(open_page: Any) -> None:
    m = 5
    # The planes of the picture lie at several depths.
    raw = np.ascontiguousarray(read_image(DATA / "planes_5x5.png")[:300, :400])
    places = (0.15, 0.3), (0.8, 0.25), (0.45, 0.85)
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

    def choose(tab: Any, *chosen: tuple[float, float], touch: bool = False) -> None:
        for n, place in enumerate(chosen):
            assert tab.locator("#message").inner_text() == f"Tilt: choose point {n + 1} of 3"
            assert tab.locator("#corners span").count() == n
            x, y = tab.evaluate(f"plenofir.placeOf({place[0]}, {place[1]})")
            (tab.touchscreen.tap if touch else tab.mouse.click)(x, y)
        assert tab.locator("#corners span").count() == 0

    with served(page_of(raw, m)) as address:
        for touch in (True, False):
            tab = open_page(address, **(phone if touch else {"viewport": DESK}))
            tab.evaluate("plenofir.depth")
            tab.evaluate("plenofir.setLevels('stored')")
            tab.evaluate("plenofir.setFocus(0.25)")
            depths = [tab.evaluate(f"plenofir.tiltPoint({x}, {y})") for x, y in places]
            if touch:
                tab.locator("#tilt").tap()
            else:
                tab.keyboard.press("t")
            choose(tab, *places, touch=touch)
            state = tab.evaluate("plenofir.state")
            corners = np.array([[1, 2 * x - 1, 2 * y - 1] for x, y in places])
            # A pixel of the screen is more than one of the picture.
            assert corners @ [state["focus"], *state["tilt"]] == pytest.approx(depths, abs=0.03)
        want = best_picture(raw, m, **options_shown(tab))
        assert np.abs(saved(tab) - coloured(want))[m:-m, m:-m].max() <= 1
        assert "tilt=" in tab.url
        # What is no plane is told, and changes nothing.
        for points in (((0.2, 0.2), (0.5, 0.5), (0.8, 0.8)), 3 * ((0.5, 0.5),)):
            tab.locator("#tilt").click()
            choose(tab, *points)
            assert "on a line" in tab.locator("#message").inner_text()
        steep = "plenofir.tiltThrough([[0.4, 0.4, -60], [0.6, 0.4, 60], [0.5, 0.6, 0]])"
        with pytest.raises(Exception, match="too steep"):
            tab.evaluate(steep)
        assert tab.evaluate("plenofir.state.tilt") == state["tilt"]
        tab.keyboard.press("t")
        tab.keyboard.press("Escape")
        assert tab.locator("#message").inner_text() == ""
        tab.locator("#flat").click()
        assert tab.evaluate("plenofir.state.tilt") == [0, 0]
        assert tab.locator("#flat").is_hidden()


def test_planes_of_a_microscope_are_in_um(open_page: Any) -> None:
    m = 5
    model = MicroscopeModel(load_instrument("lfm-antleg-20x"), m)
    page = light_field_page(cut(40, 50), m, full_scale=255, title="leg", model=model)
    with served(page) as address:
        tab = open_page(address)
        tab.evaluate("plenofir.setFocus(0.35)")
        far, near = (float(z) for z in model.depth_of_field_um(0.35))
        assert tab.locator("#plane").inner_text() == f"{float(model.height_um(0.35)):.1f} µm"
        assert tab.locator("#depth-of-field").inner_text() == f"{near:.1f} to {far:.1f} µm"
        assert tab.locator("#bench").is_hidden()


@pytest.mark.parametrize("m", [4, 5])
def test_all_in_focus_is_that_of_the_commands(open_page: Any, tmp_path: Path, m: int) -> None:
    raw = cut(30 * m, 36 * m)
    page, file = page_of(raw, m), tmp_path / "export.html"
    file.write_bytes(export(page, 300_000))
    want = coloured(all_in_focus(raw, m)).astype(np.float64)
    with served(page) as address:
        for where, most in ((address, 0), (file.as_uri(), 3)):
            tab = open_page(where)
            tab.evaluate("plenofir.setLevels('stored')")
            tab.evaluate("plenofir.setMode('sharp')")
            # An export has little room for it.
            assert np.abs(saved(tab) - want).mean() <= most


@pytest.mark.slow
def test_a_whole_sensor(open_page: Any) -> None:
    m = 11
    raw = np.random.default_rng(7).integers(0, 256, (3201, 3201), dtype=np.uint8)
    with served(page_of(raw, m, search=(-1.0, 1.0))) as address:
        tab = open_page(address)
        tab.evaluate("plenofir.setFocus(3 / 11)")
        assert (pixels(tab) == coloured(refocus(raw, m, "3/11", border="normalise"))).all()
