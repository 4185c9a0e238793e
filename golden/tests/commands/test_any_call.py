# SPDX-License-Identifier: Apache-2.0
"""Random calls of every command give right results, or one line, exit code 2 and no files."""

import itertools
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from any_call import (
    COMMANDS,
    Call,
    Words,
    calls,
    contents,
    inside,
    is_warning,
    run,
    strict_json,
)
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from plenofir.camera.calibration import decode, largest_odd_size, load_calibration
from plenofir.camera.exposure import exposure, finer
from plenofir.camera.lytro.sensor import with_gamma
from plenofir.camera.recognise import Hints
from plenofir.commands import options
from plenofir.commands.looks import aperture_of, tilt_of
from plenofir.commands.rasters import read_field
from plenofir.ground.images import Picture, read_image, read_picture
from plenofir.refocus import best_picture, interpolation_order, refocus, setting_names
from plenofir_studies.reproduce import table_or_figure

# They take ten seconds to minutes.
LONG_RUNNING = [
    ("report", name)
    for name in (
        *("rays", "precision", "sharpening", "stability", "numbers", "energy", "calibration"),
        *("resampling", "depth", "pictures", "growth", "gpu", "peers", "boxes"),
    )
]
LEAVES = [
    words
    for words, command in COMMANDS.items()
    if not hasattr(command, "commands") and words not in LONG_RUNNING
]

Parameters = dict[str, Any]


def read(p: Parameters) -> tuple[Picture, int]:
    """The light field of a call as it is told to lie, and its M."""
    hints = Hints(**{name: p[name] for name in Hints._fields if name in p})
    field = read_field(p["raster"], hints, notes=False)
    return field.picture, field.micro_image_size


def is_focused(p: Parameters) -> bool:
    """Whether a call has the calibration of a focused camera."""
    return p["calib"] is not None and load_calibration(p["calib"]).lens_types is not None


def check_pictures(p: Parameters) -> set[str]:
    """Pictures, whatever they show: the files of a folder."""
    files = {str(file) for file in Path(p["out"]).iterdir() if file.is_file()}
    for file in files:
        if file.endswith(".png"):
            read_image(Path(file))
    return files


