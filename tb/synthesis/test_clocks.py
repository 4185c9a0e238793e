# SPDX-License-Identifier: Apache-2.0
"""One clock: plan, constraints, project, components and block design of a scene say the same."""

import os
import random
import re
from pathlib import Path

import pytest

from plenofir.commands.plan_lines import print_plan
from plenofir.fpga.devices import DEVICES
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir.plan.ip.files import write_components
from plenofir.plan.plan import Plan
from plenofir.plan.project_files import TOOLS, tool_of, write_project

SCENE = """
name = "drawn"
[camera]
micro_image_size = {m}
[frame]
columns = {columns}
rows = {rows}
{rate}
colour = "{colour}"
bits = {bits}
[depth]
slices = ["1"]
[build]
device = "{device}"
{build}
"""


def text_of(rng: random.Random, device: str) -> str:
    """A scene for a device: a frame rate or none, blanking or none, a clock of its own or none."""
    rate = rng.choice([None, rng.randrange(1, 20)])
    build = [f'speed_grade = "{rng.choice(DEVICES[device].grades)}"'] if rng.random() < 0.6 else []
    if rng.random() < 0.4:
        build.append(f"clock_mhz = {rng.choice([33.3, 50.0, 81.25, 125.0])}")
    blanking = rng.choice(["", "\nblanking = [160, 45]"])
    return SCENE.format(
        m=rng.choice([3, 5, 7]),
        columns=rng.randrange(64, 800),
        rows=rng.randrange(64, 600),
        rate="" if rate is None else f"rate_hz = {rate}.0{blanking}",
        colour=rng.choice(["grey", "rgb"]),
        bits=rng.choice([8, 10, 12]),
        device=device,
        build="\n".join(build),
    )


def mhz_of(constraints: str) -> float:
    """The clock in a file of constraints: a period in ns, or a frequency."""
    frequency = re.search(r"FREQUENCY PORT \"clk\" (\S+) MHZ", constraints)
    if frequency:
        return float(frequency[1])
    period = re.search(r"PERIOD \"clk\" (\S+) ns|-period (\S+) \[get_ports clk\]", constraints)
    assert period, constraints
    return 1000 / float(period[1] or period[2])


def planned(path: Path, text: str) -> Plan:
    path.write_text(text)
    return make_plan(load_scene(path))


