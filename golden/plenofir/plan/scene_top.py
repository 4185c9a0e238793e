# SPDX-License-Identifier: Apache-2.0
"""Package and top level of a scene's core, with the resampler of its sensor."""

from plenofir.camera.resampling import red_place
from plenofir.fpga.core.engine import Generics
from plenofir.plan.plan import Plan, PlannedSensor
from plenofir.plan.sensor.calibration_loader import LOADER

TOP = "scene_top"
PACKAGE = "scene_pkg"
_SENSOR = "SENSOR_"
_INDEX = "INDEX_"


def _constant(name: str, value: int | bool | str) -> str:
    if isinstance(value, bool):
        return f"  constant {name} : boolean := {str(value).lower()};"
    if isinstance(value, str):
        return f'  constant {name} : string := "{value}";'
    return f"  constant {name} : natural := {value};"


def sensor_generics(sensor: PlannedSensor) -> Generics:
    return {**sensor.core.generics(), "MOSAIC": sensor.mosaic is not None}


def index_generics(plan: Plan) -> Generics:
    """Generics of the `depth_index` behind a scene's stack; none without one."""
    return plan.screen.index(plan.core).generics() if plan.screen.needs_index else {}


def has_choice(plan: Plan) -> bool:
    """Whether a scene's core gives one of several slices at a time."""
    return len(plan.slices) > 1 and not plan.screen.needs_stack


def package_text(plan: Plan) -> str:
    """VHDL-93 of the package with the constants of a scene."""
    constants: Generics = {**plan.core.generics(), "COLUMNS": plan.columns, "ROWS": plan.rows}
    if plan.sensor is not None:
        sizes = {"COLUMNS": plan.sensor.columns, "ROWS": plan.sensor.rows}
        generics = {**sensor_generics(plan.sensor), **sizes}
        constants.update({f"{_SENSOR}{name}": value for name, value in generics.items()})
    constants.update({f"{_INDEX}{name}": value for name, value in index_generics(plan).items()})
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


def _stream_ports(out: str, raw: str, *, several: bool) -> list[str]:
    return [
        "    s_axis_tvalid : in    std_logic;",
        "    s_axis_tready : out   std_logic;",
        f"    s_axis_tdata  : in    std_logic_vector({raw});",
        "    s_axis_tuser  : in    std_logic_vector(0 downto 0);",
        "    s_axis_tlast  : in    std_logic;",
        "    m_axis_tvalid : out   std_logic;",
        "    m_axis_tready : in    std_logic;",
        f"    m_axis_tdata  : out   std_logic_vector({out});",
        "    m_axis_tuser  : out   std_logic_vector(0 downto 0);",
        *(["    m_axis_tid    : out   std_logic_vector(7 downto 0);"] if several else []),
        "    m_axis_tlast  : out   std_logic;",
        "    error_flags   : out   std_logic_vector(4 downto 0);",
        "    error_clear   : in    std_logic",
    ]


_CHOICE = [
    "    slice         : in    std_logic_vector(7 downto 0);",
    "    sweep         : in    std_logic;",
    "    sweep_frames  : in    std_logic_vector(7 downto 0);",
]
_FLAGS = [
    "    -- As error_flags of sensor_raster.",
    "    sensor_flags  : out   std_logic_vector(5 downto 0);",
]
_LOAD_PORT = [
    "    -- Size of the raster: M times the lenses of the calibration.",
    "    columns       : in    std_logic_vector(15 downto 0);",
    "    rows          : in    std_logic_vector(15 downto 0);",
    "    -- As in sensor_raster.",
    "    load_write    : in    std_logic;",
    "    load_kind     : in    std_logic_vector(1 downto 0);",
    "    load_address  : in    std_logic_vector(19 downto 0);",
    "    load_data     : in    std_logic_vector(39 downto 0);",
]
_LOAD_SIGNALS = [
    "  signal load_write   : std_logic;",
    "  signal load_kind    : std_logic_vector(1 downto 0);",
    "  signal load_address : std_logic_vector(19 downto 0);",
    "  signal load_data    : std_logic_vector(39 downto 0);",
    "  signal loaded       : std_logic;",
    "  signal raw_tvalid   : std_logic;",
    "  signal raw_tready   : std_logic;",
]
_LOADER = [
    f"  constants : entity work.{LOADER}",
    "    port map (",
    "      clk          => clk,",
    "      reset        => reset,",
    "      load_write   => load_write,",
    "      load_kind    => load_kind,",
    "      load_address => load_address,",
    "      load_data    => load_data,",
    "      done         => loaded",
    "    );",
    "",
    "  -- No frame is taken before the calibration is there.",
    "  raw_tvalid    <= s_axis_tvalid and loaded;",
    "  s_axis_tready <= raw_tready and loaded;",
    "",
]


