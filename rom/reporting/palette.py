"""One colour and one marker for each method, the same in every figure, told apart without colour vision too."""

from __future__ import annotations

from typing import NamedTuple
from zlib import crc32


class Style(NamedTuple):
    """How a method is drawn."""

    colour: str
    marker: str


# after Paul Tol's muted scheme and Okabe and Ito's
STYLES: dict[str, Style] = {
    "direct": Style("#000000", "s"),
    "direct-reused": Style("#777777", "D"),
    "coarse-fem": Style("#999933", "X"),
    "superposition": Style("#56B4E9", "h"),
    "modal": Style("#CC6677", "v"),
    "modal-static": Style("#882255", "^"),
    "modal-krylov": Style("#332288", "o"),
    "lookup-table": Style("#0072B2", "8"),
    "pod-galerkin": Style("#117733", "P"),
    "pod-regression": Style("#44AA99", "p"),
    "transformer": Style("#E69F00", "*"),
    "mlp": Style("#D55E00", "<"),
    "mlp-residual": Style("#AA4499", ">"),
    "pole-network": Style("#661100", "H"),
    "interpolation": Style("#B58900", "d"),
}
OTHERS = (Style("#6699CC", "1"), Style("#7F3C8D", "2"))


def style(method: str) -> Style:
    """The method's own colour and marker; one of a few others, always the same, for a method not listed."""
    return STYLES.get(method) or OTHERS[crc32(method.encode()) % len(OTHERS)]


GATE = "#B2182B"
MESH_FLOOR = "#C9C2B2"
BEYOND = "#F1E3C6"
HELD_OUT = "#DCE6F2"
QUIET = "#555555"
