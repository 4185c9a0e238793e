# SPDX-License-Identifier: Apache-2.0
"""`make coverage` of a small entity: each way in which a statement can be missed."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from plenofir.fpga.tools.simulators import find_simulator
from plenofir_tb.tools import or_skip

measure = pytest.importorskip("measure_coverage", exc_type=ImportError)

ENTITY = """\
entity counted is
  generic (
    WIDE : boolean := false
  );
end entity counted;

architecture rtl of counted is

  signal step : natural := 0;
  signal tell : boolean;

begin

  step <= step + 1 after 1 ns when step < 3;

  follow : process (step) is
  begin

    if step = 2 then
      tell <= true;
    elsif step > 5 then
      tell <= false;
    end if;

  end process follow;

  wide_one : if WIDE generate
    tell <= false;
  end generate wide_one;

end architecture rtl;
"""
TOP = """\
entity two is
end entity two;

architecture rtl of two is

begin

  pair : for i in 0 to 1 generate
    one : entity work.counted;
  end generate pair;

end architecture rtl;
"""


def test_what_a_simulation_misses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with or_skip():
        nvc = find_simulator("nvc")
    sources = [tmp_path / "counted.vhd", tmp_path / "two.vhd"]
    for source, text in zip(sources, (ENTITY, TOP), strict=True):
        source.write_text(text)
    monkeypatch.setenv("NVC_COVERAGE", str(tmp_path))
    for top in ("counted", "two"):
        for command in nvc.build_commands(sources, top):
            nvc.run(command, tmp_path)
        nvc.run(nvc.run_command(top, {}), tmp_path)
    hits = measure.merged(tmp_path.glob("*.ncdb"))
    found = measure.vhdl_files(hits, sources)[sources[0]]
    lines = ENTITY.splitlines()
    never = {lines.index("      tell <= false;") + 1, lines.index("    tell <= false;") + 1}
    # In three instances the same; one way of the elsif, which counts at the if.
    assert found.missed == never
    assert found.missed_statements == 2
    assert found.missed_branches == {lines.index("    if step = 2 then") + 1: {"BIN_TRUE"}}
    assert found.statements > 4


def test_a_nameless_part_counts_once_whatever_its_number() -> None:
    # NVC counts them behind what it has folded away, which differs from instance to instance.
    found = [
        dict(
            measure.items(
                ElementTree.fromstring(
                    f'<scope block_name="COUNTED-RTL"><scope name="{name}" line="7">'
                    '<statement data="1"/></scope></scope>'
                )
            )
        )
        for name in ("_S0", "_S12", "_s1")
    ]
    assert found[0] == found[1] == found[2]
    assert [key[:2] for key in found[0]] == [("counted", 7)]


def test_ranges_of_lines() -> None:
    assert measure.ranges([1, 2, 3, 7, 9, 10]) == "1-3, 7, 9-10"
    assert measure.share(999_999, 1_000_000) == "99.9 %"
