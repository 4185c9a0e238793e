# SPDX-License-Identifier: Apache-2.0
"""Build the parts of the documentation that follow from the sources.

Committed: the long tables of ``docs/measured/tables.md``, and the short ones between marks in the
pages that people write. Not committed: one page for each VHDL entity, in ``build/docs/entities``,
and the flower and the planes in the viewer, each in one file, in ``build/docs``.

Usage: python scripts/build_docs.py [--check]

With --check nothing is written; exit code 1 if a committed page is missing or stale.
"""

import sys
import textwrap
from pathlib import Path

from camera_tables import focused_planes, lens_pitches, sensors_table
from device_tables import device_shares, device_sources, scenes_on
from entity_pages import declaration_table, entity_pages, instance_tree
from kinds_by_commands import table as kinds_by_commands
from marks import between_marks
from plenofir.camera.rays import RayModel, load_camera
from plenofir.fpga import hdl
from plenofir.fpga.constraints import Constraints, Language, crossings_of
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.plan.configure import needed_sources
from plenofir.refocus import Arithmetic, ExactArithmetic, StoredProductArithmetic
from plenofir.view import export, light_field_page
from plenofir_studies import (
    clock_counts,
    energy,
    gpu_predicted,
    growth,
    growth_measured,
    lens_pictures,
    many_pixels,
    real_tables,
    refocus_stability,
    systolic,
    thesis_benchmark,
    work_precision,
)
from plenofir_studies.errata import page_lines
from plenofir_studies.ray_stability import all_outcomes, summary
from plenofir_studies.ray_validation import rounding_sentences
from resource_tables import (
    board_builds,
    costs_of_leaving_out,
    ecp5_table,
    engine_table,
    flow_figures,
    left_out_of_scenes,
    moving_sum_tables,
    placed_table,
    resource_tables,
    sensor_table,
    stack_tables,
)

sys.path.insert(0, str(project.root() / "tb"))

from plenofir_tb.hdmi import status

DOCS = project.root() / "docs"
HDL = project.root() / "hdl"
# In the order of reading: each tree shows only what is new.
TOPS = (
    "raster_refocuser",
    "focal_stack",
    "depth_index",
    "sensor_raster",
    "csi_receiver",
    "dphy_lane",
    "sensor_setup",
    "refocuser_axi",
    "stack_axi",
    "sensor_axi",
    "wishbone_bridge",
    "load_port",
    "self_test",
    "atlys_top",
    "ulx3s_top",
    "pynqz2_top",
    "tangnano20k_top",
    "parallel_top",
    "lifcl40_top",
    "ulx3s_camera_top",
)
TABLES = DOCS / "measured" / "tables.md"
SHARES = (
    "Estimated use in percent: LUTs (ALMs, halves of CPEs) / flip-flops / block RAM / multipliers. "
    "If the scene is for the\nboard of that device, of the whole board. A cell is empty if the "
    "scene does not fit; [the first table](../resources.md#your-fpga)\nsays why."
)
PLACED_CORES = (
    "By `python scripts/resources.py devices` (Yosys and nextpnr), behind shift registers. Other "
    "scenes are estimates.\n"
    "These fit but were not placed, as each takes minutes of processor time: `thesis-m3` on "
    "GW2AR-18 and GW5A-25,\n`rgb-720p` on GW5A-25, all scenes on CCGM1A1 "
    "(`rgb-480p` reached 47.5 MHz there, by\n`make pnr`). `rgb-720p` as it is does not fit "
    "GW2AR-18 (48 of 46 block RAMs); the planner gives it stored products\nthere, in 36. "
    "Of the LIFCL-40 a table says how far each scene went; `make pnr SCENE= DEVICE=lifcl-40` "
    "places what fits, in minutes.\nThe core of `video-m11` was placed [several times]"
    "(#spread-of-the-clock)."
)
LEFT_OUT_COSTS = (
    "Estimates of `plenofir plan`, on each scene's own device. Options that cost nothing to leave "
    "out are not listed."
)
BUILDS = (
    "Shipped scenes, built by `make pnr SCENE=...`, on an ECP5 in grade 6, the slowest; seconds of "
    "processor time.\n`in_clk` is the TMDS clock, `control_clk` that of the control, `clk` the "
    "pixel clock, `clk_x5` that of the lanes. Wanted\nis the fastest pixel clock of the range, not "
    "that of the scene's mode."
)
SENSORS = (
    "What sensors deliver at their largest frames, and the share of each device's block RAM that "
    "mosaic, resampler and core\n(M = 5, three slices a fifth apart) take."
)
EXPORTS = project.root() / "build" / "docs"
EXPORT_BYTES = 8_000_000
ENTITIES = project.root() / "build" / "docs" / "entities"
BOUND_SIZES = (2, 3, 5, 7, 11)
BOUND_WIDTHS = ((0, 0), (4, 2), (8, 2))