def check_views(p: Parameters) -> set[str]:
    picture, m = read(p)
    raw = picture.pixels
    rows, columns = (length // m * m for length in raw.shape[:2])
    names = set()
    for v, u in np.ndindex(m, m):
        file = Path(p["out"]) / f"view_{v:02}_{u:02}.png"
        assert (read_image(file) == raw[v:rows:m, u:columns:m]).all()
        names.add(str(file))
    return names


def check_mosaic(p: Parameters) -> set[str]:
    picture, m = read(p)
    raw = picture.pixels
    rows, columns = (length // m for length in raw.shape[:2])
    found = read_image(Path(p["out"]))
    for v, u in np.ndindex(m, m):
        tile = found[v * rows : (v + 1) * rows, u * columns : (u + 1) * columns]
        assert (tile == raw[v : rows * m : m, u : columns * m : m]).all()
    return {p["out"]}


def check_quilt(p: Parameters) -> set[str]:
    out = Path(p["out"])
    (file,) = (out.parent if out.parent.is_dir() else Path()).glob("*_qs*x*a*.png")
    read_image(file)
    return {str(file)}


def check_compose(p: Parameters) -> set[str]:
    found = read_image(Path(p["out"]))
    if Path(p["folder"]).name != "views" or p["keep"] not in (None, 3):
        return {p["out"]}
    for v, u in np.ndindex(3, 3):
        down = 2 - v if p["flip"] in ("rows", "both") else v
        right = 2 - u if p["flip"] in ("columns", "both") else u
        place = (right, down) if p["order"] == "columns" else (down, right)
        view = read_image(Path(p["folder"]) / "view_{}_{}.png".format(*place))
        assert (found[v::3, u::3] == view).all()
    return {p["out"]}


def as_shown(p: Parameters, made: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """A picture of a raw image, made of it and exposed as asked for."""
    field, m = read(p)
    if p["exposure"] == "off" and p["gamma"] is None:
        return made(field.pixels)
    look = exposure(field, m, p["exposure"] or "auto", p["gamma"])
    if look.as_stored(field):
        return made(field.pixels)
    fine, unit = finer(field)
    return look.apply(made(fine), field.pixels.dtype, unit)


def check_refocus(p: Parameters) -> set[str]:
    if is_focused(p):
        read_image(Path(p["out"]))
        return {p["out"]}
    _, m = read(p)
    area = None
    if p["region"]:
        ends = [int(n) if n else None for n in re.split("[:,]", p["region"].replace(" ", ""))]
        area = slice(*ends[:2]), slice(*ends[2:])
    operator = (p["interpolation"], p["sharpen"], p["upsample"]) != (None, None, True)
    a = options.one_focus_setting(p["a"], m, rounded=operator)

    def made(raw: np.ndarray) -> np.ndarray:
        where = {"border": p["border"], "region": area}
        if not operator:
            pupil, rise = aperture_of(p["aperture"]), tilt_of(p["tilt"])
            box = p["box"]
            return best_picture(raw, m, a, aperture=pupil, tilt=rise, box=box, **where)
        order = interpolation_order(p["interpolation"] or ("linear" if p["upsample"] else 0))
        how = {"interpolation": order, "sharpen": p["sharpen"] or "off", "box": p["box"]}
        return refocus(raw, m, a, upsample=p["upsample"], **how, **where)

    want = as_shown(p, made)
    got = read_image(Path(p["out"]))
    assert got.shape == want.shape
    assert p["out"].lower().endswith(("jpg", "jpeg")) or (got == want).all()
    return {p["out"]}


def check_stack(p: Parameters) -> set[str]:
    if is_focused(p):
        return check_pictures(p)
    _, m = read(p)
    names = set()
    settings = options.focus_settings(p["a"] or ["0:1"], m, rounded=p["index"])
    for a, name in zip(settings, setting_names(settings, m), strict=True):
        file = Path(p["out"]) / f"refocused_{name}.png"
        border = p["border"] or ("zero" if p["index"] else "normalise")
        pupil, rise = aperture_of(p["aperture"]), tilt_of(p["tilt"])
        how = {"aperture": pupil, "tilt": rise, "border": border, "box": p["box"]}

        def made(raw: np.ndarray, a: Fraction = a, how: Parameters = how) -> np.ndarray:
            if p["index"]:
                return refocus(raw, m, a, border=how["border"])
            return best_picture(raw, m, a, **how)

        want = as_shown(p, made)
        assert (read_image(file) == want).all()
        names.add(str(file))
    # There is depth between three slices or more, in the order of their a.
    steps = {after > before for before, after in itertools.pairwise(settings)}
    equal = any(after == before for before, after in itertools.pairwise(settings))
    between = p["index"] and len(settings) > 2 and len(steps) == 1 and not equal
    if between:
        file = Path(p["out"]) / "depth.npy"
        depth = np.load(file)
        assert float(min(settings)) <= depth.min() <= depth.max() <= float(max(settings))
        names.add(str(file))
    for name, wanted in (
        ("all_in_focus", p["everywhere"] or p["index"]),
        ("depth_index", p["index"]),
        ("depth", between),
        ("confidence", between),
        ("sharpness", False),
    ):
        file = Path(p["out"]) / f"{name}.png"
        assert file.exists() >= wanted
        if file.exists():
            read_image(file)
            names.add(str(file))
    return names


def check_depth_map(p: Parameters) -> set[str]:
    out = Path(p["out"])
    if is_focused(p):
        return check_pictures(p)
    picture, m = read(p)
    step = 1 if p["resolution"] == "sensor" else m
    lenses = [n // step for n in picture.pixels.shape[:2]]
    maps, pictures = ["disparity.npy"], ["confidence.png"]
    if p["camera"] is not None:
        maps.append("distance_mm.npy")
        pictures.append("distance_tenth_mm.png")
    for name in maps:
        assert list(np.load(out / name).shape) == lenses
    for name in pictures:
        assert list(read_image(out / name).shape) == lenses
    read_image(out / "depth.png")
    return {str(file) for file in out.iterdir() if file.is_file()}


def check_calibrate(p: Parameters) -> set[str]:
    centres = load_calibration(p["out"]).centres
    if p["white"] == "white.png":
        # As drawn: pitch 9, the first centre at 4.3, 4.6.
        off = (centres[~np.isnan(centres[..., 0])] - (4.3, 4.6)) / 9
        assert np.abs(off - np.rint(off)).max() < 0.5 / 9
    return {p["out"]} | ({p["picture"]} if p["picture"] else set())


def check_decode(p: Parameters) -> set[str]:
    found = read_image(Path(p["out"]))
    if is_focused(p):
        out = Path(p["out"])
        lenses = out.with_name(f"{out.stem}_lenses.png")
        assert found.shape[:2] == read_image(lenses).shape
        return {p["out"], str(lenses)}
    # The others are prepared before they are decoded.
    if p["raw"] != "white.png":
        is_grey = p["raw"] == "capture.png"
        m = p["micro_image"] or (largest_odd_size(load_calibration(p["calib"])) if is_grey else 9)
        assert found.ndim == (2 if is_grey else 3)
        assert [length % m for length in found.shape[:2]] == [0, 0]
        return {p["out"]}
    capture = read_picture(Path(p["raw"]))
    extra = {name: p[name] and read_image(p[name]) for name in ("dark", "white")}
    how = {name: p[name] for name in ("interpolation", "scale", "devignette")}
    calibration = load_calibration(p["calib"])
    how["full_scale"] = capture.full_scale
    m = p["micro_image"] or largest_odd_size(calibration)
    want = decode(capture.pixels, calibration, m, **extra, **how)
    assert (found == with_gamma(want, p["gamma"], capture.full_scale)).all()
    return {p["out"]}


def check_configure(p: Parameters) -> set[str]:
    out = Path(p["out"])
    strict_json((out / "plan.json").read_text())
    for line in (out / "sources.txt").read_text().splitlines():
        assert (out / line).is_file()
    return {str(file) for file in out.iterdir() if file.is_file()}


def check_batch(p: Parameters) -> set[str]:
    found = {str(file) for file in Path(p["out"]).rglob("*") if file.is_file()}
    pictures = [name for name in found if name.endswith(".png")]
    assert pictures
    for name in pictures:
        read_image(Path(name))
    return found


def check_inspect(p: Parameters) -> set[str]:
    if p["out"] is None:
        return set()
    names = {"micro_image.png", "chief_rays.png", "focus.png"}
    found = {str(Path(p["out"]) / name) for name in names if (Path(p["out"]) / name).is_file()}
    assert found
    for name in found:
        read_image(Path(name))
    return found


def check_view(p: Parameters) -> set[str]:
    file = Path(p["export"])
    assert file.read_bytes().startswith(b"<!doctype html>")
    assert file.stat().st_size <= p["limit"] * 1e6
    return {p["export"]}


def check_project(p: Parameters) -> set[str]:
    assert (Path(p["out"]) / "scene_top.vhd").is_file()
    return {str(file) for file in Path(p["out"]).iterdir() if file.is_file()}


def check_reproduce(p: Parameters) -> set[str]:
    kind, number = table_or_figure(p["what"])
    if kind == "table":
        return set()
    file = p["out"] or f"figure_{number.replace('.', '_')}.png"
    read_image(Path(file))
    return {str(file)}


CHECKS: dict[Words, Callable[[Parameters], set[str]]] = {
    ("views",): check_views,
    ("compose",): check_compose,
    ("mosaic",): check_mosaic,
    ("quilt",): check_quilt,
    ("refocus",): check_refocus,
    ("develop",): check_pictures,
    ("stack",): check_stack,
    ("depth-map",): check_depth_map,
    ("calibrate",): check_calibrate,
    ("decode",): check_decode,
    ("inspect",): check_inspect,
    ("view",): check_view,
    ("configure",): check_configure,
    ("project",): check_project,
    ("reproduce",): check_reproduce,
    ("board", "picture"): lambda p: {
        str(Path(p["out"]) / f"picture.{kind}") for kind in ("png", "html")
    },
    ("batch",): check_batch,
    **dict.fromkeys(
        ((name,) for name in ("distance", "baseline", "depth", "slices", "plan", "design")),
        lambda p: {str(p[name]) for name in ("plot", "csv_file") if p[name]},
    ),
}


# Calibrations may lie beside micro images, or these may not show where they are.
NOTES = re.compile("note: (axes:|.* micro images (agree where|are not seen)) ")


def right(command: Words, call: Call, stock: Path) -> None:
    """Make the call, and check its outcome."""
    with inside(stock, call) as before:
        code, out, err = run(call.words, call.environment)
        after = contents(Path())
        assert not [name for name in after if ".plenofir" in name]
        if code == 2:
            assert err.startswith("plenofir: ") or not call.words[len(command) :], err
            assert err.count("\n") == 1, err
            assert "internal error" not in err, err
            assert after == before
            return
        if code == 1 and command == ("batch",):
            assert all(line.startswith("failed: ") for line in err.splitlines())
            return
        err = "".join(line for line in err.splitlines(True) if not NOTES.match(line))
        takes_camera = any(option.name == "camera" for option in COMMANDS[command].params)
        assert not err or (takes_camera and is_warning(err)), err
        assert code == 0 or (code == 1 and command == ("waves", "compare"))
        if "--help" in call.words:
            return
        context = COMMANDS[command].make_context("", list(call.words[len(command) :]))
        if context.params.get("as_json"):
            strict_json(out)
        assert out
        written = CHECKS[command](context.params) if command in CHECKS else set()
        # What it wrote, and nothing else; the folder of results may be the one of the inputs.
        changed = {name for name in after if after[name] != before.get(name)}
        here = {str(Path(name)) for name in written if not Path(name).is_absolute()}
        assert here <= after.keys()
        assert changed == {name for name in here if after[name] != before.get(name)}


QUICK = settings(
    max_examples=12,
    deadline=None,
    database=None,
    derandomize=True,
    # Shrinking a call takes longer than reading it.
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=list(HealthCheck),
)


# Each call of batch starts and ends some processes, one of develop makes a dozen pictures.
LONG = [("batch",), ("develop",)]


@pytest.mark.parametrize("command", [word for word in LEAVES if word not in LONG], ids=" ".join)
@QUICK
@given(st.data())
def test_any_call(stock: Path, command: Words, data: st.DataObject) -> None:
    right(command, data.draw(calls(command)), stock)


@pytest.mark.slow
@pytest.mark.parametrize("command", LEAVES, ids=" ".join)
def test_many_calls(stock: Path, command: Words) -> None:
    @settings(QUICK, max_examples=25 if command in LONG else 150, derandomize=False)
    @given(calls(command))
    def try_it(call: Call) -> None:
        right(command, call, stock)

    try_it()


@pytest.mark.parametrize("words", LONG_RUNNING, ids=" ".join)
def test_reports_are_refused_before_the_work(stock: Path, words: Words) -> None:
    for out in ("text.png/x", "/dev/null", "/proc/none"):
        right(words, Call((*words, "--out", out), (), {}), stock)
