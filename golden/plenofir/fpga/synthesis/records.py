# SPDX-License-Identifier: Apache-2.0
"""Files of recorded results: JSON with one entry per line, so that diffs show what changed."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def save_records(path: Path, content: Mapping[str, Any], levels: int = 1) -> None:
    """Write JSON; the entries of the innermost of some levels of objects take a line each."""
    path.write_text(f"{_text(content, levels, '')}\n")


def _text(value: Any, levels: int, indent: str) -> str:
    if not levels or not isinstance(value, Mapping) or not value:
        return json.dumps(value)
    deeper = f"{indent}  "
    lines = [
        f"{deeper}{json.dumps(key)}: {_text(entry, levels - 1, deeper)}"
        for key, entry in value.items()
    ]
    return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
