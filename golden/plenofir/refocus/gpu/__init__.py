# SPDX-License-Identifier: Apache-2.0
"""The refocuser for NVIDIA's GPUs: one source of CUDA C++, compiled for each kind of picture.

`refocus.cu` is the kernel, `constants` are the numbers in front of it and its tiles, `program`
compiles, keeps and launches.
"""
