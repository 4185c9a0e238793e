# SPDX-License-Identifier: Apache-2.0
"""Make the pictures of the documentation, docs/images.

Usage: python scripts/pictures.py NAME...

Without a name it lists them. The block diagrams (fir.svg and others) are drawn by hand: each SVG
is its own source. `make bench RECORD=1` draws bench.png.
"""

import subprocess
import sys
import tempfile
from collections.abc import Callable
from math import inf
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from skimage import data

from capture_pictures import real_captures
from focused_picture import focused
from module_waves import RowBench, timing_diagrams
from page_pictures import designed, developed, viewer
from picture_files import (
    FLOWER,
    IMAGES,
    PLANES,
    Pixels,
    captioned,
    enlarged,
    reduced,
    save,
    side_by_side,
)
from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.depth_picture import depth_picture
from plenofir.camera.lightfield import (
    FocalStack,
    all_in_focus,
    depth_map,
    light_field,
    sub_aperture,
)
from plenofir.camera.rays import RayModel, load_camera
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.resources.record import load_record
from plenofir.fpga.screen.board_frames import ShownFrame, golden_frame
from plenofir.fpga.simulate.chain import check_chain, run_chain
from plenofir.fpga.simulate.file_bench import run_bench
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground.images import eight_bits, read_image, write_png
from plenofir.plan import load_scene, make_plan
from plenofir.plan.scene_screen import SceneScreen, screen_of
from plenofir.refocus import best_picture, refocus
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.sharpness import depth_index
from plenofir_studies import ray_pictures, sweep
from plenofir_studies.calibration_report import MICROSCOPE, microscope_picture
from plenofir_studies.depth_scenes import plane
from plenofir_studies.engine_cells import ENGINES, SIZES, Cell, all_shifts
from plenofir_studies.resolution import central_directions
from plenofir_studies.synthetic import render


