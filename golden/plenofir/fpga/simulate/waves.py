# SPDX-License-Identifier: Apache-2.0
"""Waveforms of whole frames: which signals they hold, and how GTKWave shows them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from plenofir.fpga.core.engine import SignalKind
from plenofir.fpga.simulate.dumps import Dump


@dataclass(frozen=True)
class WaveSignal:
    """A signal in a waveform."""

    path: str  # ``/top/instance/signal``
    kind: SignalKind  # "bit", or a vector by the direction of its range


def write_save_file(path: Path, dump: Path, signals: Sequence[WaveSignal]) -> None:
    """Write a GTKWave save file that shows signals of a waveform, grouped by instance.

    `dump` lies in the same folder. Simulators differ in whether names start with the top-level
    entity, so the names are looked up in it; signals that the simulator did not write are left
    out.
    """
    widths = {signal.name: signal.width for signal in Dump(dump).signals}
    lines = [f'[dumpfile] "{dump.name}"', "[timestart] 0", "*-22.0 0"]
    group = None
    for signal in signals:
        whole = signal.path.strip("/").replace("/", ".")
        name = whole if whole in widths else whole.partition(".")[2]
        if name not in widths:
            continue
        instance = whole.rpartition(".")[0]
        if instance != group:
            lines += ["@200", f"-{instance}"]
            group = instance
        last = widths[name] - 1
        ends = {"bit": "", "downto": f"[{last}:0]", "to": f"[0:{last}]"}[signal.kind]
        bounds = "[0]" if ends == "[0:0]" else ends
        # 28: one bit; 22: hexadecimal.
        lines += ["@28" if signal.kind == "bit" else "@22", name + bounds]
    path.write_text("\n".join(lines) + "\n")
