"""The EDID block: fields by their definition, and Debian's decoder where it is installed."""

import shutil
import subprocess
from pathlib import Path

import pytest

from plenofir.fpga.hdmi.edid import make_edid, offered_modes
from plenofir.fpga.hdmi.modes import HD720, MODES, SVGA, VGA, VideoMode


def detailed_timing(block: bytes) -> dict[str, int]:
    """Read a detailed timing descriptor (E-EDID 1.3, section 3.10.2)."""
    return {
        "pixel_clock": int.from_bytes(block[:2], "little") * 10,
        "h_active": block[2] | (block[4] >> 4) << 8,
        "h_blank": block[3] | (block[4] & 15) << 8,
        "v_active": block[5] | (block[7] >> 4) << 8,
        "v_blank": block[6] | (block[7] & 15) << 8,
        "h_front": block[8] | (block[11] >> 6) << 8,
        "h_sync": block[9] | (block[11] >> 4 & 3) << 8,
        "v_front": block[10] >> 4 | (block[11] >> 2 & 3) << 4,
        "v_sync": block[10] & 15 | (block[11] & 3) << 4,
        "h_positive": block[17] >> 1 & 1,
        "v_positive": block[17] >> 2 & 1,
    }


def expected(mode: VideoMode) -> dict[str, int]:
    names = ("h_active", "v_active", "h_front", "h_sync", "v_front", "v_sync")
    return {
        "pixel_clock": mode.pixel_clock // 10 * 10,
        "h_blank": mode.h_total - mode.h_active,
        "v_blank": mode.v_total - mode.v_active,
        "h_positive": int(mode.h_positive),
        "v_positive": int(mode.v_positive),
        **{name: getattr(mode, name) for name in names},
    }


def test_block() -> None:
    block = make_edid()
    assert len(block) == 128
    assert sum(block) % 256 == 0
    assert block[:8] == b"\0\xff\xff\xff\xff\xff\xff\0"
    # Version 1.3, digital, no extension: sources send DVI.
    assert (block[18], block[19], block[20] >> 7, block[126]) == (1, 3, 1, 0)
    assert detailed_timing(block[54:72]) == expected(HD720)
    assert detailed_timing(block[72:90]) == expected(VGA)
    # 640x480 and 800x600 at 60 Hz are established timings.
    assert block[35] == 0x21
    assert block[90:95] == b"\0\0\0\xfc\0"
    assert block[95:108].split(b"\n")[0] == b"plenofir"


def test_preferred_mode_comes_first() -> None:
    assert detailed_timing(make_edid(preferred=VGA)[54:72]) == expected(VGA)
    assert detailed_timing(make_edid((SVGA,), preferred=SVGA)[54:72]) == expected(SVGA)


def test_offers_fit_the_build() -> None:
    assert [len(offered_modes(columns)) for columns in (1, 640, 799, 800, 1279, 1280)] == [
        *(1, 1, 1, 2, 2, 3)
    ]


@pytest.mark.parametrize("modes", [(VGA,), (*MODES, VGA)])
def test_impossible_offers(modes: tuple[VideoMode, ...]) -> None:
    with pytest.raises(ValueError, match="modes"):
        make_edid(modes)


@pytest.mark.skipif(shutil.which("edid-decode") is None, reason="edid-decode is not installed")
@pytest.mark.parametrize("max_columns", [100, 640, 800, 1280])
@pytest.mark.parametrize("largest_first", [True, False])
def test_conforms(tmp_path: Path, max_columns: int, largest_first: bool) -> None:
    modes = offered_modes(max_columns)
    preferred = modes[-1 if largest_first else 0]
    file = tmp_path / "edid.bin"
    file.write_bytes(make_edid(modes, preferred=preferred))
    done = subprocess.run(
        ["edid-decode", "--check", str(file)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert "EDID conformity: PASS" in done.stdout
    assert f"DTD 1:  {preferred.h_active:>4}x{preferred.v_active}" in done.stdout
