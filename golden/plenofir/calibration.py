# SPDX-License-Identifier: Apache-2.0
"""`plenofir.camera.calibration` under the name that scripts of users have."""

from plenofir.camera.calibration import *  # noqa: F403
from plenofir.camera.calibration import __all__ as __all__
