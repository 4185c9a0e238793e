# SPDX-License-Identifier: Apache-2.0
"""Hunt of `wishbone_bridge`: a rude Wishbone master before, any AXI4-Lite slave behind it."""

import random
from collections import deque
from collections.abc import Iterator
from typing import Any

from hunt.streams import FaultError, stalls

ENTITY = "wishbone_bridge"
FAULTS = [
    ("wishbone_bridge.vhd", "if wanted = '1' and request = '1' then", "if request = '1' then"),
    ("wishbone_bridge.vhd", "m_axi_wstrb    <= s_wb_sel;", "m_axi_wstrb    <= \"1111\";"),
    ("wishbone_bridge.vhd", "if m_axi_wready = '1' then", "if m_axi_awready = '1' then"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": {"ADDRESS_BITS": rng.randint(3, 16)}}


class Slave:
    """AXI4-Lite: takes each channel at any time, answers with OKAY or an error, some time later.

    Offers have to stay until they are taken; answers go out one at a time, as the bridge has one
    access under way.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(0)
        self.ready: dict[str, Iterator[bool]] = {c: iter(()) for c in ("aw", "w", "ar")}
        self.restart()

    def restart(self) -> None:
        self.shown = dict.fromkeys(("aw", "w", "ar"), 0)
        self.waits: dict[str, tuple[int, ...]] = {}
        self.got: dict[str, deque[tuple[int, ...]]] = {c: deque() for c in ("aw", "w", "ar")}
        # Accesses in order: (write, address, word, strobes, answer); the answer on offer.
        self.done: list[tuple[int, int, int, int, int]] = []
        self.due = -1
        for name in ("awready", "wready", "arready", "bvalid", "rvalid"):
            getattr(self.dut, f"m_axi_{name}").value = 0

    def value(self, name: str) -> int:
        text = str(getattr(self.dut, f"m_axi_{name}").value)
        if text.strip("01"):
            raise FaultError(f"{name} is {text}")
        return int(text, 2)

    def step(self, clock: int) -> None:
        fields = {"aw": ("awaddr",), "w": ("wdata", "wstrb"), "ar": ("araddr",)}
        for channel, names in fields.items():
            if self.value(f"{channel}valid"):
                offer = tuple(map(self.value, names))
                if self.waits.get(channel, offer) != offer:
                    raise FaultError(f"{channel}: {self.waits[channel]} became {offer}")
                if self.shown[channel]:
                    self.got[channel].append(offer)
                    self.waits.pop(channel, None)
                else:
                    self.waits[channel] = offer
            elif channel in self.waits:
                raise FaultError(f"{channel}: {self.waits[channel]} was withdrawn")
            self.shown[channel] = int(not next(self.ready[channel], False))
            getattr(self.dut, f"m_axi_{channel}ready").value = self.shown[channel]
        dut, rng = self.dut, self.rng
        dut.m_axi_bvalid.value = dut.m_axi_rvalid.value = 0
        if sum(map(len, self.got.values())) > 2:
            raise FaultError("a second access before the first is answered")
        writes = bool(self.got["aw"] and self.got["w"])
        if not writes and not self.got["ar"]:
            self.due = -1
            return
        if self.due < 0:
            self.due = rng.choice([0, 0, 1, rng.randint(0, 20)])
        if self.due > 0:
            self.due -= 1
            return
        self.due, answer, word = -1, rng.choice([0, 0, 2, 3]), rng.getrandbits(32)
        # What the other channel of answers shows is of no account.
        dut.m_axi_bresp.value, dut.m_axi_rresp.value = rng.randrange(4), rng.randrange(4)
        dut.m_axi_rdata.value = word
        if writes:
            (address,), (word, strobes) = self.got["aw"].popleft(), self.got["w"].popleft()
            dut.m_axi_bvalid.value, dut.m_axi_bresp.value = 1, answer
            self.done.append((1, address, word, strobes, answer))
        else:
            (address,) = self.got["ar"].popleft()
            dut.m_axi_rvalid.value, dut.m_axi_rresp.value = 1, answer
            self.done.append((0, address, word, 0, answer))


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.add(Slave(bench.dut))
    slave, bits = bench.ports[0], bench.design["generics"]["ADDRESS_BITS"] - 2
    slave.rng = random.Random(rng.random())
    slave.ready = {channel: stalls(rng) for channel in slave.ready}
    bench.set(s_wb_cyc=0, s_wb_stb=0, s_wb_we=0, s_wb_adr=0, s_wb_sel=0, s_wb_dat_w=0)
    await bench.reset(rng.choice([1, 1, 3]))
    begun: list[tuple[int, int, int, int]] = []
    for _ in range(rng.randint(20, 60)):
        write, place = rng.randrange(2), rng.getrandbits(bits)
        word, select = rng.getrandbits(32), rng.choice([0, 15, rng.randrange(16)])
        patience = rng.choice([10**4, 10**4, rng.randint(1, 8)])
        bench.counts["cycles: " + ("waits" if patience > 8 else "may give up")] += 1
        bench.set(s_wb_cyc=1, s_wb_stb=1, s_wb_we=write, s_wb_adr=place, s_wb_sel=select,
                  s_wb_dat_w=word)  # fmt: skip
        answered = False
        for _ in range(patience):
            await bench.clocks()
            ack, err = bench.number("s_wb_ack"), bench.number("s_wb_err")
            if not ack and not err:
                continue
            answered = True
            if ack and err:
                raise FaultError("ack and err together")
            done = slave.done[-1]
            want = (write, 4 * place, word if write else done[2], select if write else 0)
            if done[:4] != want:
                raise FaultError(f"{want} became {done}")
            if ack != (done[4] == 0):
                raise FaultError(f"ack is {ack} for the answer {done[4]}")
            if not write and ack and bench.number("s_wb_dat_r") != done[2]:
                raise FaultError(f"{bench.number('s_wb_dat_r'):#x} was read, want {done[2]:#x}")
            break
        if not answered and patience == 10**4:
            raise FaultError("a cycle is not answered")
        begun.append((write, 4 * place, word, select))
        # Back to back, with cyc kept, or with a rest.
        rest = rng.choice([0, 0, 1, rng.randint(1, 30)]) if answered else rng.choice([1, 1, 9])
        if rest:
            bench.set(s_wb_stb=0, s_wb_cyc=rng.randrange(2))
            for _ in range(rest):
                await bench.clocks()
                if bench.number("s_wb_ack") or bench.number("s_wb_err"):
                    raise FaultError("an answer to no request")
    bench.set(s_wb_stb=0, s_wb_cyc=0)
    await bench.clocks(40)
    writes = [done[:4] for done in slave.done if done[0]]
    if any(write not in begun for write in writes):
        raise FaultError("a write that nobody began")
