# SPDX-License-Identifier: Apache-2.0
"""Files that commands write: refused before any work, then all at once or none."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, cast

from plenofir.ground.errors import InputError
from plenofir.ground.files import Results, check_folder, check_result, write_file

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    import numpy.typing as npt
    from matplotlib.figure import Figure

    from plenofir.ground.images import Image, Picture

    Floats = npt.NDArray[np.float64]


PICTURES = (".png", ".tif", ".tiff", ".jpg", ".jpeg")
"""Endings of pictures that can be written."""
VOLUMES = (".tif", ".tiff")
"""Endings of volumes, see `plenofir.ground.volumes`."""
# Endings of plots, as of `plenofir.camera.plots.encode_figure`.
_PLOTS = (".svg", ".pdf", ".png")


def is_volume(out: str) -> bool:
    """Whether a result's name is that of a volume, not of a folder."""
    return out.lower().endswith(VOLUMES)


def check_file(out: str, suffixes: tuple[str, ...], *inputs: str | Path | None) -> Path:
    """Refuse a result file that cannot be written, before any work is done.

    Nor may it be one of the files that it will be made from.
    """
    path = Path(out)
    if path.suffix.lower() not in suffixes:
        raise InputError(f"the name must end in {' or '.join(suffixes)}", where=out)
    check_result(path, out, [Path(file) for file in inputs if file is not None])
    check_folder(path.parent, out)
    return path


def check_plot_and_csv(plot: Path | None, csv_file: Path | None, *inputs: str) -> None:
    """Refuse a plot or a CSV file that cannot be written, or would replace an input."""
    if plot is not None:
        check_file(str(plot), _PLOTS, *inputs)
    if csv_file is not None:
        check_file(str(csv_file), (".csv",), *inputs)
    for path in (plot, csv_file):
        if path is not None and not path.parent.is_dir():
            raise InputError(f"there is no folder {path.parent}", where=str(path))


def write_plot_and_csv(
    plot: Path | None,
    draw: "Callable[[], Figure]",
    csv_file: Path | None,
    rows: "Sequence[Mapping[str, object]]",
) -> None:
    """Draw a figure as its ending says, and write rows: once both are made, those with a path."""
    files = {}
    if plot is not None:
        from plenofir.camera.plots import encode_figure

        files[plot] = encode_figure(draw(), plot.suffix)
    if csv_file is not None:
        files[csv_file] = _csv(rows)
    for path, content in files.items():
        write_file(path, content)


def write_csv(path: Path | None, rows: "Sequence[Mapping[str, object]]") -> None:
    """Write rows, if there is a path."""
    if path is not None:
        write_file(path, _csv(rows))


def _csv(rows: "Sequence[Mapping[str, object]]") -> bytes:
    """Rows with a line of names; what is nested is left out."""
    flat = [{k: v for k, v in row.items() if not isinstance(v, dict)} for row in rows]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(flat[0]) if flat else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return text.getvalue().encode()


def save(results: Results, name: str, values: "Image | Floats | Picture") -> None:
    """Add a picture (by its ending: PNG, TIFF, JPEG) or a NumPy file to results."""
    import numpy as np

    from plenofir.ground.images import encode_picture

    if name.endswith(".npy"):
        content = io.BytesIO()
        np.save(content, cast("Floats", values))
        results.write(name, content.getbuffer())
    else:
        results.write(name, encode_picture(Path(name).suffix, cast("Image | Picture", values)))


def publish(files: "Mapping[str, Image | Floats | Picture]", folder: Path) -> None:
    """Write pictures and NumPy files, all or none of them."""
    with Results(folder) as results:
        for name, values in files.items():
            save(results, name, values)
