# SPDX-License-Identifier: Apache-2.0
"""A test picture for a computer to send to a board: a light field, pixel for pixel."""

import base64

import numpy as np

from plenofir.fpga.hdmi.marks import mark
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import encode_png, read_image
from plenofir.refocus.operator import Image

FLOWER = project.DATA / "flower_5x5.png"
"""The light field that scenes without an image are simulated with."""
FLOWER_MICRO_IMAGE_SIZE = 5


def flower_picture(columns: int, rows: int, m: int) -> Image:
    """The shipped flower with micro images of M x M pixels, repeated until it fills a screen.

    M of its 5 x 5 views are taken evenly along each side, the outer ones included; above five,
    views are repeated. InputError if the screen has no room for one micro image.
    """
    if m > min(columns, rows):
        raise InputError(
            f"a screen of {columns} x {rows} has no room for a micro image of M = {m}; use a "
            "smaller M"
        )
    flower, have = read_image(FLOWER), FLOWER_MICRO_IMAGE_SIZE
    views = np.round(np.linspace(0, have - 1, m)).astype(int)
    places = [
        (np.arange(-(-length // m))[:, None] % (there // have) * have + views).ravel()[:length]
        for length, there in ((rows, flower.shape[0]), (columns, flower.shape[1]))
    ]
    picture: Image = flower[np.ix_(*places)]
    return picture


def screen_picture(raw: Image, columns: int, rows: int, m: int, *, where: str) -> Image:
    """A light field at the upper left of a black screen, cropped to it.

    Micro images begin in the corner. InputError unless it has 8 bits a channel and at least one
    micro image.
    """
    if raw.dtype != np.uint8:
        raise InputError("has more than 8 bits a channel; a screen takes 8", where=where)
    if min(raw.shape[:2]) < m:
        raise InputError(f"is smaller than a micro image of {m} x {m} pixels", where=where)
    if raw.ndim == 2:
        raw = np.repeat(raw[:, :, np.newaxis], 3, axis=2)
    picture = np.zeros((rows, columns, 3), np.uint8)
    part = raw[: min(rows, raw.shape[0] // m * m), : min(columns, raw.shape[1] // m * m)]
    picture[: part.shape[0], : part.shape[1]] = part
    return picture


def marked_png(picture: Image) -> bytes:
    """PNG of a picture with the marks of `plenofir.fpga.hdmi.marks`, without any colour profile."""
    return encode_png(mark(picture))


def full_screen_page(png: bytes, columns: int, rows: int) -> str:
    """A page that shows a PNG in pixels of the screen, whatever the system's zoom.

    If the screen has another size, a message says so on top of the picture.
    """
    data = base64.b64encode(png).decode()
    return _PAGE.replace("COLUMNS", str(columns)).replace("ROWS", str(rows)).replace("DATA", data)


_PAGE = """\
<!doctype html>
<meta charset="utf-8">
<title>plenofir: COLUMNS x ROWS, press F</title>
<style>
  html, body { margin: 0; background: #000; overflow: hidden; cursor: none }
  img { display: block; image-rendering: pixelated }
  p { position: fixed; left: 2em; bottom: 2em; margin: 0; padding: 1em }
  p { background: #fff; color: #000; font: 16px sans-serif }
</style>
<img id="picture" alt="" src="data:image/png;base64,DATA">
<p id="words"></p>
<script>
  const picture = document.getElementById("picture"), words = document.getElementById("words");
  function fit() {
    const ratio = window.devicePixelRatio;
    picture.style.width = COLUMNS / ratio + "px";
    picture.style.height = ROWS / ratio + "px";
    const have = [screen.width, screen.height].map((length) => Math.round(length * ratio));
    const whole = document.fullscreenElement !== null || window.innerHeight === screen.height;
    words.textContent =
      have[0] !== COLUMNS || have[1] !== ROWS
        ? `This screen has ${have[0]} x ${have[1]} pixels; set it to COLUMNS x ROWS.`
        : "Press F for the whole screen.";
    words.hidden = have[0] === COLUMNS && have[1] === ROWS && whole;
  }
  addEventListener("resize", fit);
  addEventListener("keydown", (event) => {
    if (event.key.toLowerCase() === "f") document.documentElement.requestFullscreen();
  });
  fit();
</script>
"""
