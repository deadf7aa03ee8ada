"""The torch modules of the transformer: Fourier features, attention from forces to the pad."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

NORMAL_SCALE = 0.5
"""Normals turn slowly over the pad: lower Fourier frequencies serve them."""
OWN_LOGIT = 4.0
"""Lead of a pad token's own logit over its nearest neighbour's before training, for the two nearest tokens: training
begins with attention that tells all tokens apart, so that learning their values is almost a linear problem."""


class Fourier(nn.Module):
    """Inputs and sines and cosines of random projections of them (Rahimi, Recht 2007; Tancik et al. 2020).

    Parameters
    ----------
    scales : list of float
        Standard deviation of the projections' frequencies, for each input [rad].
    count : int
        Number of projections.
    """

    projection: Tensor

    def __init__(self, scales: list[float], count: int) -> None:
        super().__init__()
        self.register_buffer("projection", torch.randn(len(scales), count) * torch.tensor(scales)[:, None])
        self.size = len(scales) + 2 * count

    def forward(self, inputs: Tensor) -> Tensor:
        phase = inputs @ self.projection
        return torch.cat([inputs, phase.sin(), phase.cos()], dim=1)


def place_features(scale: float, count: int) -> Fourier:
    """Fourier features of a load's position and normal."""
    return Fourier([scale] * 3 + [NORMAL_SCALE] * 3, count)


class AttentionBlock(nn.Module):
    """Multi-head attention of tokens to the pad's tokens, then a feed-forward part; both added, both pre-normalised."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.norm, self.norm_forward = nn.LayerNorm(width), nn.LayerNorm(width)
        self.query, self.key_value = nn.Linear(width, width), nn.Linear(width, 2 * width)
        self.out = nn.Linear(width, width)
        self.feed_forward = nn.Sequential(nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, width))

    def _by_head(self, x: Tensor) -> Tensor:
        return x.view(len(x), self.heads, -1).transpose(0, 1)

    def key_values(self, pad: Tensor) -> tuple[Tensor, Tensor]:
        key, value = self.key_value(self.norm(pad)).chunk(2, dim=1)
        return self._by_head(key), self._by_head(value)

    def forward(self, tokens: Tensor, key: Tensor, value: Tensor) -> Tensor:
        query = self._by_head(self.query(self.norm(tokens)))
        weight = torch.softmax(query @ key.transpose(1, 2) / math.sqrt(query.shape[2]), dim=-1)
        tokens = tokens + self.out((weight @ value).transpose(0, 1).reshape(tokens.shape))
        return tokens + self.feed_forward(self.norm_forward(tokens))


class PadAttention(nn.Module):
    """Tokens of unit forces attend to tokens of the pad; the last attention reads the answer from learned values.

    Forces do not attend to one another: in linear statics they do not interact, so answers add exactly.

    Parameters
    ----------
    pad : (n_token, 6) Tensor
        Places of the pad's tokens.
    scale : (r,) Tensor
        Size of each output.
    """

    pad: Tensor
    scale: Tensor
    unit: Tensor
    blocks: Any  # nn.ModuleList of AttentionBlock

    def __init__(self, pad: Tensor, scale: Tensor, width: int, depth: int, heads: int) -> None:
        super().__init__()
        self.register_buffer("pad", pad.clone())
        self.register_buffer("scale", scale.clone())
        self.features = place_features(3.0, width // 2)
        self.embedding = nn.Linear(self.features.size, width)
        self.blocks = nn.ModuleList([AttentionBlock(width, heads) for _ in range(depth)])
        self.norm, self.read = nn.LayerNorm(width), nn.Linear(width, width)
        self.values = nn.Parameter(torch.zeros(len(pad), len(scale)))
        self.log_sharpness = nn.Parameter(torch.zeros(()))
        self.register_buffer("unit", torch.ones(()))
        with torch.no_grad():
            key = self.remember()[-1]
            apart = torch.cdist(key, key, compute_mode="donot_use_mm_for_euclid_dist").square()
            apart = apart[~torch.eye(len(pad), dtype=torch.bool)]
            nearest = apart.min() if len(apart) else torch.ones(())
            self.unit.copy_(OWN_LOGIT / nearest.clamp(min=1e-6))

    def remember(self) -> list:
        """Keys and values of each block, and the last keys: what of the pad's tokens forces attend to."""
        pad = self.embedding(self.features(self.pad))
        memory: list = []
        for block in self.blocks:
            memory.append(block.key_values(pad))
            pad = block(pad, *memory[-1])
        return [*memory, self.read(self.norm(pad))]

    def _logits(self, places: Tensor, memory: list) -> Tensor:
        """(n_force, n_token) Tensor: how near each token is to each force."""
        tokens = self.embedding(self.features(places))
        for block, (key, value) in zip(self.blocks, memory[:-1], strict=True):
            tokens = block(tokens, key, value)
        query, key = self.read(self.norm(tokens)), memory[-1]
        distance = query.square().sum(1)[:, None] - 2 * query @ key.T + key.square().sum(1)
        return -self.unit * self.log_sharpness.exp() * distance

    def forward(self, places: Tensor, memory: list | None = None) -> Tensor:
        logits = self._logits(places, memory or self.remember())
        return functional.softmax(logits, dim=-1) @ self.values * self.scale

    @torch.no_grad()
    def settle(self, goal: Tensor) -> None:
        """Take the values with which the answers at the tokens' places come nearest to ``goal`` (n_token, r)."""
        weight = functional.softmax(self._logits(self.pad, self.remember()), dim=-1).double()
        self.values.copy_(torch.linalg.lstsq(weight, (goal / self.scale).double()).solution)

    def without_own_token(self) -> Tensor:
        """(n_token, r) Tensor: answers at the tokens' places where each one's own token is hidden.

        Values get no gradient: this teaches attention what to look at where a place was never seen.
        """
        logits = self._logits(self.pad, self.remember())
        hidden = logits.masked_fill(torch.eye(len(self.pad), dtype=torch.bool), -math.inf)
        return functional.softmax(hidden, dim=-1) @ self.values.detach() * self.scale
