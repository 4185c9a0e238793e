"""The operator as the switch-controlled semi-systolic FIR filter (section 6.1.1 of the thesis).

The pixel is broadcast to W taps; tap w delays it by W-1-w steps. A pixel of phase p = k mod M is
added by the M neighbouring taps whose delay lies in p (a'-1) + o .. p (a'-1) + o + M-1.
"""

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from plenofir.refocus.operator import Align, output_offset

SwitchMatrix = npt.NDArray[np.bool_]


def tap_count(micro_image_size: int, shift: int) -> int:
    """Number of taps W = M + (M-1) |a' - 1|.

    Parameters
    ----------
    micro_image_size
        M in pixels.
    shift
        a' in pixels.

    Returns
    -------
    int
        W.
    """
    return micro_image_size + (micro_image_size - 1) * abs(shift - 1)


def tap_origin(micro_image_size: int, shift: int) -> int:
    """Delay o of the tap that yields S[k] at step k, so that no tap needs a negative delay.

    Parameters
    ----------
    micro_image_size
        M in pixels.
    shift
        a' in pixels.

    Returns
    -------
    int
        o in steps: 0 for a' >= 1, (M-1)(1-a') otherwise.
    """
    return 0 if shift >= 1 else (micro_image_size - 1) * (1 - shift)


def output_delay(micro_image_size: int, shift: int, align: Align = "centred") -> int:
    """Steps from a pixel to the output of the same index.

    Parameters
    ----------
    micro_image_size
        M in pixels.
    shift
        a' in pixels.
    align
        See `plenofir.refocus.operator.output_offset`.

    Returns
    -------
    int
        Delay in steps: pixels for the row filter, lines for the column filter.
    """
    return tap_origin(micro_image_size, shift) + output_offset(micro_image_size, shift, align)


def switch_matrix(micro_image_size: int, shift: int) -> SwitchMatrix:
    """Switch states S(a, w, p), Eqs. (6.8) and (6.9).

    Parameters
    ----------
    micro_image_size
        M in pixels.
    shift
        a' in pixels.

    Returns
    -------
    SwitchMatrix
        Shape (M, W), one row for each phase; true is closed.
    """
    taps = tap_count(micro_image_size, shift)
    phase = np.arange(micro_image_size)[:, None]
    delay = taps - 1 - np.arange(taps)[None, :]
    first = phase * (shift - 1) + tap_origin(micro_image_size, shift)
    return (delay >= first) & (delay < first + micro_image_size)


def filter_lines(
    lines: Iterable[npt.NDArray[np.integer]],
    micro_image_size: int,
    shift: int,
    *,
    align: Align = "centred",
) -> Iterator[npt.NDArray[np.int64]]:
    """Run lines through one FIR filter, one after the other without a gap.

    This is the filter register by register, with the moving mask that keeps neighbouring lines
    apart. Lines of zeros behind the last one push its tail out.

    Parameters
    ----------
    lines
        Lines of samples, each of shape (K,), lengths may differ.
    micro_image_size
        M in pixels.
    shift
        a' in pixels.
    align
        See `plenofir.refocus.operator.output_offset`.

    Yields
    ------
    numpy.ndarray
        One line of sums for each line in, same length.
    """
    taps = tap_count(micro_image_size, shift)
    delay = output_delay(micro_image_size, shift, align)
    switches = switch_matrix(micro_image_size, shift)
    own_at_first_step = np.arange(taps) <= taps - 1 - delay

    held = np.zeros(taps, dtype=np.int64)
    lengths: list[int] = []
    outputs: list[int] = []

    def step(sample: int, phase: int, mask: npt.NDArray[np.bool_], restart: bool) -> None:
        nonlocal held
        carried = np.concatenate(([0], held[:-1]))
        if restart:
            carried[own_at_first_step] = 0
        held = carried + np.where(switches[phase] & mask, sample, 0)
        outputs.append(int(held[-1]))

    for line in lines:
        lengths.append(len(line))
        mask = own_at_first_step.copy()
        for position, sample in enumerate(line):
            step(int(sample), position % micro_image_size, mask, position == 0)
            mask = np.concatenate(([True], mask[:-1]))
    nothing_closed = np.zeros(taps, dtype=bool)
    for _ in range(delay):
        step(0, 0, nothing_closed, False)

    start = delay
    for length in lengths:
        yield np.array(outputs[start : start + length], dtype=np.int64)
        start += length
