# SPDX-License-Identifier: Apache-2.0
"""The cores of a scene as components of a catalog: IP-XACT, Vivado's packaging, block designs.

A component is an entity without generics whose ports have widths in numbers, as catalogs want
them; inside is a core with the scene's generics. One description (`components`) makes the VHDL, the
IEEE 1685-2014 XML and the Tcl.
"""
