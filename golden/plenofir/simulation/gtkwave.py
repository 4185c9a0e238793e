"""GTKWave save files."""

import re
from collections.abc import Sequence
from pathlib import Path


def write_save_file(path: Path, dump: str, signals: Sequence[str]) -> None:
    """Write a GTKWave save file that shows signals, grouped by instance.

    Parameters
    ----------
    path
        Save file to write (``.gtkw``).
    dump
        Name of the waveform file beside it.
    signals
        Hierarchical names, ``/top/instance/signal``.
    """
    lines = [f'[dumpfile] "{dump}"', "[timestart] 0", "[color] 0"]
    group = None
    for signal in signals:
        instance, _, name = signal.strip("/").replace("/", ".").rpartition(".")
        if instance != group:
            lines += ["@200", f"-{instance}"]
            group = instance
        # 22: hexadecimal, right justified; 28: one bit.
        lines += ["@28" if re.search(r"(clk|reset|valid|ready|last|strobe|restart)$", name) else "@22"]
        lines += [f"{instance}.{name}"]
    path.write_text("\n".join(lines) + "\n")
