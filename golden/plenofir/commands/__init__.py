# SPDX-License-Identifier: Apache-2.0
"""The command ``plenofir``: one module for each group of commands."""