def simulated(*options: str) -> dict[str, Pixels]:
    """Pictures that `plenofir sim` writes, by name; it compares them with the golden model."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "plenofir", "sim", *options, "--out", folder]
        subprocess.run(command, check=True)
        return {path.stem: read_image(path) for path in Path(folder).glob("*.png")}


# Refocused by the VHDL.


def flower() -> None:
    """The flower of `make sim`, focused behind, on and in front of the middle."""
    pictures = simulated("-a", "-3/5 0 3/5")
    names = ("refocused_-3_5", "refocused_0", "refocused_3_5")
    save("flower.jpg", side_by_side(*(reduced(pictures[name]) for name in names)))


def stack() -> None:
    """All in focus and depth index of the three planes."""
    slices = ("--engine", "stack", "-a", "-1 -3/5 1/5 1", "--radius", "2")
    pictures = simulated("--raw", str(PLANES), "-M", "5", *slices)
    save("stack.jpg", side_by_side(pictures["all_in_focus"], pictures["depth_index"]))


def interpolation() -> None:
    """M = 3 nearest neighbour against M = 5 nearest and linear, focused in front and behind.

    The light field with M = 3 is made of the 3 x 3 central pixels of the 5 x 5 micro images.
    """
    size, margin, caption = 480, 8, 30
    raw = read_image(PLANES)
    side = min(raw.shape[:2]) // 2 // 5 * 5
    raw = raw[:side, :side]
    cases = (
        ("M = 3, nearest", central_directions(raw, 5, 3), 3),
        ("M = 5, nearest", raw, 5),
        ("M = 5, linear", raw, 5),
    )
    sheet = Image.new("RGB", (len(cases) * (size + margin) - margin, 2 * (size + caption)), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(18)
    for column, (name, part, m) in enumerate(cases):
        with tempfile.NamedTemporaryFile(suffix=".png") as file:
            write_png(Path(file.name), part)
            options = ("--raw", file.name, "-M", str(m), "-a", "-1 1")
            pictures = simulated(*options, "--interpolation", name.split()[-1])
        for row, a in enumerate((-1, 1)):
            x, y = column * (size + margin), row * (size + caption)
            picture = Image.fromarray(pictures[f"refocused_{a}"])
            sheet.paste(picture.resize((size, size), Image.Resampling.NEAREST), (x, y))
            draw.text((x + 4, y + size + 4), f"{name}, a = {a}", "black", font)
    save("interpolation.jpg", np.asarray(sheet))


def sweep_in_vhdl() -> None:
    """Slices of a rendered capture out of the VHDL, and how sharp each object is in each."""
    scene, m, shifts = sweep.swept_scene(), sweep.M, sweep.SHIFTS
    frames = np.repeat(scene.raster[np.newaxis], len(shifts), axis=0)
    with tempfile.TemporaryDirectory() as folder:
        result = run_bench(find_simulator("ghdl"), scene.core, frames, Path(folder), sweep_frames=1)
    figure = plt.figure(figsize=(11, 6.4), constrained_layout=True)
    grid = figure.add_gridspec(2, len(sweep.OBJECTS), height_ratios=(1, 1.5))
    for column, shift in enumerate(sweep.OBJECTS):
        axis = figure.add_subplot(grid[0, column])
        axis.imshow(result.frames[shifts.index(shift)], cmap="gray", vmin=0)
        axis.set_title(f"a = {shift}/{m}")
        axis.set_axis_off()
    axis = figure.add_subplot(grid[1, :])
    predicted = scene.model.focus_setting(scene.distances_mm)
    curves = scene.curves(result.frames)
    for curve, a, distance in zip(curves, predicted, scene.distances_mm, strict=True):
        label = f"object at {distance / 1000:.2f} m"
        (line,) = axis.plot(np.array(shifts) / m, curve, marker="o", label=label)
        axis.axvline(a, color=line.get_color(), linestyle=":")
    axis.set_xlabel("slice a (dotted: the ray model's prediction)")
    axis.set_ylabel("sharpness, largest = 1")
    axis.grid(alpha=0.3)
    axis.legend()
    save("sweep.png", figure)


def screens() -> None:
    """Pictures of a monitor, decoded from the ULX3S's serial output bits; eight minutes.

    A part of the planes is the serial input; slice, output and text are selected over the serial
    port. Nothing is written unless every pixel equals the golden model.
    """
    m, shifts = 5, (-5, -3, 1, 5)
    names = {
        ShownFrame(0, 2, 1): "screen-refocused.png",
        ShownFrame(1, 0, 1): "screen-all-in-focus.png",
        ShownFrame(2, 0, 1): "screen-depth.png",
    }
    raw = read_image(PLANES)[80:260, 130:530]
    rows, columns = raw.shape[:2]
    part = SceneScreen(output=("refocused", "all-in-focus", "depth"), overlay=True)
    model = RayModel.focused(load_camera("f193-mla2"), 1000.0, m)
    screen = screen_of(part, shifts, m, model, (rows, columns), where="scene")
    core = CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=columns,
        channels=3,
        engine=StackEngine(input_lines=m),
    )
    check_chain(core, rows, columns, screen)
    with tempfile.TemporaryDirectory() as folder:
        result = run_chain(
            find_simulator("ghdl"),
            core,
            raw,
            Path(folder) / "bench",
            board="ulx3s",
            screen=screen,
            entries=tuple(names),
        )
    slices = core.golden(raw)
    for frame, picture in zip(names, result.frames, strict=True):
        if not np.array_equal(picture, golden_frame(core, screen, frame, slices)):
            raise SystemExit(f"{names[frame]} differs from the golden model")
    for name, picture in zip(names.values(), result.frames, strict=True):
        save(name, picture)


def tangnano() -> None:
    """The Tang Nano 20K's pictures of its flower by the golden models, as its bench verifies."""
    plan = make_plan(load_scene("tangnano20k"))
    assert plan.stored is not None
    assert plan.screen.overlay is not None
    raw = np.zeros((plan.rows, plan.columns, 3), np.uint8)
    m, size = plan.core.micro_image_size, plan.stored.size
    top, left = ((raw.shape[d] - size[d]) // 2 // m * m for d in range(2))
    raw[top : top + size[0], left : left + size[1]] = plan.stored.raster()
    slices = plan.core.golden(raw)
    crops = [
        plan.screen.overlay.draw(slices[number], "refocused", number, bottom=True)
        for number in (0, 4)
    ]
    save("tangnano.jpg", side_by_side(*crops))


def waves() -> None:
    """Timing diagrams of the row module, from GHDL; all are simulated before one is written."""
    with tempfile.TemporaryDirectory() as work:
        drawings = timing_diagrams(RowBench(Path(work)))
    folder = IMAGES / "waves"
    folder.mkdir(exist_ok=True)
    for name, drawing in drawings.items():
        (folder / name).write_text(drawing)


# Refocused by the golden model.


def focus() -> None:
    """The picture that moves in the README: the focus goes from plane to plane and back."""
    raw, m = read_image(PLANES), 5
    shifts = (*range(-m, m + 1), *range(m - 1, -m, -1))
    frames = [Image.fromarray(reduced(refocus(raw, m, f"{shift}/{m}"))) for shift in shifts]
    # One palette for all, so that nothing but the focus changes.
    palette = Image.fromarray(np.vstack([np.asarray(frame) for frame in frames])).quantize(128)
    first, *others = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    first.save(IMAGES / "focus.gif", save_all=True, append_images=others, duration=140, loop=0)


def calibration() -> None:
    """Part of the microscope's white image with the centres found, and what decoding makes."""
    white, dark = (read_image(MICROSCOPE / f"{name}.png") for name in ("white", "dark"))
    grid = calibrate(white, dark)
    times, side = 8, 78
    grey = np.clip(white[:side, :side] / np.percentile(white, 99.5), 0, 1) * 255
    left = enlarged(np.repeat(grey.astype(np.uint8)[:, :, None], 3, axis=2), times)
    for y, x in grid.centres.reshape(-1, 2):
        if max(y, x) < side:
            place = tuple(round(times * (c + 0.5)) for c in (x, y))
            cv2.drawMarker(left, place, (255, 40, 40), cv2.MARKER_CROSS, 22, 2)
    even = decode(white, grid, 15)[: side - 3, : side - 3]
    bright = (np.clip(0.75 * even / np.median(even), 0, 1) * 255).astype(np.uint8)
    right = np.asarray(cv2.resize(enlarged(bright, times), left.shape[1::-1]), dtype=np.uint8)
    save("calibration.jpg", side_by_side(left, right, gap=16))


def microscope() -> None:
    """A capture of a microscope, refocused."""
    save("microscope.png", microscope_picture())


def volume() -> None:
    """Slices of the vesicle's volume, and a section along z, both with the file's micrometres."""
    from tifffile import TiffFile, xml2dict

    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "volume.ome.tif")
        captures = [str(MICROSCOPE / f"{name}.png") for name in ("raw", "white", "dark")]
        raw, white, dark = captures
        words = ["batch", raw, "--white", white, "--dark", dark, "--camera", "lfm-vesicle-60x"]
        words += ["-M", "15", "--z", "-12:12:1/2", "--out", out]
        subprocess.run([sys.executable, "-m", "plenofir", *words], check=True)
        with TiffFile(out) as file:
            stack = file.asarray().astype(float)
            pixels = xml2dict(file.ome_metadata or "")["OME"]["Image"]["Pixels"]
    across, along = pixels["PhysicalSizeX"], pixels["PhysicalSizeZ"]
    rows, columns = stack.shape[1:]
    wide, deep = columns * across, len(stack) * along
    low, high = np.percentile(stack, [1, 99.8])
    figure, axes = plt.subplots(1, 4, figsize=(11, 3), layout="constrained")
    for axis, number in zip(axes, (8, 24, 40), strict=False):
        extent = (0, wide, rows * across, 0)
        axis.imshow(stack[number], "gray", vmin=low, vmax=high, extent=extent)
        axis.set(title=f"z = {round(number * along - 12)} um", xlabel="x / um")
    section = stack[:, rows // 2 - 8 : rows // 2 + 8].mean(1)
    extent = (0, wide, deep / 2, -deep / 2)
    axes[3].imshow(section, "gray", vmin=low, vmax=high, extent=extent)
    axes[3].set(title="section along z", xlabel="x / um", ylabel="z / um")
    figure.savefig(IMAGES / "volume.jpg", dpi=90, pil_kwargs={"quality": 85})


def depth() -> None:
    """Raw capture, a view, all in focus and the depth map of a rendered scene."""
    m, lenses = 11, (72, 120)
    model = RayModel.focused(load_camera("f197-mla2"), inf, m)
    planes = [
        plane(model, data.brick(), 1 / 11, 170),
        plane(model, data.coffee(), 4 / 11, 42, (4, -36)),
        plane(model, data.astronaut(), 7 / 11, 34),
        plane(model, data.chelsea(), 10 / 11, 40, (6, 36)),
    ]
    capture = render(model, planes, lenses, rotation_degrees=0.4, noise=0.01, shading=0.3)
    raster = decode(capture.raw, calibrate(capture.white), m)
    depths = depth_map(raster, model)
    sharp = all_in_focus(raster, m, depths.disparity.pixels_per_view)
    rows, columns = light_field(raster, m).shape[:2]
    figure, axes = plt.subplots(2, 2, figsize=(11, 7.2), constrained_layout=True)
    panels = (
        ("part of the raw capture", eight_bits(capture.raw[380:524, 480:720])),
        ("central view", eight_bits(sub_aperture(raster, m, 5, 5))),
        ("all in focus", eight_bits(sharp[: rows * m, : columns * m])),
    )
    for axis, (title, image) in zip(axes.ravel(), panels, strict=False):
        axis.imshow(image, interpolation="nearest" if "raw" in title else "bicubic")
        axis.set_title(title)
    axes[1, 1].imshow(depth_picture(depths.distance_mm, "mm"))
    axes[1, 1].set_title("distance from the micro lenses")
    for axis in axes.ravel():
        axis.set_axis_off()
    save("depth.jpg", figure)


def smooth() -> None:
    """Nearest neighbour and whole slices, beside the commands' results."""
    raw, m = read_image(PLANES), 5
    slices = FocalStack(raw, m, [f"{k}/{m}" for k in range(-m - 1, m + 2)], border="normalise")
    pictures = {
        "a = 1, nearest": refocus(raw, m, 1, border="normalise"),
        "a = 1, as commands make it": best_picture(raw, m, 1),
        "all in focus: sharpest slices": depth_index(slices, m).image,
        "all in focus: pixels at their depth": all_in_focus(raw, m),
    }
    save("smooth.jpg", captioned(pictures, (slice(150, 310), slice(410, 570))))


def boxes() -> None:
    """A photograph all in focus with all views, and with small boxes by place."""
    raw, m = read_image(FLOWER), 5
    pictures = {
        "all views": all_in_focus(raw, m),
        "boxes of 3 by place": all_in_focus(raw, m, box=3),
        "boxes of 2 by place": all_in_focus(raw, m, box=2),
    }
    save("boxes.jpg", captioned(pictures, (slice(290, 450), slice(330, 490))))


# Ray model and engines.


def rays() -> None:
    """Dispersion of the micro lenses, real rays that meet, predicted distances, lens types."""
    save("dispersion.png", ray_pictures.dispersion_picture())
    save("meetings.png", ray_pictures.meetings_picture())
    save("distances.png", ray_pictures.distances_picture())
    save("lens-types.png", ray_pictures.lens_types_picture())


def engines() -> None:
    """LUTs and block RAM of both engines over a': lines are estimates, dots were synthesised."""
    measured = load_record().counted["spartan6"]
    figure, axes = plt.subplots(
        2, len(SIZES), figsize=(15, 6), sharex="col", constrained_layout=True
    )
    for column, m in enumerate(SIZES):
        shifts = list(all_shifts(m))
        for engine, colour in zip(ENGINES, ("tab:orange", "tab:blue"), strict=True):
            cells = {shift: Cell(m, (shift,), 1, engine) for shift in shifts}
            usages = [estimate(cell.core().blocks) for cell in cells.values()]
            dots = {s: measured[c.name].usage for s, c in cells.items() if c.name in measured}
            for axis, amount in zip(axes[:, column], ("lut", "block_rams"), strict=True):
                axis.plot(shifts, [getattr(u, amount) for u in usages], color=colour, label=engine)
                synthesised = [getattr(usage, amount) for usage in dots.values()]
                axis.plot(list(dots), synthesised, "o", markersize=4, color=colour)
                axis.set_yscale("log")
        axes[1, column].axhline(116, color="grey", linestyle=":", label="XC6SLX45")
        axes[0, column].set_title(f"M = {m}")
        axes[1, column].set_xlabel("a' in pixels")
    axes[0, 0].set_ylabel("LUT")
    axes[1, 0].set_ylabel("block RAM (18 Kbit)")
    axes[1, 0].legend()
    figure.suptitle("Grey, 1280 columns: lines are estimates, dots were synthesised")
    figure.set_dpi(90)
    save("engines.png", figure)


def moving_sum() -> None:
    """Re-ordering, moving sum and occupancy of the rings for one slice."""
    m, shift, length = 3, 2, 12
    layout = SumLayout(m, (shift,))
    figure, (order, rings) = plt.subplots(1, 2, figsize=(13, 5), constrained_layout=True)
    colours = plt.get_cmap("tab10")
    for i in range(length):
        v = i % m
        place = i + v * (shift - 1) + layout.place_in_group(0, v)
        label = f"phase {v}" if i < m else None
        order.plot([i, place], [1, 0], "o-", color=colours(v), label=label)
        order.annotate(str(i), (i, 1.03), ha="center")
        order.annotate(str(place), (place, -0.08), ha="center")
        age = layout.entering_age(0, v)
        rings.barh(i, age, left=i, height=0.6, color=colours(v), alpha=0.5)
        rings.barh(i, m, left=i + age, height=0.6, color=colours(v))
    order.fill_between([3.6, 3.4 + m], -0.15, -0.02, color="gold", alpha=0.5)
    order.annotate(f"sum over {m} places", (3.5 + m / 2, -0.22), ha="center")
    order.set_yticks([0, 1], ["place", "pixel"])
    order.set_ylim(-0.5, 1.15)
    order.set_xlabel("steps")
    order.set_title(f"Re-ordering, M = {m}, a' = {shift}: none left out, none twice")
    order.legend(loc="lower center", ncol=m)
    rings.invert_yaxis()
    rings.set_xlabel("step: a line of the frame comes in with each")
    rings.set_ylabel("line")
    rings.set_xticks(np.arange(0, length + layout.delay + 2 * m))
    lines = ", ".join(str(n) for n in layout.ring_lines)
    rings.set_title(f"Kept: waiting (pale), in the sum (full); rings of {lines} lines")
    figure.set_dpi(90)
    save("moving-sum.png", figure)


# The viewer, in Chromium without a GPU.


PICTURES: dict[str, Callable[[], None]] = {
    "flower": flower,
    "stack": stack,
    "interpolation": interpolation,
    "sweep": sweep_in_vhdl,
    "screens": screens,
    "tangnano": tangnano,
    "waves": waves,
    "focus": focus,
    "calibration": calibration,
    "microscope": microscope,
    "volume": volume,
    "real-captures": real_captures,
    "depth": depth,
    "focused": focused,
    "smooth": smooth,
    "boxes": boxes,
    "rays": rays,
    "engines": engines,
    "moving-sum": moving_sum,
    "viewer": viewer,
    "developed": developed,
    "design": designed,
}


def main() -> int:
    """Make what is named, or list what can be made."""
    names = sys.argv[1:]
    if not names or not PICTURES.keys() >= set(names):
        for name, make in PICTURES.items():
            print(f"{name:14} {(make.__doc__ or '').splitlines()[0]}")
        return 2 if names else 0
    for name in names:
        PICTURES[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main())
