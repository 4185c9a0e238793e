# SPDX-License-Identifier: Apache-2.0
"""Hunt of `text_overlay`: pictures smaller than the text, any font and number of slices."""

import random
from typing import Any

from hunt.rasters import Mode, draw_mode, frames
from hunt.references.overlay import drawn, place
from hunt.streams import FaultError

ENTITY = "text_overlay"
FAULTS = [
    ("text_overlay.vhd", "(OVERLAY_ROWS + MARGIN)", "(OVERLAY_ROWS + MARGIN + 1)"),
    ("overlay_pkg.vhd", "return MOST;", "return slices * label_columns;"),
]  # fmt: skip
# Steps from writing a pixel to reading it: a latency of five clocks, and one for the write.
LATENCY = 6
LETTERS = "".join(chr(code) for code in range(32, 127) if chr(code) not in '"%')


def draw(rng: random.Random) -> dict[str, Any]:
    slices = rng.choice([1, 2, 3, rng.randint(1, 12), 64])
    texts = rng.choice([1, 2, 5, rng.randint(1, 20)])
    labels = rng.choice([2, 3, rng.randint(2, 16), 8 if slices == 64 else 4])
    generics = {
        "SLICES": slices,
        "FONT": "".join(rng.choice("0123456789abcdef") for _ in range(95 * 32)),
        "TEXTS": "".join(rng.choice(LETTERS) for _ in range((slices + 3) * texts)),
        "TEXT_COLUMNS": texts,
        "LABELS": "".join(rng.choice(LETTERS) for _ in range(slices * labels)),
        "LABEL_COLUMNS": labels,
        "COLOURS": "".join(f"{rng.getrandbits(24):06x}" for _ in range(rng.choice([0, slices]))),
    }
    return {"generics": generics}


class Screen:
    """Video in, and all outputs."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.outs = [getattr(dut, f"out_{n}") for n in ("active", "h_sync", "v_sync", "pixel")]
        self.restart()

    def restart(self) -> None:
        self.queue: list[tuple[int, int, int, int]] = []
        self.got: list[list[str]] = []

    def step(self, clock: int) -> None:
        self.got.append([str(port.value) for port in self.outs])
        if self.queue:
            now = self.queue.pop(0)
            for name, value in zip(("active", "h_sync", "v_sync", "pixel"), now, strict=True):
                getattr(self.dut, f"in_{name}").value = value


def settings(rng: random.Random, slices: int) -> dict[str, int]:
    return {
        **{"show": int(rng.random() < 0.9), "bottom": rng.randrange(2)},
        **{"slice": rng.choice([rng.randrange(slices + 1), rng.randrange(256)])},
        **{"kind": rng.randrange(3), "raw": int(rng.random() < 0.2)},
        "errors": rng.choice([0, 9, 10, 31, rng.randrange(32)]),
    }


def wanted(g: dict[str, Any], mode: Mode, sent: tuple[int, int, int, int], clock: int,
           now: dict[str, int]) -> int:  # fmt: skip
    """The pixel of a clock of a frame."""
    y, x = divmod(clock % mode.total, mode.line)
    at = place(g, mode.v[0], y, x, bottom=now["bottom"]) if sent[0] and now["show"] else None
    if at is None:
        return sent[3]
    told = {name: now[name] for name in ("kind", "raw", "errors")}
    return drawn(g, *at, sent[3], slice_=now["slice"], **told)


async def stream(bench: Any, rng: random.Random) -> None:
    g = bench.design["generics"]
    if not bench.ports:
        names = ("active", "h_sync", "v_sync", "pixel")
        bench.set(**dict.fromkeys((f"in_{name}" for name in names), 0), reset=1, show=0)
        bench.set(bottom=0, slice=0, kind=0, raw=0, errors=0, rows=0)
        await bench.clocks(12)
        bench.add(Screen(bench.dut))
    screen = bench.ports[0]
    most = 8 * max(g["TEXT_COLUMNS"] + 11, g["SLICES"] * g["LABEL_COLUMNS"]) + 12
    width = rng.choice([rng.randint(1, 12), rng.randint(1, 70), min(most, rng.randint(100, 300))])
    mode = draw_mode(rng, (width, width))
    rows = rng.choice([rng.randint(1, 9), rng.randint(30, 52), rng.randint(1, 60)])
    mode = Mode(mode.h, (rows, *mode.v[1:]), mode.h_level, mode.v_level)
    bench.counts["pictures: lower than the text" if rows < 48 else "pictures: higher"] += 1
    bench.counts["pictures: narrower than the text"] += mode.h[0] < most - 4
    await bench.reset(rng.choice([1, 1, 3]))
    bench.set(rows=rows, show=0)
    now = {**settings(rng, g["SLICES"]), "show": 0}
    for number in range(rng.choice([2, 3])):
        sent = frames(mode, 1, rng)
        following = settings(rng, g["SLICES"])
        # Settings of the next frame are made in the blanking before vertical sync.
        last = rows * mode.line + 1
        screen.queue += sent[:last]
        screen.got.clear()
        if number and rng.random() < 0.15:
            bench.counts["reset inside"] += 1
            await bench.clocks(rng.randint(1, last))
            return
        await bench.clocks(last + LATENCY)
        names = ("show", "bottom", "slice", "kind", "raw", "errors")
        bench.set(**{name: following[name] for name in names})
        compare(screen.got[LATENCY:], sent[:last], g, mode, now)
        screen.queue += sent[last:]
        await bench.clocks(len(sent) - last)
        now = following


def compare(got: list[list[str]], sent: list[tuple[int, int, int, int]], g: dict[str, Any],
            mode: Mode, now: dict[str, int]) -> None:  # fmt: skip
    for clock, (one, other) in enumerate(zip(got, sent, strict=False)):
        want = (*other[:3], wanted(g, mode, other, clock, now))
        texts = [*map(str, want[:3]), f"{want[3]:024b}"]
        # In the blanking any pixel may come where the text is.
        if one[:3] != texts[:3] or (other[0] and one[3] != texts[3]):
            y, x = divmod(clock, mode.line)
            raise FaultError(f"line {y}, {x}: got {one}, want {texts}; {now}")
