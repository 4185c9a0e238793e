# SPDX-License-Identifier: Apache-2.0
"""The benchmark of a GPU, as far as a CPU allows: with arrays of another library on it."""

from itertools import count
from math import inf

import array_api_strict
import numpy as np
import pytest

from plenofir.refocus.gpu import program
from plenofir_studies import gpu_counts, gpu_host, gpu_predicted, gpu_report
from plenofir_studies.energy_meters import Meter, cpu_meter
from plenofir_studies.report_parts import Report

_JOULES = count(0, 2)


def device(change=lambda x: x):
    """A device that is the CPU; `change` is what it does to results."""
    return gpu_report.Device(
        "array_api_strict",
        "a CPU",
        array_api_strict.asarray,
        lambda x: change(np.asarray(x)),
        lambda x: array_api_strict.asarray(x, copy=True),
        lambda: None,
        Meter(lambda: [float(next(_JOULES))], [inf]),
    )


def test_times_bandwidth_and_the_cpu_beside(tmp_path):
    timed = gpu_report.measure(device(), size=66, runs=2)
    assert {t.pixels for t in timed} == {"grey 8 bit", "RGB 8 bit", "grey 16 bit"}
    assert len(timed) == 20
    assert [t.work for t in timed[6:8]] == ["16 slices", "16 slices: depth and in focus"]
    assert timed[-1].frame_bytes == 66 * 66 * 2
    one = gpu_report.Timed("grey", "a' = 1", 2e-3, 10e-3, 1e-3, 10**7)
    assert one.gigabytes == pytest.approx(10)
    assert one.share == pytest.approx(0.5)
    report = Report(tmp_path, "gpu.md")
    gpu_report.add(report, device(), [one], 3201)
    assert "| grey | a' = 1 | 2.000 | 10 | 50 % | 10.00 | 5.0 |" in report.write().read_text()


def test_energy_of_a_pixel_is_what_the_meter_says_or_a_sentence():
    there = device()
    parts = [("a card", there.meter, there.put, there.wait), ("CPU", "no RAPL", None, None)]
    rows, reasons = gpu_report.energies(parts, size=22, seconds=0.05)
    assert reasons == ["no RAPL"]
    assert [name for name, *_ in rows] == [
        "a card, in a loop",
        "a card, one camera of 60 frames a second",
    ]
    # 2 J are taken between two readings.
    frames = 2e12 / (float(rows[1][2]) * 22**2)
    assert 1 <= round(frames) <= 4
    lines = gpu_predicted.answer(rows)
    assert any(line.startswith("| a card, in a loop | measured here: ") for line in lines)


def test_wrong_pictures_are_not_timed():
    with pytest.raises(ArithmeticError, match="not the CPU's picture"):
        gpu_report.measure(device(lambda x: x ^ 1), size=44, runs=1)


def test_what_cannot_run_is_named_in_a_line(tmp_path, capsys, monkeypatch):
    def predict():
        raise ModuleNotFoundError("No module named 'cuda'", name="cuda.bindings")

    monkeypatch.setattr(gpu_predicted, "predict", predict)
    text = gpu_report.write_report(
        tmp_path, gpus=["A has no GPU", "B is missing"], seconds=0.1
    ).read_text()
    assert "\nNot run on a GPU: A has no GPU; B is missing.\n" in text
    assert isinstance(cpu_meter(), Meter) or "\nNot measured: the processor's energy" in text
    assert "\nFrom the host's memory and back" in text
    assert "\nNothing: the package cuda is missing; pip install 'plenofir[gpu]'.\n" in text
    assert capsys.readouterr().out == "Not run on a GPU: A has no GPU; B is missing.\n"
    # Here, whatever is installed: a device or a reason for each library.
    assert len(list(gpu_report.devices())) == 2


def test_the_host_s_time_is_measured_without_a_gpu():
    seconds = gpu_host.host_seconds(3, 30, 2, rounds=1)
    assert len(seconds) == 5
    assert min(seconds.values()) > 0
    assert program.launches_of.cache_info().currsize == 0


LOOP = """
.global .align 4 .b8 table[8] = {3, 0, 0, 0, 5};

.visible .entry loop(
	.param .u64 loop_param_0,
	.param .u32 loop_param_1
)
{
	ld.param.u32 	%r1, [loop_param_1];
	mov.u32 	%r2, %tid.x;
	mov.u64 	%rd1, table;
	ld.global.u32 	%r3, [%rd1+4];
	setp.eq.s32 	%p2, %r2, 40;
	bar.red.or.pred 	%p3, 0, %p2;
	@!%p3 bra 	$L_1;
	@%p2 atom.shared.add.u32 	%r5, [shared+4], %r3;
	bar.sync 	0;
	ld.shared.u32 	%r4, [shared+4];

$L_1:
	add.s32 	%r2, %r2, %r4;
	setp.lt.s32 	%p1, %r2, %r1;
	@%p1 bra 	$L_1;

	ret;

}
"""


def test_instructions_of_a_loop_are_counted_by_hand():
    kernel = gpu_counts.Kernel(LOOP, "loop")
    # Only thread 40 votes for the barrier, and adds 5 to the memory's 0. Steps of 5 from
    # 0 and from 32 to 63 and beyond: 13 and 7 rounds of 3 instructions.
    assert kernel.executed((0, 63), (0, 0), 64, (1, 1)) == 2 * 11 + 3 * (13 + 7)
    # Memory has 2 already, so steps are of 7.
    assert kernel.executed((0, 63), (0, 0), 64, (1, 1), {4: 2}) == 2 * 11 + 3 * (9 + 5)


@pytest.mark.parametrize(
    ("operation", "given", "result"),
    [
        ("mul.hi.u32", [1 << 31, 6], 3),
        ("mul.wide.s32", [-2, 3], -6),
        ("mad.lo.s32", [7, 5, -36], -1),
        ("shr.s32", [-8, 1], -4),
        ("shr.u32", [-8, 1], (1 << 31) - 4),
        ("rem.s32", [-7, 3], -1),
        ("cvt.s64.s32", [0xFFFFFFFF], -1),
        ("setp.lt.and.u32", [1, -1, 1], 1),
        ("selp.b32", [4, 9, 0], 9),
    ],
)
def test_integers_of_ptx(operation, given, result):
    assert gpu_counts._result(operation.split("."), given) == result


def test_predictions_count_what_the_compiler_makes(monkeypatch):
    pytest.importorskip("cuda.bindings.nvrtc")
    monkeypatch.setattr(gpu_predicted, "SIZE", 242)
    stack, *depth = gpu_predicted.predict(242, 1, kinds=())
    # A pixel takes tens of instructions of a thread; depth needs lenses' sums and the picture.
    assert 10 < 32 * stack.instructions / stack.pixels < 200
    assert stack.moved_bytes == 2 * 242**2
    assert depth[0].instructions == depth[1].instructions > stack.instructions
    assert depth[1].seconds == pytest.approx(depth[1].instructions / gpu_predicted.TRIAL)
    lines = gpu_predicted.page(gpu_predicted.recorded_here([stack, *depth]))
    assert any(line.startswith("| 1 slices, grey, 8 bit | ") for line in lines)
    assert "us for a slice, " in lines[-1]
