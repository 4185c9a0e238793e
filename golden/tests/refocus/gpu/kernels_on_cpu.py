# SPDX-License-Identifier: Apache-2.0
"""The GPU's kernel compiled for the processor by g++ (``cuda_on_cpu.h``), to run it in tests."""

import ctypes
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from plenofir.refocus.border import arrived
from plenofir.refocus.gpu.constants import Tile, source
from plenofir.refocus.slices import Slice

_HERE = Path(__file__).parent
_NAMESPACE = """
namespace kind{number} {{
#define refocus_tile refocus_tile_{number}
{source}
#undef refocus_tile
alignas(16) unsigned char block_memory[{shared_bytes}];
static Arguments<Pixel> given;
static void one_thread()
{{
    const int* n = given.numbers;
    refocus_tile_{number}(given.x, given.out, given.reached_rows, given.reached_columns,
                          n[0], n[1], n[2], n[3], n[4], n[5]);
}}
}}
extern "C" void run{number}(unsigned grid_x, unsigned grid_y, const void* arguments)
{{
    memcpy(&kind{number}::given, arguments, sizeof kind{number}::given);
    work = kind{number}::one_thread;
    run_blocks(grid_x, grid_y, kind{number}::THREADS, kind{number}::block_memory, {shared_bytes});
}}
"""


class Arguments(ctypes.Structure):
    """Arguments of the kernel, as ``cuda_on_cpu.h`` has them."""

    _fields_ = (
        *((f"pointer{n}", ctypes.c_void_p) for n in range(4)),
        ("numbers", ctypes.c_int * 6),
    )


class KernelsOnCpu:
    """Kernels for slices and their tiles, in one library."""

    def __init__(self, folder: Path, kinds: Sequence[tuple[Slice, Tile]]) -> None:
        self.kinds = kinds
        parts = [
            _NAMESPACE.format(number=n, source=source(slice_, tile), shared_bytes=tile.shared_bytes)
            for n, (slice_, tile) in enumerate(kinds)
        ]
        text, library = folder / "kernels.cpp", folder / "kernels.so"
        text.write_text('#include "cuda_on_cpu.h"\n' + "".join(parts), "utf-8")
        options = ["-std=c++17", "-O0", "-w", "-shared", "-fPIC", f"-I{_HERE}"]
        subprocess.run(["g++", *options, str(text), "-o", str(library)], check=True)
        self._library = ctypes.CDLL(str(library))

    def start(
        self,
        number: int,
        addresses: tuple[int, int, int, int],
        shape: tuple[int, ...],
        region: tuple[range, range],
    ) -> None:
        """Run one of the kernels on arrays, as `plenofir.refocus.gpu.program.refocus_at` does."""
        ends = (end for part in region for end in (part.start, part.stop))
        arguments = Arguments(*addresses, (ctypes.c_int * 6)(*shape[:2], *ends))
        grid = self.kinds[number][1].blocks(region)
        self._library[f"run{number}"](*map(ctypes.c_uint, grid), ctypes.byref(arguments))

    def refocus(self, number: int, raw: Any, region: tuple[range, range]) -> Any:
        """The region of a picture by one of the kernels."""
        kind = self.kinds[number][0]
        out = np.full((len(region[0]), len(region[1]), *raw.shape[2:]), 77, raw.dtype)
        reached = [
            arrived(n, kind.micro_image_size, kind.shift, kind.order, kind.align, kind.box)
            for n in raw.shape[:2]
        ]
        weights = [np.ascontiguousarray(weight[:: kind.step], np.int64) for weight in reached]
        down, across, pixels, picture = (
            array.ctypes.data for array in (*weights, np.ascontiguousarray(raw), out)
        )
        self.start(number, (pixels, picture, down, across), raw.shape, region)
        return out
