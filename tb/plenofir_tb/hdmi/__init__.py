# SPDX-License-Identifier: Apache-2.0
"""The other side of an HDMI link: what sources and monitors send, and contents of packages."""
