# SPDX-License-Identifier: Apache-2.0
"""`plenofir develop`: all pictures of a capture, from each kind of source."""

import json
import os
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow
from scipy import ndimage

from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.lightfield import all_in_focus, named_views, sub_aperture
from plenofir.camera.lightfield import views as views_of
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.recognise import recognise
from plenofir.camera.recognise.source import Hints
from plenofir.commands import last_run
from plenofir.commands.app import run
from plenofir.commands.development import Job, Marks
from plenofir.ground.errors import InputError
from plenofir.ground.films import film_frames, write_webm
from plenofir.ground.images import read_image, write_png
from plenofir.ground.project import root

DATA = root() / "golden" / "plenofir" / "data"
PICTURES = {
    "all_in_focus.png",
    "central_view.png",
    "depth.png",
    "focus.gif",
    "views.gif",
}
FILMS = {"focus.webm", "views.webm"}
PAGES = {"aligned.png", "develop.json", "disparity.npy", "index.html", "viewer.html", *FILMS}


def names(folder: Path) -> set[str]:
    return {p.name for p in folder.iterdir()}


def slices(folder: Path) -> list[Path]:
    return sorted(folder.glob("refocused_*.png"))


def test_capture_and_white_image(tmp_path: Path, capsys) -> None:
    """The microscope: nothing black, and the page shows all of it."""
    capture = DATA / "microscope"
    white, dark = capture / "white.png", capture / "dark.png"
    out = tmp_path / "out"
    words = ("develop", capture / "raw.png", "--white", white, "--dark", dark, "-M", 13)
    assert run([*map(str, words), "--out", str(out), "--slices", "3"]) == 0
    assert names(out) - {p.name for p in slices(out)} == PICTURES | PAGES | {"calib.json"}
    assert 1 <= len(slices(out)) <= 3
    for path in slices(out):
        image = read_image(path)
        assert image.shape == (364, 364)
        # Half of the range is used, and no frame is dark.
        assert np.percentile(image, 99) > 0.5 * 65535
        rim = np.concatenate([image[:6].ravel(), image[:, :6].ravel()])
        assert rim.mean() > 0.5 * image[40:60].mean()
    found = calibrate(read_image(white), read_image(dark))
    want = decode(read_image(capture / "raw.png"), found, 13, dark=read_image(dark))
    assert np.array_equal(read_image(out / "aligned.png"), want)
    # All in focus is as bright as the central view everywhere, without rings.
    sharp = all_in_focus(want, 13).reshape(28, 13, 28, 13).mean((1, 3))
    seen = sub_aperture(want, 13, 6, 6).astype(np.float64)
    ratio = ndimage.gaussian_filter(sharp, 3) / ndimage.gaussian_filter(seen, 3)
    assert np.abs(ratio - 1).max() < 0.02
    assert (sharp > 0.7 * ndimage.minimum_filter(seen, 3)).all()
    page = (out / "index.html").read_text()
    assert all(f'href="{name}"' in page for name in PICTURES)
    assert page.count('src="data:image/jpeg') == len(PICTURES) - 2 + len(slices(out))
    said = capsys.readouterr().out
    assert "calibrated: rectangular" in said
    assert "gamma 2.2" in said
    # What nobody has changed is reused by a run with another option: bytes of before.
    (out / "focus.gif").write_bytes(b"edited")
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert run([*map(str, words), "--out", str(out), "--slices", "1"]) == 0
    reused = capsys.readouterr().out.partition("unchanged since the run before: ")[2]
    assert reused.startswith("calib.json, aligned.png, central_view.png, ")
    assert not {"focus.gif", "focus.webm"} & set(reused.split(", "))
    assert len(slices(out)) == 1
    assert all((out / name).read_bytes() == before[name] for name in reused.split(", ")[:3])
    assert read_image(out / "aligned.png").shape == want.shape
    assert Pillow.open(out / "focus.gif").size
    # A calibration that somebody edited is made again.
    (out / "calib.json").write_bytes(before["calib.json"] + b"\n")
    assert run([*map(str, words), "--out", str(out), "--slices", "2", "--box", "3"]) == 0
    assert (out / "calib.json").read_bytes() == before["calib.json"]
    # Boxes are small where the ring is in focus.
    reused = capsys.readouterr().out.partition("unchanged since the run before: ")[2]
    assert "central_view.png" in reused
    assert not {"all_in_focus.png", "viewer.html"} & set(reused.strip().split(", "))
    again = {"all_in_focus.png", *(path.name for path in slices(out))} & before.keys()
    assert len(again) > 1
    assert all((out / name).read_bytes() != before[name] for name in again)


