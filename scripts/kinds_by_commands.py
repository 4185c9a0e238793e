# SPDX-License-Identifier: Apache-2.0
"""What the commands do with each kind: the table of the documentation."""

from typing import NamedTuple, get_args

from plenofir.camera.recognise.source import Kind

COMMANDS = (
    "`develop`, `view`",
    "`refocus`, `stack`, `depth-map`, `views`, `mosaic`, `quilt`",
    "`compose`",
    "`decode`",
    "`calibrate`",
    "`batch`",
)
"""Columns of the table."""

_REFUSED, _TAKEN = "refused", "taken"


class Use(NamedTuple):
    """What the commands of each column do with a kind."""

    shown: str = _REFUSED
    refocused: str = _REFUSED
    composed: str = _REFUSED
    decoded: str = _REFUSED
    calibrated: str = _REFUSED
    batch: str = _REFUSED

    @property
    def is_light_field(self) -> bool:
        """Whether the kind is a light field without anything else given."""
        return self.refocused == _TAKEN


# An aligned raw image has one M.
_VIEWS = Use(_TAKEN, _TAKEN, "a square of them")
_BY_CALIBRATION = "`refocus`, `stack`, `depth-map` with `--calib`"
_CAPTURE = Use(
    "with `--calib` or `--white`",
    _BY_CALIBRATION,
    decoded="with `--calib`",
    batch="with `--calib` or `--white`",
)

USES: dict[str, Use] = {
    "aligned raster": Use(_TAKEN, _TAKEN, _TAKEN, batch="with `-M` and `-a`"),
    "folder of views": _VIEWS,
    "mosaic of views": _VIEWS,
    "quilt of views": _VIEWS,
    "sequence of views": _VIEWS,
    "video of views": _VIEWS,
    "array of views": _VIEWS,
    "light field in a MATLAB file": _VIEWS,
    "elemental images": _VIEWS,
    "raw capture": _CAPTURE,
    "raw capture of a focused (2.0) camera": Use(
        "with `--calib`", _BY_CALIBRATION, decoded="with `--calib`", batch="`--all` with `--calib`"
    ),
    "Lytro capture": Use(_TAKEN, _TAKEN, _TAKEN, _TAKEN, batch="with `--calib`"),
    "white image": Use(calibrated=_TAKEN),
    "folder of pictures": Use(batch="its files"),
    "film of frames": Use(batch="its frames"),
    "folder of Lytro files": Use(decoded="as `--white`"),
    "Lytro file without a raw frame": Use(decoded="as `--white`, if it has white images"),
    "calibration": Use("as `--calib`", decoded="as `--calib`", batch="as `--calib`"),
    "refocused picture": Use(),
    "no light field": Use(),
    "can't tell": Use(*2 * ("with `-M`",), "with `-M`", "with `--calib`", _TAKEN, "with `-M`"),
}
"""Kinds, in the order of the table."""


def table() -> list[str]:
    """The table of kinds by commands, in Markdown."""
    kinds = [kind for kind in USES if kind in get_args(Kind)]
    lines = [f"| {' | '.join(('kind', *COMMANDS))} |", "| --- " * (len(COMMANDS) + 1) + "|"]
    return lines + [f"| {' | '.join((kind, *USES[kind]))} |" for kind in kinds]
