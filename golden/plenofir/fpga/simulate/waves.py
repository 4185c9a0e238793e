# SPDX-License-Identifier: Apache-2.0
"""Waveforms of whole frames: which signals they hold, and how GTKWave shows them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from plenofir.fpga.core.engine import Scope, SignalKind
from plenofir.fpga.tools.dumps import Dump, canonical_name
from plenofir.fpga.tools.simulators import Waves
from plenofir.ground.errors import InputError


@dataclass(frozen=True)
class WaveSignal:
    """A signal in a waveform."""

    path: str  # ``/top/instance/signal``
    kind: SignalKind  # "bit", or a vector by the direction of its range


def wave_signals_of(top: str, scopes: Iterable[Scope]) -> tuple[WaveSignal, ...]:
    """A signal for each name; instances are within the top-level entity `top`."""
    return tuple(
        WaveSignal(f"/{top}/{scope}{name}", kind)
        for kind, scope, names in scopes
        for name in names.split()
    )


def named_waves(path: Path, signals: Iterable[WaveSignal]) -> Waves:
    """A waveform of some signals."""
    return Waves(path, tuple(signal.path for signal in signals))


def write_save_file(path: Path, dump: Path, signals: Sequence[WaveSignal]) -> None:
    """Write a GTKWave save file that shows signals of a waveform, grouped by instance.

    `dump` lies in the same folder. Simulators differ in whether names start with the top-level
    entity, so the names are looked up in it. InputError for a signal that is not in it.
    """
    held = {signal.canonical: signal for signal in Dump(dump).signals}
    lines = [f'[dumpfile] "{dump.name}"', "[timestart] 0", "*-22.0 0"]
    group = None
    for signal in signals:
        whole = signal.path.strip("/").replace("/", ".")
        inner = whole.partition(".")[2]
        match = held.get(canonical_name(whole)) or held.get(canonical_name(inner))
        if match is None:
            near = get_close_matches(canonical_name(inner), held, 1, cutoff=0)
            nearest = "; the nearest is " + ", ".join(near) if near else ""
            raise InputError(f"has no signal {signal.path}{nearest}", where=dump.name)
        name = match.name
        instance = whole.rpartition(".")[0]
        if instance != group:
            lines += ["@200", f"-{instance}"]
            group = instance
        last = match.width - 1
        ends = {"bit": "", "downto": f"[{last}:0]", "to": f"[0:{last}]"}[signal.kind]
        bounds = "[0]" if ends == "[0:0]" else ends
        # 28: one bit; 22: hexadecimal.
        lines += ["@28" if signal.kind == "bit" else "@22", name + bounds]
    path.write_text("\n".join(lines) + "\n")


def finish_waves(waves: Waves, signals: Sequence[WaveSignal]) -> None:
    """Write a save file beside a waveform of these signals, once a run has written it."""
    waves.path.with_suffix(".opt").unlink(missing_ok=True)
    if waves.signals:
        write_save_file(waves.path.with_suffix(".gtkw"), waves.path, signals)
