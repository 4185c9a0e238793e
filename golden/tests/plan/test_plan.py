# SPDX-License-Identifier: Apache-2.0
"""Scene profiles, plans, project files."""

import csv
import itertools
import json
import re
from pathlib import Path

import pytest
from in_process import plenofir
from written_scenes import BASE, scene, write

from plenofir.camera.rays import Cover, Slice, covering_slices
from plenofir.camera.rays.camera import CAMERAS
from plenofir.camera.rays.cover import without_idle_slices
from plenofir.fpga import hdl
from plenofir.fpga.resources.estimate import estimate
from plenofir.ground.errors import InputError
from plenofir.ground.files import publish_files
from plenofir.plan import DEVICES, LoadedScene, load_scene, make_plan
from plenofir.plan.configure import (
    TOP,
    configure,
    needed_sources,
    package_text,
    place_from,
    top_text,
)
from plenofir.plan.loaded_scene import scene_files
from plenofir.plan.plan import Plan
from plenofir.refocus import StoredProductArithmetic, shift_to_text


@pytest.mark.parametrize("file", scene_files(), ids=lambda file: file.stem)
def test_shipped_scenes_fit(file: Path) -> None:
    plan = make_plan(load_scene(file))
    assert plan.scene == file.stem
    assert plan.slices
    assert not plan.gaps_mm
    assert all(plan.needs[name] <= plan.available[name] for name in plan.available)
    # What is left out makes the full build larger in every resource that counts. LUTs of moving
    # sums grow with the channels, hardly with slices; those of filters with both.
    lut = next(name for name in plan.needs if name.startswith("LUT"))
    ram = next(name for name in plan.needs if "Kbit" in name or "RAM" in name)
    assert plan.full[lut] > plan.needs[lut] or plan.core.channels == 3
    assert plan.full[ram] > plan.needs[ram]
    loaded = load_scene(file)
    build = loaded.scene.build.model_copy(update={"engine": "fir"})
    scene_of_taps = loaded.scene.model_copy(update={"build": build})
    with_taps = loaded.model_copy(update={"scene": scene_of_taps})
    if plan.screen.needs_stack:
        return
    if plan.core.pixels_per_clock > 1 or (plan.sensor is not None and plan.camera is None):
        with pytest.raises(InputError, match=r"at a pixel a clock|is too small"):
            make_plan(with_taps)
        return
    taps = make_plan(with_taps)
    assert taps.core.engine.kind == "fir"
    assert taps.full[lut] > taps.needs[lut]
    assert taps.full[ram] > taps.needs[ram]


def test_shipped_scenes() -> None:
    plans = [make_plan(load_scene(file)) for file in scene_files()]
    kinds = {(p.core.channels, p.core.micro_image_size, p.columns) for p in plans}
    assert {(3, 3, 640), (3, 3, 843), (3, 5, 1280), (1, 11, 3201), (3, 5, 640)} < kinds
    assert len(kinds) == 11
    assert {p.device for p in plans} >= {"xc6slx45", "lfe5u-45f", "lfe5u-85f"}


def test_slices_cover_the_range_and_each_is_needed(tmp_path: Path) -> None:
    loaded = scene(tmp_path)
    plan = make_plan(loaded)
    fields = [(part.near_mm, part.far_mm) for part in plan.slices]
    assert fields[0][1] is None
    assert fields[-1][0] <= 800
    for (near, _), (_, far) in itertools.pairwise(fields):
        assert far >= near
    for number in range(1, len(fields) - 1):
        # Without a slice in the middle, a gap opens between its neighbours.
        assert fields[number - 1][0] > fields[number + 1][1]


def test_notes_on_the_optics(tmp_path: Path) -> None:
    (note,) = make_plan(scene(tmp_path)).notes
    assert "smaller than the Rayleigh limit" in note
    camera = (CAMERAS / "f193-mla1.toml").read_text()
    narrow = camera.replace("[main_lens]", "[main_lens]\nentrance_pupil_diameter_mm = 3.0")
    (tmp_path / "narrow.toml").write_text(narrow)
    (note,) = make_plan(scene(tmp_path, ("f193-mla2", "narrow.toml"))).notes
    assert "outside the entrance pupil" in note
    assert make_plan(scene(tmp_path, ("f193-mla2", "f193-mla1"))).notes == ()


