"""How much of a scene a comparison looks at: facts of the scene, so that the comparison knows no scene by name."""

from __future__ import annotations

from typing import NamedTuple


class Extent(NamedTuple):
    """How many cases a comparison of a scene takes by default, and from which seed.

    Parameters
    ----------
    seed : int
        Nothing that learns was designed or tuned on the held-out cases that it draws.
    cases, quick_cases, least_cases : int
        Within the published ranges, training and held-out together; a tenth more lie beyond.
    least_beyond : int
        Cases beyond the ranges at least.
    validation : int
        Cases of each split by which settings are picked, neither learned from nor judged.
    batch, quick_batch : int
        Cases in a large batch.
    floor_scale : float
        Elements along each edge, over the scene's own, of the finer mesh that measures the mesh-convergence floor.
    floor_on_all : bool
        Whether it is measured on cases that any split holds out, or on those of the published one.
    """

    seed: int = 2026
    cases: int = 1434  # 6 x 239: as often as the pad of the `metamodel` preset has nodes
    quick_cases: int = 240
    least_cases: int = 10
    least_beyond: int = 8
    validation: int = 32
    batch: int = 2048
    quick_batch: int = 256
    floor_scale: float = 1.25
    floor_on_all: bool = False

    def beyond(self, cases: int) -> int:
        """Number of cases beyond the published ranges that go with ``cases`` within them."""
        return max(self.least_beyond, cases // 10)
