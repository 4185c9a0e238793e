# SPDX-License-Identifier: Apache-2.0
"""Project files of a scene: constants, a top level with nothing else in it, and lists for tools."""

import os
from collections.abc import Sequence
from pathlib import Path

from plenofir.files import publish
from plenofir.fpga import hdl
from plenofir.fpga.bitstream import ise, top_level
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdl_text import used_units
from plenofir.fpga.hdmi.edid import EDID_PACKAGE, edid_package
from plenofir.plan.planner import Plan
from plenofir.plan.verilog import verilog_files

TOP = "scene_top"
PACKAGE = "scene_pkg"
# The clock that stills are built for: 720p at 60 frames a second.
STILL_CLOCK_MHZ = 74.25


def needed_sources(top: str, entity: str, sources: Sequence[Path]) -> list[Path]:
    """Sources that an entity is built of, in order of analysis, without any other.

    Parameters
    ----------
    top
        VHDL that instantiates entities and uses packages.
    entity
        Not used by any source: the top itself.
    sources
        All sources in order of analysis, one unit a file, named as the unit.

    Returns
    -------
    list of Path
        The sources that `top` needs.
    """
    by_name = {source.stem: source for source in sources}
    needed: set[str] = set()
    waiting = [top]
    while waiting:
        for name in used_units(waiting.pop()):
            if name in by_name and name not in needed and name != entity:
                needed.add(name)
                waiting.append(by_name[name].read_text())
    return [source for source in sources if source.stem in needed]


def top_of(plan: Plan) -> str:
    """Top level of a scene.

    Parameters
    ----------
    plan
        The plan.

    Returns
    -------
    str
        Entity: the board, or one of the scene's own.
    """
    return top_level.TOP if plan.path == "video" else TOP


def clock_mhz(plan: Plan) -> float:
    """Clock that a scene is built for.

    Parameters
    ----------
    plan
        The plan.

    Returns
    -------
    float
        MHz.
    """
    return STILL_CLOCK_MHZ if plan.clock_mhz is None else plan.clock_mhz


def _constant(name: str, value: int | bool | str) -> str:
    if isinstance(value, bool):
        return f"  constant {name} : boolean := {str(value).lower()};"
    if isinstance(value, str):
        return f'  constant {name} : string := "{value}";'
    return f"  constant {name} : natural := {value};"


def package_text(plan: Plan) -> str:
    """VHDL package with the constants of a scene.

    Parameters
    ----------
    plan
        The plan.

    Returns
    -------
    str
        VHDL-93.
    """
    constants = {**plan.core.generics(), "COLUMNS": plan.columns, "ROWS": plan.rows}
    lines = [_constant(name, value) for name, value in constants.items()]
    a = " ".join(part.a for part in plan.slices)
    return "\n".join(
        [
            f"-- Constants of the scene {plan.scene} (a = {a}), written by plenofir configure.",
            "",
            f"package {PACKAGE} is",
            "",
            *lines,
            "",
            f"end package {PACKAGE};",
            "",
        ]
    )


def top_text(plan: Plan) -> str:
    """VHDL top level of a scene: the core for its frame size, ports for what it has to choose.

    Parameters
    ----------
    plan
        The plan.

    Returns
    -------
    str
        VHDL-93.
    """
    several = len(plan.slices) > 1
    zero, zeros = "'0'", 'x"00"'
    pixels = "PIXELS_PER_CLOCK * " if plan.core.pixels_per_clock > 1 else ""
    pixel = f"{pixels}CHANNELS * PIXEL_BITS - 1 downto 0"
    choice = [
        "    slice         : in    std_logic_vector(7 downto 0);",
        "    sweep         : in    std_logic;",
        "    sweep_frames  : in    std_logic_vector(7 downto 0);",
    ]
    generics = [f"      {name} => {name}" for name in plan.core.generics()]
    return "\n".join(
        [
            f"-- The scene {plan.scene}, written by plenofir configure:",
            f"-- raster_refocuser for frames of {plan.columns} x {plan.rows} pixels.",
            "",
            "library ieee;",
            "use ieee.std_logic_1164.all;",
            "use ieee.numeric_std.all;",
            "",
            "library work;",
            f"use work.{PACKAGE}.all;",
            "",
            f"entity {TOP} is",
            "  port (",
            "    clk           : in    std_logic;",
            "    reset         : in    std_logic;",
            *(choice if several else []),
            "    s_axis_tvalid : in    std_logic;",
            "    s_axis_tready : out   std_logic;",
            f"    s_axis_tdata  : in    std_logic_vector({pixel});",
            "    s_axis_tuser  : in    std_logic_vector(0 downto 0);",
            "    s_axis_tlast  : in    std_logic;",
            "    m_axis_tvalid : out   std_logic;",
            "    m_axis_tready : in    std_logic;",
            f"    m_axis_tdata  : out   std_logic_vector({pixel});",
            "    m_axis_tuser  : out   std_logic_vector(0 downto 0);",
            *(["    m_axis_tid    : out   std_logic_vector(7 downto 0);"] if several else []),
            "    m_axis_tlast  : out   std_logic;",
            "    error_flags   : out   std_logic_vector(4 downto 0);",
            "    error_clear   : in    std_logic",
            "  );",
            f"end entity {TOP};",
            "",
            f"architecture rtl of {TOP} is",
            "",
            "  constant COLUMNS_PORT : std_logic_vector(15 downto 0) :=",
            "    std_logic_vector(to_unsigned(COLUMNS, 16));",
            "  constant ROWS_PORT : std_logic_vector(15 downto 0) :=",
            "    std_logic_vector(to_unsigned(ROWS, 16));",
            "",
            "begin",
            "",
            "  core : entity work.raster_refocuser",
            "    generic map (",
            ",\n".join(generics),
            "    )",
            "    port map (",
            "      clk           => clk,",
            "      reset         => reset,",
            "      columns       => COLUMNS_PORT,",
            "      rows          => ROWS_PORT,",
            f"      slice         => {'slice' if several else zeros},",
            f"      sweep         => {'sweep' if several else zero},",
            f"      sweep_frames  => {'sweep_frames' if several else zeros},",
            "      s_axis_tvalid => s_axis_tvalid,",
            "      s_axis_tready => s_axis_tready,",
            "      s_axis_tdata  => s_axis_tdata,",
            "      s_axis_tuser  => s_axis_tuser,",
            "      s_axis_tlast  => s_axis_tlast,",
            "      m_axis_tvalid => m_axis_tvalid,",
            "      m_axis_tready => m_axis_tready,",
            "      m_axis_tdata  => m_axis_tdata,",
            "      m_axis_tuser  => m_axis_tuser,",
            f"      m_axis_tid    => {'m_axis_tid' if several else 'open'},",
            "      m_axis_tlast  => m_axis_tlast,",
            "      error_flags   => error_flags,",
            "      error_clear   => error_clear",
            "    );",
            "",
            "end architecture rtl;",
            "",
        ]
    )


