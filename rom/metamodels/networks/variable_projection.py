"""Training hidden layers with the output layer always at its optimum (variable projection, Golub and Pereyra 1973).

A network that is a sum of trunk functions times coefficients of the node is linear in those coefficients: for given
hidden weights the best ones solve a small least-squares problem. L-BFGS then moves the hidden weights alone, down the
error that is left. Random combinations of the outputs stand for all of them: their squared error has the same mean.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from rom.metamodels.networks.training import Checkpoint, History, part, prefixed, read_checkpoint, write_checkpoint

log = logging.getLogger(__name__)

INNER = 20
"""L-BFGS iterations of one step."""
MEMORY = 40
SEGMENT = 10
"""Steps after which the quasi-Newton memory begins anew, so that a checkpoint needs no more than the weights."""
BULK, TAIL = 0.5, 3
"""Share of the steps that lower the mean squared error; the others lower the mean of its third power, which the
largest errors make: it is the maximum that answers are judged by."""
STALLED, PATIENCE = 0.999, 3
"""As many steps in a row that leave more than this share of the least error yet end a phase."""
RIDGE = 1e-10
"""Of the least-squares problems, relative to the mean diagonal."""


@dataclass(frozen=True)
class Sketch:
    """Cases by groups with an output layer each; a weight of zero fills a group up.

    point : (k, 2) Tensor
        Frequency [Hz] and loss factor, each pair once.
    index : (g, n) Tensor of int
        Of each case's point.
    feature : (g, n, d) Tensor
        What else multiplies the trunk; ones where a group is one node.
    weight : (g, n) Tensor [N m^-1]
        One over the answer's norm.
    target : (g, n, m) Tensor, complex
        Combinations of the outputs, times the weight.
    learned : (g, n) Tensor of bool
        Cases that the output layer is fitted to; the rest with a weight above zero is for validation.
    """

    point: Tensor
    index: Tensor
    feature: Tensor
    weight: Tensor
    target: Tensor
    learned: Tensor

    def design(self, trunk: nn.Module) -> Tensor:
        """(g, 2, n, d q) Tensor: real and imaginary parts of weighted trunk functions times features."""
        value = trunk(self.point)[self.index]
        both = torch.stack([value.real, value.imag], dim=1)
        both = both[..., None, :] * self.feature[:, None, :, :, None]
        return both.flatten(3) * self.weight[:, None, :, None]


def learn_trunk(trunk: nn.Module, sketch: Sketch, steps: int,
                progress: Callable[[Iterable[int]], Iterable[int]] = iter,
                checkpoint: Checkpoint | None = None) -> History:
    """Minimise the relative error over the trunk's weights, first its mean square, then its tail.

    The weights with the least mean on validation of what is minimised are kept.

    Parameters
    ----------
    trunk : nn.Module
        From (n, 2) points to (n, q) complex values, in double precision.
    steps : int
        Each of :data:`INNER` iterations.
    progress : callable
        Wraps the iteration over steps, to show a bar.
    checkpoint : Checkpoint, optional
        Written every :data:`SEGMENT` steps; where it exists, training goes on from it, to the same result.

    Returns
    -------
    History
        Root mean square relative errors.

    Raises
    ------
    SchemaError
        Where the checkpoint is damaged or belongs to another training.
    """
    goal = torch.stack([sketch.target.real, sketch.target.imag], dim=1)
    held = ~sketch.learned & (sketch.weight > 0)

    def begin() -> torch.optim.LBFGS:
        return torch.optim.LBFGS(trunk.parameters(), lr=1.0, max_iter=INNER, max_eval=2 * INNER, history_size=MEMORY,
                                 line_search_fn="strong_wolfe")

    def left() -> Tensor:
        """(g, n) Tensor: squared relative error of each case, the output layer at its optimum."""
        design = sketch.design(trunk)
        used = design * sketch.learned[:, None, :, None]
        gram = torch.einsum("gpna,gpnb->gab", used, design)
        size = gram.diagonal(dim1=1, dim2=2).mean(1).clamp(min=1e-300)
        gram = gram + RIDGE * size[:, None, None] * torch.eye(gram.shape[1], dtype=gram.dtype)
        best = torch.cholesky_solve(torch.einsum("gpna,gpnm->gam", used, goal), torch.linalg.cholesky(gram))
        return (goal - torch.einsum("gpna,gam->gpnm", design, best)).square().sum((1, 3))

    power = 1

    def closure() -> Tensor:
        optimizer.zero_grad()
        loss = left()[sketch.learned].pow(power).mean().log() / power
        loss.backward()
        return loss

    def look(history: History, step: int) -> float:
        with torch.no_grad():
            error = left()
        tail = float(error[held].pow(TAIL).mean()) ** (0.5 / TAIL)
        values = [math.sqrt(float(error[part].mean())) for part in (sketch.learned, held)]
        history.look(step, values[0], values[1], start)
        log.info("step %d of %d: training error %.2e, validation %.2e", step, steps, *values)
        return tail

    start = time.perf_counter()
    state = _resume(trunk, checkpoint) if checkpoint else None
    if state is not None:
        start -= state.history.seconds[-1]
    else:
        state = _State(trunk)
        state.best_tail = look(state.history, 0)
    optimizer = begin()
    for step in progress(range(state.step + 1, steps + 1)):
        if state.power == 1 and (step > BULK * steps or state.waited >= PATIENCE):
            state.power, state.least, state.waited = TAIL, math.inf, 0
            optimizer = begin()
        elif state.waited >= PATIENCE:
            break
        power, before = state.power, weights_of(trunk)
        try:
            loss = math.exp(0.5 * float(optimizer.step(closure).detach()))
            tail = look(state.history, step)
        except torch.linalg.LinAlgError:  # a step too far: weights that are no numbers, or functions that are alike
            loss = tail = math.inf
        if not math.isfinite(tail):
            trunk.load_state_dict(before)
            optimizer = begin()
            tail = look(state.history, step)
        state.take(trunk, step, loss, tail)
        if step % SEGMENT == 0:
            optimizer = begin()
            if checkpoint:
                _keep(trunk, state, checkpoint)
    trunk.load_state_dict(state.best)
    return state.history


class _State:
    """Where a training stands, beside the trunk's weights."""

    def __init__(self, trunk: nn.Module) -> None:
        self.step, self.power, self.waited = 0, 1, 0
        self.least, self.best_tail = math.inf, math.inf
        self.history = History()
        self.best = weights_of(trunk)

    def take(self, trunk: nn.Module, step: int, loss: float, tail: float) -> None:
        """Count a step that left ``loss`` of what is minimised and ``tail`` on validation."""
        self.step = step
        self.waited = self.waited + 1 if loss > STALLED * self.least else 0
        self.least = min(self.least, loss)
        if tail < self.best_tail:
            self.best_tail = tail
            self.best = weights_of(trunk)


def weights_of(trunk: nn.Module) -> dict[str, Tensor]:
    """A copy."""
    return {name: value.detach().clone() for name, value in trunk.state_dict().items()}


NUMBERS = ("step", "power", "waited", "least", "best_tail")


def _keep(trunk: nn.Module, state: _State, checkpoint: Checkpoint) -> None:
    numbers = {**{name: getattr(state, name) for name in NUMBERS}, "history": vars(state.history)}
    write_checkpoint(checkpoint, numbers, {**prefixed("now.", trunk.state_dict()), **prefixed("best.", state.best)})


def _resume(trunk: nn.Module, checkpoint: Checkpoint) -> _State | None:
    """The state that an interrupted training of the same recipe left; None where there is none."""
    kept = read_checkpoint(checkpoint)
    if kept is None:
        return None
    attributes, weights = kept
    trunk.load_state_dict(part(weights, "now."))
    state = _State(trunk)
    state.best = part(weights, "best.")
    for name in NUMBERS:
        setattr(state, name, attributes[name])
    state.history = History(**attributes["history"])
    return state
