# SPDX-License-Identifier: Apache-2.0
"""The refocuser for NVIDIA's GPUs: one source of CUDA C++, compiled for each kind of picture.

`sums.cu`, `words.cu` and `refocus.cu` make a tile of a slice, `stack.cu` is the kernel of a stack
of them, `depth.cu` finds where each lens is sharpest; `constants` are the numbers in front of them
and the size of tiles, `program` compiles, keeps and launches.
"""
