# SPDX-License-Identifier: Apache-2.0
"""Files of recorded results: JSON with one entry per line, so that diffs show what changed.

The package reads one of them (`plenofir.fpga.resources.record`), which is written from here.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from plenofir.fpga.bitstream.open_build import NextpnrReport
from plenofir.fpga.resources.record import FILE, Figures, Placed, Record, load_record
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


def save_record(**sections: object) -> Record:
    """Write the file with some sections replaced, a design a line."""
    record = load_record().model_copy(update=sections)
    save_records(FILE, record.model_dump(exclude_defaults=True), levels=3)
    load_record.cache_clear()
    return load_record()


def record_design(section: str, place: str, name: str, entry: Figures | Placed) -> None:
    """Write the file with a design added to ``counted`` or ``placed``, or replaced there."""
    every: Mapping[str, Mapping[str, object]] = getattr(load_record(), section)
    save_record(**{section: {**every, place: {**every.get(place, {}), name: entry}}})


def record_name(scene: str, device: str, own_device: str) -> str:
    """Name of a scene's build: the scene's name, with the device if it is not the scene's own."""
    return scene if device == own_device else f"{scene} on {device}"


def load_builds() -> dict[str, NextpnrReport]:
    """Read the recorded builds, by name."""
    builds = load_record().builds
    return {name: NextpnrReport.model_validate(build) for name, build in builds.items()}


def save_builds(builds: Mapping[str, NextpnrReport]) -> None:
    """Record builds."""
    save_record(builds={name: build.model_dump() for name, build in builds.items()})
