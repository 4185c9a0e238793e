# SPDX-License-Identifier: Apache-2.0
"""Kernels for GPUs on the processor: a stand-in for NVIDIA's ``cuda.core``, by g++.

``cuda_on_cpu.h`` gives blocks, threads and shared memory.
"""

import ctypes
import re
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from mmap import PAGESIZE, mmap
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np

_HERE = Path(__file__).parent
_NAMESPACE = """
namespace text{number} {{
{renames}
{source}
alignas(16) unsigned char block_memory[1 << 18];
"""
_RUN = """
static void thread_of_{kernel}() {{ {kernel}({arguments}); }}
extern "C" int run_{kernel}(const unsigned* grid, unsigned threads, size_t bytes,
                             const long long* arguments)
{{
    return run_blocks(thread_of_{kernel}, grid, threads, block_memory, bytes, arguments);
}}
"""
_SIGNATURE = re.compile(r'extern "C" __global__ void.*?(\w+)\(([^()]*)\)\n\{', re.DOTALL)

Run = Callable[[tuple[int, int], int, int, Sequence[int]], None]
"""Runs a kernel: grid, threads of a block, bytes of shared memory, arguments."""


def compiled_kernels(texts: Sequence[str]) -> list[dict[str, Run]]:
    """The kernels of each text by their names, in one library."""
    parts = ['#include "cuda_on_cpu.h"\n']
    names: list[list[str]] = []
    for number, text in enumerate(texts):
        signatures = _SIGNATURE.findall(text)
        names.append([name for name, _ in signatures])
        renames = "\n".join(f"#define {name} {name}_{number}" for name in names[-1])
        parts.append(_NAMESPACE.format(number=number, renames=renames, source=text))
        for name, parameters in signatures:
            types = (each.rsplit(maxsplit=1)[0] for each in parameters.split(","))
            arguments = (
                f"({type_.replace('__restrict__', '')}) given[{n}]" for n, type_ in enumerate(types)
            )
            parts.append(_RUN.format(kernel=f"{name}_{number}", arguments=", ".join(arguments)))
            parts.append(f"#undef {name}\n")
        parts.append("}\n#undef CASES\n#undef ARGUMENTS\n")
    with TemporaryDirectory() as folder:
        source, library = Path(folder) / "kernels.cpp", Path(folder) / "kernels.so"
        source.write_text("".join(parts), "utf-8")
        options = ["-std=c++17", "-O0", "-w", "-shared", "-fPIC", f"-I{_HERE}"]
        subprocess.run(["g++", *options, str(source), "-o", str(library)], check=True)
        loaded = ctypes.CDLL(str(library))

    def run_of(entry: Any) -> Run:
        def run(
            grid: tuple[int, int], threads: int, shared_bytes: int, arguments: Sequence[int]
        ) -> None:
            inside = entry(
                (ctypes.c_uint * 2)(*grid),
                ctypes.c_uint(threads),
                ctypes.c_size_t(shared_bytes),
                (ctypes.c_longlong * len(arguments))(*map(int, arguments)),
            )
            assert inside, "memory was touched beyond an array"

        return run

    return [
        {name: run_of(loaded[f"run_{name}_{number}"]) for name in of_text}
        for number, of_text in enumerate(names)
    ]


def beside_protected(array: np.ndarray, at_end: bool) -> np.ndarray:
    """A copy whose memory ends, or begins, where pages begin that nobody may touch."""
    pages = -(-array.nbytes // PAGESIZE)
    memory = mmap(-1, (pages + 2) * PAGESIZE)
    address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for page in (0, pages + 1):
        status = ctypes.CDLL(None).mprotect(
            ctypes.c_void_p(address + page * PAGESIZE), ctypes.c_size_t(PAGESIZE), 0
        )
        assert status == 0
    first = (pages + 1) * PAGESIZE - array.nbytes if at_end else PAGESIZE
    copy = np.frombuffer(memory, array.dtype, array.size, first).reshape(array.shape)
    copy[:] = array
    return copy


class _Device:
    """A small GPU of compute capability 8.0."""

    compute_capability = 8, 0

    def __init__(self, number: int) -> None:
        self.properties = SimpleNamespace(
            max_shared_memory_per_block_optin=20_000,
            max_shared_memory_per_multiprocessor=100_000,
        )

    def set_current(self) -> None:
        pass


@cache
def _kernels_of(text: str) -> dict[str, Run]:
    (kernels,) = compiled_kernels([text])
    return kernels


class _Code:
    """What the compiler gives, loaded."""

    def __init__(self, code: bytes) -> None:
        self._kernels = _kernels_of(code.decode())

    from_cubin = classmethod(lambda cls, code: cls(code))

    def get_kernel(self, name: str) -> Any:
        attributes = {}

        class Attributes:
            def __getitem__(self, gpu: Any) -> Any:
                return attributes.setdefault("of", SimpleNamespace())

        return SimpleNamespace(name=name, run=self._kernels[name], attributes=Attributes())


def _launch(stream: Any, config: Any, kernel: Any, *arguments: Any) -> None:
    grid = config.grid if isinstance(config.grid, tuple) else (config.grid, 1)
    kernel.run(grid, config.block, config.shmem_size, arguments)


def cuda_core() -> Any:
    """A stand-in for the module ``cuda.core``, which compiles as it loads."""
    return SimpleNamespace(
        Device=_Device,
        LaunchConfig=lambda grid, block, shmem_size=0: SimpleNamespace(
            grid=grid, block=block, shmem_size=shmem_size
        ),
        ObjectCode=_Code,
        ProgramOptions=lambda **options: None,
        Program=lambda text, kind, options: SimpleNamespace(
            compile=lambda target: SimpleNamespace(code=text.encode())
        ),
        launch=_launch,
    )