def test_idle_slices_are_dropped() -> None:
    parts = (
        Slice(0, 2000.0, float("inf")),
        Slice(1, 1500.0, 2500.0),
        Slice(2, 1000.0, 2100.0),
    )
    cover = without_idle_slices(Cover(parts, ()), 1000.0, float("inf"))
    assert [part.a for part in cover.slices] == [0, 2]
    assert cover.gaps == ()


def test_explicit_slices(tmp_path: Path) -> None:
    changes = [("near_mm = 800.0\nfar_mm = inf", 'slices = ["-1/5", "2/5"]')]
    plan = make_plan(scene(tmp_path, *changes))
    assert plan.core.shifts == (-1, 2)
    assert plan.core.engine.kind == "moving_sum"
    integer = (changes[0][0], 'slices = ["-1", "0", "1"]')
    plan = make_plan(scene(tmp_path, integer, build='engine = "fir"'))
    assert plan.core.engine.hold
    assert plan.core.filter_layout().can_hold


def test_engine_that_fits_is_chosen(tmp_path: Path) -> None:
    # 40 lines of partial sums of three channels are too much, the pixels are not.
    slices = ", ".join(f'"{shift}/5"' for shift in range(-5, 11))
    changes = [
        ("columns = 640", "columns = 1280"),
        ("near_mm = 800.0\nfar_mm = inf", f"slices = [{slices}]"),
    ]
    build = 'arithmetic = "exact"\n'
    plan = make_plan(scene(tmp_path, *changes, build=build))
    assert plan.core.engine.kind == "moving_sum"
    assert re.match(r"fir would not fit: \d+ of 116 block RAM", plan.engine_reason)
    assert plan.line_buffers == 36
    taps, sums = plan.engines
    assert (taps.engine, sums.engine) == ("fir", "moving_sum")
    assert taps.needs is not None
    assert sums.needs == plan.needs
    with pytest.raises(InputError, match=r"needs \d+ of 116 block RAM"):
        make_plan(scene(tmp_path, *changes, build=build + 'engine = "fir"'))
    one_row = scene(tmp_path, *changes[1:], build=build + "parallel_rows = 5")
    with pytest.raises(InputError, match=r"needs \d+ of"):
        make_plan(one_row)


def test_smaller_engine_is_chosen(tmp_path: Path) -> None:
    for a in ("1/5", "2/5", "1", "-1"):
        slices = ("near_mm = 800.0\nfar_mm = inf", f'slices = ["{a}"]')
        plan = make_plan(scene(tmp_path, slices))
        shares = {
            option.engine: max(option.needs[name] / plan.available[name] for name in option.needs)
            for option in plan.engines
            if option.needs is not None
        }
        assert plan.core.engine.kind == min(shares, key=lambda engine: shares[engine])
        assert f"{shares[plan.core.engine.kind]:.0%} of the device's" in plan.engine_reason
    chosen = make_plan(scene(tmp_path, slices, build='engine = "fir"'))
    assert (chosen.core.engine.kind, chosen.engine_reason) == ("fir", "as the scene wants it")


def test_moving_sums_need_blanking(tmp_path: Path) -> None:
    # Frames of 600 lines become 629, a multiple of M; the mode has 628 with its blanking.
    changes = [
        ('model = "f193-mla2"\nfocus_mm = 5000.0\nmicro_image_size = 5', "micro_image_size = 37"),
        ("columns = 640", "columns = 800"),
        ("rows = 480", "rows = 600\nrate_hz = 60.0"),
        ("near_mm = 800.0\nfar_mm = inf", 'slices = ["1/37"]'),
    ]
    build = 'path = "video"\narithmetic = "stored"\nfraction_bits = 0\nguard_bits = 0'
    plan = make_plan(scene(tmp_path, *changes, build=build))
    assert plan.core.engine.kind == "fir"
    assert plan.engine_reason == "moving_sum: frames of 629 lines, the mode has 628"


