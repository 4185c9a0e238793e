# SPDX-License-Identifier: Apache-2.0
"""The base of all packages: errors, result files, images, the project's folder."""
