# SPDX-License-Identifier: Apache-2.0
"""The EDID block: fields by their definition, and Debian's decoder where it is installed."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from plenofir.fpga.hdmi.edid import (
    check_edid,
    describe_edid,
    edid_package,
    make_edid,
    offered_modes,
    standard_code,
    timing_of,
)
from plenofir.fpga.hdmi.modes import HD720, HD720_50, MODES, SVGA, VGA, XGA, VideoMode
from plenofir.ground.errors import InputError


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
    assert detailed_timing(block[72:90]) == expected(HD720_50)
    # 640x480, 800x600 and 1024x768 at 60 Hz are established timings.
    assert block[35:38] == b"\x21\x08\0"
    assert block[90:95] == b"\0\0\0\xfc\0"
    assert block[95:108].split(b"\n")[0] == b"plenofir"


def test_preferred_mode_comes_first() -> None:
    assert detailed_timing(make_edid((HD720, VGA))[54:72]) == expected(VGA)
    assert detailed_timing(make_edid((HD720, VGA))[72:90]) == expected(HD720)
    assert detailed_timing(make_edid((SVGA,))[54:72]) == expected(SVGA)


def test_offers_fit_the_build() -> None:
    assert [len(offered_modes(columns)) for columns in (1, 640, 799, 800, 1023, 1024, 1280)] == [
        *(1, 1, 1, 2, 2, 3, 5)
    ]


@pytest.mark.parametrize("modes", [(), (*MODES, VGA)])
def test_impossible_offers(modes: tuple[VideoMode, ...]) -> None:
    with pytest.raises(ValueError, match="mode"):
        make_edid(modes)


@pytest.mark.skipif(shutil.which("edid-decode") is None, reason="edid-decode is not installed")
@pytest.mark.parametrize("max_columns", [100, 640, 800, 1024, 1280])
def test_conforms(tmp_path: Path, max_columns: int) -> None:
    modes = offered_modes(max_columns)
    preferred = modes[-1]
    file = tmp_path / "edid.bin"
    file.write_bytes(make_edid(modes))
    done = subprocess.run(
        ["edid-decode", "--check", str(file)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert "EDID conformity: PASS" in done.stdout
    assert f"DTD 1:  {preferred.h_active:>4}x{preferred.v_active}" in done.stdout
    for mode in modes:
        size = rf"{mode.h_active}x{mode.v_active} +{int(mode.frame_rate)}\."
        assert re.search(size, done.stdout), done.stdout


def test_codes_of_the_modes() -> None:
    """As VESA's list of display monitor timings prints them; 50 Hz has no code."""
    codes = {mode.name: standard_code(mode) for mode in MODES}
    assert codes == {
        VGA.name: 0x3140,
        SVGA.name: 0x4540,
        XGA.name: 0x6140,
        HD720_50.name: 0,
        HD720.name: 0x81C0,
    }


def with_checksums(content: bytes) -> bytes:
    """The same with right last bytes of all blocks."""
    blocks = [content[i : i + 127] for i in range(0, len(content), 128)]
    return b"".join(block + bytes([-sum(block) % 256]) for block in blocks)


def two_blocks() -> bytes:
    """An EDID with an empty CEA extension."""
    block = bytearray(make_edid())
    block[126] = 1
    return with_checksums(bytes(block) + b"\x02\x03\x04".ljust(128, b"\0"))


def test_own_edids() -> None:
    for content, text in ((make_edid(), "send DVI"), (two_blocks(), "may send HDMI")):
        check_edid(content, where="own.bin")
        assert describe_edid(content).startswith("1280 x 720 at 60.00 Hz preferred; ")
        assert text in describe_edid(content)
        package = edid_package(content)
        assert f"EDID_BYTES : positive := {len(content)};" in package
        assert package.count("00FFFFFFFFFFFF00") == 1
        assert content[-16:].hex().upper() in package
    assert timing_of(make_edid()[90:]) is None
    assert "no preferred mode" in describe_edid(bytes(128))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "own.bin: has 0 bytes; an EDID has 128 or 256"),
        (make_edid() + bytes(1), "129 bytes"),
        (make_edid() * 3, "384 bytes"),
        (
            b"\x01" + make_edid()[1:],
            "begins with 01 ff ff ff ff ff ff 00; an EDID begins with 00 ff",
        ),
        (make_edid() * 2, "byte 126 tells of 0 extension blocks, but 256 bytes hold 1"),
        (two_blocks()[:128], "byte 126 tells of 1 extension blocks, but 128 bytes hold 0"),
        (make_edid()[:127] + b"\0", "bytes 0 to 127 have the sum"),
        (two_blocks()[:-1] + b"\1", "bytes 128 to 255 have the sum"),
    ],
)
def test_own_edids_refused(content: bytes, message: str) -> None:
    with pytest.raises(InputError) as error:
        check_edid(content, where="own.bin")
    assert message in str(error.value)