def error_bounds(text: str) -> str:
    """Put the table of error bounds between its marks in a page."""
    arithmetics: list[Arithmetic] = [
        *(StoredProductArithmetic(fraction_bits=f, guard_bits=g) for f, g in BOUND_WIDTHS),
        ExactArithmetic(),
    ]
    heads = [f"F = {f}, G = {g}" for f, g in BOUND_WIDTHS]
    lines = [f"| M | {' | '.join(heads)} | exact |", "| --- " * (len(arithmetics) + 1) + "|"]
    for m in BOUND_SIZES:
        bounds = [f"{float(arithmetic.error_bound(m, 8)):.3f}" for arithmetic in arithmetics]
        lines.append(f"| {m} | {' | '.join(bounds)} |")
    return between_marks(text, "bounds", "\n".join(lines))


def section(page: str) -> list[str]:
    """The lines of a page as a section of another one: its headings a level lower."""
    return [f"#{line}" if line.startswith("#") else line for line in page.rstrip().splitlines()]


def measured(title: str, explained_in: str, *tables: tuple[str, list[str]]) -> str:
    """Make a page of measured tables: titles and lines."""
    lines = [f"# {title}", "", f"Explained in [{explained_in}](../{explained_in})."]
    for heading, table in tables:
        lines += ["", f"## {heading}", "", *table]
    return "\n".join(lines)


def measured_tables() -> str:
    """The page of the long tables."""
    of_stacks, of_indices = stack_tables()
    laws = growth.laws(growth_measured.load_recorded(), energy.load_measured())
    clocks = clock_counts.table(clock_counts.SIMULATED).splitlines()
    formulas = "Small arrays: formulas, which a simulation of each row confirms"
    pages = (
        measured("Clocks of the filter array", "fir-array.md", (formulas, clocks)),
        measured(
            "Both engines, cell by cell", "moving-sum.md", ("Spartan-6, XC6SLX45", engine_table())
        ),
        "# Error against run time\n\n" + work_precision.page(work_precision.load_recorded()),
        many_pixels.page(),
        measured(
            "Scenes on devices",
            "resources.md",
            ("Shares of a device", [SHARES, "", *device_shares()]),
            (
                "Cores that were placed",
                [PLACED_CORES, "", *placed_table(), "", *scenes_on("lifcl-40")],
            ),
            ("What was left out", left_out_of_scenes()),
            ("What leaving out costs", [LEFT_OUT_COSTS, "", *costs_of_leaving_out()]),
            ("Where the amounts are from", device_sources()),
        ),
        measured("Clocks of cores and arrays", "resources.md", ("Clocks on an ECP5", ecp5_table())),
        measured("Focal stacks", "stack.md", ("Stacks", of_stacks), ("Depth indices", of_indices)),
        measured("Growth", "studies.md", ("Laws", laws)),
        measured(
            "Boards",
            "boards/README.md",
            ("Builds", [BUILDS, "", *board_builds()]),
            ("Sensors", [SENSORS, "", *sensors_table()]),
        ),
    )
    lines = ["# Measured tables", "", "Built by `make docs`."]
    for page in pages:
        lines += ["", *section(page)]
    return "\n".join([*lines, ""])


def instance_list(text: str) -> str:
    """Put who instantiates whom between its marks in a page."""
    return between_marks(text, "instances", instance_tree(TOPS))


def core_page(text: str) -> str:
    """Put the core's files, generics and ports between their marks in its page."""
    top = HDL / "refocuser" / "raster_refocuser.vhd"
    files = [*needed_sources(top.read_text(), top.stem, hdl.hdl_sources()), top]
    names = " ".join(str(path.relative_to(HDL)) for path in files)
    listed = textwrap.wrap(names, 110, initial_indent="  ", subsequent_indent="  ")
    commands = ["```sh", "cd hdl", "ghdl -a --std=93 \\", " \\\n".join(listed), "```"]
    text = between_marks(text, "core files", "\n".join(commands))
    tables = [declaration_table(top.read_text(), kind) for kind in ("generic", "port")]
    return between_marks(text, "core ports", "\n".join([*tables[0], "", *tables[1]]))


# Tools whose constraints the page of clock crossings shows.
CROSSING_TOOLS: dict[Language, str] = {
    "xdc": "Vivado, XDC",
    "quartus-sdc": "Quartus, SDC",
    "radiant-pdc": "Radiant, PDC",
    "lpf": "Diamond, LPF",
    "gowin-sdc": "Gowin EDA, SDC",
    "ucf": "ISE, UCF",
}


def with_crossings(text: str) -> str:
    """The constraints of `csi_receiver` for each tool, and those of `bus_crossing`."""
    sources = hdl.all_sources()
    needed = needed_sources("use work.csi_receiver; use work.bus_crossing;", "", sources)
    constraints = Constraints({"byte_clk": 125, "clk": 100}, crossings_of(needed))
    blocks = (
        f"{title}:\n\n```text\n{constraints.text(language)}```"
        for language, title in CROSSING_TOOLS.items()
    )
    return between_marks(text, "crossings", "\n\n".join(blocks))


