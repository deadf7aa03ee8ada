"""Craig-Bampton superelements: interface degrees of freedom kept, the rest by the modes of the held interface.

u = [I 0; Psi Phi] [u_b; q] with constraint modes Psi = -K_ii^-1 K_ib, exact in statics, and the lowest mass-orthonormal
modes Phi of the interior with the interface held (Craig and Bampton, AIAA J. 6, 1968, 1313). What the modes above those
do at low frequency is added, where an accuracy is asked for, by the load-dependent vectors of the interface's inertia
forces, K_ii^-1 (M_ib + M_ii Psi) and its images under K_ii^-1 M_ii (modal truncation vectors; Dickens, Nakagawa and
Wittbrodt, Comput. Struct. 62, 1997, 985): a few of them do what hundreds of modes do. All columns of Phi are made
mass-orthonormal and diagonal in the stiffness, so that the superelement has the same form.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rom.bodies.body import Body
from rom.bodies.places import chosen_dofs
from rom.checks import real_number, whole_number
from rom.errors import SolverError
from rom.fullorder import SecondOrderModel

CUT = 1.5
"""Frequency up to which interior modes are taken, over the upper end of the band."""
MOST_BLOCKS = 20
"""Blocks of load-dependent vectors before a tolerance is given up."""
INDEPENDENT = 1e-10
"""Squared length of what a vector adds, relative, below which it is rounding."""
CHECKS, MOST_RESONANCES = 7, 8
"""Frequencies at which the interface is compared: evenly over the band, and at resonances of the superelement."""
CHECK_LOSS = 0.02
"""Loss factor of that comparison: without loss no two models agree at a resonance."""


@dataclass(frozen=True, eq=False)
class Superelement:
    """A body reduced to its interface and a few modes.

    Parameters
    ----------
    body : Body
        The reduced matrices: interface degrees of freedom under their names, then ``mode 1``, ``mode 2`` ...
    basis : (n, m) ndarray
        Displacements of the whole body for unit values of them [1], [kg^-1/2].
    interface : (k,) ndarray of int
        Interface among the degrees of freedom of the whole body.
    error : float
        Largest error of the interface's frequency responses at the frequencies that were checked; NaN where none was.
    """

    body: Body
    basis: np.ndarray
    interface: np.ndarray
    error: float = math.nan


def craig_bampton(body: Body, interface: str | Iterable[str], *, modes: int | None = None, band: float | None = None,
                  tolerance: float = 1e-4) -> Superelement:
    """Reduce a body to an interface.

    Parameters
    ----------
    body : Body
    interface : str or iterable of str
        Degrees of freedom, nodes, sets or planes that are kept, see :func:`rom.bodies.places.chosen_dofs`.
    modes : int, optional
        Number of interior modes; or
    band : float [Hz], optional
        modes and load-dependent vectors, as many as the responses of the interface need up to this frequency.
    tolerance : float
        Largest error of those, see :func:`interface_error`.

    Raises
    ------
    ValueError
        Without mass, for an interface that does not exist or is everything, or a tolerance that is not reached.
    SolverError
        Where the interior can move though the interface is held.
    """
    if (modes is None) == (band is None):
        raise ValueError(f"modes={modes!r} and band={band!r} were given: give one of the two")
    kept = chosen_dofs(interface, body.dof_names, body.grid)
    inside = np.setdiff1d(np.arange(body.model.n), kept)
    if not len(inside):
        raise ValueError(f"the interface is all {len(kept)} degrees of freedom: nothing is left to reduce; name fewer")
    stiffness, mass = sp.csr_array(body.model.stiffness), sp.csr_array(body.model.mass)
    interior = SecondOrderModel(stiffness[inside][:, inside], mass[inside][:, inside])
    try:
        constraint = -interior.solve_static(stiffness[inside][:, kept].toarray())
    except SolverError as error:
        raise SolverError(f"the rest of the body moves though its interface is held ({error}): name more of it"
                          ) from error
    k = len(kept)

    def made(vectors: np.ndarray) -> Superelement:
        basis = np.zeros((body.model.n, k + vectors.shape[1]))
        basis[kept, np.arange(k)] = 1
        basis[inside, :k], basis[inside, k:] = constraint, vectors
        return _projected(body, basis, kept)

    if modes is not None:
        whole_number("modes", modes, 0, len(inside))
        return made(interior.natural_modes(count=modes).shape if modes else np.empty((len(inside), 0)))
    top = real_number("band", band, above=0, unit="Hz")
    vectors = interior.natural_modes(below_hz=CUT * top).shape
    inertia = mass[inside][:, kept].toarray() + interior.mass @ constraint
    for _ in range(MOST_BLOCKS):
        found = made(vectors)
        worst = float(interface_error(body, found, _checks(found, top)).max())
        if worst <= tolerance:
            return replace(found, error=worst)
        block = interior.solve_static(inertia)
        added = _orthonormal(interior, vectors, block)
        if not added.shape[1]:
            break
        vectors = _diagonal(interior, np.concatenate([vectors, added], axis=1))
        inertia = interior.mass @ added
    raise ValueError(f"{vectors.shape[1]} modes and vectors leave an error of {worst:.1e} at the interface, "
                     f"tolerance={tolerance:g}: allow more error, or a lower band than {top:g} Hz")


def interface_error(body: Body, superelement: Superelement, frequency: ArrayLike,
                    loss_factor: float = CHECK_LOSS) -> np.ndarray:
    """Error of the receptances of a superelement's interface against the whole body.

    Parameters
    ----------
    body : Body
    superelement : Superelement
        Of that body; its matrices may have been written and read since.
    frequency : (k,) array_like [Hz]
    loss_factor : float

    Returns
    -------
    error : (k,) ndarray
        ||H_reduced - H|| / ||H|| in the Frobenius norm over all pairs of interface degrees of freedom.
    """
    k = len(superelement.interface)
    force = np.zeros((body.model.n, k))
    force[superelement.interface, np.arange(k)] = 1
    errors = []
    for one in np.atleast_1d(frequency).tolist():
        truth = body.model.solve_harmonic(force, one, loss_factor)[superelement.interface]
        reduced = superelement.body.model.solve_harmonic(np.eye(superelement.body.model.n, k), one, loss_factor)[:k]
        errors.append(np.linalg.norm(reduced - truth) / np.linalg.norm(truth))
    return np.array(errors)


def _checks(found: Superelement, top: float) -> np.ndarray:
    """Frequencies up to ``top`` where an error of the superelement would show [Hz]."""
    even = top * np.linspace(1 / CHECKS, 1, CHECKS)
    stiffness, mass = found.body.model.stiffness.toarray(), found.body.model.mass.toarray()
    shift = (2 * math.pi * top) ** 2  # with it the pencil is definite, however the body is held
    inverse = scipy.linalg.eigh(mass, stiffness + shift * mass, eigvals_only=True)
    square = 1 / inverse[inverse * 2 * shift >= 1] - shift
    resonances = np.sqrt(np.maximum(square, 0)) / (2 * math.pi)
    resonances = resonances[resonances > even[0] / CHECKS]
    some = np.linspace(0, len(resonances) - 1, min(len(resonances), MOST_RESONANCES))
    return np.concatenate([even, resonances[np.round(some).astype(int)]])


def _orthonormal(interior: SecondOrderModel, vectors: np.ndarray, block: np.ndarray) -> np.ndarray:
    """What a block adds to mass-orthonormal vectors, mass-orthonormal; dependent columns are left out."""
    mass = interior.mass
    for _ in range(2):  # twice is enough against rounding
        block = block - vectors @ (vectors.T @ (mass @ block))
        gram = block.T @ (mass @ block)
        square, turn = np.linalg.eigh((gram + gram.T) / 2)
        here = square > INDEPENDENT * max(square[-1], np.finfo(float).tiny)
        block = block @ (turn[:, here] / np.sqrt(square[here]))
    return block


def _diagonal(interior: SecondOrderModel, vectors: np.ndarray) -> np.ndarray:
    """The same mass-orthonormal vectors turned until they are orthogonal in the stiffness, too."""
    small = vectors.T @ (interior.stiffness @ vectors)
    return vectors @ np.linalg.eigh((small + small.T) / 2)[1]


def _projected(body: Body, basis: np.ndarray, kept: np.ndarray) -> Superelement:
    k, count = len(kept), basis.shape[1] - len(kept)

    def project(matrix: sp.csr_array) -> sp.csr_array:
        small = basis.T @ (matrix @ basis)
        return sp.csr_array((small + small.T) / 2)

    names = [*body.dof_names[kept].astype(str).tolist(), *(f"mode {i + 1}" for i in range(count))]
    model = body.model
    return Superelement(Body(
        {region: project(one) for region, one in body.stiffness_by_region.items()} or project(model.stiffness),
        project(model.mass), dof_names=names, name=f"{body.name}, {k} + {count} degrees of freedom",
        viscous=None if body.viscous is None else project(body.viscous),
        loss_stiffness=None if model.loss_stiffness is None else project(model.loss_stiffness),
        doubts=body.doubts, origin={"format": "Craig-Bampton", "notes": [f"made of {model.n} degrees of freedom"]}),
        basis, kept)
