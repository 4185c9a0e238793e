# SPDX-License-Identifier: Apache-2.0
"""Resources of designs: the one estimate, and the one record of what tools counted and placed."""
