# SPDX-License-Identifier: Apache-2.0
"""Configurations of the cores: generics, limits, resources and latency."""
