"""The published network for vibration: a perceptron of node, frequency and loss factor that knows no mechanics.

A perceptron of frequency and loss factor, and features of the loaded node, multiply one another before the linear
output layer. No mode, no static response and no pole enters: what it knows it has from the answers. (A perceptron of
all inputs together has to learn to multiply: four layers of 512 stood at a maximum error of 31 % after 8,000 steps.)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rom.metamodels.facts import Curve
from rom.metamodels.networks.separable import SeparableNetwork
from rom.scenes import LinearScene, Scene

if TYPE_CHECKING:
    import torch


class Mlp(SeparableNetwork):
    """A perceptron of frequency and loss factor times features of the loaded position and normal.

    Parameters
    ----------
    rank : int, optional
        Number of POD modes; default: 300, or all that the answers span where they are fewer.
    terms : int
        Number of complex functions of frequency and loss factor.
    width, depth : int
        Of the hidden layers.
    steps : int
        Of training them, 20 quasi-Newton iterations each.
    storage : {"float32", "float16"}
        See `SeparableNetwork`.
    seed : int
    precision : {"float64", "float32"}
    """

    name: ClassVar[str] = "mlp"
    summary: ClassVar[str] = "a perceptron of frequency and loss factor, multiplied with features of the loaded place"
    colour: ClassVar[str] = "#D55E00"
    static_reason: ClassVar[str] = "takes one force with a frequency; several static forces are the transformer's case"
    static_part: ClassVar[bool] = False
    default_rank: ClassVar[int] = 300

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"terms": 8, "width": 16, "steps": 5},))

    def __init__(self, scene: LinearScene, rank: int | None = None, terms: int = 28, width: int = 80, depth: int = 2,
                 steps: int = 600, storage: str = "float32", seed: int = 0, precision: str = "float32") -> None:
        super().__init__(scene, rank, steps, storage, seed, precision, terms=terms, width=width, depth=depth)

    def _trunk(self) -> torch.nn.Module:
        from rom.metamodels.networks.trunks import PerceptronTrunk

        return PerceptronTrunk(self.scene.band_hz, *(self.settings[name] for name in ("terms", "width", "depth")))