def test_marks_change_with_what_results_are_made_from(tmp_path: Path, monkeypatch) -> None:
    """Contents count, not names and times; a pipe is never the same."""
    files = {name: tmp_path / f"{name}.png" for name in ("capture", "white", "dark")}
    for path in files.values():
        path.write_bytes(b"one")
    folder = tmp_path / "views"
    folder.mkdir()
    job = Job(Hints(white=files["white"], dark=files["dark"]), "f193-mla2")

    def marks(job: Job = job, capture: Path = files["capture"]) -> Marks:
        return job.marks(capture)

    def changed(other: Marks) -> set[str]:
        return {name for name in Marks._fields if getattr(other, name) != getattr(first, name)}

    first, everything = marks(), set(Marks._fields)
    assert not changed(marks())
    for name, reached in (
        ("capture", everything - {"calibration"}),
        ("white", everything),
        ("dark", everything),
    ):
        status = files[name].stat()
        files[name].write_bytes(b"two")
        os.utime(files[name], ns=(status.st_atime_ns, status.st_mtime_ns))
        assert changed(marks()) == reached
        files[name].write_bytes(b"one")
    assert changed(marks(job._replace(slices=2, tilt=(0.1, 0.0), box=3))) == {"whole"}
    assert changed(marks(job._replace(exposure="off"))) == {"pictures", "whole"}
    assert changed(marks(job._replace(camera="f197-mla2"))) == {"pictures", "whole"}
    turned = job._replace(hints=job.hints._replace(flip="rows"))
    assert changed(marks(turned)) == everything - {"calibration"}
    empty = marks(capture=folder)
    assert empty == marks(capture=folder)
    (folder / "view.png").write_bytes(b"one")
    assert empty.field != marks(capture=folder).field
    os.mkfifo(tmp_path / "pipe")
    assert marks(capture=tmp_path / "pipe").field != marks(capture=tmp_path / "pipe").field
    monkeypatch.setattr(last_run, "program_mark", lambda: "another version")
    assert changed(marks()) == everything


def test_aligned_image_and_folder_of_views_are_the_same(tmp_path: Path, capsys) -> None:
    raster = read_image(DATA / "flower_detail_5x5.png")[:150, :150]
    write_png(tmp_path / "raw.png", raster)
    for name, view in named_views(views_of(raster, 5)).items():
        (tmp_path / "views").mkdir(exist_ok=True)
        write_png(tmp_path / "views" / name, view)
    for source, more in (("raw.png", ["-M", "5"]), ("views", [])):
        out = str(tmp_path / f"of_{source}")
        assert run(["develop", str(tmp_path / source), *more, "--out", out, "--slices", "4"]) == 0
    one, other = tmp_path / "of_raw.png", tmp_path / "of_views"
    assert names(one) == names(other)
    assert np.array_equal(read_image(one / "aligned.png"), raster)
    for path in slices(one):
        assert np.array_equal(read_image(path), read_image(other / path.name))
    assert "taken as aligned, M = 5" in capsys.readouterr().out


