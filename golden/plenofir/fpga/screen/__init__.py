# SPDX-License-Identifier: Apache-2.0
"""Outputs of a board's screen besides the refocused slice: depth, all in focus, a text."""
