"""What methods of linear scenes ask of a scene before they apply to it."""

from __future__ import annotations

from typing import Any

from rom.scenes import LinearScene, Scene

NOT_LINEAR = "contact, friction and fibres that carry tension only are no linear system: nothing adds up"
NO_MODES = ("natural modes belong to a linear system about one state; here contact opens and closes, the skin sticks "
            "and slips, and fibres stiffen a hundredfold")


def not_linear(scene: Scene, reason: str = NOT_LINEAR) -> str | None:
    """Why a method of linear scenes does not apply, or None."""
    return None if isinstance(scene, LinearScene) else reason


def not_harmonic(scene: Scene, reason: str, not_linear_reason: str = NO_MODES) -> str | None:
    """Why a method of vibrating linear scenes does not apply, or None."""
    return not_linear(scene, not_linear_reason) or (None if scene.harmonic else reason)


def within(scene: Any, count: int) -> int:
    """``count`` modes or directions, or as many as the small body of a linear scene can be asked for."""
    return max(1, min(count, scene.n_free // 4))
