"""Reduced-order models of the human fingertip; ``rom.solve`` answers cases to a tolerance. Nothing heavy loads here."""

from __future__ import annotations

from typing import Any

__all__ = ["solve"]


def __getattr__(name: str) -> Any:
    """``solve``, imported when it is first asked for."""
    if name != "solve":
        raise AttributeError(f"module 'rom' has no attribute {name!r}")
    from rom.solving import solve

    return solve