def _size(name: str, value: str) -> list[str]:
    return [
        f"  constant {name} : std_logic_vector(15 downto 0) :=",
        f"    std_logic_vector(to_unsigned({value}, 16));",
    ]


def _sensor_instance(sensor: PlannedSensor) -> list[str]:
    generics = [f"      {name} => {_SENSOR}{name}" for name in sensor_generics(sensor)]
    row, column = (0, 0) if sensor.mosaic is None else red_place(sensor.mosaic)
    # A built-in calibration is loaded after reset; the loader holds frames back until then.
    source = "raw" if sensor.calibrated else "s_axis"
    return [
        "  sensor : entity work.sensor_raster",
        "    generic map (",
        ",\n".join(generics),
        "    )",
        "    port map (",
        "      clk           => clk,",
        "      reset         => reset,",
        "      columns       => RAW_COLUMNS_PORT,",
        "      rows          => RAW_ROWS_PORT,",
        f'      red_place     => "{row}{column}",',
        "      load_write    => load_write,",
        "      load_kind     => load_kind,",
        "      load_address  => load_address,",
        "      load_data     => load_data,",
        f"      s_axis_tvalid => {source}_tvalid,",
        f"      s_axis_tready => {source}_tready,",
        "      s_axis_tdata  => s_axis_tdata,",
        "      s_axis_tuser  => s_axis_tuser,",
        "      s_axis_tlast  => s_axis_tlast,",
        *(
            f"      m_axis_{name} => raster_{name},"
            for name in ("tvalid", "tready", "tdata ", "tuser ", "tlast ")
        ),
        "      error_flags   => sensor_flags,",
        "      error_clear   => error_clear",
        "    );",
        "",
    ]


def _instance(
    label: str, entity: str, generics: list[str], inputs: str, outputs: str, more: dict[str, str]
) -> list[str]:
    """A core between two streams; `more` are its other ports."""
    ports = {"clk": "clk", "reset": "reset", **more}
    parts = ("tvalid", "tready", "tdata", "tuser", "tlast")
    ports |= {f"s_axis_{name}": f"{inputs}_{name}" for name in parts}
    ports |= {f"m_axis_{name}": f"{outputs}_{name}" for name in parts}
    ports["error_clear"] = "error_clear"
    return [
        f"  {label} : entity work.{entity}",
        "    generic map (",
        ",\n".join(f"      {generic}" for generic in generics),
        "    )",
        "    port map (",
        ",\n".join(f"      {port.ljust(13)} => {signal}" for port, signal in ports.items()),
        "    );",
        "",
    ]


def _stream_signals(name: str, data: str) -> list[str]:
    # Names of signals are aligned as in the sources written by hand.
    width = max(len(name) + 7, 13)
    types = {"tvalid": "std_logic", "tready": "std_logic", "tdata": f"std_logic_vector({data})"}
    types |= {"tuser": "std_logic_vector(0 downto 0)", "tlast": "std_logic"}
    return [f"  signal {f'{name}_{part}'.ljust(width)} : {kind};" for part, kind in types.items()]


