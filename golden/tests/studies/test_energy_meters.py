# SPDX-License-Identifier: Apache-2.0
"""Meters of energy, with a library and files in the place of NVML and RAPL."""

import subprocess
from math import inf

import pytest

from plenofir_studies.energy_meters import Meter, cpu_meter, gpu_meter, spent_by

NVML = """
#include <string.h>
static unsigned long long energy = 5000;
int nvmlInit_v2(void) { return 0; }
int nvmlDeviceGetHandleByPciBusId_v2(const char* at, void** device)
{
    *device = &energy;
    return strcmp(at, "0000:01:00.0") ? 6 : 0;
}
int nvmlDeviceGetTotalEnergyConsumption(void* device, unsigned long long* millijoules)
{
    *millijoules = *(unsigned long long*)device += 1500;
    return 0;
}
"""


@pytest.fixture
def nvml(tmp_path):
    """A library whose one GPU takes 1.5 J between two readings."""
    source, library = tmp_path / "nvml.c", tmp_path / "nvml.so"
    source.write_text(NVML)
    subprocess.run(["gcc", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    return str(library)


def test_a_gpu_s_energy_is_that_of_nvml(nvml):
    meter = gpu_meter("0000:01:00.0", nvml)
    assert isinstance(meter, Meter)
    assert meter.spent(meter.read(), meter.read()) == pytest.approx(1.5)
    assert gpu_meter("0000:02:00.0", nvml) == (
        "the GPU's energy is not known: nvmlDeviceGetHandleByPciBusId_v2 gives the error 6"
    )


def test_without_nvml_a_sentence_says_so():
    said = gpu_meter("0000:01:00.0", "libnone.so.1")
    assert said == "the GPU's energy is not known: libnone.so.1 of NVIDIA's driver is missing"
    # The library of C has none of its functions.
    assert "has no nvmlInit_v2" in str(gpu_meter("0000:01:00.0", "libc.so.6"))


def zone(folder, number, name, energy):
    there = folder / f"intel-rapl:{number}"
    there.mkdir()
    (there / "name").write_text(f"{name}\n")
    (there / "energy_uj").write_text(f"{energy}\n")
    (there / "max_energy_range_uj").write_text("10000000\n")
    return there / "energy_uj"


def test_a_processor_s_energy_is_that_of_all_packages(tmp_path):
    assert "has no package of RAPL" in str(cpu_meter(tmp_path))
    first = zone(tmp_path, 0, "package-0", 9_000_000)
    second = zone(tmp_path, 1, "package-1", 1_000_000)
    others = zone(tmp_path, 2, "psys", 3)
    meter = cpu_meter(tmp_path)
    assert isinstance(meter, Meter)
    before = meter.read()
    # One of the counters begins again.
    first.write_text("500000\n")
    second.write_text("3000000\n")
    others.write_text("4000000\n")
    assert meter.spent(before, meter.read()) == pytest.approx(1.5 + 2)
    second.write_text("none\n")
    assert str(cpu_meter(tmp_path)).startswith("the processor's energy is not known: ")


@pytest.mark.parametrize(("rate", "least", "most"), [(inf, 50, inf), (100, 8, 22)])
def test_frames_of_some_seconds_are_counted(rate, least, most):
    readings = iter([[1.0], [4.0]])
    waits: list[int] = []
    works: list[int] = []
    meter = Meter(lambda: next(readings), [inf])
    spent = spent_by(meter, lambda: works.append(1), lambda: waits.append(1), 0.2, rate)
    # One frame comes before the first reading.
    assert spent.frames == len(works) - 1
    assert least <= spent.frames <= most
    # Few frames may be under way.
    assert len(waits) >= (spent.frames if rate < inf else spent.frames // 32)
    assert spent.watts == pytest.approx(3 / spent.seconds)
    assert spent.seconds >= 0.2
