# SPDX-License-Identifier: Apache-2.0
"""The other side of `plenofir_studies.peers`: runs in an environment of the peers alone.

Usage: python peers_side.py TASK INPUT.npz OUTPUT.npz

Arrays of a light field have the axes v, u, y, x. The output is an array and the processor time of
the peer's call, the least of `runs`; versions are those of the package.
"""

import contextlib
import io
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Work = Callable[[], Array]


def plenopticam_refocus(views: Array, shift: int, exact: bool) -> Work:
    """Slice a = shift / M by ``LfpShiftAndSum``; views are enlarged unless a is an integer."""
    from plenopticam.cfg import PlenopticamConfig
    from plenopticam.lfp_refocuser import LfpShiftAndSum
    from plenopticam.misc.status import PlenopticamStatus

    m = len(views)
    config = PlenopticamConfig()
    config.default_values()
    # plenopticam writes enlarged pictures beside the capture.
    config.params[config.lfp_path] = os.path.join(os.getcwd(), "capture")
    config.params[config.ptc_leng] = m
    config.params[config.opt_prnt] = False
    config.params[config.opt_refi] = not exact
    first = shift // m
    config.params[config.ran_refo] = [first, first + 1]
    field = np.repeat(views[..., np.newaxis].astype(float), 3, axis=-1)

    def work() -> Array:
        slices = LfpShiftAndSum(vp_img_arr=field.copy(), cfg=config, sta=PlenopticamStatus())
        slices.main()
        return np.asarray(slices.refo_stack[0 if exact else shift - first * m])[..., 0]

    return work


def plenpy_refocus(views: Array, shift: int, exact: bool) -> Work:
    """Slice a = shift / M by ``get_refocus``, whose slopes are M / (M - 1) times larger."""
    from plenpy.lightfields import LightField

    del exact
    m = len(views)
    field = LightField(np.ascontiguousarray(views[..., np.newaxis], dtype=float))
    return lambda: field.get_refocus(shift / m * (m - 1) / m)


def plenpy_depth(views: Array) -> Work:
    """Disparity by its structure tensor with its defaults."""
    from plenpy.lightfields import LightField

    field = LightField(np.ascontiguousarray(views[..., np.newaxis], dtype=float) / 65535)
    return lambda: field.get_disparity()[0]


def plenopticam_depth(views: Array) -> Work:
    """Disparity by ``depthy``, with what plenopticam sets."""
    from depthy.lightfield import epi_depth

    field = np.repeat(views[..., np.newaxis].astype(float) / 65535, 3, axis=-1)
    return lambda: epi_depth(lf_img_arr=field, lf_wid=1, primal_opt=True, perc_clip=1)


def plenopticam_centres(white: Array) -> Work:
    """Centres (y, x) by ``LfpCalibrator`` and its fit of a grid."""
    from plenopticam.cfg import PlenopticamConfig
    from plenopticam.lfp_calibrator import LfpCalibrator
    from plenopticam.misc.status import PlenopticamStatus

    config = PlenopticamConfig()
    config.default_values()
    config.params[config.cal_meth] = "grid-fit"
    config.params[config.cal_path] = os.path.join(os.getcwd(), "white.png")
    config.params[config.lfp_path] = os.path.join(os.getcwd(), "capture")
    config.params[config.opt_prnt] = False

    def work() -> Array:
        LfpCalibrator(white.astype(float), config, PlenopticamStatus()).main()
        centres = np.asarray(config.calibs[config.mic_list], dtype=float)
        if not centres.size:
            raise ValueError("no arrangement of micro lenses is recognised")
        return centres[:, :2]

    return work


def pyolaf_centres(white: Array, pitch: float) -> Work:
    """Centres (y, x) by ``LFM_processWhiteImage``, which is told the pitch."""
    from pyolaf.geometry import LFM_processWhiteImage

    def work() -> Array:
        _, grid = LFM_processWhiteImage(white.astype(float), pitch, "reg", False)
        return np.asarray(grid).reshape(-1, 2)[:, ::-1]

    return work


TASKS: dict[str, Callable[..., Work]] = {
    "plenopticam refocus": plenopticam_refocus,
    "plenpy refocus": plenpy_refocus,
    "plenopticam depth": plenopticam_depth,
    "plenpy depth": plenpy_depth,
    "plenopticam centres": plenopticam_centres,
    "pyolaf centres": pyolaf_centres,
}


def main() -> None:
    """Do the task of the command line."""
    warnings.simplefilter("ignore")
    task, source, target = sys.argv[1:]
    arrays = dict(np.load(source))
    runs = int(arrays.pop("runs"))
    words = {name: value if value.ndim else value.item() for name, value in arrays.items()}
    if task.endswith("refocus"):
        words["shift"], words["exact"] = int(words["shift"]), bool(words["exact"])
    seconds = []
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        os.chdir(folder)
        work = TASKS[task](**words)
        for _ in range(runs):
            started = time.process_time()
            result = np.asarray(work())
            seconds.append(time.process_time() - started)
        os.chdir("/")
    np.savez(target, result=result, seconds=min(seconds), version=version(task.split()[0]))


if __name__ == "__main__":
    main()
