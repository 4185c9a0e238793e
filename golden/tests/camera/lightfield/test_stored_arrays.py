# SPDX-License-Identifier: Apache-2.0
"""Light fields in NumPy, HDF5 and MATLAB files, with other types and orders of dimensions."""

import io
import pickle
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pytest
from drawn_views import drawn
from scipy.io import savemat

from plenofir.camera.recognise.arrays import array_axes, read_array
from plenofir.ground.errors import InputError
from plenofir.ground.levels import levels


@pytest.fixture(scope="module")
def views() -> np.ndarray:
    return drawn(3, 4, (24, 32))[0]


def written(path: Path, array: np.ndarray, name: str = "LF") -> Path:
    if path.suffix == ".npy":
        np.save(path, array)
    elif path.suffix == ".npz":
        np.savez_compressed(path, **{name: array})
    elif path.suffix == ".mat":
        savemat(path, {name: array}, do_compression=True)
    else:
        with h5py.File(path, "w") as file:
            file.create_dataset(name, data=array, compression="gzip")
    return path


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".mat", ".h5"])
def test_every_file_of_arrays(views: np.ndarray, tmp_path: Path, suffix: str) -> None:
    for name, array in (("LF", views), ("whatever", views / 255), ("data", views.astype(float))):
        found = read_array(written(tmp_path / f"{name}{suffix}", array, name))
        white = found.picture.full_scale
        assert found.kind == "views"
        assert np.array_equal(np.rint(found.picture.pixels * (255 / white)), views)
    grey = read_array(written(tmp_path / f"grey{suffix}", views[..., :1], "LF"))
    assert (grey.picture.pixels == views[..., 0]).all()
    for array, kind in (
        (views.reshape(12, *views.shape[2:]), "sequence"),
        (views[0, 0], "picture"),
        (views[0, 0, ..., 0], "picture"),
    ):
        found = read_array(written(tmp_path / f"{kind}{suffix}", array))
        assert found.kind == kind
        assert (found.picture.pixels == array).all()
    with pytest.raises(InputError, match=r"no such file; views are an array LF of"):
        read_array(tmp_path / f"none{suffix}")
    whole = written(tmp_path / f"whole{suffix}", views).read_bytes()
    cut = tmp_path / f"cut{suffix}"
    for end in (0, 3, 60, 300, len(whole) // 2, len(whole) - 40):
        cut.write_bytes(whole[:end])
        with pytest.raises(InputError, match=r"cut\.\w+: (damaged|is no file of arrays)"):
            read_array(cut)


def test_orders_of_dimensions() -> None:
    size = {"v": 5, "u": 6, "t": 24, "s": 32, "c": 3}
    for letters in ("vuts", "tsvu", "vutsc", "vucts", "tsvuc", "tscvu", "ctsvu", "cvuts"):
        kind, axes = array_axes(tuple(size[one] for one in letters), "file")
        wanted = [one for one in "vutsc" if one in letters]
        assert kind == "views"
        assert [letters[k] for k in axes] == wanted
    with pytest.raises(InputError, match=r"its array has shape \(9, 9, 9, 9\), which can be"):
        array_axes((9, 9, 9, 9), "file")
    with pytest.raises(InputError, match="which can be vucts or cvuts"):
        array_axes((3, 5, 3, 24, 32), "file")
    for shape in ((7,), (2, 3, 24, 32, 5), (1, 1, 24, 32), (0, 3, 24, 32)):
        with pytest.raises(InputError, match=r"its array has shape .*(views are an array|without)"):
            array_axes(shape, "file")


def test_the_light_field_among_other_arrays(views: np.ndarray, tmp_path: Path) -> None:
    depth = np.ones(views.shape[:4], np.float32)
    with h5py.File(tmp_path / "hci_old.h5", "w") as file:
        file["LF"], file["GT_DEPTH"] = views, depth
    with h5py.File(tmp_path / "group.h5", "w") as file:
        file["scene/views"], file["scene/weights"] = views, depth
        file["elsewhere"] = h5py.ExternalLink("hci_old.h5", "LF")
    for name, array in (("hci_old.h5", "LF"), ("group.h5", "scene/views")):
        found = read_array(tmp_path / name)
        assert (found.picture.pixels == views).all()
        assert found.lines[0] == ("array", f"{array} 3 x 4 x 24 x 32 x 3")
    # A structure, as toolboxes save their results.
    savemat(tmp_path / "struct.mat", {"result": {"LF": views, "Options": {"n": 3.0}}})
    assert (read_array(tmp_path / "struct.mat").picture.pixels == views).all()
    savemat(tmp_path / "two.mat", {"a": views, "b": views})
    with pytest.raises(InputError, match=r"2 arrays of 4 or 5 dimensions \(a, b\)"):
        read_array(tmp_path / "two.mat")


def test_objects_and_bombs_are_refused(tmp_path: Path) -> None:
    class Harm:
        def __reduce__(self) -> tuple[object, ...]:
            return (pytest.fail, ("it was executed",))

    content = io.BytesIO()
    np.lib.format.write_array(content, np.array([None] * 4, object), allow_pickle=True)
    head = content.getvalue()[: -len(pickle.dumps(None))]
    (tmp_path / "object.npy").write_bytes(head + pickle.dumps(Harm()))
    with zipfile.ZipFile(tmp_path / "object.npz", "w") as archive:
        archive.writestr("LF.npy", (tmp_path / "object.npy").read_bytes())
    with pytest.raises(InputError, match=r"holds Python objects \(pickled\), which are not read"):
        read_array(tmp_path / "object.npy")
    with pytest.raises(InputError, match=r"no array of views|Python objects"):
        read_array(tmp_path / "object.npz")
    huge = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        huge, {"descr": "|u1", "fortran_order": False, "shape": (9, 9, 40000, 40000)}
    )
    (tmp_path / "huge.npy").write_bytes(huge.getvalue())
    with zipfile.ZipFile(tmp_path / "huge.npz", "w") as archive:
        archive.writestr("LF.npy", huge.getvalue())
    with h5py.File(tmp_path / "huge.h5", "w") as file:
        file.create_dataset("LF", (9, 9, 40000, 40000), "u1", chunks=(1, 1, 100, 100))
    for name in ("huge.npy", "huge.npz", "huge.h5"):
        with pytest.raises(InputError, match="is larger than 4 GiB"):
            read_array(tmp_path / name)


def test_values_of_every_type() -> None:
    ramp = np.linspace(0, 1, 12).reshape(3, 4)
    for kind, scale, white in (
        ("f2", 1, 65535),
        (">f4", 1, 65535),
        ("f8", 1, 65535),
        ("i2", 32767, 32767),
        ("i4", 255, 255),
        ("u4", 65535, 65535),
        (">u2", 65535, 65535),
        ("u1", 255, 255),
    ):
        values = (np.rint(ramp * scale) if scale > 1 else ramp).astype(kind)
        found = levels(values, "file")
        assert found.full_scale == white
        assert found.notes == ()
        assert np.abs(found.values / white - ramp).max() < 3e-3
    holes = levels(np.array([[0.5, np.nan], [1.02, -0.01]]), "file")
    assert holes.full_scale == int(65535 / 1.02)
    assert np.allclose(holes.values / holes.full_scale, [[0.5, 0], [1.02, 0]], atol=1e-4)
    assert len(holes.notes) == 3
    for values in ([[0.0, 3.7]], [[-1.0, 0.5]], [[-3, 5]], [[0, 70000]], [[0.0, 0.0]], [[1j, 0]]):
        with pytest.raises(InputError, match=r"file: has (values|whole numbers)"):
            levels(np.array(values), "file")
