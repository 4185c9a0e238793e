# SPDX-License-Identifier: Apache-2.0
"""What cores can be built for: their generics, limits, resources and latency."""
