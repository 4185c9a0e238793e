# SPDX-License-Identifier: Apache-2.0
"""Shared by the testbenches: stream driver and monitor, scoreboard, frames, runner."""
