# SPDX-License-Identifier: Apache-2.0
"""Make the pictures of docs/ray-model.md that are drawn from the ray model and real rays.

Usage: python scripts/ray_pictures.py
"""

from plenofir import project
from plenofir.images import write_png
from plenofir_studies.ray_pictures import dispersion_picture, distances_picture, meetings_picture

IMAGES = project.root() / "docs" / "images"


def main() -> None:
    """Write the pictures."""
    write_png(IMAGES / "dispersion.png", dispersion_picture())
    write_png(IMAGES / "meetings.png", meetings_picture())
    write_png(IMAGES / "distances.png", distances_picture())


if __name__ == "__main__":
    main()
