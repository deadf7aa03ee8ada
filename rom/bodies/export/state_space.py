"""State space x' = A x + B f, u = C x + D f of a body between chosen forces and displacements.

The states are omega_k q_k and q_k' of the lowest natural modes (q_k itself where omega_k is 0), so that both have one
size; D is the static answer of all other modes, with which u at rest is exact. Hysteretic damping has no real matrices
in time: each mode is given the viscous damping that loses as much at its own frequency, zeta_k = eta_k / 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rom.bodies.body import Body
from rom.bodies.loads import Loads
from rom.bodies.places import chosen_dofs, columns_of
from rom.bodies.readers.found import needed
from rom.checks import real_number
from rom.files import whole_file


@dataclass(frozen=True, eq=False)
class StateSpace:
    """A linear system in time.

    Parameters
    ----------
    a, b, c, d : (s, s), (s, i), (o, s), (o, i) ndarray
        Forces [N] in, displacements [m] out.
    inputs, outputs : tuple of str
        Names of forces and displacements.
    name : str
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    name: str = "body"

    def frequency_response(self, frequency: ArrayLike) -> np.ndarray:
        """(k, o, i) ndarray of complex [m/N]: C (i omega - A)^-1 B + D at (k,) frequencies [Hz]."""
        s = 2j * math.pi * np.atleast_1d(np.asarray(frequency, dtype=float))
        eye = np.eye(len(self.a))
        return self.c @ np.linalg.solve(s[:, None, None] * eye - self.a, self.b.astype(complex)) + self.d

    def write(self, path: str | Path) -> None:
        """Write A, B, C, D and the names as .npz or .mat.

        Raises
        ------
        ValueError
            For another ending.
        OSError
            Where the file cannot be written.
        """
        path = Path(path)
        content: dict[str, Any] = {"A": self.a, "B": self.b, "C": self.c, "D": self.d,
                                   "inputs": np.array(self.inputs), "outputs": np.array(self.outputs)}
        if path.suffix not in (".npz", ".mat"):
            raise ValueError(f"{path.name} ends in {path.suffix or 'nothing'}: give a state space's name .npz or .mat")
        with whole_file(path) as temporary, open(temporary, "wb") as file:
            if path.suffix == ".npz":
                np.savez(file, **content)
            else:
                import scipy.io

                scipy.io.savemat(file, content | {name: np.array(content[name], dtype=object)
                                                  for name in ("inputs", "outputs")})

    def to_control(self) -> Any:
        """The same as ``control.StateSpace`` of python-control."""
        control = needed("control", "python-control", "control", "a state space of python-control")
        return control.ss(self.a, self.b, self.c, self.d, inputs=list(self.inputs), outputs=list(self.outputs),
                          name=self.name)


def state_space(body: Body, inputs: str | Iterable[str] | Loads, outputs: str | Iterable[str], *,
                modes: int | None = None, below_hz: float | None = None, loss_factor: float = 0.0) -> StateSpace:
    """Make a state space from a body's natural modes.

    Parameters
    ----------
    body : Body
    inputs : str, iterable of str, or Loads
        Where unit forces act: places, see :func:`rom.bodies.places.chosen_dofs`, or loads of a scene.
    outputs : str or iterable of str
        Displacements that are wanted.
    modes : int, optional
        Number of natural modes, rigid ones counted; or
    below_hz : float [Hz], optional
        all below this frequency.
    loss_factor : float
        Of the whole body, beside damping that the body has itself.

    Raises
    ------
    ValueError
        For places that do not exist, without mass, or where not one of ``modes`` and ``below_hz`` is given.
    SolverError
        Where the modes are not found.
    """
    real_number("loss_factor", loss_factor, 0)
    out = chosen_dofs(outputs, body.dof_names, body.grid)
    force, names = columns_of(inputs, body.dof_names, body.grid)
    found = body.model.natural_modes(count=modes, below_hz=below_hz)
    square, shape = found.eigenvalue, found.shape
    omega = np.sqrt(np.maximum(square, 0))
    rigid = omega == 0
    scale = np.where(rigid, 1.0, omega)
    damping = np.zeros((len(omega),) * 2) if body.viscous is None else shape.T @ (body.viscous @ shape)
    loss = loss_factor * square
    if body.model.loss_stiffness is not None:
        loss = loss + np.einsum("nm,nm->m", shape, body.model.loss_stiffness @ shape)
    damping = damping + np.diag(np.divide(loss, omega, out=np.zeros_like(loss), where=~rigid))
    m = len(omega)
    a = np.block([[np.zeros((m, m)), np.diag(scale)], [np.diag(-square / scale), -damping]])
    b = np.concatenate([np.zeros((m, force.shape[1])), shape.T @ force])
    c = np.concatenate([shape[out] / scale, np.zeros((len(out), m))], axis=1)
    elastic = shape[:, ~rigid]
    d = body.model.solve_static(force)[out] - elastic[out] @ ((elastic.T @ force) / square[~rigid, None])
    return StateSpace(a, b, c, d, tuple(names), tuple(body.dof_names[out].astype(str).tolist()), body.name)
