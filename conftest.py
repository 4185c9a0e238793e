# SPDX-License-Identifier: Apache-2.0
"""One thread of linear algebra in each process: pytest's workers have the cores already.

OpenBLAS reads the variable when NumPy is imported. Its threads wait by spinning: beside each other
two workers take several times as long for matrices of some thousand rows.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
