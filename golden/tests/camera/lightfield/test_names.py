# SPDX-License-Identifier: Apache-2.0
"""Views among the files of a folder: by their names, whatever lies beside them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from plenofir.camera.recognise.names import Named, named_views, picture_files
from plenofir.ground.errors import InputError


def folder(tmp_path: Path, *names: str) -> Path:
    for name in names:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return tmp_path


def found(path: Path) -> Named:
    return named_views(picture_files(path), path)


def grid(rows: int, columns: int, name: Callable[[int, int], str]) -> list[str]:
    return [name(v, u) for v in range(rows) for u in range(columns)]


@pytest.mark.parametrize(
    "name",
    [
        lambda v, u: f"view_{v}_{u}.png",
        lambda v, u: f"out_{v:02}_{u:02}_{-381.909 + 60 * v:.6f}_{1103.4 - 60 * u:.6f}_.png",
        lambda v, u: f"IMG_0002_013_{v:02}_{u:02}.jpg",
        lambda v, u: f"{v:03}_{u:03}.ppm",
        lambda v, u: f"lf_{v + 1}_{u + 1}.tif",
        lambda v, u: f"{v:02}/{u:02}.png",
        lambda v, u: f"rectified/view{v:02}-{u:02}.png",
        lambda v, u: f"a/b/row{v}/{u}.png",
        # The light field library of 1996; the view interpolation benchmark of 2020.
        lambda v, u: f"lion.{v}.{u}.ppm",
        lambda v, u: f"kitchen/001/4.5/{v}_{u}.png",
    ],
)
@pytest.mark.parametrize(("rows", "columns"), [(5, 5), (3, 7), (2, 9)])
def test_rows_and_columns(
    tmp_path: Path, rows: int, columns: int, name: Callable[[int, int], str]
) -> None:
    path = folder(tmp_path, *grid(rows, columns, name))
    views = found(path)
    assert not views.running
    assert views.notes == ()
    assert len(views.places) == rows * columns
    assert all(path / name(*place) == file for place, file in views.places.items())


def test_a_running_number(tmp_path: Path) -> None:
    for count, step in ((15, 1), (25, 5), (48, 1)):
        sub = tmp_path / f"{count}"
        views = found(folder(sub, *[f"2026_rail_{n * step:03}.png" for n in range(count)]))
        assert views.running
        assert [views.places[0, n].stem[-3:] for n in (0, 1)] == ["000", f"{step:03}"]
        assert len(views.places) == count


def test_what_lies_beside_the_views(tmp_path: Path) -> None:
    names = grid(5, 5, lambda v, u: f"view_{v}_{u}.png")
    beside = ("Thumbs.db", ".DS_Store", "README.txt", "._view_0_0.png", ".hidden_9_9.png")
    more = ("depth.png", "preview.jpg", "depth/0.png", "__MACOSX/view_0_0.png")
    views = found(folder(tmp_path, *names, *beside, *more))
    assert len(views.places) == 25
    assert views.notes == ("left alone: depth.png, preview.jpg, named otherwise than the views",)
    # Maps of depth that are numbered as the views are.
    folder(tmp_path, *grid(5, 5, lambda v, u: f"depth_{v}_{u}.png"))
    views = found(tmp_path)
    assert {path.name[:4] for path in views.places.values()} == {"view"}
    assert "and 24 more" in views.notes[0]


def test_what_is_missing_or_too_much_is_named(tmp_path: Path) -> None:
    names = grid(5, 5, lambda v, u: f"view_{v}_{u}.png")
    one = folder(tmp_path / "one", *[name for name in names if name != "view_1_3.png"])
    with pytest.raises(InputError, match=r"one: of 5 x 5 views view_1_3\.png is missing"):
        found(one)
    run = [f"Cam{n:03}.png" for n in range(20) if n not in (3, 7)]
    with pytest.raises(InputError, match=r"of 20 views Cam003\.png, Cam007\.png are missing"):
        found(folder(tmp_path / "run", *run))
    twice = [*names, *[name.replace(".png", ".jpg") for name in names]]
    with pytest.raises(InputError, match=r"has 2 sets of pictures .*view_#_#\.jpg, view_#_#\.png"):
        found(folder(tmp_path / "twice", *twice))
    several = [*[f"left/{name}" for name in names], "right/view_0_0.png"]
    with pytest.raises(InputError, match=r"has 2 folders of pictures \(left, right\)"):
        found(folder(tmp_path / "several", *several))
    for number, odd in enumerate((["a.png", "b.png"], ["a1.png", "b7.png", "c9.png"], [])):
        path = folder(tmp_path / f"odd{number}", "x.txt", *odd)
        with pytest.raises(InputError, match=r"have their row and column, or a running number"):
            found(path)