def top_text(plan: Plan) -> str:
    """VHDL-93 top level of a scene: the core for its frame size, with ports for run-time choices.

    With a sensor `sensor_raster` is before the core. A built-in calibration is loaded from a ROM,
    otherwise it comes through the load port. All slices at once are a `focal_stack`, and a
    `depth_index` behind it if the sharpest ones are wanted.
    """
    sensor, core = plan.sensor, plan.core
    several, stack = has_choice(plan), plan.screen.needs_stack
    loads = sensor is not None and not sensor.calibrated
    pixels = "PIXELS_PER_CLOCK * " if core.pixels_per_clock > 1 else ""
    pixel = raw = f"{pixels}CHANNELS * PIXEL_BITS - 1 downto 0"
    slices = f"{pixels}{len(core.shifts)} * CHANNELS * PIXEL_BITS - 1 downto 0"
    out = f"{pixels}{plan.screen.stack_pixel_bits(core)} - 1 downto 0" if stack else pixel
    # A mosaic has one colour in each pixel; the resampler makes three of it.
    if sensor is not None and sensor.mosaic is not None:
        raw = "PIXEL_BITS - 1 downto 0"
    before = "mosaic and lenses, then " if sensor is not None else ""
    behind = " and depth_index" if index_generics(plan) else ""
    signals: list[str] = []
    if sensor is not None:
        signals = [
            *_size("RAW_COLUMNS_PORT", f"{_SENSOR}COLUMNS"),
            *_size("RAW_ROWS_PORT", f"{_SENSOR}ROWS"),
            "",
            *(_LOAD_SIGNALS if sensor.calibrated else []),
            *_stream_signals("raster", pixel),
        ]
    # With a calibration that is loaded at run time the size of the raster is one of its facts.
    size = {name: name if loads else f"{name.upper()}_PORT" for name in ("columns", "rows")}
    one, none = {"slice": 'x"00"', "sweep": "'0'", "sweep_frames": 'x"00"'}, {"m_axis_tid": "open"}
    chosen = {name: name for name in (*one, *none)} if several else {**one, **none}
    generics = [f"{name} => {name}" for name in core.generics()]
    source, result = "s_axis" if sensor is None else "raster", "m_axis"
    errors, cores = {"error_flags": "error_flags"}, list[str]()
    if behind:
        signals += [
            *_stream_signals("stack", slices),
            "  signal stack_flags  : std_logic_vector(4 downto 0);",
            "  signal index_flags  : std_logic_vector(4 downto 0);",
        ]
        result, errors = "stack", {"error_flags": "stack_flags"}
        cores = _instance(
            *("index", "depth_index", [f"{n} => {_INDEX}{n}" for n in index_generics(plan)]),
            *("stack", "m_axis"),
            {**size, "picture_rows": size["rows"], **one, **none, "error_flags": "index_flags"},
        )
        cores += ["  error_flags <= stack_flags or index_flags;", ""]
    choice = {} if stack else chosen
    cores = [
        *_instance(
            "core", core.engine.ENTITY, generics, source, result, {**size, **choice, **errors}
        ),
        *cores,
    ]
    return "\n".join(
        [
            f"-- The scene {plan.scene}, written by plenofir configure:",
            f"-- {before}{core.engine.ENTITY}{behind} for frames of {plan.columns} x {plan.rows} "
            "pixels.",
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
            *(_CHOICE if several else []),
            *(_LOAD_PORT if loads else []),
            *(_FLAGS if sensor is not None else []),
            *_stream_ports(out, raw, several=several),
            "  );",
            f"end entity {TOP};",
            "",
            f"architecture rtl of {TOP} is",
            "",
            *([] if loads else _size("COLUMNS_PORT", "COLUMNS") + _size("ROWS_PORT", "ROWS")),
            *signals,
            "",
            "begin",
            "",
            *(_LOADER if sensor is not None and sensor.calibrated else []),
            *(_sensor_instance(sensor) if sensor is not None else []),
            *cores,
            "end architecture rtl;",
            "",
        ]
    )