def test_rows_that_are_no_multiple_of_m_need_no_blank_lines(tmp_path: Path) -> None:
    def planned(*changes: tuple[str, str], build: str) -> Plan:
        slices = ("near_mm = 800.0\nfar_mm = inf", 'slices = ["2"]')
        return make_plan(scene(tmp_path, slices, *changes, build=build))

    rate, odd = ("rows = 480", "rows = 480\nrate_hz = 60.0"), ("rows = 480", "rows = 482")
    odd_rate = ("rows = 480", "rows = 482\nrate_hz = 60.0")
    plan = planned(odd_rate, build='engine = "moving_sum"')
    assert plan.core.engine.any_rows
    assert plan.core.generics()["ANY_ROWS"] is True
    assert "constant ANY_ROWS : boolean := true;" in package_text(plan)
    assert plan.frame_clocks == 482 * plan.columns
    without = planned(rate, build='engine = "moving_sum"')
    assert not without.core.engine.any_rows
    assert plan.line_buffers == without.line_buffers + 1
    # Stills do not follow each other, taps ask for nothing, video has its blanking.
    assert not planned(odd, build='engine = "moving_sum"').core.engine.any_rows
    assert "ANY_ROWS" not in planned(odd_rate, build='engine = "fir"').core.generics()
    camera = 'model = "f193-mla2"\nfocus_mm = 5000.0\nmicro_image_size = 5'
    seven = (camera, "micro_image_size = 7")
    assert planned(seven, rate, build='engine = "moving_sum"').core.engine.any_rows
    assert not planned(
        seven, rate, build='engine = "moving_sum"\npath = "video"'
    ).core.engine.any_rows


LARGE = [
    ('"rgb"', '"grey"'),
    ("near_mm = 800.0\nfar_mm = inf", 'slices = ["2/5"]'),
]


def large(folder: Path, rate: float, build: str, columns: int = 3000) -> LoadedScene:
    size = ("columns = 640\nrows = 480", f"columns = {columns}\nrows = 3000\nrate_hz = {rate}")
    return scene(folder, size, *LARGE, build=build)


