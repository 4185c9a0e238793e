# SPDX-License-Identifier: Apache-2.0
"""The pages of a simulation's pictures and of a live source, in a real browser."""

import json
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from in_browser import pixels, served

from plenofir.ground.images import encode_png, read_image
from plenofir.ground.project import DATA
from plenofir.view import Live, export, folder_frames, live_page, pictures_page


def test_pictures_of_a_simulation(open_page: Any, tmp_path: Path) -> None:
    picture = np.ascontiguousarray(read_image(DATA / "flower_detail_5x5.png")[:40, :50])
    other = picture.copy()
    other[3, 4] += 2
    for name, image in (("diff", picture), ("golden", other), ("refocused", picture)):
        (tmp_path / f"{name}.png").write_bytes(encode_png(image))
    (tmp_path / "report.json").write_text(json.dumps({"mismatches": 1}))
    page = pictures_page(tmp_path)
    assert page.field["pictures"] == ["refocused.png", "golden.png", "diff.png"]
    file = tmp_path / "export.html"
    file.write_bytes(export(page, 1_000_000))
    with served(page) as address:
        for where in (address, file.as_uri()):
            tab = open_page(where)
            assert tab.evaluate("plenofir.compared") == {
                "largest": 2,
                "differ": 1,
                "pixels": 2000,
            }
            assert "1 pixels differ" in tab.locator("#notes").inner_text()
            tab.evaluate("plenofir.setMode('difference')")
            shown = pixels(tab)
            assert (shown[3, 4] == 2 * 16).all()
            assert np.count_nonzero(shown) == 3
            tab.evaluate("plenofir.choose('refocused.png', 'diff.png')")
            assert "Equal in all 2000 pixels" in tab.locator("#compared").inner_text()


def test_a_live_source_shows_its_newest_frame(open_page: Any, tmp_path: Path) -> None:
    m, count = 3, 40

    def put(number: int) -> None:
        (tmp_path / "new").write_bytes(encode_png(np.full((30, 30), 5 * number, np.uint8)))
        (tmp_path / "new").rename(tmp_path / f"{number:03}.png")

    def grow() -> None:
        for number in range(1, count):
            time.sleep(0.05)
            put(number)

    put(0)
    live = Live(folder_frames(tmp_path, 25), lambda picture: picture, m, "folder")
    with served(live_page(live, title="live")) as address:
        tab = open_page(address)
        camera = threading.Thread(target=grow)
        camera.start()
        camera.join()
        last = f"() => plenofir.live.frames + plenofir.live.dropped >= {count}"
        tab.wait_for_function(last, timeout=120_000)
        state = tab.evaluate("plenofir.live")
        # Every frame of the folder was shown or counted, and the last one is on show.
        assert state["frames"] + state["dropped"] == count
        assert state["frames"] >= 2
        assert state["milliseconds"] >= 0
        assert (pixels(tab)[12:18, 12:18] == 5 * (count - 1)).all()
        assert "frames a second" in tab.locator("#live").inner_text()
