# SPDX-License-Identifier: Apache-2.0
"""Many frames: order, names, resumption, failed frames, and problems with the folder."""

import asyncio
import errno
import os
import resource
import shutil
import sys
from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace as Namespace
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pytest
from test_refocus import random_image

from plenofir.commands import batch as commands
from plenofir.commands.app import main
from plenofir.ground.errors import InputError, ToolError
from plenofir.ground.images import read_image, write_png
from plenofir.refocus import batch, best_picture, refocus
from plenofir.refocus.batch import (
    Made,
    Settings,
    find_frames,
    refocus_frames,
    result_names,
    run_batch,
)
from plenofir.refocus.batch_record import RECORD, Content, Entry, Record

SETTINGS = Settings(5, (Fraction(1), Fraction(1, 5)))
NAMES = ("_2_a1.png", "_1_a1_5.png")


@pytest.fixture
def frames(tmp_path):
    """A folder with frames in a folder, both with names that need care."""
    rng = np.random.default_rng(0)
    folder = tmp_path / 'it\'s "quoted" -a 100%s {x}\\ $HOME;光'
    (folder / "in").mkdir(parents=True)
    for number in (1, 2, 10):
        raw = rng.integers(0, 65536, (40, 50, 3), dtype=np.uint16)
        write_png(folder / "in" / f"frame_{number}.png", raw)
    return folder


@pytest.fixture
def here(monkeypatch):
    """Workers in this process, for tests of what is done with their results."""

    def made(sources, settings, folder, client, together):
        for number, source in enumerate(sources):
            yield number, *batch.refocus_frames([source.absolute()], settings, folder)

    monkeypatch.setattr(batch, "dask_client", lambda *_: nullcontext())
    monkeypatch.setattr(batch, "_made", made)


def check_results(sources, out: Path) -> None:
    """Every result is right, and nothing else is in the folder but the record."""
    names = result_names(sources, SETTINGS)
    wanted = {name for group in names for name in group} | {RECORD}
    assert {path.name for path in out.iterdir()} == wanted
    for source, group in zip(sources, names, strict=True):
        raw = read_image(source)
        for a, name in zip(SETTINGS.a, group, strict=True):
            assert np.array_equal(read_image(out / name), refocus(raw, 5, a)), name


def test_order_and_names(frames):
    pattern = str(frames / "in" / "*.png")
    found = find_frames([pattern])
    assert [path.stem for path in found] == ["frame_1", "frame_2", "frame_10"]
    assert find_frames([str(found[2]), pattern]) == [found[2], *found[:2]]
    # a = 1, a = 1/5 and a = -3/5 cannot be taken for one another.
    assert result_names(found, SETTINGS)[2] == ("frame_10_2_a1.png", "frame_10_1_a1_5.png")
    assert result_names(found, Settings(5, (Fraction(-3, 5),)))[0] == ("frame_1_a-3_5.png",)
    for bad, message in (
        (str(frames / "*.tif"), "no such files"),
        (str(frames / "in"), r"(?s)is a folder; give a pattern such as .*in/\*.png"),
        ("x" * 300, "no such files|name too long"),
        ("nul\0", "no such files"),
    ):
        with pytest.raises(InputError, match=message):
            find_frames([bad])
    with pytest.raises(InputError, match="same name"):
        result_names([frames / "a.png", frames / "b" / "a.png"], SETTINGS)


def test_a_box_is_that_of_refocus_and_changes_the_record():
    raw, a = random_image((30, 40), np.uint8), Fraction(2, 5)
    for best, want in ((False, refocus(raw, 5, a, box=3)), (True, best_picture(raw, 5, a, box=3))):
        settings = Settings(5, (a,), best=best, box=3)
        assert np.array_equal(settings.refocused(raw, a), want)
        assert settings.signature() == f"{replace(settings, box=None).signature()} box=3"


def test_names_with_brackets_are_no_patterns(frames):
    folder = frames / "in"
    literal = folder / "x[1].png"
    (folder / "frame_1.png").rename(literal)
    (folder / "frame_2.png").rename(folder / "x1.png")
    assert find_frames([str(literal)]) == [literal]
    assert find_frames([str(folder / "x[2-9].png"), str(folder / "x?.png")][1:]) == [
        folder / "x1.png"
    ]
    literal.unlink()
    assert find_frames([str(literal)]) == [folder / "x1.png"]


