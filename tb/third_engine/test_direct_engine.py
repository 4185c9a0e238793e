# SPDX-License-Identifier: Apache-2.0
"""A third engine, added by the recipe of CONTRIBUTING.md alone: direct sums for small M."""

from pathlib import Path

import numpy as np
import pytest
from direct_engine import DirectEngine

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import Raster, SliceEngine
from plenofir.fpga.simulate import file_bench
from plenofir.fpga.simulate.report import Report
from plenofir.fpga.simulate.request import Run
from plenofir.fpga.simulate.run import run
from plenofir.fpga.tools.simulators import SimulationError
from plenofir.ground.errors import InputError
from plenofir.ground.images import write_png
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name

HERE = Path(__file__).parent
# What the recipe asks for in the sources: place, line that stands there, lines in front of it.
RECIPE = (
    ("core_pkg.vhd", "(fir, moving_sum, stack)", "(fir, moving_sum, direct, stack)"),
    (
        *("refocuser_pkg.vhd", '    assert same_text(engine, "fir")'),
        '    if same_text(engine, "direct") then\n      return direct;\n    end if;\n\n'
        '    assert same_text(engine, "fir")',
    ),
    (
        *("refocuser_pkg.vhd", "      when stack =>"),
        "      when direct =>\n\n        return work.direct_pkg.plan_of(core);\n\n"
        "      when stack =>",
    ),
    (
        *("refocuser.vhd", "  component stack_array is"),
        """  component direct_array is
    generic (
      CORE : core_t
    );
    port (
      clk        : in    std_logic;
      reset      : in    std_logic;
      token      : in    token_t;
      token_data : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
      out_token  : out   tokens_t(0 to 0);
      out_sums   : out   std_logic_vector(row_sums_bits(CORE) - 1 downto 0)
    );
  end component direct_array;

  component stack_array is""",
    ),
    (
        *("refocuser.vhd", "  stack_engine : if CORE.engine = stack generate"),
        """  direct_engine : if CORE.engine = direct generate

    direct_sums : component direct_array
      generic map (
        CORE => CORE
      )
      port map (
        clk        => clk,
        reset      => reset,
        token      => engine_token,
        token_data => engine_data,
        out_token  => sum_tokens,
        out_sums   => sums
      );

  end generate direct_engine;

  stack_engine : if CORE.engine = stack generate""",
    ),
)


def with_engine(folder: Path) -> list[Path]:
    """The sources of the file bench with the engine."""
    sources = file_bench.core_sources()
    for number, (file, old, new) in enumerate(RECIPE):
        sources = plant(folder / str(number), sources, file, old, new)
    place = next(i for i, source in enumerate(sources) if source.name == "refocuser_pkg.vhd")
    files = [HERE / f"direct_{part}.vhd" for part in ("pkg", "pass", "array")]
    return [*sources[:place], *files, *sources[place:]]


@pytest.fixture
def direct(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulator is the one that starts soonest."""
    monkeypatch.setenv("GHDL_BACKEND", "mcode")


def with_direct(core: CoreConfiguration, engine: DirectEngine) -> CoreConfiguration:
    """The core with an engine that the configuration's union does not name."""
    return core.model_copy(update={"engine": engine})


def simulated(folder: Path, core: CoreConfiguration) -> Report:
    shape = (17, core.max_columns, 3)[: 2 if core.channels == 1 else 3]
    raw = np.random.default_rng(1).integers(0, 256, shape, np.uint8)
    write_png(folder / "raw.png", raw)
    what = Run(
        raw=folder / "raw.png",
        core=core,
        out=folder / "out",
        simulator=simulator_name(),
        stalls=3,
    )
    return run(what)


CORE = with_direct(
    CoreConfiguration(micro_image_size=3, shifts=(-1, 4, 0), max_columns=13, channels=3),
    DirectEngine(),
)
CORES = {
    "M3": CORE,
    "M2 sharpened": with_direct(
        CoreConfiguration(
            micro_image_size=2, shifts=(3, 1), max_columns=14, align="causal", sharpening=(4, 0)
        ),
        DirectEngine(),
    ),
}


@pytest.mark.usefixtures("direct")
def test_pictures_are_exact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sources = with_engine(tmp_path / "hdl")
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    for name, core in CORES.items():
        (tmp_path / name).mkdir()
        report = simulated(tmp_path / name, core)
        assert report.agrees, name
        assert report.pixels_compared == 17 * core.max_columns * len(core.shifts)
        assert report.latency_clocks == core.latency_clocks(core.max_columns, 17, len(core.shifts))


@pytest.mark.usefixtures("direct")
@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("plan.row_tokens   := core.geometry.output_delay;", "row_tokens that are shorter"),
        ("plan.modulus      := 1;", "no modulus"),
    ],
    ids=["delay", "modulus"],
)
def test_a_plan_without_a_number_is_refused_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, message: str
) -> None:
    sources = with_engine(tmp_path / "hdl")
    sources = plant(tmp_path / "plan", sources, "direct_pkg.vhd", line, "")
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    with pytest.raises(SimulationError, match=message):
        simulated(tmp_path, CORE)


def test_python_refuses_a_plan_without_a_number_by_name() -> None:
    class TooShort(DirectEngine):
        def row_tokens(self, raster: Raster) -> int:
            return raster.delay - 1

    class NoModulus(DirectEngine):
        frame_lines = SliceEngine.frame_lines

    CORE.check_limits()
    with pytest.raises(InputError, match="direct: row_tokens, 3 of 1 pixels, are shorter"):
        with_direct(CORE, TooShort()).check_limits()
    with pytest.raises(TypeError, match=r"NoModulus.*frame_lines"):
        NoModulus()
