# SPDX-License-Identifier: Apache-2.0
"""A server in a thread, and the picture that a page shows."""

import asyncio
import base64
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from plenofir.view import Page
from plenofir.view.server import bound, serving

PIXELS = """async () => {
    const image = await plenofir.pixels();
    let text = "";
    for (let n = 0; n < image.data.length; n += 8192) {
        text += String.fromCharCode(...image.data.subarray(n, n + 8192));
    }
    return [image.height, image.width, btoa(text)];
}"""


@contextmanager
def served(page: Page) -> Iterator[str]:
    """The address of a page, served by a thread."""
    address: list[str] = []
    started, loop, ended = threading.Event(), asyncio.new_event_loop(), asyncio.Event()

    def ready(where: str) -> None:
        address.append(where)
        started.set()

    server = threading.Thread(
        target=lambda: loop.run_until_complete(serving(page, bound(0), ready, ended))
    )
    server.start()
    assert started.wait(30)
    try:
        yield address[0]
    finally:
        loop.call_soon_threadsafe(ended.set)
        server.join()
        loop.close()


def pixels(tab: Any) -> npt.NDArray[np.uint8]:
    """The picture on show, shape (rows, columns, 3)."""
    rows, columns, text = tab.evaluate(PIXELS)
    found = np.frombuffer(base64.b64decode(text), np.uint8).reshape(rows, columns, 4)
    assert (found[..., 3] == 255).all()
    return found[..., :3]
