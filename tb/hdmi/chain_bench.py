"""cocotb tests of the whole board: serial TMDS bits in, refocused, serial TMDS bits out."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import Timer

from plenofir.fpga.hdmi.colour import to_full_range_rgb, way_of
from plenofir.fpga.hdmi.link import Packed, ReceivedFrame, encode_frames
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.hdmi.packets import AviInfo, ColourSpace
from plenofir.fpga.hdmi.script import Code, Command, pixel_period
from plenofir.fpga.hdmi.status import parse_status
from plenofir.refocus import ExactArithmetic
from plenofir_tb.case import read_case
from plenofir_tb.serial import SKEWS, SerialLink, last_frames
from plenofir_tb.sources import LIMITED_YCBCR, MODE_HDMI, RGB, hdmi_source
from plenofir_tb.video import MODE_720, light_field, measured

CASE = read_case()
# What the documentation states: the clocks are up after LOCK_US (with the meter's window of this
# bench), then the frame under way and two whole ones go by.
LOCK_US = 100
LOCK_FRAMES = 4

MODE_VGA = VideoMode(
    name="vga",
    pixel_clock=25_175,
    h_active=32,
    h_front=2,
    h_sync=6,
    h_back=3,
    v_active=24,
    v_front=1,
    v_sync=2,
    v_back=3,
    h_positive=False,
    v_positive=False,
)


def signal(mode: VideoMode) -> list[Command]:
    """Commands that start a source."""
    return [pixel_period(mode), Command(Code.CLOCK, 1)]


class Bench:
    """Source, board and monitor.

    Parameters
    ----------
    dut
        The entity ``hdmi_bench``.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.link = SerialLink(dut)
        self.rng = np.random.default_rng(cocotb.RANDOM_SEED)
        self.random = random.Random(cocotb.RANDOM_SEED)

    def pictures(self, mode: VideoMode, count: int) -> list[np.ndarray]:
        """Random pictures for a mode."""
        shape = (count, mode.v_active, mode.h_active, 3)
        return list(self.rng.integers(0, 256, shape, np.uint8))

    def golden(self, picture: np.ndarray, slice_: int = 0, info: AviInfo = RGB) -> np.ndarray:
        """What the board must make of a picture."""
        rgb = to_full_range_rgb(picture, way_of(info))
        return ExactArithmetic().refocus(rgb, CASE["m"], shift=CASE["shifts"][slice_])

    def led(self) -> int:
        """Light-emitting diodes, LED 0 in bit 0."""
        return int(self.dut.led.value)

    def lost_frames(self, mode: VideoMode) -> int:
        """Frames that may go by between a new signal and the first refocused frame."""
        frame_us = 1000 * mode.h_total * mode.v_total / mode.pixel_clock
        return int(np.ceil(LOCK_US / frame_us)) + LOCK_FRAMES

    async def relock(
        self, mode: VideoMode, script: list[Command | Packed], info: AviInfo | None = None
    ) -> list[ReceivedFrame]:
        """Send a script, then frames: the first whole frame that is not black must be right.

        The source is one of DVI, or one of HDMI that tells of its pictures. Returns the frames from
        the first right one on.
        """
        lost = self.lost_frames(mode)
        frames = self.pictures(mode, lost + 3)
        source = hdmi_source(info) if info else encode_frames
        taken = await self.link.play([*script, *signal(mode), source(mode, frames)])
        got = last_frames(taken, mode.h_total)
        assert got, "no picture"
        assert got[-1].mode == measured(mode)
        shown = [frame for frame in got if frame.pixels.any()]
        assert shown, "nothing but black"
        # Black frames come before the picture, never between.
        assert all(frame.pixels.any() for frame in got[-len(shown) :])
        wanted = [self.golden(frame, info=info or RGB) for frame in frames]
        first = next(
            (i for i, want in enumerate(wanted) if np.array_equal(shown[0].pixels, want)), None
        )
        assert first is not None, "the first frame is wrong"
        assert first <= lost, f"first frame {first}, {lost} may be lost"
        for frame, want in zip(shown, wanted[first:], strict=False):
            assert np.array_equal(frame.pixels, want)
        # The last frame has not come out as a whole.
        assert len(shown) >= len(frames) - first - 2
        return shown


