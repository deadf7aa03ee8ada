"""Methods made on demand for the loads that some cases name: `superposition`, and `modal-krylov` to a tolerance.

Load-dependent vectors cost a static solve each, so they are made for those loads alone; the modes are the scene's.
How many vectors a tolerance takes is known beforehand. Galerkin on p Krylov vectors of K^-1 M, deflated of m modes,
finds u as well as any polynomial of degree p - 1 does on the spectrum [0, 1 / lambda_(m+1)], and Chebyshev's reach

    error <= C rho^-p,    rho = |z + sqrt(z^2 - 1)|,    z = 2 (1 + i eta) lambda_(m+1) / omega^2 - 1

(Saad, Iterative Methods for Sparse Linear Systems, section 6.11). That is a forecast; the certificate then decides.
"""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from rom.fullorder import Modes
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.modal import ModalKrylov
from rom.metamodels.residual_bound import residual_bound
from rom.metamodels.superposition import Superposition
from rom.metamodels.validity import Assessment
from rom.scenes import CaseArrays, LinearScene

MOST_VECTORS = 24
"""More would cost more than direct solves, and a band that needs them asks for more modes."""


def vectors_for(scene: LinearScene, cases: CaseArrays, tolerance: float, modes: Modes | None = None) -> int | None:
    """Forecast of the number of vectors a load with which `modal-krylov` meets a tolerance.

    Parameters
    ----------
    scene : LinearScene
    cases : CaseArrays
    tolerance : float
    modes : Modes, optional
        Default: the scene's own, which are then computed.

    Returns
    -------
    int or None
        None where too many would be needed, as beyond the modes.
    """
    if not len(cases):
        return None
    bound = (modes or residual_bound(scene).modes).next_eigenvalue_bound
    inertia = (2.0 * np.pi * cases.frequency) ** 2
    moving = inertia > 0
    if not moving.any() or not math.isfinite(bound):
        return 1
    z = 2.0 * (1.0 + 1j * cases.loss_factor[moving]) * bound / inertia[moving] - 1.0
    root = np.sqrt(z * z - 1.0)
    rate = np.maximum(np.abs(z + root), np.abs(z - root)).min()
    if rate < 1.5:
        return None
    count = math.ceil(math.log(2.0 / tolerance) / math.log(rate)) + 1
    return count if count <= MOST_VECTORS else None


class SomeLoads(Metamodel):
    """What knows the loads of some cases alone; not for files."""

    loads: np.ndarray
    """(n,) ndarray of int: the unit loads it knows."""

    def renumbered(self, cases: CaseArrays) -> CaseArrays:
        """The same cases with positions among :attr:`loads` for nodes."""
        return CaseArrays(np.searchsorted(self.loads, cases.node), cases.force, cases.frequency, cases.loss_factor)

    def _answer(self, cases: CaseArrays) -> tuple[np.ndarray, Assessment]:
        return super()._answer(self.renumbered(cases))


class SuperpositionOfSomeLoads(SomeLoads, Superposition):
    """`superposition` of the loads of some cases alone."""

    @classmethod
    def of(cls, scene: LinearScene, cases: CaseArrays) -> Self:
        """Fitted to the loads that ``cases`` name."""
        model = cls(scene)
        model.loads = np.unique(cases.node)
        return model.fit()

    def _loads(self) -> np.ndarray:
        return self.loads


class KrylovOfSomeLoads(SomeLoads, ModalKrylov):
    """`modal-krylov` that knows the loads of some cases alone; not for files."""

    @classmethod
    def of(cls, scene: LinearScene, cases: CaseArrays, vectors: int, modes: Modes | None = None) -> Self:
        """Fitted to the loads that ``cases`` name.

        Parameters
        ----------
        scene : LinearScene
        cases : CaseArrays
        vectors : int
        modes : Modes, optional
            Default: the scene's own.
        """
        modes = modes or residual_bound(scene).modes
        model = cls(scene, modes=modes.count, vectors=vectors)
        model._modes = modes
        model.loads = np.unique(cases.node)
        return model.fit()

    _modes: Modes

    def _natural_modes(self) -> Modes:
        return self._modes

    def _unit_loads(self) -> np.ndarray:
        return self.scene.unit_loads[:, self.loads]
