# SPDX-License-Identifier: Apache-2.0
"""A real browser for the viewer's pages, one for all tests."""

import shutil
from collections.abc import Callable, Iterator
from typing import Any

import pytest

# WebGL 2 by the processor: no test machine needs a GPU.
SOFTWARE = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--disable-gpu-compositing",
)


# While it is open, the driver's event loop runs in this thread, so no other loop can.
@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, without a window."""
    path = shutil.which("chromium")
    if path is None:
        pytest.skip("chromium is not installed: sudo apt-get install chromium")
    driver = pytest.importorskip("playwright.sync_api")
    with driver.sync_playwright() as tools:
        chromium = tools.chromium.launch(executable_path=path, args=SOFTWARE)
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[..., Any]]:
    """Open an address and wait for its picture; afterwards no page may have complained."""
    complaints: list[str] = []
    contexts = []

    def opened(address: str, **options: Any) -> Any:
        size = options.pop("viewport", {"width": 500, "height": 300})
        context = browser.new_context(viewport=size, **options)
        contexts.append(context)
        # The machine may have other work.
        context.set_default_timeout(120_000)
        tab = context.new_page()
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.goto(address)
        tab.evaluate("plenofir.ready")
        return tab

    yield opened
    for context in contexts:
        context.close()
    # What the software renderer says of itself.
    assert [text for text in complaints if "GL Driver Message" not in text] == []
