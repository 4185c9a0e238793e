# SPDX-License-Identifier: Apache-2.0
"""From a camera and a scene to the smallest hardware that does the job."""

from plenofir.fpga.devices import DEVICES, Device, Usage
from plenofir.plan.loaded_scene import LoadedScene, load_scene
from plenofir.plan.plan import LeftOut, Plan
from plenofir.plan.planner import make_plan
from plenofir.plan.scene import Scene

__all__ = [
    "DEVICES",
    "Device",
    "LeftOut",
    "LoadedScene",
    "Plan",
    "Scene",
    "Usage",
    "load_scene",
    "make_plan",
]
