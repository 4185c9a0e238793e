# SPDX-License-Identifier: Apache-2.0
"""Views in a MATLAB file, as the LFToolbox and the EPFL's data set have them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.images import Image

_LARGEST_MAT = 4 << 30
_MATLAB_5, _HDF5 = b"MATLAB", b"\x89HDF\r\n\x1a\n"
_MAT_ADVICE = "views are an array LF of (rows, columns of views, height, width, 3 or 4)"


def read_mat(path: Path) -> Image:
    """Read the views of a MATLAB file (version 5 to 7, or 7.3, which needs h5py).

    It has an array LF, or just one array of 4 or 5 dimensions: rows and columns of views, height,
    width, and 3 channels or 4 (the last one, a weight, is left out). uint8 and uint16 are taken as
    they are, floats from 0 to 1 as uint16.
    """
    where = str(path)
    try:
        if not path.is_file():
            raise InputError(f"no such file; {_MAT_ADVICE}", where=where)
        if path.stat().st_size > _LARGEST_MAT:
            raise InputError("is larger than 4 GiB; use a smaller light field", where=where)
        with input_file(path).open("rb") as file:
            head = file.read(1 << 10)
        if _HDF5 in head or b"MATLAB 7.3" in head:
            array = _from_hdf5(path, where)
        elif head.startswith(_MATLAB_5):
            array = _from_matlab_5(path, where)
        else:
            raise InputError(f"is not a MATLAB file; {_MAT_ADVICE}", where=where)
    except InputError:
        raise
    except MemoryError:
        raise InputError(
            "is too large for the memory; use a smaller light field", where=where
        ) from None
    except Exception as error:  # Readers raise whatever a damaged file leads them to.
        reason = " ".join(str(error).split()) or type(error).__name__
        what = f"damaged ({reason[:200]})"
        raise InputError(f"{what}; copy or export the file again", where=where) from None
    if array.ndim not in (4, 5) or array.shape[0] != array.shape[1] or 0 in array.shape:
        raise InputError(f"its array has shape {array.shape}; {_MAT_ADVICE}", where=where)
    if array.ndim == 5:
        if array.shape[4] not in (1, 3, 4):
            raise InputError(
                f"its views have {array.shape[4]} channels; they must have 1, 3 or 4", where=where
            )
        array = array[..., 0] if array.shape[4] == 1 else array[..., :3]
    if array.dtype in (np.float32, np.float64):
        low, high = float(array.min()), float(array.max())
        if not 0 <= low <= high <= 1:
            raise InputError(
                f"has values from {low:g} to {high:g}; floats must go from 0 to 1", where=where
            )
        array = np.rint(array * 65535).astype(np.uint16)
    if array.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"has values of type {array.dtype}; use uint8, uint16, or floats from 0 to 1",
            where=where,
        )
    return np.ascontiguousarray(array)


def _chosen(shapes: Mapping[str, tuple[int, ...]], where: str) -> str:
    """Name of the array that is the light field."""
    many = [name for name, shape in shapes.items() if len(shape) in (4, 5)]
    if "LF" in many:
        return "LF"
    if len(many) != 1:
        what = f"{len(many)} arrays of 4 or 5 dimensions" if many else "no array of views"
        raise InputError(f"{what}; {_MAT_ADVICE}", where=where)
    return many[0]


def _from_matlab_5(path: Path, where: str) -> npt.NDArray[Any]:
    from scipy.io import loadmat, whosmat

    shapes = {name: shape for name, shape, _ in whosmat(str(path))}
    name = _chosen(shapes, where)
    return np.asarray(loadmat(str(path), variable_names=[name])[name])


def _from_hdf5(path: Path, where: str) -> npt.NDArray[Any]:
    try:
        import h5py
    except ImportError:
        raise InputError("h5py is not installed, which reads this file; pip install h5py") from None
    with h5py.File(path, "r") as file:
        shapes = {name: part.shape for name, part in file.items() if hasattr(part, "shape")}
        # MATLAB counts the first index fastest, HDF5 the last.
        return np.asarray(file[_chosen(shapes, where)]).T
