# SPDX-License-Identifier: Apache-2.0
"""The bitstream of the Atlys board: built with ISE 14.7, checked without it."""
