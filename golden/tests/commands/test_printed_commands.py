# SPDX-License-Identifier: Apache-2.0
"""Commands that are printed run in a shell as they are, whatever the names of files."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from discs import disc_views
from in_process import plenofir

from plenofir.camera.calibration import calibration_of_grid
from plenofir.camera.lightfield.indexing import compose
from plenofir.camera.recognise import recognise
from plenofir.ground.errors import InputError
from plenofir.ground.images import write_png
from plenofir.ground.shell import command
from plenofir.refocus.batch import find_frames
from plenofir_studies.synthetic import regular_grid

NAMES = ["plain", "Ümläute 光场\n100%", 'it\'s "quoted"', "-leading \\", "$HOME;`x`*[1] & more"]


def typed(line: str, folder: Path) -> list[str]:
    """The words that a shell hands to plenofir."""
    stub = folder / "bin" / "plenofir"
    stub.parent.mkdir(exist_ok=True)
    stub.write_text('#!/bin/sh\nprintf "%s\\0" "$@" > "$WORDS"\n')
    stub.chmod(0o755)
    words = folder / "words"
    environment = {"PATH": f"{stub.parent}:{os.environ['PATH']}", "WORDS": str(words)}
    subprocess.run(["sh", "-c", line], cwd=folder, env=environment, check=True)
    return words.read_text().split("\0")[:-1]


@pytest.mark.parametrize("name", NAMES)
def test_advice_of_inspect(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    views = disc_views(3)
    raster, mosaic, frames, folder, calib = (
        Path(f"{name}{end}") for end in (".png", " m.png", " frames", "", ".json")
    )
    for place in (frames, folder):
        place.mkdir()
    write_png(raster, compose(views))
    tiles = np.moveaxis(views, 2, 1).reshape(3 * 72, 3 * 96, 3)
    write_png(mosaic, tiles)
    for n in range(3):
        write_png(frames / f"frame_{n}.png", compose(views))
    for v, u in np.ndindex(3, 3):
        write_png(folder / f"view_{v}_{u}.png", np.ascontiguousarray(views[v, u]))
    calibration_of_grid(regular_grid((90, 90), 9.0), (90, 90)).save(calib)
    count = 0
    for path in (raster, mosaic, frames, folder, calib):
        source = recognise(path)
        assert source.advice
        for line in source.advice:
            words = typed(line, tmp_path)
            count += 1
            # One of the words is the file, or a pattern of files; it is no option.
            given = [word for word in words if not word.startswith("-")]
            assert any((tmp_path / word).exists() for word in given) or words[0] == "batch"
            if words[0] == "batch":
                assert len(find_frames(words[1:2])) == 3
            if words[0] in ("compose", "refocus"):
                done = plenofir(*words, cwd=tmp_path)
                assert done.returncode == 0, done.stderr
    assert count >= 5
    with pytest.raises(InputError) as refused:
        find_frames([str(frames)])
    pattern = refused.value.problem.removeprefix("is a folder; give a pattern such as ")
    assert len(find_frames(typed(f"plenofir {pattern}", tmp_path))) == 3


def test_words_are_quoted() -> None:
    line = command("decode", Path("-a b.png"), "-M", 5, "--calib", Path("ü'.json"))
    assert line == "plenofir decode './-a b.png' -M 5 --calib 'ü'\"'\"'.json'"