def clock_table(text: str) -> str:
    """Put broadcast nets, and the clock counts of the text's example, between their marks."""
    text = between_marks(text, "nets", "\n".join(systolic.summary()))
    return between_marks(text, "extrapolated", clock_counts.table(clock_counts.EXTRAPOLATED))


def status_table(text: str) -> str:
    """Put the board's status line and the meaning of its fields between their marks in a page."""
    lines = ["    " + status.example_line(), "", "| field | meaning |", "| --- | --- |"]
    lines += [f"| `{field.name}` | {field.meaning} |" for field in status.FIELDS]
    return between_marks(text, "status", "\n".join(lines))


def benchmark_and_errata(text: str) -> str:
    """Put the benchmark and the errata of the thesis between their marks in a page."""
    benchmark = section(thesis_benchmark.page(thesis_benchmark.load_recorded()))
    text = between_marks(text, "benchmark", "\n".join(benchmark))
    gpu = [*gpu_predicted.answer(), "", *gpu_predicted.page(gpu_predicted.load_recorded())]
    text = between_marks(text, "gpu", "\n".join(gpu))
    return between_marks(text, "errata", "\n".join(page_lines()))


def energy_and_growth(text: str) -> str:
    """Put what was recorded of energy, and plans by the laws of growth, between their marks."""
    energies = energy.load_measured()
    text = between_marks(text, "energy", "\n".join(energy.page(energies, None)).rstrip())
    plans = growth.planned(growth_measured.load_recorded(), energies)
    return between_marks(text, "growth", "\n".join(plans))


def ray_model(text: str) -> str:
    """Planes of a focused camera, the thesis's printed digits, and errors in extreme cases."""
    text = between_marks(text, "focused planes", "\n".join(focused_planes()))
    text = between_marks(text, "digits", rounding_sentences())
    text = between_marks(text, "real rays", "\n".join(real_tables.summary()))
    pictures = lens_pictures.summary(lens_pictures.load_recorded())
    text = between_marks(text, "pictures by real rays", "\n".join(pictures))
    text = between_marks(text, "stability of refocusing", "\n".join(refocus_stability.summary()))
    return between_marks(text, "stability", "\n".join(summary(all_outcomes())))


def kind_table(text: str) -> str:
    """Put what commands do with each kind of file between its marks in a page."""
    return between_marks(text, "kinds", "\n".join(kinds_by_commands()))


def committed_pages() -> dict[Path, str]:
    """Make the pages that stand in the repository."""
    written = {
        DOCS / "files.md": lambda text: between_marks(
            text, "kinds", "\n".join(kinds_by_commands())
        ),
        DOCS / "boards" / "controls.md": status_table,
        DOCS / "boards" / "cameras.md": lens_pitches,
        DOCS / "thesis.md": benchmark_and_errata,
        DOCS / "ray-model.md": ray_model,
        DOCS / "studies.md": energy_and_growth,
        DOCS / "golden-model.md": error_bounds,
        DOCS / "moving-sum.md": moving_sum_tables,
        DOCS / "core.md": core_page,
        DOCS / "fir-array.md": clock_table,
        DOCS / "resampling.md": sensor_table,
        DOCS / "flows.md": flow_figures,
        DOCS / "clock-crossings.md": with_crossings,
        DOCS / "resources.md": resource_tables,
        HDL / "README.md": instance_list,
    }
    pages = {path: fill(path.read_text()) for path, fill in written.items()}
    return {**pages, TABLES: measured_tables()}


def light_field_export(name: str, camera: tuple[str, float] | None) -> bytes:
    """A light field of the package as a page of its own, as plenofir view --export makes it."""
    raw = read_image(project.DATA / name)
    model = RayModel.focused(load_camera(camera[0]), camera[1], 5) if camera else None
    page = light_field_page(raw, 5, full_scale=255, title=name, model=model)
    return export(page, EXPORT_BYTES)


def main() -> int:
    """Write or check the pages."""
    pages = committed_pages()
    # Building the other pages checks the headers that they are made of.
    built = entity_pages(ENTITIES)
    stale = {path for path, text in pages.items() if not path.exists() or path.read_text() != text}
    if "--check" in sys.argv[1:]:
        for path in sorted(stale):
            print(f"{path.relative_to(project.root())} is stale; run make docs", file=sys.stderr)
        return 1 if stale else 0
    ENTITIES.mkdir(parents=True, exist_ok=True)
    for path in ENTITIES.glob("*"):
        path.unlink()
    for path, text in {**built, **{path: pages[path] for path in stale}}.items():
        path.write_text(text)
    for name, camera in (("flower", None), ("planes", ("f193-mla2", 1500))):
        path = EXPORTS / f"{name}.html"
        path.write_bytes(light_field_export(f"{name}_5x5.png", camera))
        print(f"{path.relative_to(project.root())}: {path.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
