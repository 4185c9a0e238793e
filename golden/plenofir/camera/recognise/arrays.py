# SPDX-License-Identifier: Apache-2.0
"""Arrays of numbers in files: NumPy's .npy and .npz, HDF5, MATLAB's .mat.

A light field is an array of 4 or 5 dimensions. Which dimension is which follows from the sizes
where it can: views are fewer than the pixels along each side of one, channels are 1, 3 or 4 and
the last dimension, or the one before a picture's rows.
"""

import re
import zipfile
import zlib
from collections.abc import Callable, Mapping
from math import prod
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.images import Picture
from plenofir.ground.levels import levels

ARRAYS = (".npy", ".npz", ".mat", ".h5", ".hdf5", ".hdf", ".he5")
"""Endings of files with arrays."""

Kind = Literal["views", "sequence", "picture"]

# An array is unpacked into memory in one piece, and its header decides how large that is.
_LARGEST = 4 << 30
_MATLAB_5, _HDF5 = b"MATLAB", b"\x89HDF\r\n\x1a\n"
_CHANNELS = (1, 3, 4)
# Fewer pixels along a side are no view.
_SMALLEST_VIEW = 8
# Names of the one light field among several arrays, the likeliest first.
_NAMES = ("LF", "lf", "lightfield", "light_field", "views", "data")
_NOT_VIEWS = re.compile(r"(gt|depth|disp|mask|label|weight|conf|normal)", re.IGNORECASE)
_COMPRESSED = 15  # miCOMPRESSED, a MATLAB 5 file's type of element
LOOKED_FOR = (
    "views are an array LF of (rows, columns of views, height, width), with 1, 3 or 4 channels last"
)


class StoredArray(NamedTuple):
    """An array that was read: views (v, u, t, s[, 3]), a sequence (n, t, s[, 3]) or a picture."""

    kind: Kind
    picture: Picture
    lines: tuple[tuple[str, str], ...]  # which array it is, and what was changed


def read_array(path: Path) -> StoredArray:
    """Read the light field, the pictures in a row, or the picture of a file of arrays.

    uint8 and uint16 are taken as they are, others as `levels` does. Raises `InputError` for a
    damaged file, objects that would have to be executed (pickles), arrays above 4 GiB, and where
    it is not certain which array, or which dimension, is which.
    """
    where = str(path)
    try:
        if not path.is_file():
            raise InputError(f"no such file; {LOOKED_FOR}", where=where)
        with input_file(path).open("rb") as file:
            head = file.read(1 << 10)
        read = _reader(head)
        if read is None:
            raise InputError(
                f"is no file of arrays (NumPy, HDF5, MATLAB); {LOOKED_FOR}", where=where
            )
        name, array = read(path, where)
        return _meaning(array, name, where)
    except InputError:
        raise
    except MemoryError:
        raise InputError(
            "is too large for the memory; use a smaller light field", where=where
        ) from None
    except Exception as error:  # Readers raise whatever a damaged file leads them to.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"damaged ({reason[:200]}); copy or export the file again", where=where
        ) from None


def _reader(head: bytes) -> Callable[[Path, str], tuple[str, npt.NDArray[Any]]] | None:
    if head.startswith(b"\x93NUMPY"):
        return _of_npy
    if head.startswith(b"PK"):
        return _of_npz
    if head.startswith(_HDF5) or _HDF5 in head or b"MATLAB 7.3" in head:
        return _of_hdf5
    return _of_matlab_5 if head.startswith(_MATLAB_5) else None


def _check_size(shape: tuple[int, ...], dtype: np.dtype[Any], where: str) -> None:
    if dtype.hasobject:
        raise InputError(
            "holds Python objects (pickled), which are not read: they could run anything; save "
            "numbers alone",
            where=where,
        )
    if prod(shape) * dtype.itemsize > _LARGEST:
        raise InputError("is larger than 4 GiB; use a smaller light field", where=where)


