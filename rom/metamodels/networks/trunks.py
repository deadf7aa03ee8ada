"""Trunks: functions of frequency and loss factor alone that a network multiplies with coefficients of the node.

`PoleTrunk` has learned poles over the single complex variable s = omega^2 / (1 + i eta), `PerceptronTrunk` is a plain
perceptron of frequency and loss factor. Both give a few complex functions, in double precision: poles that lie close
together make functions that are nearly alike, and their coefficients large.
"""

from __future__ import annotations

import math
from itertools import pairwise

import torch
from torch import Tensor, nn

FOURIER = ((6.0, 1.5), 24)
"""Standard deviations of the random frequencies, in frequency and in loss factor [rad], and their number."""
NEAR = 0.8
"""Share of the poles that begin near the band, the others stand for what lies above it."""
FIRST_POLE, NEAR_POLE, LAST_POLE = 0.3, 1.5, 4.0
"""Where poles begin, as frequencies over the band's upper end: evenly from the first on, then geometrically."""


class PoleTrunk(nn.Module):
    """``s / (mu_k - s)`` of learned poles ``mu_k``, and ``s``, ``s^2``, ... for the poles far above the band.

    Static answers are no part of it: every function vanishes with s. (Vector fitting, Gustavsen and Semlyen 1999, has
    the same form, one pole set for all outputs.)

    Parameters
    ----------
    band_hz : float
        Upper end of the band [Hz]; s is measured in its omega^2.
    poles : int
    powers : int
    """

    def __init__(self, band_hz: float, poles: int, powers: int) -> None:
        super().__init__()
        self.band_hz, self.powers = band_hz, powers
        near = max(1, round(NEAR * poles))
        above = torch.logspace(math.log10(NEAR_POLE), math.log10(LAST_POLE), poles - near + 1, dtype=torch.float64)
        start = torch.cat([torch.linspace(FIRST_POLE, NEAR_POLE, near, dtype=torch.float64), above[1:]])
        self.log_pole = nn.Parameter(2.0 * start.log())
        self.size = poles + powers

    def forward(self, point: Tensor) -> Tensor:
        """(n, size) Tensor, complex, from (n, 2) frequencies [Hz] and loss factors."""
        s = variable(point, self.band_hz)
        return torch.cat([s / (self.log_pole.exp() - s), *(s**power for power in range(1, self.powers + 1))], dim=1)


class PerceptronTrunk(nn.Module):
    """A perceptron of frequency, loss factor and Fourier features of both; half of its outputs are imaginary parts.

    Parameters
    ----------
    band_hz : float
        Upper end of the band [Hz].
    terms : int
        Number of complex functions.
    width, depth : int
        Of the hidden layers.
    vanishing : bool
        Whether the functions are multiplied by s, so that they vanish at 0 Hz.
    """

    projection: Tensor

    def __init__(self, band_hz: float, terms: int, width: int, depth: int, vanishing: bool = False) -> None:
        super().__init__()
        self.band_hz, self.size, self.vanishing = band_hz, terms, vanishing
        scales, count = FOURIER
        self.register_buffer("projection", torch.randn(2, count, dtype=torch.float64)
                             * torch.tensor(scales, dtype=torch.float64)[:, None])
        hidden: list[nn.Module] = []
        for before, after in pairwise([2 + 2 * count] + [width] * depth):
            hidden += [nn.Linear(before, after, dtype=torch.float64), nn.SiLU()]
        self.layers = nn.Sequential(*hidden, nn.Linear(width, 2 * terms, dtype=torch.float64))

    def forward(self, point: Tensor) -> Tensor:
        """(n, size) Tensor, complex, from (n, 2) frequencies [Hz] and loss factors."""
        inputs = torch.stack([2 * point[:, 0] / self.band_hz - 1, 4 * point[:, 1] - 1], dim=1)
        phase = inputs @ self.projection
        real, imaginary = self.layers(torch.cat([inputs, phase.sin(), phase.cos()], dim=1)).chunk(2, dim=1)
        value = torch.complex(real, imaginary)
        return value * variable(point, self.band_hz) if self.vanishing else value


def variable(point: Tensor, band_hz: float) -> Tensor:
    """(n, 1) Tensor, complex: s = omega^2 / (1 + i eta) over the band's omega^2."""
    stiffness = torch.complex(torch.ones_like(point[:, 1]), point[:, 1])
    return ((point[:, 0] / band_hz).square() / stiffness)[:, None]
