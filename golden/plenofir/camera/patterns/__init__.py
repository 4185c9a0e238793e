# SPDX-License-Identifier: Apache-2.0
"""Micro lenses and views, found in the pixels of a picture."""