def test_a_film_of_views_and_a_second_run(tmp_path: Path, capsys) -> None:
    """A film's frames are views; M is seen in a raster; files of an earlier run go."""
    raster = read_image(DATA / "planes_5x5.png")[:150, :160]
    frames = [raster[v::5, u::5] for v in range(5) for u in range(5)]
    assert write_webm(tmp_path / "views.webm", frames, 5)
    out = tmp_path / "out"
    words = ["--out", str(out), "--slices"]
    assert run(["develop", str(tmp_path / "views.webm"), *words, "9"]) == 0
    assert "sequence: 5 lines of 5 views, by their motion" in capsys.readouterr().out
    decoded = read_image(out / "aligned.png")
    # A film is compressed.
    assert np.abs(decoded[..., 1].astype(int) - raster[..., 1]).mean() < 12
    first = slices(out)
    write_png(tmp_path / "raw.png", raster)
    write_png(out / "own.png", raster)
    assert run(["develop", str(tmp_path / "raw.png"), *words, "2"]) == 0
    assert "taken as aligned, M = 5 by its joints" in capsys.readouterr().out
    assert (out / "own.png").exists()
    assert len(slices(out)) <= 2 < len(first)
    # The same again stays; after a change of the file or of the pictures it is made anew.
    kept = (out / "index.html").stat().st_mtime_ns
    assert run(["develop", str(tmp_path / "raw.png"), *words, "2"]) == 0
    said = capsys.readouterr().out
    assert "taken as aligned, M = 5 by its joints" in said
    assert "there already" in said
    assert (out / "index.html").stat().st_mtime_ns == kept
    report = json.loads((out / "develop.json").read_text())
    assert {*report["files"], "own.png"} == names(out)
    frames = list(film_frames(out / "focus.webm"))
    assert frames[0].shape == (600, 640, 3)
    # Views are enlarged four times at most.
    sides = np.array(raster.shape[:2]) // 5
    (view, *_) = film_frames(out / "views.webm")
    assert view.shape[:2] == tuple(np.rint(min(4, 640 / sides.max()) * sides).astype(int) // 2 * 2)
    page = (out / "index.html").read_text()
    assert all(f'href="{name}"' in page for name in FILMS)
    assert write_webm(tmp_path / "views.webm", frames[:1] * 24, 5)
    with pytest.raises(InputError, match="24 pictures that are no captures, and no views"):
        recognise(tmp_path / "views.webm").field()


def test_distances_with_a_camera(tmp_path: Path) -> None:
    raster = [str(DATA / "planes_5x5.png"), "-M", "5"]
    camera = ["--camera", "f193-mla2", "--focus", "1500"]
    alone = tmp_path / "alone.tif"
    words = ["develop", *raster, *camera, "--out", str(tmp_path / "out")]
    assert run([*words, "--slices", "2"]) == 0
    assert run(["refocus", *raster, "--a", "3/5", *camera, "--out", str(alone)]) == 0
    assert run(["stack", *raster, "--a", "1/5", *camera, "--out", str(tmp_path / "stack")]) == 0
    distances = np.load(tmp_path / "out" / "distance_mm.npy")
    assert np.nanmax(distances) > 2 * np.nanmin(distances)
    model = RayModel.focused(load_camera("f193-mla2"), 1500, 5)
    others = (alone, *(tmp_path / "stack").glob("refocused*.png"))
    for path in (*slices(tmp_path / "out"), *others):
        with Pillow.open(path) as file:
            packet = file.info.get("XML:com.adobe.xmp") or file.info["xmp"].decode()
        facts = dict(re.findall(r':(\w+)="([^"]*)"', packet))
        a, told = Fraction(facts["a"]), Fraction(facts["SubjectDistance"]) * 1000
        assert float(told) == pytest.approx(float(model.distance(float(a)).mm), rel=1e-4)
        assert float(Fraction(facts["FocalLength"])) == pytest.approx(193.2935)


@pytest.mark.slow
def test_batch_of_captures(tmp_path: Path, capsys) -> None:
    """One calibration for all; existing results are kept, changed ones made again."""
    capture = DATA / "microscope"
    raw = read_image(capture / "raw.png")
    for name, share in (("one", 1), ("two", 2)):
        write_png(tmp_path / f"{name}.png", raw // share)
    write_png(tmp_path / "bad.png", np.zeros((40, 40), np.uint16))
    out = tmp_path / "out"
    words = ["batch", *(str(tmp_path / f"{n}.png") for n in ("one", "two", "bad"))]
    words += ["--white", str(capture / "white.png"), "--dark", str(capture / "dark.png")]
    words += ["--out", str(out), "--workers", "1"]
    assert run(words) == 1
    said = capsys.readouterr()
    assert "2 captures developed, 0 there already, 1 failed" in said.out
    assert said.err.startswith("failed: ")
    assert "bad.png" in said.err
    assert names(out) == {"calib.json", "exposure.json", "one", "two"}
    assert names(out / "one") >= PICTURES | FILMS
    # With one exposure half of the light is darker.
    means = [read_image(out / name / "central_view.png").mean() for name in ("one", "two")]
    assert means[1] < 0.85 * means[0]
    (out / "two" / "depth.png").write_bytes(b"")
    assert run(words[:3] + words[4:]) == 0
    assert "1 captures developed, 1 there already, 0 failed" in capsys.readouterr().out
    assert read_image(out / "two" / "depth.png").size


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "give -M for aligned raw images, or --white or --calib for captures"),
        (("-M", "5", "-a", "0", "--camera", "f193-mla2"), "--camera requires --calib"),
        (("--calib", "c.json", "-a", "0"), "leave out -a"),
        (("--calib", "c.json", "--white", "w.png"), "--white: cannot be combined with --calib"),
        (("--calib", "c.json", "--focus", "900"), "--focus requires --camera"),
    ],
)
def test_bad_batches(tmp_path: Path, words, message) -> None:
    write_png(tmp_path / "raw.png", np.zeros((20, 20), np.uint8))
    with pytest.raises(InputError, match=message):
        run(["batch", str(tmp_path / "raw.png"), *words, "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            (),
            "can.t tell: too small.*; give --white or --calib for a raw capture, or -M for",
        ),
        (("-M", "5", "--focus", "900"), "--focus requires --camera"),
        (("-M", "5", "--exposure", "much"), "use auto, off, or a number of EV"),
        (("-M", "5", "--camera", "missing"), "missing"),
        (("-M", "5", "--dark", "dark.png"), "--dark: is not used for .*raw.png"),
        (("--white", "w.png", "--calib", "c.json"), "--white: cannot be combined with --calib"),
    ],
)
def test_bad_calls(tmp_path: Path, words, message) -> None:
    write_png(tmp_path / "raw.png", np.zeros((20, 20), np.uint8))
    with pytest.raises(InputError, match=message):
        run(["develop", str(tmp_path / "raw.png"), *words, "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()
