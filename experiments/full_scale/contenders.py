"""Who is judged on the whole population: weights that were trained on it, and what speaks for every other method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import xarray as xr

from rom.comparison.entries import Entry, chosen_curves, entries_of, fitted
from rom.comparison.truth import Truth
from rom.datasets import SPLITS
from rom.scenes import LinearScene


@dataclass(eq=False)
class Contenders:
    """The entries of a comparison's results, fitted again when they are asked for.

    Parameters
    ----------
    scene : LinearScene
    truth : Truth
        Of the comparison; its seed decides which cases are held out.
    entries : list of Entry
        In the order of the results.
    """

    scene: LinearScene
    truth: Truth
    entries: list[Entry]

    @classmethod
    def of(cls, results: xr.Dataset, scene: LinearScene, truth: Truth, quick: bool) -> Contenders:
        """The entries of these results."""
        known = {entry.label: entry for entry in entries_of(scene, chosen_curves(scene, None, quick))}
        entries = [known[str(name)] for name in results["entry"].values]
        for entry, headline in zip(entries, results["headline"].values, strict=True):
            entry.headline = bool(headline)
        return cls(scene, truth, entries)

    def judged(self) -> list[tuple[int, int]]:
        """Positions of entries and splits: trained weights, and every headline that needs no factorization a case."""
        return [(i, j) for j in range(len(SPLITS)) for i, entry in enumerate(self.entries)
                if (entry.trained or entry.headline) and entry.kind.slow == 1]

    def model(self, entry: int, split: int) -> Any:
        """A fitted model; None where no weights of this split come with the toolkit."""
        return fitted(self.entries[entry], self.scene, self.truth, SPLITS[split])