@pytest.mark.parametrize(
    ("rate", "pixels"),
    [(8.0, 1), (12.0, 1), (13.0, 2), (17.0, 2), (18.0, 4), (60.0, 8), (71.0, 8), (72.0, 16)],
)
def test_the_fewest_pixels_a_clock_that_keep_the_rate(
    tmp_path: Path, rate: float, pixels: int
) -> None:
    plan = make_plan(large(tmp_path, rate, 'device = "lfe5u-85f"'))
    assert plan.core.pixels_per_clock == pixels
    assert plan.frame_clocks == -(-3000 // pixels) * 3000
    kept = DEVICES["lfe5u-85f"].clock_mhz
    assert plan.clock_mhz == pytest.approx(plan.frame_clocks * rate / 1e6)
    assert plan.clock_mhz <= kept(pixels)
    # Half as many would not do.
    assert pixels == 1 or 2 * plan.clock_mhz > kept(max(pixels // 2, 1))
    generics = plan.core.generics()
    assert generics.get("PIXELS_PER_CLOCK", 1) == pixels
    assert "PIXELS_PER_CLOCK * CHANNELS" in top_text(plan) or pixels == 1


def test_pixels_a_clock_are_what_the_scene_says(tmp_path: Path) -> None:
    build = 'device = "lfe5u-85f"\npixels_per_clock = '
    assert make_plan(large(tmp_path, 8.0, f"{build}4")).core.pixels_per_clock == 4
    with pytest.raises(InputError, match=r"135 MHz at 4 pixels a clock; on the LFE5U-85F .* 80"):
        make_plan(large(tmp_path, 60.0, f"{build}4"))
    # A line's last word counts as a whole one.
    plan = make_plan(large(tmp_path, 8.0, f"{build}32", columns=3201))
    assert plan.frame_clocks == 101 * 3000


def test_a_rate_that_a_device_does_not_keep_is_refused(tmp_path: Path) -> None:
    rate = r"scene\.toml: frame\.rate_hz: 3000 x 3000 at 60 Hz needs 540 MHz at a pixel a clock; "
    with pytest.raises(InputError, match=rate + "on the XC6SLX45 cores keep 74.25") as refusal:
        make_plan(large(tmp_path, 60.0, ""))
    device = refusal.value.problem.split("'")[1]
    assert device.startswith("lfe5u")
    assert make_plan(large(tmp_path, 60.0, f'device = "{device}"')).device == device
    with pytest.raises(InputError, match="use a lower rate or a smaller frame"):
        make_plan(large(tmp_path, 400.0, 'device = "lfe5u-85f"'))
    with pytest.raises(InputError, match="at a pixel a clock"):
        make_plan(large(tmp_path, 60.0, 'device = "lfe5u-85f"\narithmetic = "stored"'))


def test_many_slices_fit_the_board_with_moving_sums(tmp_path: Path) -> None:
    def slices(m: int, low: int, high: int) -> tuple[str, str]:
        texts = ", ".join(f'"{shift_to_text(shift, m)}"' for shift in range(low, high + 1))
        return ("near_mm = 800.0\nfar_mm = inf", f"slices = [{texts}]")

    size = [("columns = 640", "columns = 1280"), ("rows = 480", "rows = 720\nrate_hz = 60.0")]
    plan = make_plan(scene(tmp_path, *size, slices(5, -5, 10), build='path = "video"'))
    assert len(plan.core.shifts) == 16
    assert plan.engine_reason.startswith("fir would not fit: 177 of 116 block RAM")
    assert all(plan.needs[name] <= plan.available[name] for name in plan.available)
    changes = [
        *size,
        slices(11, -11, 11),
        ('model = "f193-mla2"\nfocus_mm = 5000.0\nmicro_image_size = 5', "micro_image_size = 11"),
        ('"rgb"', '"grey"'),
    ]
    plan = make_plan(scene(tmp_path, *changes))
    assert len(plan.core.shifts) == 23
    assert plan.engine_reason.startswith("fir would not fit: 227 of 116 block RAM")


def test_auto_arithmetic_takes_what_fits(tmp_path: Path) -> None:
    wide = ("columns = 640", "columns = 2048")
    assert make_plan(scene(tmp_path)).core.arithmetic.kind == "exact"
    many = ("near_mm = 800.0\nfar_mm = inf", 'slices = ["-1", "4/5"]')
    plan = make_plan(scene(tmp_path, wide, many, build='engine = "fir"'))
    arithmetic = plan.core.arithmetic
    assert isinstance(arithmetic, StoredProductArithmetic)
    # With one fraction bit more it would not fit.
    bits = arithmetic.fraction_bits + 1
    more = StoredProductArithmetic(fraction_bits=bits, guard_bits=min(2, bits))
    usage = estimate(plan.core.model_copy(update={"arithmetic": more}).blocks)
    assert DEVICES["xc6slx45"].overflow(usage)


def test_overflow_names_resource_and_numbers(tmp_path: Path) -> None:
    build = 'arithmetic = "exact"'
    big = [("columns = 640", "columns = 4096"), ("far_mm = inf", "far_mm = 5000.0")]
    with pytest.raises(
        InputError, match=r"XC6SLX45 is too small: it needs \d+ of 116 block RAM"
    ) as refusal:
        make_plan(scene(tmp_path, *big, build=build))
    assert "xc6slx" in refusal.value.problem
    device = refusal.value.problem.split("'")[1]
    plan = make_plan(scene(tmp_path, *big, build=f'{build}\ndevice = "{device}"'))
    assert plan.device == device


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("columns = 640", "columns = 0", r"frame\.columns = 0 should be greater than"),
        ("columns = 640", 'columns = "640"', r"frame\.columns = '640' should be a valid integer"),
        ("columns = 640", "width = 640", r"frame\.columns is missing"),
        ("rows = 480", "rows = 480\ndepth = 3", r"there is no field frame\.depth"),
        ('"rgb"', '"red"', r"frame\.colour = 'red' should be 'grey' or 'rgb'"),
        ("far_mm = inf", "far_mm = 700.0", r"depth: near_mm must be below"),
        ("far_mm = inf", "", r"depth: give either near_mm and far_mm"),
        ('model = "f193-mla2"', "", r"a depth range needs camera\.model"),
        ('"f193-mla2"', '"f1"', r"f1: no such camera"),
        (
            "[build]",
            '[build]\ndevice = "xc7a350t"',
            r"build\.device = 'xc7a350t': .* the nearest is xc7a35t",
        ),
        ("[build]", "[build]\nguard_bits = 9", r"guard_bits must be at most fraction_bits"),
        ("[build]", '[build]\nsharpen = "1/24"', r"build\.sharpen = '1/24': use auto, off"),
        ("[build]", '[build]\nsharpen = "auto"\nparallel_rows = 2', r"needs parallel_rows = 1"),
        ("[build]", '[build]\nsharpen = "1/16"\narithmetic = "stored"', r"needs exact sums"),
        ("[build]", '[build]\nsharpen = "auto"\npath = "video"', r"sharpen needs path = 'core'"),
        ("[build]", '[build]\nborder = "mirror"', r"build\.border"),
        ("[build]", "[build]\nbox = 0", r"build\.box"),
        ("[build]", "[build]\nbox = 2\nnoise = 0.5", r"give either box, or resolution and noise"),
        ("[build]", "[build]\nresolution = 0", r"build\.resolution = 0 should be greater than 0"),
        ("[build]", '[build]\nborder = "normalise"\nparallel_rows = 2', r"needs parallel_rows = 1"),
        (
            "[build]",
            '[build]\nborder = "normalise"\narithmetic = "stored"',
            r"needs arithmetic = 'exact'",
        ),
        ("[build]", '[build]\nborder = "normalise"\npath = "video"', r"needs path = 'core'"),
        ("[build]", '[build]\nborder = "normalise"\nsharpen = "auto"', r"needs sharpen = 'off'"),
        ("[build]", '[build]\nengine = "both"', r"build\.engine = 'both' should be 'auto'"),
        (
            "[build]",
            '[build]\nengine = "moving_sum"\nparallel_rows = 2',
            r"needs parallel_rows = 1",
        ),
        ("[build]", "[build]\npixels_per_clock = 3", r"build\.pixels_per_clock"),
        (
            "[build]",
            '[build]\nengine = "fir"\npixels_per_clock = 2',
            "pixels_per_clock above 1 needs engine = 'moving_sum'",
        ),
        (
            "[build]",
            '[build]\narithmetic = "stored"\npixels_per_clock = 2',
            "pixels_per_clock above 1 needs arithmetic = 'exact'",
        ),
        ("[build]", '[build]\npath = "video"', r"build\.path = 'video' needs frame\.rate_hz"),
        ("[build]", '[build]\nedid = "own.bin"', r"build\.edid needs build\.path = 'video'"),
        ("far_mm = inf", "far_mm = nan", r"depth"),
        ("focus_mm = 5000.0", "focus_mm = 5.0", r"."),
        ('name = "test"', 'name = "a b"', r"name = 'a b'"),
        ("[frame]", "[frame", r"cannot be read"),
        ("near_mm = 800.0\nfar_mm = inf", 'slices = ["1/7"]', r"grid of M = 5"),
        ("near_mm = 800.0\nfar_mm = inf", 'slices = ["1", "5/5"]', r"twice"),
        ("near_mm = 800.0\nfar_mm = inf", "slices = []", r"depth\.slices"),
        ("near_mm = 800.0\nfar_mm = inf", "near_mm = 1.0\nfar_mm = 2.0", r"no slice|scene"),
    ],
)
def test_bad_scenes(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = write(tmp_path, BASE.replace(old, new))
    done = plenofir("plan", str(path))
    assert done.returncode == 2, done.stdout
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    assert re.search(message, done.stderr), done.stderr


def test_plan_as_json() -> None:
    done = plenofir("plan", "video-m11", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    content = json.loads(done.stdout)
    assert content["needs"]["MULT18X18D"] == content["core"]["engine"]["pixels_per_clock"] == 8
    assert content["slices"][0]["far_mm"] is None


def test_configure_leaves_all_files(tmp_path: Path) -> None:
    plan = make_plan(load_scene("grey-microscope"))
    sources = configure(plan, tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "plan.json",
        "scene_pkg.vhd",
        "scene_top.prj",
        "scene_top.ucf",
        "scene_top.vhd",
        "scene_top.xst",
        "sources.txt",
        "xst",
    }
    listed = (tmp_path / "out" / "sources.txt").read_text().splitlines()
    assert [(tmp_path / "out" / line).resolve() for line in listed] == [
        source.resolve() for source in sources
    ]
    package = (tmp_path / "out" / "scene_pkg.vhd").read_text()
    assert f'SHIFTS : string := "{" ".join(map(str, plan.core.shifts))}"' in package
    assert f"{1000 / plan.clock_mhz:.3f} ns" in (tmp_path / "out" / "scene_top.ucf").read_text()


def test_project_files_are_published_as_they_are(tmp_path: Path) -> None:
    configure(make_plan(load_scene("grey-microscope")), tmp_path / "project")
    publish_files(tmp_path / "project", tmp_path / "out")
    wanted = {path.name for path in (tmp_path / "project").iterdir() if path.is_file()}
    assert {path.name for path in (tmp_path / "out").iterdir()} == wanted


def test_configure_needs_a_folder_that_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    plan = make_plan(load_scene("grey-microscope"))
    with pytest.raises(InputError, match="cannot be written"):
        configure(plan, tmp_path / "out")


def test_sources_of_a_core_are_those_it_is_built_of() -> None:
    sources = needed_sources("core : entity work.axis_fifo", TOP, hdl.hdl_sources())
    assert [source.stem for source in sources] == [
        "math_pkg",
        "ram_blocks_pkg",
        "ram_simple_dual_port",
        "axis_fifo",
    ]


def test_cover_needs_its_greedy_choice() -> None:
    model = load_scene("lytro1-raw").model()
    assert model is not None
    cover = covering_slices(model, 500.0, float("inf"))
    again = without_idle_slices(cover, 500.0, float("inf"))
    assert again.slices == cover.slices


@pytest.mark.parametrize("scene", ["rgb-720p", "grey-microscope"])
def test_plots_and_csv(tmp_path: Path, scene: str) -> None:
    drawing, table = tmp_path / "plan.svg", tmp_path / "plan.csv"
    done = plenofir("plan", scene, "--json", "--plot", str(drawing), "--csv", str(table))
    assert done.returncode == 0, done.stderr
    plan = json.loads(done.stdout)
    text = drawing.read_text()
    assert ("depth of field" in text) == (plan["slices"][0]["near_mm"] is not None)
    rows = list(csv.DictReader(table.open()))
    assert {row["resource"]: int(row["this_scene"]) for row in rows} == plan["needs"]
    assert {row["resource"]: int(row["full_build"]) for row in rows} == plan["full"]
    assert all(f">{n}</text>" in text for n in plan["needs"].values())


def test_sums_wider_than_any_word_are_refused(tmp_path: Path) -> None:
    """Candidates are weighed before their limits are told: no weight may end in a traceback."""
    changes = (
        ("micro_image_size = 5", "micro_image_size = 11"),
        ('colour = "rgb"', 'colour = "grey"\nbits = 16'),
        ("near_mm = 800.0\nfar_mm = inf", 'slices = ["1"]'),
    )
    build = 'interpolation = "3"\narithmetic = "exact"'
    with pytest.raises(InputError, match=r"sum of 44 bits .* exceeds the core's limit of 31 bits"):
        make_plan(scene(tmp_path, *changes, build=build))


def test_sources_on_another_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows has no relative path between drives: lists of sources name the whole path then."""
    source = Path("/hdl/core/token_pkg.vhd")
    assert place_from(source, Path("/out/scene")) == "../../hdl/core/token_pkg.vhd"

    def refuse(path: Path, start: Path) -> str:
        raise ValueError(f"path {path} is on another mount than {start}")

    monkeypatch.setattr("os.path.relpath", refuse)
    assert place_from(source, Path("/out/scene")) == source.resolve().as_posix()
