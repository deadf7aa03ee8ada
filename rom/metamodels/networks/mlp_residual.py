"""A perceptron of what mechanics leaves unexplained.

With s = omega^2 / (1 + i eta) a unit force f answers u = (K - s M)^-1 f / (1 + i eta). `mlp-residual` sums the load's
static response v = K^-1 f, what m modes add to it, and a network that vanishes with s for what the left-out modes add:

    (1 + i eta) u = v + sum_(k <= m) phi_k (phi_k^T f) s / (lambda_k (lambda_k - s)) + s network(place, f, eta).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rom.metamodels.facts import Curve, Needs
from rom.metamodels.networks.separable import SeparableNetwork
from rom.scenes import LinearScene, Scene

if TYPE_CHECKING:
    import torch


class MlpResidual(SeparableNetwork):
    """Static responses, natural modes, and a network of what they leave.

    Parameters
    ----------
    modes : int
        Number of natural modes.
    rank : int, optional
        Number of POD modes of what they leave; default: 96, or all that it spans where they are fewer.
    terms : int
        Number of complex functions of frequency and loss factor.
    width, depth : int
        Of the perceptron of both.
    steps : int
        Of training it, 20 quasi-Newton iterations each.
    storage : {"float32", "float16"}
        See `SeparableNetwork`.
    seed : int
    precision : {"float64", "float32"}
    """

    name: ClassVar[str] = "mlp-residual"
    summary: ClassVar[str] = "static responses and modes, and a perceptron of what they leave"
    colour: ClassVar[str] = "#AA4499"
    static_reason: ClassVar[str] = "nothing is left over when the static part is exact"
    static_part: ClassVar[bool] = True
    default_rank: ClassVar[int] = 96

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(modes=True, responses=True, network=True)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"modes": 10, "rank": 16, "width": 16, "steps": 5},))

    def __init__(self, scene: LinearScene, modes: int = 40, rank: int | None = None, terms: int = 4, width: int = 32,
                 depth: int = 2, steps: int = 40, storage: str = "float32", seed: int = 0,
                 precision: str = "float32") -> None:
        super().__init__(scene, rank, steps, storage, seed, precision, modes=modes, terms=terms, width=width,
                         depth=depth)

    def _solve_known(self) -> None:
        super()._solve_known()
        modes = self.scene.model.natural_modes(count=self.settings["modes"])
        self._modes = modes.shape.T
        self._eigenvalue, self._participation = modes.eigenvalue, self.scene.unit_loads.T @ modes.shape

    def _trunk(self) -> torch.nn.Module:
        from rom.metamodels.networks.trunks import PerceptronTrunk

        terms, width, depth = (self.settings[name] for name in ("terms", "width", "depth"))
        return PerceptronTrunk(self.scene.band_hz, terms, width, depth, vanishing=True)
