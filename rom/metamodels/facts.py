"""What methods say of themselves: the settings that a comparison runs, and what they ask of the full-order model."""

from __future__ import annotations

from typing import Any, NamedTuple


class Curve(NamedTuple):
    """Settings of one method in a comparison, and which of them is its headline: what speaks for it in tables."""

    settings: tuple[dict[str, Any], ...] = ({},)
    headline: int = -1


class Needs(NamedTuple):
    """What a method asks of the full-order model in `fit` and in its first answer."""

    stiffness: bool = True
    solves: bool = False
    """Whether it solves the scene's own equation, real or complex as the scene is."""
    modes: bool = False
    responses: bool = False
    """Whether static responses of the unit loads are computed."""
    other_mesh: bool = False
    network: bool = False
    regression: bool = False
