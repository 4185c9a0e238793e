# SPDX-License-Identifier: Apache-2.0
"""Where tests find helpers, and what makes them quicker beside each other."""

import os
import shlex
import sys
from pathlib import Path

# One thread of linear algebra in each process: pytest's workers have the cores already. OpenBLAS
# reads this when NumPy is imported. Its threads wait by spinning: beside each other two workers
# take several times as long for matrices of some thousand rows.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Bytecode is kept, also where the environment says otherwise: hundreds of processes import the same
# modules, and would spend a third of their time on compiling them.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Helpers of all tests, the packages of the testbenches, the studies, and behind all others what
# scripts share.
_ROOT = Path(__file__).parent
sys.path[:0] = [str(_ROOT / folder) for folder in ("golden/tests", "tb", "studies")]
sys.path.append(str(_ROOT / "scripts"))

# What Verilator's makefiles put before the compiler.
_CACHE = _ROOT / "tb" / "plenofir_tb" / "object_cache.py"
os.environ.setdefault("OBJCACHE", shlex.join([sys.executable, str(_CACHE)]))
