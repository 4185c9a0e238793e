# SPDX-License-Identifier: Apache-2.0
"""Checks all of the Atlys' bitstream build that can be checked without ISE.

The sources are read as text, in the one style that they are written in (``scripts/vsg.yaml``).
"""