@pytest.mark.parametrize("device", ["xc6slx45", "xc7z020", "5ceba4", "lfe5u-45f", "lifcl-40"])
def test_every_file_has_the_clock_of_the_plan(
    device: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seed = os.environ.get("DRAWN") or str(random.randrange(1 << 30))
    print(f"seed {seed}")
    rng = random.Random(f"{seed} {device}")
    for number in range(4):
        text = text_of(rng, device)
        try:
            plan = planned(tmp_path / "scene.toml", text)
        except InputError as error:
            # A clock of the scene's own may be too slow for its rate.
            assert "build.clock_mhz is" in str(error), text  # noqa: PT017
            continue
        clock = plan.built_mhz
        assert plan.clock_mhz is None or clock >= plan.clock_mhz
        capsys.readouterr()
        print_plan(plan, None)
        assert f"built for {clock:g} MHz; the {plan.part} " in capsys.readouterr().out
        print(f"seed {seed}")
        out = tmp_path / str(number)
        configure(plan, out / "configured")
        for file in (out / "configured").glob("scene_top.[ul][cp]f"):
            assert mhz_of(file.read_text()) == pytest.approx(clock, rel=1e-3), text
        name = tool_of(plan, None)[0]
        write_project(plan, name, out / "project")
        ending = TOOLS[name].constraints[0]
        (file,) = (out / "project").glob(f"scene_*.{ending}")
        constraints = file.read_text()
        assert mhz_of(constraints) == pytest.approx(clock, rel=1e-3), text
        assert (
            f"Clock: {clock:g} MHz at the port clk; part {plan.part}"
            in (out / "project" / "README").read_text()
        )
        tcl = "".join(path.read_text() for path in (out / "project").glob("*.tcl"))
        assert (f"speed -{plan.grade}" if device == "xc6slx45" else plan.part) in tcl, text
        write_components(plan, out / "ip")
        assert f"Planned for {clock:g} MHz on {plan.part}." in (out / "ip" / "README").read_text()
        if device == "xc7z020":
            facts = (out / "ip" / "scene.tcl").read_text()
            assert re.search(rf"^set clock_mhz {re.escape(f'{clock:g}')}$", facts, re.M)
            assert f"set part {plan.part}\n" in facts
            for side in ("in", "out"):
                bits, memory = (
                    int(re.search(rf"^set {kind}_{side} (\d+)$", facts, re.M)[1])  # type: ignore[index]
                    for kind in ("bits", "memory_bits")
                )
                assert memory >= bits
                assert memory in (64, 128, 256, 512, 1024)


HD = SCENE.format(
    m=7,
    columns=1920,
    rows=1080,
    rate='rate_hz = 60.0\nblanking = "video"',
    colour="rgb",
    bits=8,
    device="xc7z020",
    build="",
)


def test_blanking_counts(tmp_path: Path) -> None:
    """1080p60 sends 148.5 million pixels a second, its blanking included: two of them a clock."""
    plan = planned(tmp_path / "scene.toml", HD)
    assert plan.core.pixels_per_clock == 2
    assert (plan.built_mhz, plan.clock_mhz, plan.blanking) == (74.25, 74.25, (280, 45))
    without = HD.replace('\nblanking = "video"', "")
    plan = planned(tmp_path / "scene.toml", without)
    assert plan.built_mhz == pytest.approx(1920 / 2 * 1080 * 60 / 1e6)
    for change, message in (
        (('"video"', "[280]"), r"frame\.blanking"),
        (("rate_hz = 60.0", "rate_hz = 61.0"), "no mode of 1920 x 1080 at 61 Hz is known"),
        (("rate_hz = 60.0\n", ""), "blanking needs rate_hz"),
        (('"xc7z020"', '"xc6slx45"\npath = "video"'), "frame.blanking needs build.path = 'core'"),
    ):
        with pytest.raises(InputError, match=message):
            planned(tmp_path / "scene.toml", HD.replace(*change))


def test_a_clock_and_a_grade_of_the_scene(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    plan = planned(path, f"{HD}clock_mhz = 150.0\nspeed_grade = '-3'")
    assert (plan.built_mhz, plan.part) == (150, "xc7z020clg400-3")
    assert plan.core.pixels_per_clock == 1
    assert any(note.startswith("150 MHz is more than the 110 MHz") for note in plan.notes)
    with pytest.raises(InputError, match=r"needs 148\.5 MHz .* build\.clock_mhz is 60"):
        planned(path, f"{HD}clock_mhz = 60.0\npixels_per_clock = 1\nengine = 'fir'")
    with pytest.raises(InputError, match="no grade '4': the XC7Z020 comes in 1, 2, 3"):
        planned(path, f"{HD}speed_grade = '4'")
    with pytest.raises(InputError, match="clock_mhz needs path = 'core'"):
        planned(path, f"{HD}clock_mhz = 60.0\npath = 'video'")


def test_slower_grades_are_trusted_less() -> None:
    """Clocks hold for the grade of the table; two grades below, ECP5 loses a quarter."""
    device = DEVICES["lifcl-40"]
    assert (device.grade, device.in_grade("9").clocks_mhz) == ("9", device.clocks_mhz)
    slow = device.in_grade("7")
    assert slow.assumed
    assert slow.clock_mhz(1) == pytest.approx(0.85**2 * device.clock_mhz(1), abs=0.1)
    fast = DEVICES["lfe5u-45f"].in_grade("8")
    assert fast.clocks_mhz == DEVICES["lfe5u-45f"].clocks_mhz
    for device in DEVICES.values():
        assert device.grade in device.grades or not device.grades
        assert "{" not in device.part
