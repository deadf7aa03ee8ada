"""One colour and one marker for each method, the same in every figure, told apart without colour vision too."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple
from zlib import crc32


class Style(NamedTuple):
    """How a method is drawn."""

    colour: str
    marker: str


# after Paul Tol's muted scheme and Okabe and Ito's
COLOURS = {
    "direct": "#000000", "direct-reused": "#777777", "coarse-fem": "#999933", "superposition": "#56B4E9",
    "modal": "#CC6677", "modal-static": "#882255", "modal-krylov": "#332288", "lookup-table": "#0072B2",
    "pod-galerkin": "#117733", "pod-regression": "#44AA99", "transformer": "#E69F00", "mlp": "#D55E00",
    "mlp-residual": "#AA4499", "pole-network": "#661100", "interpolation": "#B58900"}
"""Of results that do not bring the colours of all methods themselves, as the attribute ``method_colours``."""
MARKERS = "sDXhv^o8Pp*<>Hd"
"""In the order of the colours."""
OTHERS = (Style("#6699CC", "1"), Style("#7F3C8D", "2"))


def style(method: str, colours: Mapping[str, str] = COLOURS) -> Style:
    """The method's own colour and marker; one of a few others, always the same, for a method not listed."""
    if method not in colours:
        return OTHERS[crc32(method.encode()) % len(OTHERS)]
    return Style(colours[method], MARKERS[list(colours).index(method) % len(MARKERS)])


GATE = "#B2182B"
MESH_FLOOR = "#C9C2B2"
HELD_OUT = "#DCE6F2"
QUIET = "#555555"