def test_batch_goes_on_and_reports_failures(frames):
    """With worker processes."""
    (frames / "in" / "frame_3.png").write_text("no image")
    sources, out = find_frames([str(frames / "in" / "*.png")]), frames / "out"
    done = run_batch(sources, SETTINGS, out, workers=2)
    assert [f.state for f in done] == ["done", "done", "failed", "done"]
    assert [f.source.stem for f in done] == ["frame_1", "frame_2", "frame_3", "frame_10"]
    assert "frame_3.png: no image" in done[2].reason
    assert [path.name for path in done[3].results] == ["frame_10" + name for name in NAMES]
    good = [sources[0], sources[1], sources[3]]
    check_results(good, out)
    # Nothing to do: no cluster is started.
    states = {f.state for f in run_batch(good, SETTINGS, out, scheduler="tcp://nowhere:1")}
    assert states == {"kept"}


def test_what_is_made_again(frames, here):
    sources, out = find_frames([str(frames / "in" / "*.png")]), frames / "out"
    run_batch(sources, SETTINGS, out)
    results = [out / f"{source.stem}{NAMES[1]}" for source in sources]

    def states() -> list[str]:
        found = [frame.state for frame in run_batch(sources, SETTINGS, out)]
        check_results(sources, out)
        return found

    assert states() == ["kept"] * 3
    # A result is lost, emptied, altered at the same size.
    results[0].unlink()
    assert states() == ["done", "kept", "kept"]
    results[1].write_bytes(b"")
    assert states() == ["kept", "done", "kept"]
    content = bytearray(results[2].read_bytes())
    content[-20] ^= 1
    results[2].write_bytes(content)
    assert states() == ["kept", "kept", "done"]
    # A frame is changed.
    write_png(sources[1], read_image(sources[1])[:, :45])
    assert states() == ["kept", "done", "kept"]
    # Other settings in the same folder, and back: the first results are there still.
    other = Settings(5, (Fraction(1), Fraction(1, 5)), order=1)
    assert {f.state for f in run_batch(sources, other, out)} == {"done"}
    assert states() == ["done"] * 3


def test_a_run_that_was_killed(frames, here):
    """Half a line in the record, results without a line, files of workers."""
    sources, out = find_frames([str(frames / "in" / "*.png")]), frames / "out"
    run_batch(sources, SETTINGS, out)
    record = out / RECORD
    lines = record.read_bytes().splitlines(keepends=True)
    record.write_bytes(lines[0] + lines[1][:-1])
    (out / f"frame_1{NAMES[0]}").write_bytes(b"half")
    (out / ".plenofir-batch-dead").mkdir()
    (out / ".plenofir-batch-dead" / "x").write_bytes(b"half")
    assert [f.state for f in run_batch(sources, SETTINGS, out)] == ["done", "done", "done"]
    check_results(sources, out)
    assert len(record.read_bytes().splitlines()) == 4


def test_records_that_cannot_be_used(frames, here):
    sources, out = find_frames([str(frames / "in" / "*.png")]), frames / "out"
    run_batch(sources, SETTINGS, out)
    record = out / RECORD
    good = record.read_bytes()
    for bad in (b"[1,2]\n", b"null\n", b"\n", b"\xff\n", b"[" * 5000 + b"\n", b'{"mark":"x"}\n'):
        record.write_bytes(good + bad)
        with pytest.raises(InputError, match=r"batch.jsonl: line 4 is damaged; delete") as refused:
            run_batch(sources, SETTINGS, out)
        assert "\n" not in str(refused.value)
        assert record.read_bytes() == good + bad
    record.write_bytes(good)
    with Record(out), pytest.raises(InputError, match="another run is writing here"):
        run_batch(sources, SETTINGS, out)
    (out / "batch.json").write_text("{}")
    with pytest.raises(InputError, match="record of an earlier version"):
        run_batch(sources, SETTINGS, out)


def test_the_record_only_grows_by_a_line(tmp_path):
    """The time for a frame does not depend on the number of frames."""
    content = Content(size=1, sha256="0" * 64)
    with Record(tmp_path) as record:
        sizes = []
        for number in range(100):
            entry = Entry(source="x", mark=f"{number:064}", results={"x": content})
            before = record.path.stat()
            record.add(entry)
            after = record.path.stat()
            assert after.st_ino == before.st_ino
            sizes.append(after.st_size - before.st_size)
    assert len(set(sizes)) == 1
    with Record(tmp_path) as record:
        assert len(record.entries) == 100


