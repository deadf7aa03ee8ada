"""A network over the single complex variable s = omega^2 / (1 + i eta): learned poles, residues of the load's place.

    (1 + i eta) u / F = v + sum_k s / (mu_k - s) R_k(position, normal) + s A_1(position, normal) + s^2 A_2(...),

v the load's static response. This is the form of every answer, so that little is left to learn: no eigenproblem is
solved, the poles come from the answers alone, and those far above the band are what powers of s stand for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rom.metamodels.facts import Curve
from rom.metamodels.networks.separable import SeparableNetwork
from rom.scenes import LinearScene, Scene

if TYPE_CHECKING:
    import torch


class PoleNetwork(SeparableNetwork):
    """Static responses and learned poles over one complex variable, residues from the load's position and normal.

    Parameters
    ----------
    rank : int, optional
        Number of fields that residues are made of; default: 200, or all that the answers span where they are fewer.
    poles : int
    powers : int
        Highest power of s.
    steps : int
        Of training the poles, 20 quasi-Newton iterations each.
    storage : {"float32", "float16"}
        See `SeparableNetwork`.
    seed : int
    precision : {"float64", "float32"}
    """

    name: ClassVar[str] = "pole-network"
    summary: ClassVar[str] = "static responses, and learned poles over s = omega^2 / (1 + i eta) with learned residues"
    colour: ClassVar[str] = "#661100"
    static_reason: ClassVar[str] = "a static answer has no poles"
    static_part: ClassVar[bool] = True
    default_rank: ClassVar[int] = 200

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"poles": 10, "rank": 40, "steps": 5},))

    def __init__(self, scene: LinearScene, rank: int | None = None, poles: int = 18, powers: int = 2, steps: int = 40,
                 storage: str = "float32", seed: int = 0, precision: str = "float32") -> None:
        super().__init__(scene, rank, steps, storage, seed, precision, poles=poles, powers=powers)

    def _trunk(self) -> torch.nn.Module:
        from rom.metamodels.networks.trunks import PoleTrunk

        return PoleTrunk(self.scene.band_hz, self.settings["poles"], self.settings["powers"])