@cocotb.test()
async def phases_and_skews(dut: Any) -> None:
    """Each channel at all word phases, channels up to several pixels apart."""
    bench = Bench(dut)
    await bench.link.reset()
    bit_ps = 1e9 / MODE_720.pixel_clock / 10
    for base in CASE["phases"]:
        phases = [(base + 3 * c) % 10 + 10 * bench.random.randrange(4) for c in range(3)]
        skews = [
            Command(SKEWS[c], round((phase + bench.random.random()) * bit_ps))
            for c, phase in enumerate(phases)
        ]
        await bench.relock(MODE_720, skews)
        assert bench.led() & 0x1F == 0x1F, f"LEDs {bench.led():08b}"


@cocotb.test()
async def jitter(dut: Any) -> None:
    """Edges that are off by a quarter of a bit either way, and a clock lane out of phase."""
    bench = Bench(dut)
    await bench.link.reset()
    bit_ps = 1e9 / MODE_720.pixel_clock / 10
    script = [
        Command(Code.JITTER, round(bit_ps / 4)),
        Command(Code.CLOCK_SKEW, round(bench.random.random() * 10 * bit_ps)),
    ]
    await bench.relock(MODE_720, [*script])


@cocotb.test()
async def wrong_words(dut: Any) -> None:
    """Words in a picture that no encoder sends: an error, and the picture goes on."""
    bench = Bench(dut)
    await bench.link.reset()
    lost = bench.lost_frames(MODE_720)
    words = encode_frames(MODE_720, bench.pictures(MODE_720, lost + 4))
    begin = (lost + 2) * MODE_720.h_total * MODE_720.v_total
    # Four ones, and no inversion where there ought to be one.
    words[begin + 9] = words[begin + 9] & ~np.uint32(0x3FF) | np.uint32(0x00F)
    await bench.link.play([*signal(MODE_720), words])
    assert bench.led() & 0x3F == 0x3F, f"LEDs {bench.led():08b}"


@cocotb.test()
async def modes_change(dut: Any) -> None:
    """Between the two settings of the PLLs, back and forth, in the middle of frames."""
    bench = Bench(dut)
    await bench.link.reset()
    for mode in (MODE_VGA, MODE_720, MODE_VGA):
        await bench.relock(mode, [])
        assert bench.led() & 0x1F == 0x1F
        part = encode_frames(mode, bench.pictures(mode, 1))
        await bench.link.play([part[: bench.random.randrange(len(part))]])


@cocotb.test()
async def hdmi_and_dvi(dut: Any) -> None:
    """A source goes from HDMI to DVI and to HDMI in other colours, and no frame is lost."""
    bench = Bench(dut)
    await bench.link.reset()
    frames = bench.pictures(MODE_HDMI, bench.lost_frames(MODE_HDMI) + 8)
    first, second = len(frames) - 6, len(frames) - 4
    words = [
        hdmi_source(AviInfo(format_code=1))(MODE_HDMI, frames[:first]),
        encode_frames(MODE_HDMI, frames[first:second]),
        hdmi_source(LIMITED_YCBCR)(MODE_HDMI, frames[second:]),
    ]
    taken = await bench.link.play([*signal(MODE_HDMI), *words])
    got = last_frames(taken, MODE_HDMI.h_total)
    # All but the last frame, which has not come out as a whole.
    assert len(got) >= 7
    for number, frame in zip(range(len(frames) - 2, -1, -1), got[::-1], strict=False):
        info = LIMITED_YCBCR if number >= second else RGB
        # In the first lines of other colours nobody has told of them.
        if number != second:
            assert np.array_equal(frame.pixels, bench.golden(frames[number], info=info)), number
        assert frame.mode == measured(MODE_HDMI)