def test_a_full_disk_stops_the_run(frames, here, monkeypatch):
    sources, out = find_frames([str(frames / "in" / "*.png")]), frames / "out"
    run_batch(sources[:1], SETTINGS, out)
    tried = []

    def full(sources, settings, folder):
        tried.append(sources)
        (made,) = refocus_frames(sources, settings, folder)
        return [Made(made.results[:1], stop=OSError(errno.ENOSPC, "No space left on device"))]

    with monkeypatch.context() as patch:
        patch.setattr(batch, "refocus_frames", full)
        with pytest.raises(InputError, match=r"frame_2_1_a1_5.png: cannot be written \(No space"):
            run_batch(sources, SETTINGS, out)
    assert len(tried) == 1
    assert not list(out.glob(".*"))
    assert [f.state for f in run_batch(sources, SETTINGS, out)] == ["kept", "done", "done"]
    check_results(sources, out)


@pytest.mark.parametrize("room", [100, 600, 5000])
def test_files_that_cannot_grow(frames, here, room):
    """The limit is met by the record or by a result."""
    sources, out = find_frames([str(frames / "in" / "*.png")]), frames / "out"
    # Compiles the kernels beforehand, whose files would otherwise hit the limit.
    run_batch(sources, SETTINGS, frames / "before")
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, old[1]))
    try:
        with pytest.raises(InputError, match=r"cannot be written \(File too large\)"):
            run_batch(sources, SETTINGS, out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    run_batch(sources, SETTINGS, out)
    check_results(sources, out)


def test_a_scheduler_that_runs_already(frames, monkeypatch, capfd):
    from distributed import LocalCluster

    monkeypatch.chdir(frames)
    (frames / "in" / "frame_3.png").write_text("no image")
    with LocalCluster(
        n_workers=1, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        options = ("-M", "5", "-a", "2/5", "--scheduler", address)
        monkeypatch.setattr(sys, "argv", ["plenofir", "batch", "in/frame_*.png", *options])
        with pytest.raises(SystemExit) as exit_:
            main()
    assert exit_.value.code == 1
    captured = capfd.readouterr()
    assert "batch: 3 frames refocused, 0 there already, 1 failed" in captured.out
    assert captured.err.startswith("failed: ")
    want = best_picture(read_image(frames / "in" / "frame_10.png"), 5, "2/5")
    assert np.array_equal(read_image(frames / "batch" / "frame_10_a2_5.png"), want)


def test_nobody_else_reaches_the_processes(tmp_path):
    """Whoever could talk to one of them would run code as its user."""
    from distributed import Security
    from distributed.core import connect

    async def reached(address: str, **options: object) -> bool:
        try:
            comm = await connect(address, timeout=2, **options)
        except (OSError, RuntimeError):
            return False
        comm.abort()
        return True

    with batch.dask_client("local", 1) as client:
        info = client.scheduler_info()
        (worker, facts), *_ = info["workers"].items()
        assert client.submit(os.getpid).result() != os.getpid()
        for address in (info["address"], worker, facts["nanny"]):
            place = address.partition("://")[2]
            stranger = Security.temporary().get_connection_args("client")
            assert not asyncio.run(reached(f"tcp://{place}")), address
            assert not asyncio.run(reached(f"tls://{place}", **stranger)), address
        ports = [info["services"]["dashboard"], *facts["services"].values()]
        for port in ports:
            for path in ("info/main/workers.html", "json/counts.json", "metrics"):
                with pytest.raises(HTTPError, match="404"):
                    urlopen(f"http://127.0.0.1:{port}/{path}", timeout=5)


def test_names_that_are_no_text(frames, here):
    name = os.fsdecode(b"\xff.png")
    (frames / "in" / "frame_1.png").rename(frames / "in" / name)
    sources, out = find_frames([str(frames / "in" / "*.png")]), frames / "out"
    for state in ("done", "kept"):
        assert {frame.state for frame in run_batch(sources, SETTINGS, out)} == {state}
    check_results(sources, out)
    (out / os.fsdecode(b"\xff_2_a1.png")).write_bytes(b"")
    assert [f.state for f in run_batch(sources, SETTINGS, out)].count("done") == 1


def test_refusals(frames):
    sources = find_frames([str(frames / "in" / "*.png")])
    linked = frames / "linked"
    linked.symlink_to(frames / "in")
    for out in (frames / "in", linked):
        with pytest.raises(InputError, match="lies in the folder for results"):
            run_batch(sources, SETTINGS, out)
    for settings, message in (
        (Settings(5, (Fraction(1, 3),)), "denominator divides 5"),
        (Settings(5, (Fraction(1, 5),), upsample=False), "integer"),
        (Settings(5, (Fraction(1),), box=3), "box: must be a multiple of gcd"),
        (Settings(5, (Fraction(1),), box=6, best=True), "box: must be 5 samples or fewer"),
        (Settings(5, ()), "no focus settings"),
        (Settings(0, (Fraction(1),)), "must be an integer, 1 or more"),
    ):
        with pytest.raises(InputError, match=message):
            run_batch(sources, settings, frames / "out")
    long = frames / "in" / ("x" * 248 + ".png")
    shutil.copy(sources[0], long)
    with pytest.raises(InputError, match="too long"):
        run_batch([long], SETTINGS, frames / "out")


class LostFuture:
    """A frame that was done when it was told, and is not any more: its worker has died."""

    status = "lost"

    def __init__(self, *work, pure):
        self.key, self.work = id(self), work

    def exception(self):
        return None  # As Dask's, once the frame is made anew.

    def result(self):
        function, *arguments = self.work
        return function(*arguments)


@pytest.fixture
def dying_workers(monkeypatch):
    """Workers that die with each result, whose frames Dask makes anew."""

    class Futures(list):
        add = list.append

    monkeypatch.setattr(batch, "dask_client", lambda *_: nullcontext(Namespace(submit=LostFuture)))
    monkeypatch.setattr("distributed.as_completed", lambda futures=(): Futures(futures))


def test_a_worker_that_dies_with_its_result(frames, dying_workers):
    sources = find_frames([str(frames / "in" / "*.png")])
    run = run_batch(sources, SETTINGS, frames / "out")
    assert [(frame.state, frame.reason) for frame in run] == [("done", "")] * 3
    check_results(sources, frames / "out")


def test_a_worker_that_dies_with_a_development(frames, dying_workers, monkeypatch):
    hints = Namespace(white=None)
    monkeypatch.setattr(commands, "_develop_frame", lambda *_: ("", ()))
    monkeypatch.setattr("plenofir.commands.development.is_developed", lambda *_: False)
    sources = find_frames([str(frames / "in" / "*.png")])
    workers = Namespace(scheduler="local", workers=1)
    shown = []
    done = commands._develop_all(
        sources,
        Namespace(hints=hints),
        frames / "out",
        workers,
        lambda *numbers: shown.append(numbers),
        per_frame=True,
    )
    assert done == (0, [])
    assert shown == [(0, 3), (1, 3), (2, 3), (3, 3)]


def test_workers_that_do_not_start(frames, monkeypatch):
    """On a machine with much else to do."""

    def fail(**_):
        raise RuntimeError("Nanny failed to start.")

    monkeypatch.setattr("distributed.LocalCluster", fail)
    with pytest.raises(ToolError, match=r"do not start \(Nanny failed to start.\); run it again"):
        run_batch(find_frames([str(frames / "in" / "*.png")]), SETTINGS, frames / "out")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-M", "5", "-a", "1/3", "--interpolation", "1"), "--a: 1/3 is not on the grid"),
        (("-M", "5", "-a", "1 1"), "--a: 1 is given twice"),
        (("-M", "0", "-a", "1"), "--micro-image: '0'"),
        (("-M", "5", "-a", "1", "--workers", "0"), "--workers: '0'"),
        (
            ("-M", "5", "-a", "1", "--workers", "99999999999"),
            "--workers: 99999999999 workers are not possible",
        ),
        (("-M", "5", "-a", "1", "--scheduler", "x"), "--scheduler: 'x'"),
        (
            ("-M", "5", "-a", "1", "--scheduler", "tls://127.0.0.1:9"),
            "tls://127.0.0.1:9: needs certificates",
        ),
        (("-M", "5", "-a", "1", "--out", "in/frame_1.png"), "in/frame_1.png/batch.jsonl: cannot"),
    ],
)
def test_bad_options_are_one_line(frames, monkeypatch, capfd, options, message):
    monkeypatch.chdir(frames)
    monkeypatch.setattr(sys, "argv", ["plenofir", "batch", "in/*.png", *options])
    with pytest.raises(SystemExit) as exit_:
        main()
    assert exit_.value.code == 2
    err = capfd.readouterr().err
    assert err.startswith(f"plenofir: {message}")
    assert err.count("\n") == 1
