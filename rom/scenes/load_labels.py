"""From the labels that name a load in cases to its column among the unit loads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rom.bodies import Loads
from rom.scenes.cases import NO_FORCE, positions_of


class LoadLabels:
    """Finds loads by their labels.

    Parameters
    ----------
    loads : Loads
    """

    def __init__(self, loads: Loads) -> None:
        self._names = loads.names
        self._known: list[tuple[str, np.ndarray]] = []
        """Each label's values, in the order in which the loads list them."""
        number = np.zeros(len(loads), dtype=np.int64)
        for name, values in loads.labels.items():
            _, first, inverse = np.unique(values, return_index=True, return_inverse=True)
            number = number * len(first) + np.argsort(np.argsort(first))[inverse]
            self._known.append((name, values[np.sort(first)]))
        self._order = np.argsort(number)
        self._sorted = number[self._order]

    def columns(self, given: Mapping[str, np.ndarray]) -> np.ndarray:
        """Columns of the unit loads.

        Parameters
        ----------
        given : mapping of (n_case, n_force) ndarray
            Values of every label.

        Returns
        -------
        (n_case, n_force) ndarray of int
            NO_FORCE where the first label names none.

        Raises
        ------
        ValueError
            Where no load has the labels.
        """
        first, allowed = self._known[0]
        wanted = positions_of(given[first], allowed, first)
        present = wanted != NO_FORCE
        for name, allowed in self._known[1:]:
            code = positions_of(given[name][present], allowed, name)
            if (code == NO_FORCE).any():
                raise ValueError(f"{name} is missing where a force acts: give one of {', '.join(map(str, allowed))}")
            wanted[present] = wanted[present] * len(allowed) + code
        place = np.minimum(np.searchsorted(self._sorted, wanted), len(self._order) - 1)
        wrong = present & (self._sorted[place] != wanted)
        if wrong.any():
            words = " ".join(str(given[name][wrong][0]) for name, _ in self._known)
            raise ValueError(f"no load is called {words}: choose among {', '.join(self._names[:8])} ...")
        return np.where(present, self._order[place], NO_FORCE)