@cocotb.test(skip=not CASE["thorough"])
async def hdmi_modes_change(dut: Any) -> None:
    """DVI and HDMI between the settings of the PLLs, in the middle of frames."""
    bench = Bench(dut)
    await bench.link.reset()
    slow = MODE_HDMI.model_copy(update={"pixel_clock": 25_175, "h_positive": False})
    sources: list[tuple[VideoMode, AviInfo | None]] = [
        (MODE_HDMI, AviInfo(format_code=4)),
        (MODE_VGA, None),
        (MODE_HDMI, LIMITED_YCBCR),
        (slow, AviInfo(ColourSpace.YCBCR_444, format_code=1, ycc_range=1)),
        (MODE_720, None),
        (slow, AviInfo(ColourSpace.YCBCR_422, format_code=1)),
    ]
    for mode, info in sources:
        await bench.relock(mode, [], info)
        assert bench.led() & 0x1F == 0x1F
        source = hdmi_source(info) if info else encode_frames
        part = source(mode, bench.pictures(mode, 1))
        await bench.link.play([part[: bench.random.randrange(len(part))]])


@cocotb.test(skip=not CASE["thorough"])
async def hdmi_bit_errors(dut: Any) -> None:
    """Random bit errors with islands: pictures without any are right, the raster stays."""
    await spoilt_frames(Bench(dut), MODE_HDMI, LIMITED_YCBCR)


@cocotb.test()
async def clock_lost_and_back(dut: Any) -> None:
    """The clock lane stands still for a while: the LED goes out, then all comes back."""
    bench = Bench(dut)
    await bench.link.reset()
    await bench.relock(MODE_720, [])
    part = encode_frames(MODE_720, bench.pictures(MODE_720, 1))[: bench.random.randrange(1300)]
    await bench.link.play([part, Command(Code.CLOCK, 0), Command(Code.WAIT, 100_000)])
    assert bench.led() & 0x1F == 0, f"LEDs {bench.led():08b}"
    await bench.relock(MODE_720, [])


@cocotb.test()
async def cable_pulled(dut: Any) -> None:
    """Pulled in the middle of a frame, and plugged again somewhere in another one."""
    bench = Bench(dut)
    await bench.link.reset()
    await bench.relock(MODE_720, [])
    part = encode_frames(MODE_720, bench.pictures(MODE_720, 1))[: bench.random.randrange(1300)]
    open_part = encode_frames(MODE_720, bench.pictures(MODE_720, 4))
    await bench.link.play([part, Command(Code.CABLE, 0), open_part])
    assert bench.led() & 0x1F == 0
    rest = encode_frames(MODE_720, bench.pictures(MODE_720, 1))[bench.random.randrange(1300) :]
    await bench.relock(MODE_720, [Command(Code.CABLE, 1), rest])


@cocotb.test()
async def data_lost_while_the_clock_runs(dut: Any) -> None:
    """Data lanes stand still, the clock runs: channels are lost, the monitor gets black frames."""
    bench = Bench(dut)
    await bench.link.reset()
    await bench.relock(MODE_720, [])
    # Long enough for the alignment to be given up.
    quiet = np.zeros(9 * MODE_720.h_total * MODE_720.v_total, np.uint32)
    black = last_frames(await bench.link.play([quiet]), MODE_720.h_total)
    assert black, "the monitor lost its signal"
    assert all(frame.mode == measured(MODE_720) for frame in black)
    assert bench.led() & 0x1F == 0x01, f"LEDs {bench.led():08b}"
    await bench.relock(MODE_720, [])


@cocotb.test()
async def open_clock_input(dut: Any) -> None:
    """An open input that oscillates starts nothing; a source is followed then."""
    bench = Bench(dut)
    await bench.link.reset()
    await bench.link.play([Command(Code.OPEN_CLOCK, 200_000)])
    assert bench.led() & 0x1F == 0
    status = parse_status(await ask(dut, "?"))
    assert status["present"] == status["running"] == status["restarts"] == (0,)
    await bench.relock(MODE_720, [])


