"""What methods of the finger on glass have in common."""

from __future__ import annotations

import numpy as np

from rom.finger_on_glass.tissue import VARIANTS
from rom.scenes import Scene
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.paths import PathArrays


def not_on_glass(scene: Scene) -> str | None:
    """Why a method of load paths does not apply to a scene, or None."""
    return None if isinstance(scene, FingerOnGlass) else "it answers load paths: a case of this scene has no history"


def check_learned(method: str, paths: PathArrays, learned) -> None:
    """ValueError where a path's variant was never learned."""
    for v in np.unique(paths.variant):
        if int(v) not in learned:
            raise ValueError(f"{method} never learned the variant {VARIANTS[v]}: it was fitted to "
                             f"{', '.join(VARIANTS[k] for k in learned)}; fit it with paths of this variant")


def check_counts(method: str, paths: PathArrays, least: int) -> None:
    """ValueError where a variant has too few training paths to be learned from."""
    counts = np.bincount(paths.variant, minlength=len(VARIANTS))
    scarce = [f"{VARIANTS[v]} ({n})" for v, n in enumerate(counts) if 0 < n < least]
    if scarce:
        raise ValueError(f"{method} needs {least} complete paths or more of each variant that it learns: too few of "
                         f"{', '.join(scarce)}")


def joined_reasons(ranges: np.ndarray, early: list[str]) -> np.ndarray:
    """(n_path,) ndarray of str: what lies outside the trained ranges, and where paths ended early."""
    return np.array(["; ".join(filter(None, pair)) for pair in zip(ranges.tolist(), early, strict=True)], dtype=str)
