# SPDX-License-Identifier: Apache-2.0
"""Comparing waveform files, on files that a small VCD writer makes."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from vcd import COUNT, Vcd, bits, counter

from plenofir.fpga.simulate.dump_compare import DumpComparison, compare_dumps, parse_bound
from plenofir.fpga.tools.dumps import canonical_name, time_text
from plenofir.ground.errors import InputError


def compared(tmp_path: Path, a: Vcd, b: Vcd, **options) -> DumpComparison:
    return compare_dumps(a.write(tmp_path / "a.vcd"), b.write(tmp_path / "b.vcd"), **options)


@pytest.mark.parametrize(
    ("name", "canonical"),
    [
        ("Top.Core.Data[7:0]", "top.core.data"),
        ("core.data(7 downto 0)", "core.data"),
        ("core.row.channel(0).sum [9:0]", "core.row.channel[0].sum"),
        ("fir.held.[3]", "fir.held[3]"),
        ("fir.held[3][7:0]", "fir.held[3]"),
        ("fifo.address.[4:0]", "fifo.address"),
        ("closed(0 to 4)", "closed"),
    ],
)
def test_names(name: str, canonical: str) -> None:
    assert canonical_name(name) == canonical


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("120ns", Fraction(120, 10**9)),
        ("1us", Fraction(1, 10**6)),
        ("1.5 US", Fraction(3, 2 * 10**6)),
        ("0fs", Fraction(0)),
        ("2s", Fraction(2)),
        ("40", 40),
    ],
)
def test_bounds(text: str, bound) -> None:
    found = parse_bound(text, "--from")
    assert found == bound
    assert type(found) is type(bound)


@pytest.mark.parametrize(
    "text", ["ns", "12xs", "1.5", "-3", "-3ns", "1e3ns", "12 n s", "1,5us", "x", ""]
)
def test_malformed_bounds(text: str) -> None:
    with pytest.raises(InputError, match="neither a time such as 120ns"):
        parse_bound(text, "--from")


def test_time_text() -> None:
    times = [(335, 9), (1565, 9), (15, 13), (0, 0), (3, 0), (10, 6)]
    want = ["335 ns", "1.565 us", "1.5 ps", "0 fs", "3 s", "10 us"]
    assert [time_text(Fraction(n, 10**e)) for n, e in times] == want


def test_equal_files(tmp_path: Path) -> None:
    found = compared(tmp_path, counter(), counter())
    assert found.equal
    assert (found.clock, found.samples, found.signals) == ("clk", 8, 2)
    assert found.only_in_a == found.only_in_b == found.not_comparable == found.never_defined == ()


@pytest.mark.parametrize(
    "other",
    [
        counter(top="tb"),
        counter(top="another.top"),
        counter(top="Outer.TB", clock="CLK"),
        counter(unit="1ps", ticks_per_ns=Fraction(1000)),
        counter(unit="100 fs", ticks_per_ns=Fraction(10000)),
        counter(period=66),
        Vcd({"Core.COUNT": (3, list(COUNT)), "core.Odd": (1, list("01010101"))}, top=""),
    ],
)
def test_names_and_units_of_other_simulators(tmp_path: Path, other: Vcd) -> None:
    for a, b in ((counter(), other), (other, counter())):
        found = compared(tmp_path, a, b)
        assert found.equal, found.differences
        assert (found.samples, found.signals) == (8, 2)
        assert found.only_in_a == found.only_in_b == ()
        wrong = Vcd({**b.signals}, b.top, b.clock, b.unit, b.ticks_per_ns, b.cycles, b.period)
        name = next(n for n in wrong.signals if n.lower().endswith("odd"))
        wrong.signals[name] = (1, list("01010001"))
        found = compared(tmp_path, a, wrong)
        assert [(d.signal.endswith("core.odd"), d.cycle) for d in found.differences] == [(True, 5)]


def test_first_difference_is_named(tmp_path: Path) -> None:
    other = counter(unit="1ps", ticks_per_ns=Fraction(1000))
    other.signals["core.count[2:0]"][1][4] = "110"
    other.signals["core.odd"][1][6:8] = ["1", "0"]
    found = compared(tmp_path, counter(), other)
    first, second = found.differences
    assert (first.signal, first.cycle) == ("core.count", 4)
    assert (first.time_a, first.time_b) == (Fraction(45, 10**9),) * 2
    assert (first.value_a, first.value_b) == ("4 (0x4)", "6 (0x6)")
    assert str(first) == "core.count, cycle 4, 45 ns: 4 (0x4) in A, 6 (0x6) in B"
    assert (second.signal, second.cycle, second.value_a) == ("core.odd", 6, "0")
    slower = compared(tmp_path, counter(), counter(period=20, signals=other.signals))
    assert str(slower.differences[0]).startswith("core.count, cycle 4, 45 ns in A, 90 ns in B: ")


def test_outer_signals_come_first_within_a_cycle(tmp_path: Path) -> None:
    a = Vcd({"out": (1, ["0", "0"]), "core.deep.out": (1, ["0", "0"])})
    b = Vcd({"core.deep.out": (1, ["0", "1"]), "out": (1, ["0", "1"])})
    assert [d.signal for d in compared(tmp_path, a, b).differences] == ["out", "core.deep.out"]
    b.signals["out"] = (1, ["0", "0", "1"])
    assert [d.signal for d in compared(tmp_path, a, b).differences] == ["core.deep.out", "out"]


@pytest.mark.parametrize(
    ("left", "right", "cycle", "strict_cycle"),
    [
        # Undefined at first, in different ways and for different times.
        (["uu", "xx", "01"], ["xx", "xx", "01"], None, 0),
        (["uu", "01", "10"], ["00", "01", "10"], None, 0),
        (["", "01", "10"], ["zz", "01", "10"], None, 0),
        (["01", "10"], ["", "10"], None, 0),
        # Defined on both sides, then undefined on one.
        (["00", "01", "10"], ["00", "0x", "10"], 1, 1),
        (["00", "01", "10"], ["uu", "01", "xx"], 2, 0),
        # Undefined on both sides.
        (["00", "zz", "10"], ["00", "xx", "10"], None, 1),
        # Weak levels are levels.
        (["lh", "01"], ["01", "lh"], None, 0),
        (["lh", "01"], ["00", "01"], 0, 0),
        # One bit is defined later than the other, each counts from then on.
        (["u0", "u1", "11"], ["00", "00", "11"], 1, 0),
        (["u1", "01", "11"], ["11", "11", "11"], 1, 0),
        # A bit that one file never defines.
        (["uu", "u0", "u1"], ["00", "00", "01"], 0, 0),
        (["uu", "uu", "uu"], ["uu", "uu", "01"], 2, 2),
    ],
)
def test_undefined_values(tmp_path: Path, left, right, cycle, strict_cycle) -> None:
    for a, b in ((left, right), (right, left)):
        vcd_a, vcd_b = (Vcd({"x": (2, values)}) for values in (a, b))
        for strict, want in ((False, cycle), (True, strict_cycle)):
            found = compared(tmp_path, vcd_a, vcd_b, strict=strict)
            assert [d.cycle for d in found.differences] == ([] if want is None else [want])
            assert found.equal == (want is None)


def test_bits_that_are_never_defined_are_named(tmp_path: Path) -> None:
    found = compared(tmp_path, bits("u1", "u0"), bits("x1", "x0"))
    assert found.equal
    assert found.never_defined == ("x",)
    assert compared(tmp_path, bits("11", "u0"), bits("11", "x0")).never_defined == ()


@pytest.mark.parametrize("width", [1, 62, 63, 64, 65])
def test_signals_about_as_wide_as_a_machine_word(tmp_path: Path, width: int) -> None:
    values = ["u" * width, "1" * width, "0" * width, "1" * width]
    assert compared(tmp_path, bits(*values), bits(*values)).equal
    for wrong in ("0" + "1" * (width - 1), "1" * (width - 1) + "0"):
        found = compared(tmp_path, bits(*values), bits(*values[:3], wrong))
        assert [d.cycle for d in found.differences] == [3]


def test_wide_signals(tmp_path: Path) -> None:
    values = ["1" * 200, "u" + "01" * 99 + "1", "0" * 199 + "1"]
    other = [*values]
    assert compared(tmp_path, bits(*values), bits(*other)).equal
    other[2] = "1" + "0" * 198 + "1"
    found = compared(tmp_path, bits(*values), bits(*other))
    assert [d.cycle for d in found.differences] == [2]
    assert found.differences[0].value_b == f"{2**199 + 1} (0x{2**199 + 1:x})"
    other[1] = "u" + "01" * 99 + "x"
    assert [d.cycle for d in compared(tmp_path, bits(*values), bits(*other)).differences] == [1]


def test_reals(tmp_path: Path) -> None:
    a = Vcd({"level": (0, ["r1.5", "r-2", "r3"])})
    b = Vcd({"level": (0, ["r1.50", "r-2.0", "r3.25"])})
    found = compared(tmp_path, a, b)
    assert [str(d) for d in found.differences] == ["level, cycle 2, 25 ns: 3.0 in A, 3.25 in B"]


def test_signals_of_one_file(tmp_path: Path) -> None:
    a, b = counter(), counter()
    a.signals["core.left"] = (1, ["0"])
    b.signals |= {"core.right[0]": (1, ["0"]), "other": (1, ["0"])}
    found = compared(tmp_path, a, b)
    assert found.equal
    assert (found.only_in_a, found.only_in_b) == (("core.left",), ("core.right", "other"))
    assert compared(tmp_path, a, b, signals=["core.*"]).only_in_b == ("core.right",)


def test_signals_with_another_width(tmp_path: Path) -> None:
    a, b = counter(), counter()
    a.signals["wide"], b.signals["wide"] = (3, ["001"]), (4, ["0001"])
    found = compared(tmp_path, a, b)
    assert found.equal
    assert (found.signals, found.not_comparable) == (2, ("wide",))
    strict = compared(tmp_path, a, b, strict=True)
    assert [(d.signal, d.value_a, d.value_b) for d in strict.differences] == [
        ("wide", '"001"', '"0001"')
    ]
    with pytest.raises(InputError, match="wide: the files have them with different types"):
        compared(tmp_path, a, b, signals=["wide"])


@pytest.mark.parametrize(
    ("pattern", "names"),
    [
        ("core.count", ["core.count"]),
        ("count", ["core.count"]),
        ("Core.Count[2:0]", ["core.count"]),
        ("tb.core.count", ["core.count"]),
        ("core", ["core.count", "core.odd", "core.deep.count_up"]),
        ("core.*", ["core.count", "core.odd", "core.deep.count_up"]),
        ("co*nt*", ["core.count", "core.deep.count_up"]),
        ("o?d", ["core.odd"]),
        ("mem[1]", ["mem[1]"]),
        ("mem", ["mem[0]", "mem[1]"]),
    ],
)
def test_choice_of_signals(tmp_path: Path, pattern: str, names: list[str]) -> None:
    a, b = counter(top="tb"), counter()
    for vcd, value in ((a, "01"), (b, "10")):
        vcd.signals["core.count[2:0]"] = (3, [f"0{value}"])
        vcd.signals["core.odd"] = (1, [value[0]])
        vcd.signals["core.deep.count_up"] = (1, [value[0]])
        vcd.signals["mem[0][1:0]"] = vcd.signals["mem[1][1:0]"] = (2, [value])
    found = compared(tmp_path, a, b, signals=[pattern])
    assert [d.signal for d in found.differences] == names
    assert found.signals == len(names)
    two = compared(tmp_path, a, b, signals=[pattern, "odd"])
    assert {d.signal for d in two.differences} == {*names, "core.odd"}


@pytest.mark.parametrize(
    ("begin", "end", "cycles", "first"),
    [
        (None, None, 8, 2),
        ("2", "2", 1, 2),
        ("3", None, 5, 6),
        (None, "1", 2, None),
        ("3", "5", 3, None),
        ("25ns", "25ns", 1, 2),
        ("26ns", "64999ps", 3, None),
        ("26ns", "0.065us", 4, 6),
        ("7", "100", 1, None),
        ("70ns", "1s", 1, None),
    ],
)
def test_ranges(tmp_path: Path, begin, end, cycles: int, first: int | None) -> None:
    other = counter(unit="1ps", ticks_per_ns=Fraction(1000))
    other.signals["core.odd"] = (1, list("01110111"))
    other.signals["core.odd"][1][2] = "1"
    options = {
        "begin": parse_bound(begin, "--from") if begin else None,
        "end": parse_bound(end, "--to") if end else None,
    }
    found = compared(tmp_path, counter(), other, **options)
    assert found.samples == cycles
    assert [d.cycle for d in found.differences] == ([] if first is None else [first])


def test_a_file_that_ends_early_is_no_equal(tmp_path: Path) -> None:
    short = counter(cycles=6)
    found = compared(tmp_path, counter(), short)
    assert not found.equal
    assert not found.differences
    assert (found.samples, found.cycles_a, found.cycles_b) == (6, 8, 6)
    for end in (5, Fraction(56, 10**9)):
        for a, b in ((counter(), short), (short, counter())):
            assert compared(tmp_path, a, b, end=end).equal
    for end in (6, Fraction(66, 10**9)):
        for a, b in ((counter(), short), (short, counter())):
            found = compared(tmp_path, a, b, end=end)
            assert {found.cycles_a, found.cycles_b} == {6, 7}


def test_without_a_clock(tmp_path: Path) -> None:
    a = counter(clock="")
    b = counter(clock="", unit="10ps", ticks_per_ns=Fraction(100))
    found = compared(tmp_path, a, b)
    assert found.equal
    assert (found.clock, found.samples) == (None, 8)
    b.signals["core.odd"] = (1, list("01000101"))
    found = compared(tmp_path, a, b)
    assert str(found.differences[0]) == "core.odd, 25 ns: 1 in A, 0 in B"
    later = compared(tmp_path, a, b, begin=Fraction(26, 10**9))
    assert (later.equal, later.samples) == (True, 4)
    with pytest.raises(InputError, match="--to: a cycle needs a clock"):
        compared(tmp_path, a, b, end=3)
    # With a clock in the files, on request; the clock's own changes are instants then.
    found = compared(tmp_path, counter(), counter(), clock="none")
    assert (found.clock, found.samples, found.signals) == (None, 16, 3)


def test_choice_of_the_clock(tmp_path: Path) -> None:
    a = counter(clock="pclk")
    with_top = counter(clock="pclk", top="tb")
    assert compared(tmp_path, with_top, a, clock="tb.pclk").clock == "pclk"
    a.signals["core.fast.clk"] = (1, list("01010101"))
    a.signals["core.fast.inside.clk"] = (1, list("01010101"))
    # The outermost clk; it rises at 5, 25, 45, 65 ns.
    found = compared(tmp_path, a, a)
    assert (found.clock, found.samples, found.signals) == ("core.fast.clk", 4, 4)
    assert compared(tmp_path, a, a, clock="PCLK").samples == 8
    assert compared(tmp_path, a, a, clock=" Pclk ").clock == "pclk"
    assert compared(tmp_path, a, a, clock="fast.clk").clock == "core.fast.clk"
    a.signals["core.slow.clk"] = (1, list("00110011"))
    with pytest.raises(InputError, match=r"2 signals fit 'clk'; choose core\.fast\.clk"):
        compared(tmp_path, a, a)
    with pytest.raises(InputError, match="--clock: there is no signal 'clock' in both"):
        compared(tmp_path, a, a, clock="clock")
    a.signals["still"] = (1, ["1"])
    with pytest.raises(InputError, match="still never rises"):
        compared(tmp_path, a, a, clock="still")
    with pytest.raises(InputError, match="count never rises"):
        compared(tmp_path, a, a, clock="core.count")


def test_rising_edges_are_those_from_0_to_1(tmp_path: Path) -> None:
    a = Vcd({"clk": (1, list("u1x10l1h0h")), "x": (1, list("0"))}, clock="")
    found = compared(tmp_path, a, a)
    assert (found.clock, found.samples) == ("clk", 2)


@given(st.data())
def test_any_single_change_is_found(tmp_path_factory: pytest.TempPathFactory, data) -> None:
    tmp_path = tmp_path_factory.mktemp("dumps")
    seed = data.draw(st.integers(0, 2**31))
    rng = np.random.default_rng(seed)
    widths = data.draw(st.lists(st.integers(1, 80), min_size=1))
    cycles = data.draw(st.integers(1, 12))

    def word(width: int) -> str:
        return "".join(rng.choice(list("01"), width))

    a = Vcd(
        {f"core.s{n}": (w, [word(w) for _ in range(cycles)]) for n, w in enumerate(widths)},
        cycles=cycles,
    )
    names = [*a.signals]
    name = data.draw(st.sampled_from(names))
    cycle = data.draw(st.integers(0, cycles - 1))
    width, values = a.signals[name]
    place = data.draw(st.integers(0, width - 1))
    wrong = [*values]
    flipped = "1" if wrong[cycle][place] == "0" else "0"
    wrong[cycle] = wrong[cycle][:place] + flipped + wrong[cycle][place + 1 :]
    order = data.draw(st.permutations(names))
    b = Vcd(
        {n: (width, wrong) if n == name else a.signals[n] for n in order},
        top=data.draw(st.sampled_from(["", "tb", "x.y"])),
        unit="10 ps",
        ticks_per_ns=Fraction(100),
        cycles=cycles,
    )
    found = compared(tmp_path, a, b)
    assert found.signals == len(widths)
    assert [(d.signal.split(".")[-1], d.cycle) for d in found.differences] == [
        (name.split(".")[-1], cycle)
    ]


def test_text_and_booleans(tmp_path: Path) -> None:
    """Enumerations as text; a boolean as text in one file and as a bit in the other."""
    head = "$timescale 1ns $end\n$var wire 1 c clk $end\n"
    clock = "#5\n1c\n#10\n0c\n#15\n1c\n"
    text = (
        "$var string 0 s state $end\n$attrbegin misc 02 BOOLEAN 1025 $end\n"
        "$var string 0 r running $end\n$enddefinitions $end\n#0\n0c\nsIDLE s\nstrue r\n"
        f"{clock}sBUSY s\nsfalse r\n#20\n0c\n#25\n1c\n"
    )
    bit = (
        "$var string 1 s state $end\n$var wire 1 r running $end\n"
        f"$enddefinitions $end\n#0\n0c\nsidle s\n1r\n{clock}sbusy s\n0r\n#20\n0c\n#25\n1c\n"
    )
    a, b = tmp_path / "a.vcd", tmp_path / "b.vcd"
    a.write_text(head + text)
    b.write_text(head + bit)
    found = compare_dumps(a, b)
    assert (found.equal, found.signals, found.not_comparable) == (True, 2, ())
    b.write_text(head + bit.replace("sbusy", "sdone").replace("0r", "1r"))
    assert [str(d) for d in compare_dumps(a, b).differences] == [
        "state, cycle 2, 25 ns: busy in A, done in B",
        "running, cycle 2, 25 ns: 0 in A, 1 in B",
    ]
    b.write_text(head + bit.replace("string 1 s state", "wire 2 s state").replace("sidle", "b0"))
    b.write_text(b.read_text().replace("sbusy", "b1"))
    assert compare_dumps(a, b).not_comparable == ("state",)
