# SPDX-License-Identifier: Apache-2.0
"""What a board's screen shows besides the refocused slice: depth, all in focus, a text."""
