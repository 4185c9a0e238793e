"""What a core takes of a Spartan-6, estimated from its structure without any tool.

Block RAM and multipliers follow the rules of Yosys (`synth_xilinx -family xc6s`) and are equal to
its results. Look-up tables and flip-flops are sums over the parts of the structure, with weights
that were fitted to synthesised cores (scripts/fit_estimate.py); tests hold them to its results.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.devices import Usage
from plenofir.refocus.arithmetic import ExactArithmetic, StoredProductArithmetic
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.switches import FilterLayout

# Yosys takes the memory with the lowest cost: a RAMB8BWER 65, a RAMB16BWER 129, a group of four
# LUTs as RAM 8, a bit of a ROM in logic 1/64 (brams_xc3sda.txt, lutrams_xc5v.txt, memory_libmap).
_RAMB8_COST = 65
_RAMB16_COST = 129
_LUT_RAM_COST = 8
_ROM_BITS_FOR_A_COST = 64
_MULTIPLEXER_COST = 0.5
# Bits of a word at each number of address bits, parity bits included.
_RAMB8_WIDTHS = {8: 36, 9: 18, 10: 9, 11: 4, 12: 2, 13: 1}
_RAMB16_WIDTHS = {9: 36, 10: 18, 11: 9, 12: 4, 13: 2, 14: 1}
# Unsigned bits that a side of a DSP48A1 takes.
_DSP_BITS = 17
_DSP_LEAST_PRODUCT = 9


@dataclass(frozen=True)
class Memory:
    """A memory of a core.

    Attributes
    ----------
    name
        What it is for.
    address_bits
        It has 2**address_bits words.
    width
        Bits of a word.
    copies
        How many of it there are.
    rom
        Whether it is only read.
    words
        Words, if they are no power of two.
    """

    name: str
    address_bits: int
    width: int
    copies: int
    rom: bool = False
    words: int | None = None

    @property
    def _words(self) -> int:
        return 1 << self.address_bits if self.words is None else self.words

    @property
    def bits(self) -> int:
        """Bits of all copies."""
        return self.copies * self.width * self._words

    @property
    def usage(self) -> Usage:
        """What all copies take; ROMs in logic count nothing here."""
        options = [
            *self._blocks(_RAMB8_WIDTHS, _RAMB8_COST, half=True),
            *self._blocks(_RAMB16_WIDTHS, _RAMB16_COST, half=False),
        ]
        if self.rom:
            options.append((self.width * self._words / _ROM_BITS_FOR_A_COST, Usage()))
        else:
            options.append(self._lut_ram())
        return min(options, key=lambda option: option[0])[1] * self.copies

    def _joined(self, banks: int) -> float:
        """Cost of a decoder and of multiplexers behind several banks."""
        return _MULTIPLEXER_COST * (banks - 1) * (self.width + 1)

    def _blocks(
        self, widths: dict[int, int], cost: int, *, half: bool
    ) -> Iterator[tuple[float, Usage]]:
        """Block RAMs side by side, in one bank or several."""
        for bank_bits, width in widths.items():
            banks = -(-self._words >> bank_bits) or 1
            count = banks * -(-self.width // width)
            lut = (banks - 1) * self.width // 2
            usage = Usage(lut, ramb8=count) if half else Usage(lut, ramb16=count)
            yield cost * count + self._joined(banks), usage

    def _lut_ram(self) -> tuple[float, Usage]:
        """Four LUTs: 32 words of 6 bits, or 64 words of 3 bits."""
        width = 6 if self.address_bits <= 5 else 3
        banks = -(-self._words // 64)
        whole, rest = divmod(self.width, width)
        cost = _LUT_RAM_COST * whole + (1 + (_LUT_RAM_COST - 1) * rest / width if rest else 0)
        lut = 4 * (whole + (rest > 0)) * banks + (banks - 1) * self.width // 2
        return banks * cost + self._joined(banks), Usage(lut)


def block_sizes(words: int, width: int) -> list[int]:
    """Blocks that ram_blocks.vhd divides a memory into.

    Parameters
    ----------
    words, width
        Words of the memory, bits of a word.

    Returns
    -------
    list of int
        Words of each block: none needs a multiplexer between block RAMs, and no other such division
        into blocks of 2**n words takes fewer block RAMs, or as many in fewer blocks.
    """

    def divide(full: int, least: int) -> list[int]:
        sizes, left = [], words
        while left:
            bits = min(full, left.bit_length() - 1)
            sizes.append(1 << bits if bits >= least else left)
            left -= sizes[-1]
        return sizes

    def block_rams(size: int) -> int:
        bits = max((size - 1).bit_length(), min(_RAMB16_WIDTHS))
        return -(-width // _RAMB16_WIDTHS[bits])

    bits = sorted(_RAMB16_WIDTHS)
    divisions = [divide(full, least) for full in bits for least in bits if least <= full]
    return min(divisions, key=lambda sizes: (sum(map(block_rams, sizes)), len(sizes)))


@dataclass(frozen=True)
class _Filter:
    """The filters of a pass, with their stage.

    Attributes
    ----------
    layout
        Taps and switches.
    lanes
        Filters that work in step.
    depth
        Interleaved streams.
    data_bits, sum_bits
        Widths of the input and of the partial sums.
    value_bits
        Width of what the stored product reads; 0 for none.
    modules
        Column modules that the lanes belong to.
    """

    layout: FilterLayout
    lanes: int
    depth: int
    data_bits: int
    sum_bits: int
    value_bits: int
    modules: int

    @property
    def kept(self) -> int:
        """Partial sums that are kept from step to step."""
        return self.layout.taps - (not self.layout.hold)


def _filters(core: CoreConfiguration) -> Iterator[_Filter]:
    """All passes, rows first (the generics of fir_stage in fir_array.vhd)."""
    passes = core.order + 1
    m = core.micro_image_size
    pixel_max = (1 << core.pixel_bits) - 1
    for number in range(2 * passes):
        column = number >= passes
        layout = core.layout if number % passes == 0 else core.box_layout
        if isinstance(core.arithmetic, StoredProductArithmetic):
            guard, fraction = core.arithmetic.guard_bits, core.arithmetic.fraction_bits
            value_bits = core.pixel_bits + (guard if number else 0)
            scale_bits = fraction - (guard if number else 0)
            product_max = (((2 << value_bits) - 2 << scale_bits) + m) // (2 * m)
        else:
            value_bits = 0
            product_max = pixel_max * m**number
        yield _Filter(
            layout=layout,
            lanes=core.parallel_rows * core.channels,
            depth=core.column_depth if column else 1,
            data_bits=product_max.bit_length(),
            sum_bits=(m * product_max).bit_length(),
            value_bits=value_bits,
            modules=core.parallel_rows if column else 1,
        )


@dataclass(frozen=True)
class _Sum:
    """A stage of moving sums (the generics of moving_sum_stage in moving_sum_array.vhd).

    Attributes
    ----------
    layout
        Schedule.
    columns
        Whether it filters columns.
    data_bits
        Bits of a pixel of all channels, as it is summed.
    sum_bits
        Bits of a sum of all channels.
    value_bits
        Width of what a stored product reads; 0 for none.
    tag_bits
        Side information of a step.
    """

    layout: SumLayout
    columns: bool
    data_bits: int
    sum_bits: int
    value_bits: int
    tag_bits: int

    @property
    def reach(self) -> int:
        """Largest age at which a pixel is needed."""
        return self.layout.reach

    @property
    def banks(self) -> int:
        """Memories that the lines of pixels lie in."""
        return 1 + self.layout.pixels_leave

    @property
    def bank_lines(self) -> int:
        """Lines of a bank; a memory has one at least."""
        return max(sum(self.layout.ring_lines) // self.banks, 1)

    @property
    def table_words(self) -> int:
        """Words of a table by slice and phase."""
        return _table_words(self.layout)


def _table_words(layout: SumLayout) -> int:
    slices = len(layout.shifts)
    rows = 1 if slices == 1 else 1 << (slices - 1).bit_length()
    return rows << max((layout.micro_image_size - 1).bit_length(), 1)


def _sums(core: CoreConfiguration) -> Iterator[_Sum]:
    """All stages of the engine of moving sums, in their order."""
    passes, m = core.order + 1, core.micro_image_size
    slice_bits = max((len(core.shifts) - 1).bit_length(), 1)
    for number in range(2 * passes):
        exact = isinstance(core.arithmetic, ExactArithmetic)
        columns = exact == (number < passes)
        layout = core.sum_layout
        if number % passes:
            layout = core.box_sum_layout
        value_bits = 0
        largest = ((1 << core.pixel_bits) - 1) * m**number
        if isinstance(core.arithmetic, StoredProductArithmetic):
            guard, fraction = core.arithmetic.guard_bits, core.arithmetic.fraction_bits
            value_bits = core.pixel_bits + (guard if number else 0)
            scale_bits = fraction - (guard if number else 0)
            largest = (((2 << value_bits) - 2 << scale_bits) + m) // (2 * m)
        yield _Sum(
            layout=layout,
            columns=columns,
            data_bits=core.channels * largest.bit_length(),
            sum_bits=core.channels * (m * largest).bit_length(),
            value_bits=value_bits,
            tag_bits=2 + slice_bits + (0 if columns else 3),
        )


def _sum_memories(core: CoreConfiguration) -> Iterator[Memory]:
    """Memories of the engine of moving sums."""
    depth_bits = max((core.max_columns - 1).bit_length(), 1)
    for part in _sums(core):
        layout = part.layout
        if part.columns and core.max_columns > 1:
            banks, words = part.banks, part.bank_lines * core.max_columns
            if sum(layout.ring_lines):
                for size in block_sizes(words, part.data_bits):
                    address_bits = (size - 1).bit_length()
                    yield Memory("lines of pixels", address_bits, part.data_bits, banks, words=size)
                line_bits = (sum(layout.ring_lines) // banks).bit_length()
                width = (words - 1).bit_length()
                yield Memory("addresses of lines", line_bits, width, 1 + banks, rom=True)
            sums = 2 + layout.holds_outputs + layout.begins_within_group
            yield Memory("sums", depth_bits, part.sum_bits, sums, words=core.max_columns)
        else:
            bits = part.reach.bit_length()
            yield Memory("pixels of a line", bits, part.data_bits, 1 + layout.pixels_leave)
        if part.value_bits:
            lane = part.data_bits // core.channels
            yield Memory("stored products", part.value_bits, lane, core.channels, rom=True)
        address_bits = (part.table_words - 1).bit_length()
        for name, width in (
            ("ages", (part.reach + 1).bit_length()),
            ("phases", max((core.micro_image_size - 1).bit_length(), 1)),
        ):
            yield Memory(name, address_bits, width, 1, rom=True)


def memories(core: CoreConfiguration) -> tuple[Memory, ...]:
    """List the memories of a raster core.

    Parameters
    ----------
    core
        Its generics.

    Returns
    -------
    tuple of Memory
        Line buffers, stored products, FIFOs, row buffers.
    """
    found = list(_sum_memories(core)) if core.engine == "moving_sum" else []
    for part in _filters(core) if core.engine == "fir" else ():
        if part.depth > 1 and part.kept:
            bits = (part.depth - 1).bit_length()
            width = part.kept * part.sum_bits
            found.append(Memory("line buffers", bits, width, part.lanes))
        if part.value_bits:
            found.append(
                Memory("stored products", part.value_bits, part.data_bits, part.lanes, rom=True)
            )
        slices = len(part.layout.shifts)
        rows = (slices - 1).bit_length() + (core.micro_image_size - 1).bit_length()
        columns = int(part.layout.switched.sum())
        found.append(Memory("switch tables", max(rows, 1), columns, 1, rom=True))
    data_bits = core.channels * core.pixel_bits
    n = core.parallel_rows
    input_words = core.max_columns + 2 * n
    found.append(Memory("input FIFO", (input_words - 1).bit_length(), data_bits + 2, 1))
    under_way = 2 + (n > 1) + core.array_clocks
    output_words = (2 * core.max_columns + n if n > 1 else 0) + 2 * under_way
    slice_bits = max((len(core.shifts) - 1).bit_length(), 1)
    width = data_bits + 2 + slice_bits + 1
    found.append(Memory("output FIFO", (output_words - 1).bit_length(), width, n))
    if n > 1:
        bits = max((core.max_columns - 1).bit_length(), 1)
        found.append(Memory("row buffers", bits, data_bits, n - 1))
    return tuple(found)


def reciprocal_bits(value_max: int, divisor: int) -> tuple[int, int]:
    """Widths of the two factors of divide_round.

    Parameters
    ----------
    value_max
        Largest value to divide.
    divisor
        The constant.

    Returns
    -------
    tuple of int
        Bits of value + half the divisor, and of the reciprocal.
    """
    largest = value_max + divisor // 2
    exponent = next(t for t in range(64) if (-(1 << t)) % divisor * largest < 1 << t)
    return largest.bit_length(), (-(-(1 << exponent) // divisor)).bit_length()


def multipliers(core: CoreConfiguration) -> int:
    """Count the DSP48A1 of a raster core.

    Parameters
    ----------
    core
        Its generics.

    Returns
    -------
    int
        None for stored products and for M of a power of two.
    """
    if not isinstance(core.arithmetic, ExactArithmetic):
        return 0
    divisor = core.micro_image_size ** (2 * core.order + 2)
    if divisor & (divisor - 1) == 0:
        return 0
    largest = core.arithmetic.largest_sum(core.micro_image_size, core.pixel_bits, core.order)
    factors = reciprocal_bits(largest, divisor)
    widths = [_dsp_parts(bits) for bits in factors]
    # Products of less than nine bits become logic.
    each = sum(a + b >= _DSP_LEAST_PRODUCT for a in widths[0] for b in widths[1])
    return each * core.channels * core.parallel_rows


def _dsp_parts(bits: int) -> list[int]:
    """Widths with sign that Yosys splits an unsigned factor into."""
    parts = []
    left = bits + 1
    while left > _DSP_BITS + 1:
        parts.append(_DSP_BITS + 1)
        left -= _DSP_BITS
    return [*parts, left]


def structure(core: CoreConfiguration) -> dict[str, int]:
    """Count the parts of a raster core that look-up tables and flip-flops go to.

    Parameters
    ----------
    core
        Its generics.

    Returns
    -------
    dict
        Name of a part to its bits; the parts of the two engines differ.
    """
    if core.engine == "moving_sum":
        return _sum_structure(core)
    n = core.parallel_rows
    counts = dict.fromkeys(
        (
            "core",
            "register bits",
            "switched bits",
            "always closed bits",
            "restart bits",
            "rom bits",
            "switches",
            "skew bits",
            "parallel rows",
            "pixel bits",
            "address bits",
        ),
        0,
    )
    counts["core"] = 1
    for part in _filters(core):
        taps, delay = part.layout.taps, part.layout.delay
        switched = int(part.layout.switched.sum())
        bits = part.lanes * part.sum_bits
        if part.depth > 1 and part.kept:
            # Word in flight, output register of the line buffers, sum.
            counts["register bits"] += bits * (2 * part.kept + 1)
        else:
            counts["register bits"] += bits * taps
        counts["register bits"] += part.lanes * (1 if part.value_bits else 2) * part.data_bits
        if part.value_bits:
            counts["register bits"] += part.lanes * part.data_bits
            counts["rom bits"] += part.lanes * _rom_luts(part.value_bits, part.data_bits)
        if core.broadcast_taps:
            groups = -(-taps // core.broadcast_taps)
            counts["register bits"] += part.lanes * (groups * part.data_bits + taps)
        closed = int(part.layout.switches.all(axis=(0, 1)).sum())
        counts["switched bits"] += bits * (switched - closed)
        counts["always closed bits"] += bits * closed
        counts["restart bits"] += bits * min(taps - delay, taps)
        counts["switches"] += taps * part.modules
    result_bits = max(part.sum_bits for part in _filters(core)) * core.channels
    counts["skew bits"] = (n - 1) * n * result_bits
    counts["parallel rows"] = n - 1
    counts["pixel bits"] = n * core.channels * core.pixel_bits
    counts["address bits"] = (core.max_columns - 1).bit_length()
    return counts


def _sum_structure(core: CoreConfiguration) -> dict[str, int]:
    """Parts of a core with moving sums."""
    names = ("core", "sum bits", "pixel bits", "control bits", "tables", "delays", "rings")
    counts = dict.fromkeys((*names, "skips", "block bits", "address bits"), 0)
    counts["core"] = 1
    counts["address bits"] = (core.max_columns - 1).bit_length()
    for part in _sums(core):
        layout, m = part.layout, core.micro_image_size
        counts["sum bits"] += part.sum_bits
        counts["pixel bits"] += part.data_bits
        counts["control bits"] += (part.reach + 1).bit_length()
        tables = 3 * (part.reach + 1).bit_length() + 4 + 2
        counts["tables"] += -(-part.table_words // 64) * tables
        counts["delays"] += layout.delay
        if part.columns and core.max_columns > 1:
            ring = sum(layout.ring_lines).bit_length()
            counts["rings"] += m * ring
            banks, words = part.banks, part.bank_lines * core.max_columns
            counts["block bits"] += banks * part.data_bits * len(block_sizes(words, part.data_bits))
            if len(layout.shifts) > 1:
                counts["skips"] += m * ring * -(-part.table_words // 64)
        if part.value_bits:
            lane = part.data_bits // core.channels
            counts["tables"] += core.channels * _rom_luts(part.value_bits, lane)
    return counts


# The board without its core, synthesised: receiver, transmitter, timing, control; no block RAM.
_VIDEO_LUT = 2650
_VIDEO_FLIP_FLOPS = 2885

# LUTs and flip-flops of each part (scripts/fit_estimate.py).
_LUT_WEIGHTS = {
    "core": 209,
    "switched bits": 1.92,
    "always closed bits": 1.63,
    "switches": 1.81,
    "skew bits": 0.946,
    "parallel rows": 91.2,
    "address bits": 1.34,
}
_FLIP_FLOP_WEIGHTS = {
    "core": 232,
    "register bits": 0.545,
    "switched bits": 0.101,
    "restart bits": 1.65,
    "skew bits": 3.38,
}


_SUM_LUT_WEIGHTS = {
    "core": 270,
    "pixel bits": 9.4,
    "control bits": 0.116,
    "tables": 2.64,
    "rings": 4.69,
    "block bits": 0.618,
}
_SUM_FLIP_FLOP_WEIGHTS = {
    "core": 356,
    "pixel bits": 11,
    "control bits": 9.88,
    "tables": 0.364,
    "delays": 1.32,
    "rings": 4.99,
    "block bits": 1.75,
}


def estimate(core: CoreConfiguration) -> Usage:
    """Estimate what a raster core takes of the device.

    Parameters
    ----------
    core
        Its generics.

    Returns
    -------
    Usage
        Block RAM and multipliers as Yosys maps them, LUTs and flip-flops within some percent.
    """
    parts = structure(core)
    in_memories = sum((memory.usage for memory in memories(core)), Usage())
    lut_weights, flip_flop_weights = _LUT_WEIGHTS, _FLIP_FLOP_WEIGHTS
    if core.engine == "moving_sum":
        lut_weights, flip_flop_weights = _SUM_LUT_WEIGHTS, _SUM_FLIP_FLOP_WEIGHTS
    logic = Usage(
        lut=round(sum(weight * parts[name] for name, weight in lut_weights.items())),
        flip_flops=round(sum(weight * parts[name] for name, weight in flip_flop_weights.items())),
        dsp=multipliers(core),
    )
    return in_memories + logic


def _rom_luts(address_bits: int, width: int) -> int:
    """LUTs of a ROM in logic, 64 words of a bit each; none for a ROM in block RAM."""
    if Memory("", address_bits, width, 1, rom=True).usage.block_rams:
        return 0
    return width << max(address_bits - 6, 0)


def video_usage(core: CoreConfiguration) -> Usage:
    """Estimate what the video path and the board's control take around a core.

    Parameters
    ----------
    core
        Its generics.

    Returns
    -------
    Usage
        The board without its core.
    """
    return Usage(_VIDEO_LUT, _VIDEO_FLIP_FLOPS)