async def faulty_delay_lines(dut: Any, seed: int, recovery_us: float) -> None:
    """Let delay lines go wrong for some frames; right again within a time behind the last fault."""
    bench = Bench(dut)
    await bench.link.reset()
    dut._log.info("seed of the faults: %d", seed)
    during = encode_frames(MODE_720, bench.pictures(MODE_720, 8))
    frame_us = 1000 * MODE_720.h_total * MODE_720.v_total / MODE_720.pixel_clock
    lost = bench.lost_frames(MODE_720) + int(np.ceil(recovery_us / frame_us))
    frames = bench.pictures(MODE_720, lost + 3)
    taken = await bench.link.play(
        [
            *(Command(Code.DELAY_FAULTS, seed), *signal(MODE_720), during),
            *(Command(Code.DELAY_FAULTS, 0), encode_frames(MODE_720, frames)),
        ]
    )
    got = last_frames(taken, MODE_720.h_total)
    assert len(got) >= 2
    # The last frame has not come out as a whole.
    for frame, picture in zip(got[::-1], frames[-2 : lost - 1 : -1], strict=False):
        assert np.array_equal(frame.pixels, bench.golden(picture))
    assert bench.led() & 0x1F == 0x1F, f"LEDs {bench.led():08b}"
    status = parse_status(await ask(dut, "?"))
    assert any(status["hung"])
    assert status["tracking"] == (7,)
    assert bool(status["restarts"][0]) == bool(seed % 2)


@cocotb.test()
async def delay_lines_hang(dut: Any) -> None:
    """Delay lines hang, ignore and answer late; a reset of the delay brings them back."""
    seed = 2 * random.Random(cocotb.RANDOM_SEED).randrange(1, 1 << 20)
    await faulty_delay_lines(dut, seed, 2 * 1023 / 148.5)


@cocotb.test()
async def delay_lines_hang_until_a_restart(dut: Any) -> None:
    """Only a restart of the receiver's clocks brings them back: the supervisor does it."""
    seed = 2 * random.Random(cocotb.RANDOM_SEED).randrange(1 << 20) + 1
    await faulty_delay_lines(dut, seed, CASE["patience_us"] + LOCK_US)


