# SPDX-License-Identifier: Apache-2.0
"""What a file is, by its pixels: a raster, a raw capture, a mosaic of views, or none of them."""