def configure(plan: Plan, out: Path, *, verilog: bool = False) -> list[Path]:
    """Write the project files of a scene: all of them or none.

    Parameters
    ----------
    plan
        The plan.
    out
        Folder.
    verilog
        Whether to write it in Verilog, too; see `plenofir.plan.verilog.verilog_files`.

    Returns
    -------
    list of Path
        VHDL sources in order of analysis, those in the folder included.

    Raises
    ------
    plenofir.errors.InputError
        If the folder cannot be written, or if GHDL is not installed and `verilog` wants it.
    """
    top = top_of(plan)
    own = _board_top(plan) if plan.path == "video" else _core_top(plan)
    needed = needed_sources(own[f"{top}.vhd"], top, hdl.board_sources())
    # Own files in the place of those that they replace, the others behind.
    sources = [out / path.name if path.name in own else path for path in needed]
    vhdl = (out / name for name in own if name.endswith(".vhd"))
    sources += [path for path in vhdl if path not in sources]
    places = [os.path.relpath(source, out) for source in sources]
    lists = {
        "plan.json": plan.model_dump_json(indent=2) + "\n",
        "sources.txt": "".join(f"{place}\n" for place in places),
    }
    if verilog:
        lists.update(verilog_files(plan, top, own, sources))
    if DEVICES[plan.device].family == "ecp5":
        publish({**own, **lists}, out)
        return sources
    lists[f"{top}.prj"] = "".join(f'vhdl work "{place}"\n' for place in places)
    publish({**own, **lists}, out)
    # XST wants the folder for its temporary files to be there.
    (out / "xst").mkdir(exist_ok=True)
    return sources


def _core_top(plan: Plan) -> dict[str, str]:
    """Package, top level, clock and XST's script (ECP5: the clock alone) of a core."""
    part = DEVICES[plan.device]
    period_ns = 1000 / clock_mhz(plan)
    vhdl = {f"{PACKAGE}.vhd": package_text(plan), f"{TOP}.vhd": top_text(plan)}
    if part.family == "ecp5":
        return {**vhdl, f"{TOP}.lpf": f'FREQUENCY PORT "clk" {clock_mhz(plan):g} MHZ;\n'}
    return {
        **vhdl,
        f"{TOP}.ucf": (
            f"# Clock of the scene {plan.scene}: {clock_mhz(plan):g} MHz.\n"
            'NET "clk" TNM_NET = "clk";\n'
            f'TIMESPEC "TS_clk" = PERIOD "clk" {period_ns:.3f} ns HIGH 50 %;\n'
        ),
        f"{TOP}.xst": ise.xst_script(
            ise.read_options(ise.option_folder() / "xst.opt"), TOP, f"{part.name}-2-{part.package}"
        ),
    }


def _board_top(plan: Plan) -> dict[str, str]:
    """Top level with the scene's generics, its EDID, pins and clocks, XST's script of the board."""
    own = {}
    if plan.edid is not None:
        own[f"{EDID_PACKAGE}.vhd"] = edid_package(bytes.fromhex(plan.edid))
    return {
        **own,
        f"{top_level.TOP}.vhd": top_level.top_with_generics(top_level.board_generics(plan.core)),
        f"{top_level.TOP}.ucf": ise.constraints_file().read_text(),
        f"{top_level.TOP}.xst": ise.xst_script(ise.read_options(ise.option_folder() / "xst.opt")),
    }