async def spoilt_frames(bench: Bench, mode: VideoMode, info: AviInfo | None) -> None:
    """Send random bit errors in three frames, anywhere, also in the blanking."""
    await bench.link.reset()
    lost = bench.lost_frames(mode)
    frames = bench.pictures(mode, lost + 9)
    words = (hdmi_source(info) if info else encode_frames)(mode, frames)
    total = mode.h_total * mode.v_total
    hit: set[int] = set()
    for _ in range(40):
        at = bench.random.randrange((lost + 2) * total, (lost + 5) * total)
        words[at] ^= np.uint32(1 << bench.random.randrange(30))
        hit.add(at // total)
    got = last_frames(await bench.link.play([*signal(mode), words]), mode.h_total)
    assert got[-1].mode == measured(mode)
    # No frame is missing between the last one, which has not come out whole, and the first.
    begin = len(frames) - 2 - len(got) + 1
    assert begin <= lost
    for i, (frame, shown) in enumerate(zip(frames[begin:], got, strict=False)):
        if begin + i not in hit:
            want = bench.golden(frame, info=info or RGB)
            assert np.array_equal(shown.pixels, want), f"frame {begin + i}"
    assert bench.led() & 0x3F == 0x3F, f"LEDs {bench.led():08b}"


@cocotb.test()
async def bit_errors(dut: Any) -> None:
    """Random bit errors: told by the LED, pictures without any are right, the raster stays."""
    bench = Bench(dut)
    await spoilt_frames(bench, MODE_720, None)
    # That no frame follows is an error too, a little later.
    await Timer(2, "us")
    dut.button_clear.value = 1
    await Timer(2, "us")
    dut.button_clear.value = 0
    await Timer(2, "us")
    assert not bench.led() & 0x20, "the error LED stays lit"


async def uart_send(dut: Any, text: str) -> None:
    """Send characters to the board."""
    bit_ns = 10 * CASE["bit_clocks"]
    for code in text.encode():
        for bit in (0, *(code >> i & 1 for i in range(8)), 1):
            dut.uart_rx.value = bit
            await Timer(bit_ns, "ns")


async def uart_line(dut: Any) -> str:
    """Receive one line from the board."""
    bit_ns = 10 * CASE["bit_clocks"]
    text = ""
    for _ in range(400):
        for _ in range(10_000):
            if not int(dut.uart_tx.value):
                break
            await Timer(bit_ns / 10, "ns")
        else:
            raise AssertionError(f"no answer behind {text!r}")
        code = 0
        await Timer(bit_ns / 2, "ns")
        for i in range(8):
            await Timer(bit_ns, "ns")
            code |= int(dut.uart_tx.value) << i
        await Timer(bit_ns, "ns")
        assert int(dut.uart_tx.value), "no stop bit"
        text += chr(code)
        if text.endswith("\r\n"):
            return text.strip()
    raise AssertionError(text)


async def ask(dut: Any, text: str) -> str:
    """Send a command and receive its answer."""
    answer = cocotb.start_soon(uart_line(dut))
    await uart_send(dut, text + "\r\n")
    return await answer


@cocotb.test()
async def commands_and_status(dut: Any) -> None:
    """The serial port: status before and with a signal of HDMI, pass-through, errors."""
    bench = Bench(dut)
    await bench.link.reset()
    status = parse_status(await ask(dut, "?"))
    assert status["slices"] == (len(CASE["shifts"]),)
    for name in ("present", "running", "tracking", "aligned", "following", "rate"):
        assert status[name] == (0,), name
    # Both data channels are joined in the bench, so the monitor is the board itself.
    while not status["monitor"][0]:
        await Timer(100, "us")
        status = parse_status(await ask(dut, "?"))
    assert status["monitor"] == (1,)
    assert status["monitor_mode"] == (640, 480, 599)
    assert status["monitor_ok"] == (0,)
    assert status["edid"][0] >= 128
    assert await ask(dut, "c") == "ok"
    mode = MODE_HDMI
    await bench.relock(mode, [], LIMITED_YCBCR)
    # While the phase is found a word may be wrong.
    assert await ask(dut, "c") == "ok"
    # The clock goes on while the answer comes.
    frames = bench.pictures(mode, 28)
    asking = cocotb.start_soon(ask(dut, "?"))
    await bench.link.play([hdmi_source(LIMITED_YCBCR)(mode, frames)])
    status = parse_status(await asking)
    window_us = CASE["meter_window"] / 100
    wanted = {
        **dict.fromkeys(("present", "running", "following", "hsync", "vsync", "hdmi", "avi"), 1),
        **dict.fromkeys(("unsupported", "restarts", "slice", "sweep", "pass"), 0),
        "tracking": 7,
        "aligned": 7,
        "colour": ColourSpace.YCBCR_444,
        "limited": 1,
        "vic": 4,
        "columns": mode.h_active,
        "rows": mode.v_active,
    }
    for name, value in wanted.items():
        assert status[name] == (value,), f"{name}={status[name]}"
    # The bench's blanking between scripts tears the raster.
    assert not status["errors"][0] & ~0b110
    assert status["packet_errors"] == (0, 0)
    assert status["hung"] == status["word_errors"] == (0, 0, 0)
    assert all(abs(taps) < 10 for taps in status["taps"])
    # Both meters count in units of their window.
    assert abs(status["clock"][0] - mode.pixel_clock / 1000 * window_us / 16) <= 1
    # A division takes longer than one of these frames, and one more may begin with a torn one.
    unit_us = window_us / 160
    frame_us = 1000 * mode.h_total * mode.v_total / mode.pixel_clock
    await Timer(250, "us")
    status = parse_status(await ask(dut, "?"))
    assert abs(status["rate"][0] / (1e7 * unit_us / frame_us) - 1) < 0.1
    assert await ask(dut, "p 1") == "ok"
    assert await ask(dut, "p 2") == "error"
    assert await ask(dut, "x") == "error"
    assert await ask(dut, "s") == "error"
    assert await ask(dut, "s 256") == "error"
    assert await ask(dut, f"s {len(CASE['shifts'])}") == "error"


async def press(button: Any) -> None:
    """Press and release a button."""
    for level in (1, 0):
        button.value = level
        await Timer(2, "us")


@cocotb.test()
async def focus_is_stepped(dut: Any) -> None:
    """Slices by buttons, around both ends, by the serial port, and in a sweep; no frame is lost."""
    bench = Bench(dut)
    await bench.link.reset()
    await bench.relock(MODE_720, [])
    slices = len(CASE["shifts"])
    shown = 0
    steps = [(dut.button_down, -1), (dut.button_up, 1), (dut.button_up, 1)] if slices > 1 else []
    for button, step in steps:
        await press(button)
        shown = (shown + step) % slices
        assert bench.led() >> 6 == shown & 3
        frames = bench.pictures(MODE_720, 5)
        taken = await bench.link.play([encode_frames(MODE_720, frames)])
        got = last_frames(taken, MODE_720.h_total)
        # The bench's blanking tears the raster; the last frame has not come out as a whole.
        want = bench.golden(frames[-2], shown)
        assert np.array_equal(got[-1].pixels, want)
        assert not np.array_equal(want, bench.golden(frames[-2], (shown + 1) % slices))
    assert await ask(dut, "s 0") == "ok"
    assert bench.led() >> 6 == 0
    assert await ask(dut, "w 1") == "ok"
    frames = bench.pictures(MODE_720, slices + 5)
    taken = await bench.link.play([encode_frames(MODE_720, frames)])
    got = last_frames(taken, MODE_720.h_total)[-slices:]
    order = []
    for frame, picture in zip(got, frames[-slices - 1 :], strict=False):
        fits = [s for s in range(slices) if np.array_equal(frame.pixels, bench.golden(picture, s))]
        assert len(fits) == 1, "a frame of a sweep is wrong"
        order += fits
    assert order == [(order[0] + i) % slices for i in range(slices)]


@cocotb.test()
async def passed_through(dut: Any) -> None:
    """With the switch the pictures come out as they are."""
    bench = Bench(dut)
    await bench.link.reset()
    dut.switch_pass.value = 1
    frames = bench.pictures(MODE_720, bench.lost_frames(MODE_720) + 3)
    taken = await bench.link.play([*signal(MODE_720), encode_frames(MODE_720, frames)])
    got = last_frames(taken, MODE_720.h_total)
    assert len(got) >= 2
    for frame, want in zip(got[::-1], frames[-2::-1], strict=False):
        assert np.array_equal(frame.pixels, want)
        assert frame.mode == measured(MODE_720)


@cocotb.test()
async def test_pattern(dut: Any) -> None:
    """No source, the switch on: the pattern, refocused, at 25.175 MHz; then a source again."""
    bench = Bench(dut)
    await bench.link.reset()
    dut.switch_pattern.value = 1
    got = last_frames(await bench.link.play([Command(Code.WAIT, 500_000)]), MODE_720.h_total)
    assert len(got) >= 2
    want = bench.golden(pattern(MODE_720))
    for frame in got[-2:]:
        assert np.array_equal(frame.pixels, want)
    dut.switch_pattern.value = 0
    await bench.relock(MODE_720, [])


def pattern(mode: VideoMode) -> np.ndarray:
    """The test pattern of the board."""
    shifts = CASE["shifts"]
    depths = (
        (shifts[0], shifts[len(shifts) // 2] if len(shifts) > 2 else 0, shifts[-1])
        if len(shifts) > 1
        else (shifts[0], 0, -shifts[0])
    )
    return light_field(mode, CASE["m"], depths, (mode.h_active // 3, 2 * mode.h_active // 3))