def _header(file: Any) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of a .npy file."""
    version = np.lib.format.read_magic(file)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    shape, _, dtype = read[version](file)
    return shape, dtype


def _of_npy(path: Path, where: str) -> tuple[str, npt.NDArray[Any]]:
    with path.open("rb") as file:
        shape, dtype = _header(file)
    _check_size(shape, dtype, where)
    return "", np.load(path, allow_pickle=False)


def _of_npz(path: Path, where: str) -> tuple[str, npt.NDArray[Any]]:
    shapes: dict[str, tuple[int, ...]] = {}
    dtypes = {}
    with zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            if member.endswith(".npy"):
                with archive.open(member) as file:
                    name = member.removesuffix(".npy")
                    shapes[name], dtypes[name] = _header(file)
    name = _chosen(shapes, where)
    _check_size(shapes[name], dtypes[name], where)
    with np.load(path, allow_pickle=False) as arrays:
        return name, arrays[name]


def _of_hdf5(path: Path, where: str) -> tuple[str, npt.NDArray[Any]]:
    try:
        import h5py
    except ImportError:
        raise InputError("h5py is not installed, which reads this file; pip install h5py") from None
    with h5py.File(path, "r") as file:
        shapes: dict[str, tuple[int, ...]] = {}

        def note(name: str, part: Any) -> None:
            # MATLAB keeps what cells refer to in #refs#.
            if isinstance(part, h5py.Dataset) and not name.startswith("#"):
                shapes[name] = part.shape or ()

        # Links to other files are not followed.
        file.visititems(note)
        name = _chosen(shapes, where)
        data = file[name]
        if data.external or data.is_virtual:
            raise InputError(f"the numbers of {name} are in other files; copy them", where=where)
        _check_size(data.shape, data.dtype, where)
        array = np.asarray(data)
        # MATLAB counts the first index fastest, HDF5 the last.
        is_matlab = "MATLAB_class" in data.attrs or path.suffix.lower() == ".mat"
    return name, array.T if is_matlab else array


def _unpacked_sizes(path: Path) -> int:
    """Bytes of all variables of a MATLAB 5 file, unpacked, by the heads of its elements."""
    total = 0
    with path.open("rb") as file:
        start = file.read(128)
        order: Literal["little", "big"] = "little" if start[126:128] == b"IM" else "big"
        while len(tag := file.read(8)) == 8:
            kind, length = (int.from_bytes(part, order) for part in (tag[:4], tag[4:]))
            place = file.tell()
            if kind == _COMPRESSED:
                head = zlib.decompressobj().decompress(file.read(min(length, 1 << 10)), 8)
                total += int.from_bytes(head[4:8], order)
            else:
                total += length
            file.seek(place + length)
    return total


def _of_matlab_5(path: Path, where: str) -> tuple[str, npt.NDArray[Any]]:
    from scipy.io import loadmat

    if _unpacked_sizes(path) > _LARGEST:
        raise InputError("is larger than 4 GiB; use a smaller light field", where=where)
    arrays: dict[str, npt.NDArray[Any]] = {}

    def take(name: str, value: Any, depth: int) -> None:
        # Structures may contain themselves by way of cells.
        if not isinstance(value, np.ndarray) or depth > 3:
            return
        if value.dtype.names is not None and value.size == 1:
            for field in value.dtype.names:
                take(f"{name}.{field}", value.flat[0][field], depth + 1)
        elif value.dtype.kind in "iuf":
            arrays[name] = value

    for name, value in loadmat(str(path)).items():
        if not name.startswith("__"):
            take(name, value, 0)
    name = _chosen({name: array.shape for name, array in arrays.items()}, where)
    return name, arrays[name]


def _chosen(shapes: Mapping[str, tuple[int, ...]], where: str) -> str:
    """Name of the array that is the light field, or of the only picture."""

    def last(name: str) -> str:
        return re.split(r"[./]", name)[-1]

    def of(dimensions: tuple[int, ...]) -> list[str]:
        return [name for name, shape in shapes.items() if len(shape) in dimensions]

    many = of((4, 5))
    if len(many) > 1:
        named = [[name for name in many if last(name) == likely_name] for likely_name in _NAMES]
        likely = [name for name in many if not _NOT_VIEWS.match(last(name))]
        many = next((names for names in [*named, likely] if len(names) == 1), many)
    if not many:
        many = [name for name in of((2, 3)) if min(shapes[name][:2]) >= _SMALLEST_VIEW]
    if len(many) != 1:
        names = f" ({', '.join(sorted(many)[:5])})" if many else ""
        there = f"{len(many)} arrays of 4 or 5 dimensions{names}" if many else "no array of views"
        raise InputError(f"{there}; {LOOKED_FOR}", where=where)
    return many[0]


def _meaning(array: npt.NDArray[Any], name: str, where: str) -> StoredArray:
    """Meaning of an array's dimensions, in the order of this project."""
    kind, axes = array_axes(array.shape, where)
    ordered = array.transpose(axes)
    lines = [("array", f"{name + ' ' if name else ''}{' x '.join(map(str, array.shape))}")]
    if ordered.ndim == {"views": 5, "sequence": 4, "picture": 3}[kind]:
        # The fourth channel is a weight, or opacity.
        ordered = ordered[..., 0] if ordered.shape[-1] == 1 else ordered[..., :3]
    as_levels = levels(ordered, where)
    lines += [("values", note) for note in as_levels.notes]
    picture = Picture(np.ascontiguousarray(as_levels.values), as_levels.full_scale)
    return StoredArray(kind, picture, tuple(lines))


_ORDERS: dict[int, tuple[tuple[Kind, str], ...]] = {
    2: (("picture", "ts"),),
    3: (("picture", "tsc"), ("picture", "cts"), ("sequence", "nts")),
    4: (
        ("views", "vuts"),
        ("views", "tsvu"),
        ("sequence", "ntsc"),
        ("sequence", "ncts"),
    ),
    5: (
        ("views", "vutsc"),
        ("views", "vucts"),
        ("views", "tscvu"),
        ("views", "tsvuc"),
        ("views", "ctsvu"),
        ("views", "cvuts"),
    ),
}


def array_axes(shape: tuple[int, ...], where: str) -> tuple[Kind, tuple[int, ...]]:
    """What an array is, and its dimensions in the order v, u (or n), t, s, c."""
    if 0 in shape:
        raise InputError(f"its array has shape {shape}, without any number", where=where)
    fits = []
    for kind, letters in _ORDERS.get(len(shape), ()):
        size = dict(zip(letters, shape, strict=True))
        side = min(size["t"], size["s"])
        most = max(size.get("v", 1), size.get("u", 1))
        if (
            side >= _SMALLEST_VIEW
            and most <= side
            and size.get("c", 1) in _CHANNELS
            and not ("n" in size and size["n"] < 2)
            and not (kind == "views" and most < 2)
        ):
            fits.append((kind, letters))
    # A last dimension that can be channels is; views of so few pixels are none.
    if len(fits) > 1 and shape[-1] in _CHANNELS:
        fits = [one for one in fits if one[1].endswith("c")]
    if len(fits) > 1 and len(shape) == 3:
        fits = [one for one in fits if one[1] != "nts" or shape[0] not in _CHANNELS]
    if len(fits) != 1:
        doubt = f", which can be {' or '.join(f[1] for f in fits)}" if fits else ""
        raise InputError(f"its array has shape {shape}{doubt}; {LOOKED_FOR}", where=where)
    kind, letters = fits[0]
    return kind, tuple(letters.index(one) for one in "vuntsc" if one in letters)
