# SPDX-License-Identifier: Apache-2.0
"""The error that the package raises, and exit codes: `plenofir.ground.errors` by a shorter name."""

from plenofir.ground.errors import InputError as InputError
from plenofir.ground.errors import ToolError as ToolError
