"""The viewer without a browser: its data, its server, what it refuses."""

import http.client
import json
import socket
import zlib
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from in_browser import served
from in_process import plenofir
from scipy import ndimage

from plenofir import InputError
from plenofir.camera.rays import RayModel, load_camera
from plenofir.images import write_png
from plenofir.view import export, light_field_page, pictures_page
from plenofir.view.light_field import LightField, plane_table
from plenofir.view.mosaic import packed_views

RNG = np.random.default_rng(3)
RAW = RNG.integers(0, 256, (23, 31, 3), dtype=np.uint8)


def test_views_are_those_of_the_raw_image_and_black_beyond_it() -> None:
    m = 4
    views = LightField(RAW, m).views()
    assert views.shape == (m, m, 6, 8, 3)
    for v, u in np.ndindex(m, m):
        part = RAW[v::m, u::m]
        assert (views[v, u, : part.shape[0], : part.shape[1]] == part).all()
        assert views[v, u].sum() == part.sum()


def test_binned_views_are_means_of_micro_lenses() -> None:
    m, binning = 3, 2
    raw = RAW[:18, :30]
    views, binned = LightField(raw, m).views(), LightField(raw, m).views(binning)
    means = views.reshape(m, m, 3, binning, 5, binning, 3).mean((3, 5))
    assert (binned == np.floor(means + 0.5)).all()


def test_the_table_of_distances_is_the_ray_model() -> None:
    m = 5
    model = RayModel.focused(load_camera("f193-mla2"), 3000, m)
    table = plane_table(model, (-1.0, 2.0))
    json.dumps(table, allow_nan=False)
    a = table["first"] + table["step"] * np.arange(len(table["alpha"]))
    assert a[0] == -1
    assert a[-1] == pytest.approx(2)
    # All of the grid is in it.
    assert np.isin(np.arange(-5, 11), np.rint(a * m * 1e6) / 1e6).all()
    for name, border in (("centre", "distance"), ("near", "near_border"), ("far", "far_border")):
        found = getattr(model, border)(a)
        mm = np.array([np.nan if x is None else x for x in table[name]["mm"]])
        np.testing.assert_allclose(mm, found.mm, atol=1e-4)
        assert table[name]["state"] == found.states.tolist()


def test_depth_is_the_disparity_that_was_drawn() -> None:
    m, a = 5, 0.75
    rng = np.random.default_rng(4)
    texture = rng.uniform(0, 255, (30, 30))
    raw = np.zeros((150, 150), np.uint8)
    t, s = np.indices((30, 30))
    for v, u in np.ndindex(m, m):
        place = (t + a * (v - 2) + 5) / 2, (s + a * (u - 2) + 5) / 2
        raw[v::m, u::m] = ndimage.map_coordinates(texture, place, order=1)
    page = light_field_page(raw, m, full_scale=255, title="")
    part = page.parts["depth"](1)
    values = np.frombuffer(zlib.decompress(part.content), "<u2").reshape(30, 30)
    assert part.size == "30x30"
    depth = -1 + 3 * (values[5:-5, 5:-5] / 65535)
    assert abs(np.median(depth) - a) < 0.1


def asked(address: str, path: str, host: str | None = None) -> http.client.HTTPResponse:
    where = urlsplit(address)
    connection = http.client.HTTPConnection(where.hostname or "", where.port, timeout=10)
    connection.request("GET", path, headers={"Host": host or where.netloc})
    answer = connection.getresponse()
    answer.body = answer.read()  # type: ignore[attr-defined]
    connection.close()
    return answer


def test_only_what_was_named_is_served_and_only_to_who_has_the_address() -> None:
    page = light_field_page(RAW, 3, full_scale=255, title="")
    with served(page) as address:
        where = urlsplit(address)
        assert where.hostname == "127.0.0.1"
        assert len(where.path) > 20
        whole = asked(address, where.path)
        assert whole.status == 200
        assert "default-src 'none'" in (whole.getheader("Content-Security-Policy") or "")
        assert whole.getheader("Server") is None
        views = asked(address, f"{where.path}views?bin=1").body  # type: ignore[attr-defined]
        assert views == LightField(RAW, 3).views().tobytes()
        for path in ("/", "/views", "/x/views", f"{where.path[:-2]}x/views"):
            assert asked(address, path).status == 404, path
        for name in ("server.py", "..%2Fserver.py", "../server.py", "%2Fetc%2Fpasswd", "views/"):
            assert asked(address, where.path + name).status == 404, name
        for binning in ("0", "65", "-1", "x", "9" * 5000, "%C2%B2"):
            assert asked(address, f"{where.path}views?bin={binning}").status == 400, binning
        assert asked(address, where.path, "elsewhere.example").status == 403
        assert asked(address, where.path, f"localhost:{where.port}").status == 200


def test_what_cannot_be_viewed_is_refused_in_one_line(tmp_path: Path) -> None:
    file, folder = tmp_path / "raw.png", tmp_path / "folder"
    folder.mkdir()
    write_png(file, RAW)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        calls = (
            ((str(file),), "--micro-image: is missing"),
            ((str(file), "-M", "24"), "less than one micro image"),
            ((str(tmp_path / "none.png"), "-M", "3"), "no such file"),
            ((str(file), "-M", "3", "--focus", "3000"), "--focus: is for --camera"),
            ((str(file), "-M", "3", "--camera", "none"), "none"),
            ((str(file), "-M", "3", "-a", "1"), "FIRST:LAST"),
            ((str(file), "-M", "3", "-a", "2:1"), "--a: 2 to 1"),
            ((str(file), "-M", "3", "--export", "page.txt"), "no such kind of file"),
            ((str(file), "-M", "3", "--export", str(tmp_path / "x.html"), "--limit", "0"), "limit"),
            ((str(folder),), "0 pictures"),
            ((str(folder), "-M", "3"), "--micro-image: is for a light field"),
            ((str(file), "-M", "3", "--port", port, "--no-browser"), f"--port: {port}"),
        )
        for words, message in calls:
            done = plenofir("view", *words)
            assert done.returncode == 2, words
            assert message in done.stderr, words
            assert done.stderr.count("\n") == 1, words
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "raw.png"]


def test_an_export_keeps_to_its_size(tmp_path: Path) -> None:
    raw = np.random.default_rng(8).integers(0, 256, (150, 150, 3), dtype=np.uint8)
    page = light_field_page(raw, 3, full_scale=255, title="noise")
    for limit in (200_000, 100_000, 70_000):
        content = export(page, limit)
        assert len(content) <= limit
        assert b"Scaled down" in content if limit == 70_000 else b"Views" in content
    with pytest.raises(InputError, match="does not fit"):
        export(page, 60_000)
    assert packed_views(LightField(raw, 3).views(), 1000) is None
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "page.html"
    done = plenofir("view", str(tmp_path / "raw.png"), "-M", "3", "--export", str(out))
    assert done.stdout == f"{out}: {out.stat().st_size / 1e6:.1f} MB\n"
    assert done.returncode == 0


def test_pictures_too_large_for_an_export_are_refused(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        write_png(tmp_path / name, RNG.integers(0, 256, (100, 100, 3), dtype=np.uint8))
    with pytest.raises(InputError, match="MB of pictures"):
        export(pictures_page(tmp_path), 80_000)
