"""Many frames: order, going on, failed frames."""

import sys
from fractions import Fraction

import numpy as np
import pytest

from plenofir.commands.app import main
from plenofir.errors import InputError
from plenofir.images import read_image, write_png
from plenofir.refocus import refocus
from plenofir.refocus.batch import RECORD, Settings, find_frames, result_names, run_batch

SETTINGS = Settings(5, (Fraction(-3, 5), Fraction(1)))


@pytest.fixture
def frames(tmp_path):
    rng = np.random.default_rng(0)
    for number in (1, 2, 10):
        raw = rng.integers(0, 65536, (40, 50, 3), dtype=np.uint16)
        write_png(tmp_path / f"frame_{number}.png", raw)
    return tmp_path


def test_order_and_names(frames):
    found = find_frames(str(frames / "*.png"))
    assert [path.stem for path in found] == ["frame_1", "frame_2", "frame_10"]
    assert result_names(found, SETTINGS)[2] == ("frame_10_a-3.png", "frame_10_a+5.png")
    assert result_names(found, Settings(5, (Fraction(1),)))[0] == ("frame_1.png",)
    with pytest.raises(InputError, match="no such files"):
        find_frames(str(frames / "*.tif"))
    with pytest.raises(InputError, match="same name"):
        result_names([frames / "a.png", frames / "b" / "a.png"], SETTINGS)


def test_batch_goes_on_and_reports_failures(frames):
    (frames / "frame_3.png").write_text("no image")
    sources, out = find_frames(str(frames / "*.png")), frames / "out"
    done = run_batch(sources, SETTINGS, out, workers=2)
    assert [f.state for f in done] == ["done", "done", "failed", "done"]
    assert [f.source.stem for f in done] == ["frame_1", "frame_2", "frame_3", "frame_10"]
    assert "frame_3.png: no image" in done[2].reason
    for frame in (done[0], done[1], done[3]):
        raw = read_image(frame.source)
        for a, result in zip(SETTINGS.a, frame.results, strict=True):
            assert np.array_equal(read_image(result), refocus(raw, 5, a))
    assert len(list(out.iterdir())) == 7  # and no half-written ones

    # One result lost, one frame changed, one repaired: these are made anew, the other is kept.
    done[0].results[1].unlink()
    raw = np.zeros((40, 50, 3), np.uint16)
    write_png(sources[1], raw[:, :45])
    write_png(sources[2], raw)
    again = run_batch(sources, SETTINGS, out, workers=1)
    assert [f.state for f in again] == ["done", "done", "done", "kept"]
    assert read_image(again[1].results[0]).shape == (40, 45, 3)
    # Nothing to do: no cluster is started.
    states = {f.state for f in run_batch(sources, SETTINGS, out, scheduler="tcp://nowhere:1")}
    assert states == {"kept"}
    (out / RECORD).write_text("broken")
    with pytest.raises(InputError, match="scheduler"):
        run_batch(sources, SETTINGS, out, scheduler="nonsense")


def test_a_scheduler_that_runs_already(frames, monkeypatch, capfd):
    from distributed import LocalCluster

    monkeypatch.chdir(frames)
    (frames / "frame_3.png").write_text("no image")
    with LocalCluster(
        n_workers=1, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        options = ("-M", "5", "-a", "2/5", "--scheduler", address)
        monkeypatch.setattr(sys, "argv", ["plenofir", "batch", "frame_*.png", *options])
        with pytest.raises(SystemExit) as exit_:
            main()
    assert exit_.value.code == 1
    captured = capfd.readouterr()
    assert "batch: 3 frames refocused, 0 there already, 1 failed" in captured.out
    assert captured.err.startswith("failed: ")
    want = refocus(read_image(frames / "frame_10.png"), 5, "2/5")
    assert np.array_equal(read_image(frames / "batch" / "frame_10.png"), want)


def test_refusals(frames):
    sources = find_frames(str(frames / "*.png"))
    with pytest.raises(InputError, match="would replace a frame"):
        run_batch(sources, Settings(5, (Fraction(1),)), frames)
    with pytest.raises(InputError, match="denominator divides 5"):
        run_batch(sources, Settings(5, (Fraction(1, 3),)), frames / "out")
    with pytest.raises(InputError, match="integer"):
        run_batch(sources, Settings(5, (Fraction(1, 5),), upsample=False), frames / "out")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-M", "5", "-a", "1/3"), "--a: 1/3 is not on the grid"),
        (("-M", "5", "-a", "1 1"), "--a: 1 is given twice"),
        (("-M", "0", "-a", "1"), "--micro-image: '0'"),
        (("-M", "5", "-a", "1", "--workers", "0"), "--workers: '0'"),
        (("-M", "5", "-a", "1", "--scheduler", "x"), "--scheduler: 'x'"),
    ],
)
def test_bad_options_are_one_line(frames, monkeypatch, capfd, options, message):
    monkeypatch.chdir(frames)
    monkeypatch.setattr(sys, "argv", ["plenofir", "batch", "*.png", *options])
    with pytest.raises(SystemExit) as exit_:
        main()
    assert exit_.value.code == 2
    err = capfd.readouterr().err
    assert err.startswith(f"plenofir: {message}")
    assert err.count("\n") == 1
