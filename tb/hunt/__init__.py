# SPDX-License-Identifier: Apache-2.0
"""Random streams into every entity with a stream: see README.md."""

VARIABLE = "PLENOFIR_HUNT"
"""Environment variable that tells the simulator's side what is to be done, as JSON."""
