"""Loads: named columns of the right-hand side, which force amplitudes multiply."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from rom.checks import shown


@dataclass(frozen=True, eq=False)
class Loads:
    """Unit loads and the labels by which cases name them.

    Parameters
    ----------
    columns : (n, n_load) ndarray [-]
        Right-hand sides of unit amplitude.
    labels : dict of (n_load,) ndarray
        Values of the variables that name a load in labelled cases: one variable such as ``load`` (words) or
        ``load_node`` (numbers), or several that name it together.
    position : (n_load, 3) ndarray [m], optional
        Needed by methods that learn over space, and by nobody else.
    direction : (n_load, 3) ndarray [-], optional
        Outward unit normals where the loads push into a surface.

    Raises
    ------
    ValueError
        Where the shapes differ or two loads have the same labels.

    Examples
    --------
    >>> import numpy as np
    >>> loads = Loads.named(np.eye(3), ["left", "middle", "right"])
    >>> len(loads), loads.names
    (3, ['left', 'middle', 'right'])
    """

    columns: np.ndarray
    labels: dict[str, np.ndarray]
    position: np.ndarray | None = None
    direction: np.ndarray | None = None

    def __post_init__(self) -> None:
        count = self.columns.shape[1] if self.columns.ndim == 2 else -1
        if count < 1 or not self.labels:
            raise ValueError(f"the loads have shape {self.columns.shape} and {len(self.labels)} kinds of label: give "
                             "(n, n_load) columns and at least one label for each")
        for name, values in (self.labels | {"position": self.position, "direction": self.direction}).items():
            if values is not None and len(values) != count:
                raise ValueError(f"{len(values)} values of {name} were given for {count} loads: give one for each")
        rows = list(zip(*(values.tolist() for values in self.labels.values()), strict=True))
        if len(set(rows)) != count:
            twice = next(row for i, row in enumerate(rows) if row in rows[:i])
            raise ValueError(f"two loads are called {shown(twice[0] if len(twice) == 1 else twice)}: give each a name "
                             "of its own")

    @classmethod
    def named(cls, columns: np.ndarray, names, position: np.ndarray | None = None,
              direction: np.ndarray | None = None) -> Self:
        """Loads that the variable ``load`` names.

        Parameters
        ----------
        columns : (n, n_load) array_like [-]
        names : sequence of str
        position, direction : (n_load, 3) ndarray, optional
        """
        return cls(np.atleast_2d(np.asarray(columns, dtype=float)), {"load": np.asarray(names)}, position, direction)

    def __len__(self) -> int:
        """Number of loads."""
        return self.columns.shape[1]

    @property
    def names(self) -> list[str]:
        """Each load's labels in words."""
        return [" ".join(map(str, row)) for row in zip(*(v.tolist() for v in self.labels.values()), strict=True)]
