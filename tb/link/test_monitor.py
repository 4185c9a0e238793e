# SPDX-License-Identifier: Apache-2.0
"""The reader of the monitor's EDID, against a device with faults."""

from plenofir_tb.runner import Case, run_cases


def test_monitor_edid() -> None:
    times = {"quarter": 3, "stretch": 100, "pause": 300}
    cases: dict[str, dict[str, int]] = {"monitor_edid": times, "timing_rate": {}}
    run_cases(
        [
            Case(
                entity,
                "link.monitor_bench",
                {name.upper(): clocks for name, clocks in own.items()},
                {"entity": entity, **own},
            )
            for entity, own in cases.items()
        ],
        long=True,
    )
