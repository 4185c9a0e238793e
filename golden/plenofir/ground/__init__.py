# SPDX-License-Identifier: Apache-2.0
"""What all else stands on: errors, files of results, images, where the project lies."""
