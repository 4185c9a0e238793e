# SPDX-License-Identifier: Apache-2.0
"""Text over the picture, against its golden model."""

from plenofir.fpga.screen.overlay import Overlay
from plenofir_tb.runner import Case, run_cases
from plenofir_tb.video import shrunken


def case(
    texts: tuple[str, ...],
    labels: tuple[str, ...],
    columns: int,
    rows: int = 50,
    shades: int = 1,
) -> Case:
    """Pictures with texts over them, with colours of several shades of each slice."""
    colours = tuple(
        ((40 * i + 9) % 256, (200 - 30 * i) % 256, 70 * i % 256)
        for i in range(len(labels) * shades)
    )
    overlay = Overlay(texts, labels, colours)
    mode = shrunken("overlay", h_active=columns, v_active=rows)
    return Case(
        "text_overlay",
        "overlay.overlay_bench",
        overlay.generics(),
        {"texts": texts, "labels": labels, "colours": colours, "mode": mode.model_dump()},
    )


WIDE = case(("a = 0", "a = 4/5  1.02 m", "all", "depth~", "input"), ("1.02 m", "inf"), 250, 60)


def test_texts_rulers_and_errors() -> None:
    # The second one is cut at the right edge, and as high as the picture.
    cut = case(("a", "b", "c", "d", "e", "f"), ("1", "23", "4"), 70, 48, shades=8)
    # Labels that are too long for a line of the picture.
    many = case(tuple("x" for _ in range(67)), tuple(f"{n:7}" for n in range(64)), 30, 44)
    run_cases([WIDE, cut, many])
