# SPDX-License-Identifier: Apache-2.0
"""Parsers of ISE's reports, and reports for which a build is refused.

The texts have the form of public logs, with other contents: ISE 14.7 for the same device in
github.com/MDMTseng/AtlysSGM (``source/VmodCAM_Ref.twr``, ``.bld``, ``.syr``), 14.2 in
github.com/tariqmuh/Vmod_in_HDMI (``implementation/system.twr``, ``.bld``), 14.7 in
github.com/toptensoftware/clken_test (``top.twr``), and a clock derived behind a choice of
clocks and two PLLs as in issue 68 of github.com/timvideos/HDMI2USB-jahanzeb-firmware. Of the
sections of unconstrained paths only the titles were found in public text; they have the form of the
other sections here.
"""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.fpga.bitstream import ise
from plenofir.fpga.bitstream.ise_reports import (
    Timing,
    Treatment,
    derived,
    messages,
    read_timing,
    treatments,
)
from plenofir.ground.errors import InputError

# Clocks of the receiver and the transmitter, as NGDBuild derives them from TS_tmds.
CLOCKS = {
    "pixel": "TS_tmds",
    "half": "TS_tmds / 2",
    "tx_pixel": "TS_pixel",
    "tx_half": "TS_pixel / 2",
}


def section(constraint: str, paths: int = 7, errors: int = 0) -> str:
    return f"""\
================================================================================
Timing constraint: {constraint}
For more information, see Period Analysis in the Timing Closure User Guide (UG612).

 {paths} paths analyzed, {paths} endpoints analyzed, {errors} failing endpoints
 {errors} timing error{"" if errors == 1 else "s"} detected. ({errors} setup errors, 0 hold errors)
 Minimum period is   3.886ns.
--------------------------------------------------------------------------------

"""


def period(name: str, of: str, paths: int = 7) -> str:
    """A derived period, broken and padded as TRCE does it."""
    return section(f'TS_{name} = PERIOD TIMEGRP \n"{name}"         {of} HIGH \n50%;', paths)


def report(*more: str, **changed: str) -> str:
    """A good report, with sections changed (or removed) or added."""
    sections = {name: period(name, of) for name, of in CLOCKS.items()} | changed
    return "".join([*sections.values(), *more])


def check(text: str) -> dict[str, str]:
    """The build's check of a report."""
    return ise.check_timing(read_timing(text), Path("atlys_top.twr"))


def test_accepted() -> None:
    clocks = check(report(section("Unconstrained path analysis", paths=0)))
    assert {clock: text.split(" = ")[0] for clock, text in clocks.items()} == {
        "clk": "TS_pixel",
        "clk_x2": "TS_half",
        "tx_clk": "TS_tx_pixel",
        "tx_clk_x2": "TS_tx_half",
    }


@pytest.mark.parametrize(
    ("text", "what"),
    [
        pytest.param("", "clock clk is not timed", id="empty"),
        pytest.param(
            section('TS_control = PERIOD TIMEGRP "control" 10 ns HIGH 50%;'),
            "clock clk is not timed",
            id="not-derived",
        ),
        pytest.param(
            report(tx_half=period("tx_half", "TS_pixel / 2", paths=0)),
            "clock tx_clk_x2 is not timed",
            id="no-paths",
        ),
        pytest.param(
            report(tx_pixel="", tx_half=""), "clock tx_clk is not timed", id="not-through-two"
        ),
        pytest.param(
            report(tx_pixel=period("tx_pixel", "TS_control")),
            "clock tx_clk is not timed",
            id="from-another",
        ),
        pytest.param(
            report(half=period("half", "TS_tmds / 10")), "clock clk_x2 is not timed", id="serial"
        ),
        pytest.param(
            report(section("Unconstrained path analysis", paths=3)),
            "3 paths are in no constraint: Unconstrained path analysis",
            id="unconstrained",
        ),
        pytest.param(
            report(
                section(
                    'Unconstrained OFFSET IN BEFORE analysis for clock "clk_100_BUFGP"', paths=1
                )
            ),
            "1 paths are in no constraint: Unconstrained OFFSET IN BEFORE analysis for clock "
            '"clk_100_BUFGP"',
            id="unconstrained-pin",
        ),
        pytest.param(
            report(section('TS_a = MAXDELAY FROM TIMEGRP\n "a" TO TIMEGRP "b" 4 ns;', errors=1)),
            'timing is not met: TS_a = MAXDELAY FROM TIMEGRP "a" TO TIMEGRP "b" 4 ns (1 errors, '
            "3.886 ns would be met)",
            id="too-slow",
        ),
    ],
)
def test_refused(text: str, what: str) -> None:
    with pytest.raises(InputError) as caught:
        check(text)
    assert caught.value.problem.startswith(what)
    assert caught.value.where == "atlys_top.twr"


