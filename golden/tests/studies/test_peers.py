# SPDX-License-Identifier: Apache-2.0
"""Other software beside this one: what is compared, with stand-ins for the peers."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from in_process import plenofir

from plenofir.ground.errors import InputError
from plenofir_studies import peers
from plenofir_studies.sharpening import TEXTURES, plane


def test_likeness_of_pictures_at_both_resolutions() -> None:
    field = plane(5, 5, TEXTURES[1])
    lenses, pixels = peers.likeness(field.pixels / 3, field)
    assert min(lenses, pixels) > 100
    lenses, linear, cubic = peers.likeness(field.lenses, field)
    assert lenses > 80
    assert 30 < linear < 45 < cubic
    # A picture that is moved by a pixel is no longer like the object.
    assert peers.likeness(np.roll(field.pixels, 1, axis=1), field)[1] < 33


def test_an_answer_and_a_failure_come_from_another_interpreter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    side = tmp_path / "side.py"
    side.write_text(
        "import sys, numpy as np\n"
        "task, source, target = sys.argv[1:]\n"
        "given = np.load(source)\n"
        "if task == 'broken': raise ValueError('no lenses')\n"
        "np.savez(target, result=given['views'] + given['runs'], seconds=2.5, version='1.2')\n"
    )
    monkeypatch.setattr(peers.peers_side, "__file__", str(side))
    ask = peers.asked(Path(sys.executable))
    answer = ask("fine", runs=3, views=np.arange(3))
    assert not isinstance(answer, str)
    assert answer.result.tolist() == [3, 4, 5]
    assert (answer.seconds, answer.version) == (2.5, "1.2")
    assert ask("broken", views=np.arange(3)) == "ValueError: no lenses"
    with pytest.raises(InputError, match="cannot be run"):
        peers.asked(tmp_path / "none")("fine")


def test_rows_of_the_tables() -> None:
    def ask(task: str, **arrays: Any) -> peers.Answer | str:
        if task.startswith("plenpy"):
            return "ImportError: plenpy"
        views = arrays["views"]
        # The central view: a poor picture.
        return peers.Answer(views[len(views) // 2, len(views) // 2].astype(float), 1.5, "0.9")

    rows = dict((name, cells) for name, *cells in peers.pictures(ask))
    assert [len(cells) for cells in rows.values()] == [len(peers.PLANES)] * 4
    assert set(rows["plenpy"]) == {"ImportError: plenpy"}
    assert float(rows["plenofir, as shown"][0].split(" / ")[1]) > 36
    timed = list(peers.times(ask, size=55))
    assert timed[2] == ("plenopticam", "1.500", "5 x 5")
    assert timed[0][2] == "55 x 55"


def test_centres_that_lie_nowhere_in_the_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peers, "_WHITE", (120, 130))
    places = {"plenopticam centres": np.zeros((0, 2)), "pyolaf centres": np.full((9, 2), np.nan)}

    def ask(task: str, **_: Any) -> peers.Answer:
        return peers.Answer(places[task], 1.5, "0.9")

    own, *others = peers.centres(ask)
    assert max(float(cell.split(",")[0]) for cell in own[1:]) < 0.1
    assert [cells[1:] for cells in others] == [("no centre in the picture",) * 2] * 2


def test_an_interpreter_that_cannot_be_run_is_one_line(tmp_path: Path) -> None:
    done = plenofir(
        *("report", "peers", "--python", str(tmp_path / "none"), "--out", str(tmp_path / "out"))
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "cannot be run" in done.stderr
    assert not (tmp_path / "out").exists()
