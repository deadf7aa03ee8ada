"""Training: AdamW with a warm-up and a cosine, the best weights on a validation part kept.

Nothing depends on the clock or on global random state, so the seed alone decides the weights on a given machine.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from rom.datasets.tensors import read_tensors, write_tensors
from rom.errors import SchemaError

log = logging.getLogger(__name__)

WARM_UP = 0.1
"""Share of the steps in which the learning rate rises."""
CHECKS = 20
"""Looks at the validation part, evenly spread over the steps."""

Errors = Callable[[Tensor | None], Tensor]


@dataclass
class History:
    """Root mean square relative error at each look, of the training batches since the last and of validation, and
    seconds since training began (interruptions left out)."""

    step: list[int] = field(default_factory=list)
    train: list[float] = field(default_factory=list)
    validation: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list, compare=False)

    def look(self, step: int, train: float, validation: float, start: float) -> None:
        """Take in a look, ``start`` being the `perf_counter` when training began."""
        self.step.append(step)
        self.train.append(train)
        self.validation.append(validation)
        self.seconds.append(time.perf_counter() - start)


class Checkpoint(NamedTuple):
    """A file to resume from, and what must agree for that."""

    path: Path
    recipe: str


def train(module: nn.Module, errors: Errors, validation_errors: Callable[[], Tensor], count: int, *, steps: int,
          batch: int, learning_rate: float, weight_decay: float, generator: torch.Generator,
          progress: Callable[[Iterable[int]], Iterable[int]] = iter, checkpoint: Checkpoint | None = None) -> History:
    """Minimise the mean squared relative error.

    Parameters
    ----------
    module : nn.Module
        Left in evaluation mode with the weights that did best on validation.
    errors : callable
        Squared relative error of each training case at the given positions, of all where None.
    validation_errors : callable
        The same of every validation case.
    count : int
        Number of training cases.
    batch : int
        Cases a step; all at once where it is not below ``count``.
    progress : callable
        Wraps the iteration over steps, to show a bar.
    checkpoint : Checkpoint, optional
        Written at each look; where it exists, training goes on from it, to the same result.

    Raises
    ------
    ValueError
        Where training diverges.
    SchemaError
        Where the checkpoint is damaged or belongs to another training.
    """
    history, best, best_state, start = History(), math.inf, None, time.perf_counter()
    optimizer = torch.optim.AdamW(module.parameters(), lr=learning_rate, weight_decay=weight_decay)
    every = max(1, steps // CHECKS)
    queue = torch.empty(0, dtype=torch.long)
    total, first = 0.0, 1
    kept = read_checkpoint(checkpoint) if checkpoint else None
    if kept is not None:
        numbers, arrays = kept
        first, best, history = numbers["step"] + 1, numbers["best"], History(**numbers["history"])
        start -= history.seconds[-1]
        best_state = part(arrays, "best.")
        module.load_state_dict(part(arrays, "now."))
        queue = arrays["queue"]
        generator.set_state(arrays["generator"])
        state = optimizer.state_dict()
        state["state"] = {k: part(arrays, f"moments.{k}.") for k in range(len(list(module.parameters())))}
        optimizer.load_state_dict(state)
    module.train()
    for step in progress(range(first, steps + 1)):
        index = None
        if batch < count:
            while len(queue) < batch:
                queue = torch.cat([queue, torch.randperm(count, generator=generator)])
            index, queue = queue[:batch], queue[batch:]
        for group in optimizer.param_groups:
            group["lr"] = learning_rate * _rate(step / steps)
        loss = errors(index).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        total += float(loss.detach())
        if step % every == 0 or step == steps:
            module.eval()
            with torch.no_grad():
                validation = math.sqrt(float(validation_errors().mean()))
            module.train()
            since = step - (history.step[-1] if history.step else 0)
            history.look(step, math.sqrt(total / since), validation, start)
            total = 0.0
            log.info("step %d of %d: training error %.2e, validation %.2e", step, steps, history.train[-1], validation)
            if validation < best:
                best, best_state = validation, {k: v.detach().clone() for k, v in module.state_dict().items()}
            if checkpoint and best_state is not None:
                moments = optimizer.state_dict()["state"]
                write_checkpoint(checkpoint, {"step": step, "best": best, "history": vars(history)}, {
                    "queue": queue, "generator": generator.get_state(), **prefixed("now.", module.state_dict()),
                    **prefixed("best.", best_state),
                    **{name: value for k, parts in moments.items()
                       for name, value in prefixed(f"moments.{k}.", parts).items()}})
    if best_state is None:
        raise ValueError(f"training diverged with learning_rate={learning_rate:g}: give a smaller one")
    module.load_state_dict(best_state)
    module.eval()
    return history


def write_checkpoint(checkpoint: Checkpoint, numbers: dict[str, Any], tensors: dict[str, Tensor]) -> None:
    """Keep the state of a training, whole or not at all."""
    write_tensors(checkpoint.path, {name: tensor.numpy() for name, tensor in tensors.items()},
                  {"recipe": checkpoint.recipe, **numbers})


def read_checkpoint(checkpoint: Checkpoint) -> tuple[dict[str, Any], dict[str, Tensor]] | None:
    """Numbers and tensors that an interrupted training of the same recipe left; None where there is none.

    Raises
    ------
    SchemaError
        Where the file is damaged or belongs to another training.
    """
    if not checkpoint.path.exists():
        return None
    attributes, arrays = read_tensors(checkpoint.path)
    if attributes.get("recipe") != checkpoint.recipe:
        raise SchemaError(f"{checkpoint.path} belongs to a training with other settings, cases or mesh: delete it or "
                          "name another file")
    return attributes, {name: torch.from_numpy(array) for name, array in arrays.items()}


def prefixed(prefix: str, tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    """The same tensors, ``prefix`` before their names."""
    return {prefix + name: tensor for name, tensor in tensors.items()}


def part(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """Tensors whose names begin with ``prefix``, without it."""
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}


def _rate(share: float) -> float:
    """Factor of the learning rate when ``share`` of the steps is done."""
    if share < WARM_UP:
        return share / WARM_UP
    return 0.5 + 0.5 * math.cos(math.pi * (share - WARM_UP) / (1 - WARM_UP))
