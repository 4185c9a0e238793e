# SPDX-License-Identifier: Apache-2.0
"""A page of the viewer as one file, which opens without a server and without a network."""

import base64
import html
import json
import re
from collections.abc import Mapping

from plenofir.view.page import STYLE, Page, Part

_STYLE_LINK = '<link rel="stylesheet" href="view.css">'
_MAIN = re.compile(r'<script type="module" src="[^"]*"></script>')
_IMPORT = re.compile(r'from "\./([a-z_]+\.js)"')
# A data URL has no base for "./".
_ROOM = "plenofir/"
# Nothing is loaded from anywhere.
_POLICY = (
    '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
    "script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; img-src data: blob:\">"
)
# Bytes around the data, and for longer notes.
_TAGS = 4096


def _data(name: str, part: Part) -> str:
    text = base64.b64encode(part.content).decode()
    facts = "".join(f' data-{key}="{html.escape(value)}"' for key, value in part.facts.items())
    return (
        f'<script type="text/plain" id="data-{html.escape(name)}"'
        f' data-type="{html.escape(part.kind)}"{facts}>{text}</script>'
    )


def _json(content: Mapping[str, object]) -> str:
    """JSON that cannot end the element it stands in."""
    return json.dumps(content, allow_nan=False).replace("<", "\\u003c")


def export(page: Page, limit: int) -> bytes:
    """Put a page with its data into one HTML file of at most `limit` bytes.

    Views are compressed: without loss if that fits; else 16 bit ones in 256 steps of brightness;
    scaled down if nothing else fits. The page says which.
    """
    room = limit - len(_assembled(page, page.field, {})) - _TAGS
    # Base64 has four bytes for three.
    return _assembled(page, *page.packed(max(room, 0) // 4 * 3))


def _assembled(page: Page, field: Mapping[str, object], parts: Mapping[str, Part]) -> bytes:
    scripts = {
        name: _IMPORT.sub(rf'from "{_ROOM}\1"', page.asset(name).decode()) for name in page.scripts
    }
    main = scripts.pop(page.scripts[-1])
    # Modules import each other by name, which must be resolved within the file.
    modules = {
        f"{_ROOM}{name}": f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"
        for name, text in scripts.items()
    }
    whole = [
        *(_data(name, part) for name, part in parts.items()),
        f'<script type="application/json" id="data-field">{_json(field)}</script>',
        f'<script type="importmap">{_json({"imports": modules})}</script>',
        f'<script type="module">{main}</script>',
    ]
    document = page.asset(page.document).decode()
    document = document.replace("<head>", f"<head>\n{_POLICY}", 1)
    document = document.replace(_STYLE_LINK, f"<style>{page.asset(STYLE).decode()}</style>", 1)
    return _MAIN.sub(lambda _: "\n".join(whole), document, count=1).encode()
