# SPDX-License-Identifier: Apache-2.0
"""From a camera's wires to raw pixels: the hard D-PHY, and pins of an ECP5."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga import hdl
from plenofir.fpga.csi import frame_packets, settle_clocks
from plenofir.ground import project
from plenofir.plan.configure import needed_sources
from plenofir_tb.camera_wires import wire_words
from plenofir_tb.runner import draw_seed, vhdl_simulator

BOARDS = {"lifcl": "lifcl40", "ecp5u": "ulx3s"}
ROWS, COLUMNS, FRAMES = 3, 16, 2
MISSING = 4
"""Count of bursts that not all lanes began, or none."""


def receive(
    folder: Path,
    library: str,
    lanes: int,
    bits: int,
    mbits: int,
    skew: int,
    *,
    continuous: bool,
    exchanged: bool = False,
) -> None:
    """Send frames of noise over the wires, and check that they arrive without faults.

    With the lines of each lane `exchanged`, every burst is counted instead.
    """
    seed = draw_seed()
    print(f"seed {seed}")
    frames = np.random.default_rng(seed).integers(0, 1 << bits, (FRAMES, ROWS, COLUMNS))
    packets = [p for n, f in enumerate(frames) for p in frame_packets(f, bits, number=n + 1)]
    wire_words(packets).tofile(folder / "input.bin")
    files = project.root() / "tb" / "file_bench"
    generics = {"LANES": lanes, "PIXEL_BITS": bits, "BIT_PS": round(5e5 / mbits) * 2}
    generics |= {"CONTINUOUS": continuous, "SKEW": skew, "COLUMNS": COLUMNS, "ROWS": ROWS}
    generics |= {"EXCHANGED": exchanged}
    benches = [files / f"{name}.vhd" for name in ("dphy_camera", f"phy_{library}", "dphy_bench")]
    text = "".join(path.read_text() for path in benches)
    sources = needed_sources(text, "dphy_bench", hdl.board_sources(BOARDS[library]))
    vhdl_simulator().simulate(
        [*sources, *benches],
        "dphy_bench",
        {**generics, "SETTLE": settle_clocks(mbits)},
        folder,
        models=hdl.model_sources(library),
    )
    counts = [int(word) for word in (folder / "counts.txt").read_text().split()]
    assert counts == [len(packets) * (exchanged and n == MISSING) for n in range(12)]
    got = np.fromfile(folder / "output.bin", "<i4")
    assert np.array_equal(got, frames.ravel()[: 0 if exchanged else None])


@pytest.mark.parametrize("library", BOARDS)
def test_frames_over_the_wires(tmp_path: Path, library: str) -> None:
    receive(tmp_path, library, 2, 8, 400, 0, continuous=False)


def test_lines_that_are_exchanged_are_told(tmp_path: Path) -> None:
    receive(tmp_path, "ecp5u", 2, 8, 400, 3, continuous=False, exchanged=True)


@pytest.mark.slow
@pytest.mark.parametrize("library", BOARDS)
@pytest.mark.parametrize(
    ("lanes", "bits", "mbits", "skew", "continuous"),
    [
        *((1, 8, 80, 0, False), (1, 12, 200, 0, True), (2, 10, 912, 3, False)),
        *((4, 10, 624, 5, True), (4, 12, 900, 0, False), (4, 8, 1500, 9, False)),
    ],
)
def test_rates_lanes_and_skews(
    tmp_path: Path,
    library: str,
    lanes: int,
    bits: int,
    mbits: int,
    skew: int,
    *,
    continuous: bool,
) -> None:
    receive(tmp_path, library, lanes, bits, mbits, skew, continuous=continuous)
