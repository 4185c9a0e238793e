# SPDX-License-Identifier: Apache-2.0
"""Files of recorded results: JSON with one entry per line, so that diffs show what changed."""

import json
from pathlib import Path
from typing import Any

from plenofir.ground.files import write_file


def save_records(path: Path, content: Any, levels: int = 1) -> None:
    """Write what `records_text` makes."""
    write_file(path, records_text(content, levels))


def records_text(content: Any, levels: int = 1) -> str:
    """JSON; the entries of the innermost of some levels of lists and objects take a line each.

    What has no lists and objects in it takes one line.
    """
    return f"{_text(content, levels, '')}\n"


def _text(value: Any, levels: int, indent: str) -> str:
    deeper = f"{indent}  "
    if levels and isinstance(value, dict) and any(map(_is_nested, value.values())):
        entries = (f"{json.dumps(k)}: {_text(v, levels - 1, deeper)}" for k, v in value.items())
        return "{\n" + ",\n".join(deeper + entry for entry in entries) + f"\n{indent}}}"
    if levels and isinstance(value, list) and any(map(_is_nested, value)):
        entries = (_text(entry, levels - 1, deeper) for entry in value)
        return "[\n" + ",\n".join(deeper + entry for entry in entries) + f"\n{indent}]"
    return json.dumps(value)


def _is_nested(value: Any) -> bool:
    return isinstance(value, dict | list | tuple)
