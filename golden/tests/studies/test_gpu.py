# SPDX-License-Identifier: Apache-2.0
"""The benchmark of a GPU, as far as a CPU allows: with arrays of another library on it."""

import array_api_strict
import numpy as np
import pytest

from plenofir_studies import gpu_report
from plenofir_studies.report_parts import Report


def device(change=lambda x: x):
    """A device that is the CPU; `change` is what it does to results."""
    return gpu_report.Device(
        "array_api_strict",
        "a CPU",
        array_api_strict.asarray,
        lambda x: change(np.asarray(x)),
        lambda x: array_api_strict.asarray(x, copy=True),
        lambda: None,
    )


def test_times_bandwidth_and_the_cpu_beside(tmp_path):
    timed = gpu_report.measure(device(), size=66, runs=2)
    assert {t.pixels for t in timed} == {"grey 8 bit", "RGB 8 bit", "grey 16 bit"}
    assert len(timed) == 18
    assert timed[-1].frame_bytes == 66 * 66 * 2
    one = gpu_report.Timed("grey", "a' = 1", 2e-3, 10e-3, 1e-3, 10**7)
    assert one.gigabytes == pytest.approx(10)
    assert one.share == pytest.approx(0.5)
    report = Report(tmp_path, "gpu.md")
    gpu_report.add(report, device(), [one], 3201)
    assert "| grey | a' = 1 | 2.000 | 10 | 50 % | 10.00 | 5.0 |" in report.write().read_text()


def test_wrong_pictures_are_not_timed():
    with pytest.raises(ArithmeticError, match="not the CPU's picture"):
        gpu_report.measure(device(lambda x: x ^ 1), size=44, runs=1)


def test_what_cannot_run_is_named_in_a_line(tmp_path, capsys):
    text = gpu_report.write_report(tmp_path, gpus=["A has no GPU", "B is missing"]).read_text()
    assert "\nNot run on a GPU: A has no GPU; B is missing.\n" in text
    assert capsys.readouterr().out == "Not run on a GPU: A has no GPU; B is missing.\n"
    # Here, whatever is installed: a device or a reason for each library.
    assert len(list(gpu_report.devices())) == 2