def test_derived_in_units_of_frequency() -> None:
    """If the root is in MHz the factors are inverted, and a phase comes before HIGH."""
    timing = [
        Timing('TS_b = PERIOD TIMEGRP "b" TS_a * 2 PHASE 0.833333333 ns HIGH 50%', 1, 0, 1.0),
        Timing('TS_c = PERIOD TIMEGRP "c" TS_b HIGH 50%', 1, 0, 1.0),
    ]
    assert derived(timing, "TS_a") == {
        timing[0].constraint: (1, 0.5),
        timing[1].constraint: (2, 0.5),
    }


def test_constraint_of_a_net() -> None:
    """Constraints derived from a period of a net have another form, over several lines."""
    text = """\
Timing constraint: PERIOD analysis for net "dcm/fast" derived from  NET \n"dcm/slow" PERIOD \
= 10 ns HIGH 50%;  multiplied by 1.25 to 12.500 nS and duty \ncycle corrected to HIGH 6.250 nS  \n\
For more information, see Period Analysis in the Timing Closure User Guide (UG612).\n
 1 path analyzed, 1 endpoint analyzed, 0 failing endpoints
 1 timing error detected. (1 component switching limit error)
 Minimum period is   4.400ns.
"""
    assert read_timing(text) == [
        Timing(
            'PERIOD analysis for net "dcm/fast" derived from NET "dcm/slow" PERIOD = 10 ns '
            "HIGH 50%",
            1,
            1,
            4.4,
        )
    ]


def test_messages_of_ngdbuild() -> None:
    """Some have no number; those with equal text are counted together."""
    log = """\
Checking Constraint Associations...
WARNING:NgdBuild - The value of SIM_DEVICE on instance
   'receive_clocks/pll' of type PLL_ADV has been changed
   from 'VIRTEX5' to 'SPARTAN6'.
INFO:ConstraintSystem:178 - TNM 'tmds', used in period specification
   'TS_tmds', was traced into PLL_ADV instance receive_clocks/pll. The following new TNM
   groups and period specifications were generated at the PLL_ADV output(s): \n\
   CLKOUT1: <TIMESPEC TS_receive_clocks_pll_pixel = PERIOD
   "receive_clocks_pll_pixel" TS_tmds HIGH 50%>

WARNING:NgdBuild:452 - logical net 'N50' has no driver
WARNING:NgdBuild:452 - logical net 'N50' has no driver
Done...
"""
    found = messages("ngdbuild", log, "WARNING")
    assert [(message.code, message.text, message.times) for message in found] == [
        (
            "NgdBuild",
            "The value of SIM_DEVICE on instance 'receive_clocks/pll' of type PLL_ADV has been "
            "changed from 'VIRTEX5' to 'SPARTAN6'.",
            1,
        ),
        ("NgdBuild:452", "logical net 'N50' has no driver", 2),
    ]


def test_treatments(tmp_path: Path) -> None:
    known = treatments(ise.warning_file())
    assert known["Xst:737"] == Treatment.FATAL
    assert known["Xst:1710"] == Treatment.UNIMPORTANT
    path = tmp_path / "warnings.txt"
    for line in ("ignored Xst:1 # why", "fatal", "fatal Xst:1 Xst:2", "unimportant Xst:737"):
        path.write_text(f"fatal Xst:737 # a latch\n\n{line}\n")
        with pytest.raises(InputError, match="a code that is not there yet") as caught:
            treatments(path)
        assert caught.value.where == f"{path}:3"


WORDS = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=20)


@given(st.lists(st.tuples(st.sampled_from(("WARNING", "ERROR", "INFO")), WORDS), max_size=10))
def test_messages(entries: list[tuple[str, str]]) -> None:
    """Every warning of a log is found, counted by its text, whatever surrounds it."""
    log = "\n".join(f"{severity}:Xst:1 - {text.strip()}x\nnoise" for severity, text in entries)
    wanted = [f"{text.strip()}x" for severity, text in entries if severity == "WARNING"]
    found = messages("xst", log, "WARNING")
    assert [message.text for message in found] == list(dict.fromkeys(wanted))
    assert sum(message.times for message in found) == len(wanted)
