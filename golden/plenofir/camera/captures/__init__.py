# SPDX-License-Identifier: Apache-2.0
"""From a camera's own pixels to what is decoded: colours, hot pixels, and a grid that fits."""
