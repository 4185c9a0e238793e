# SPDX-License-Identifier: Apache-2.0
"""The viewer's server, and what the command refuses, without a browser."""

import http.client
import os
import re
import socket
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
from in_browser import served
from in_process import plenofir

from plenofir.ground.images import encode_png, write_png
from plenofir.view import light_field_page, pictures_page
from plenofir.view.views_and_depth import LightField

RNG = np.random.default_rng(3)
RAW = RNG.integers(0, 256, (23, 31, 3), dtype=np.uint8)


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


def test_names_that_are_no_text(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"\xfe")
    folder.mkdir()
    for name in (b"\xff.png", b"b.png"):
        write_png(folder / os.fsdecode(name), RAW)
    page = pictures_page(folder)
    assert r"\xff.png" in page.field["pictures"]
    with served(page) as address:
        part = asked(address, f"{urlsplit(address).path}%5Cxff.png")
        assert part.body == encode_png(RAW)  # type: ignore[attr-defined]
    for shown in (folder, folder / os.fsdecode(b"\xff.png")):
        options = () if shown == folder else ("-M", "5")
        done = plenofir("view", str(shown), *options, "--export", str(tmp_path / "x.html"))
        assert (done.returncode, done.stderr) == (0, "")


def test_what_cannot_be_viewed_is_refused_in_one_line(tmp_path: Path) -> None:
    file, folder = tmp_path / "raw.png", tmp_path / "folder"
    folder.mkdir()
    write_png(file, RAW)
    text = tmp_path / "text.avi"
    text.write_text("no video")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        calls = (
            ((), "give either a raw image"),
            ((str(file), "--source", str(folder)), "give either a raw image"),
            (
                ("--source", str(folder), "-M", "3", "--export", "x.html"),
                "--export cannot be",
            ),
            (("--source", str(text), "-M", "3"), "cannot be opened|needs OpenCV"),
            (("--source", str(tmp_path / "none"), "-M", "3"), "no such file"),
            ((str(file), "-M", "3", "--calib", str(file)), "raw.png"),
            ((str(folder), "--calib", str(file)), "--calib is for a light field"),
            ((str(file),), "can't tell: too small .* or -M for an aligned raw image"),
            ((str(file), "-M", "24"), "less than one micro image"),
            ((str(tmp_path / "none.png"), "-M", "3"), "no such file"),
            ((str(file), "-M", "3", "--focus", "3000"), "--focus requires --camera"),
            ((str(file), "-M", "3", "--camera", "none"), "none"),
            ((str(file), "-M", "3", "--camera", "lfm-antleg-20x", "--focus", "9"), "by its stage"),
            ((str(file), "-M", "3", "-a", "1"), "FIRST:LAST"),
            ((str(file), "-M", "3", "-a", "2:1"), "--a: 2 to 1"),
            ((str(file), "-M", "3", "--export", "page.txt"), "must end in .html or .htm"),
            ((str(file), "-M", "3", "--export", str(tmp_path / "x.html"), "--limit", "0"), "limit"),
            ((str(folder),), "0 pictures"),
            ((str(folder), "-M", "3"), "no image files"),
            ((str(file), "-M", "3", "--port", port, "--no-browser"), f"--port: {port} cannot"),
        )
        for words, message in calls:
            done = plenofir("view", *words)
            assert done.returncode == 2, words
            assert re.search(message, done.stderr), (words, done.stderr)
            assert done.stderr.count("\n") == 1, words
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "raw.png", "text.avi"]
