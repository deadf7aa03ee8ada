"""Linear second-order model K u + M u'' = f with structural damping: statics, harmonics, modes.

With u(t) = Re(u e^{+i omega t}) the complex stiffness is K* = K (1 + i eta) + i L; eta > 0 dissipates, and so does a
loss stiffness L, the sum of eta_t K_t where tissues t have loss factors of their own; usually there is none.
Mean powers over a period follow from f = Z u: the input (1/2) Re(f^H i omega u) = -(omega / 2) Im(f^H u) equals
the dissipation (omega / 2) u^H (eta K + L) u.
"""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from rom.errors import SolverError
from rom.fullorder.checked_solution import checked_solution
from rom.fullorder.conditioning import HOPELESS
from rom.fullorder.dynamic_stiffness import DynamicStiffness, check_not_negative
from rom.fullorder.factorization import Factorization, choose_backend, factorize
from rom.fullorder.modes import Modes, natural_modes
from rom.fullorder.products import real_times, relative_size
from rom.fullorder.symmetric import check_finite, check_symmetric


class SecondOrderModel:
    """Full-order model of a linear elastic body.

    Factorizations are made when first needed and kept.

    Parameters
    ----------
    stiffness : (n, n) scipy sparse matrix [N/m]
        Real symmetric.
    mass : (n, n) scipy sparse matrix [kg], optional
        Real symmetric, positive definite; not needed for statics.
    loss_stiffness : (n, n) scipy sparse matrix [N/m], optional
        Imaginary part L of the complex stiffness beside the loss factor's: real symmetric, positive semi-definite.
        Statics and natural modes are those of the real K.
    backend : {"auto", "pardiso", "superlu"}
        See `rom.fullorder.factorization.factorize`.

    Raises
    ------
    ValueError
        If a matrix is not sparse, square, real, finite, symmetric and in double precision, their sizes differ, or the
        loss stiffness has a negative number on its diagonal.
    """

    def __init__(
        self, stiffness: Any, mass: Any = None, *, loss_stiffness: Any = None, backend: str = "auto"
    ) -> None:
        others = {"mass matrix": mass, "loss stiffness": loss_stiffness}
        given = {"stiffness matrix": stiffness} | {name: one for name, one in others.items() if one is not None}
        for name, matrix in given.items():
            check_symmetric(matrix, name)
            if matrix.dtype.kind == "c":
                raise ValueError(
                    f"the {name} is complex: it must be real, damping enters by the loss factor and by loss_stiffness"
                )
            if matrix.dtype.kind == "f" and matrix.dtype.itemsize < 8:
                raise ValueError(
                    f"the {name} is stored as {matrix.dtype}: its rounding, times the condition number, would go into "
                    "every answer; assemble it in double precision"
                )
            if matrix.shape != stiffness.shape:
                raise ValueError(
                    f"the {name} has shape {matrix.shape} and the stiffness matrix {stiffness.shape}: "
                    "both must describe the same dofs"
                )
        if loss_stiffness is not None and not np.all(loss_stiffness.diagonal() >= 0):
            raise ValueError(
                f"the loss stiffness has {np.min(loss_stiffness.diagonal()):.3g} N/m on its diagonal: it must be "
                "positive semi-definite, as loss factors of at least 0 make it"
            )
        self.backend = choose_backend(backend)
        self.stiffness = sp.csr_array(stiffness)
        self.loss_stiffness = None if loss_stiffness is None else sp.csr_array(loss_stiffness)
        self._mass = None if mass is None else sp.csr_array(mass)
        self._static: Factorization | None = None
        self._dynamic_stiffness: DynamicStiffness | None = None
        self._harmonic: Factorization | None = None
        self._harmonic_case: tuple[float, float] | None = None

    def afresh(self, backend: str | None = None) -> SecondOrderModel:
        """The same matrices with nothing factorised yet, for another backend if one is named."""
        other = copy.copy(self)
        if backend is not None:
            other.backend = choose_backend(backend)
        other._static = other._harmonic = other._harmonic_case = None
        return other

    def forget_harmonic(self) -> None:
        """Let the factor of Z go, symbolic phase and all: the next one owes nothing to earlier cases."""
        self._harmonic = self._harmonic_case = None

    def __getstate__(self) -> dict[str, Any]:
        """Matrices alone: factors live in the solver's memory and are made again where they are needed."""
        return {**vars(self), "_static": None, "_harmonic": None, "_harmonic_case": None}

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return self.stiffness.shape[0]

    @property
    def mass(self) -> sp.csr_array:
        """Mass matrix [kg]; ValueError in a model made without one."""
        if self._mass is None:
            raise ValueError("this model has no mass matrix, it answers statics only: construct it with mass=...")
        return self._mass

    @property
    def matrices(self) -> tuple[sp.csr_array | None, ...]:
        """Stiffness, mass and loss stiffness; None for what the model has not."""
        return self.stiffness, self._mass, self.loss_stiffness

    @property
    def has_mass(self) -> bool:
        """Whether it was made with a mass matrix."""
        return self._mass is not None

    @property
    def has_static_factorization(self) -> bool:
        """Whether the factor of K is there already."""
        return self._static is not None

    @property
    def static_factorization(self) -> Factorization:
        """Factor of K, made once and kept.

        Raises
        ------
        SolverError
            If K is singular, as for a body that can move rigidly.
        """
        if self._static is None:
            self._static = factorize(self.stiffness, backend=self.backend)
        return self._static

    @property
    def dynamic_stiffness(self) -> DynamicStiffness:
        """K, complex where there is a loss stiffness, and M on their common pattern."""
        if self._dynamic_stiffness is None:
            loss = self.loss_stiffness
            elastic = self.stiffness if loss is None else self.stiffness + 1j * loss
            self._dynamic_stiffness = DynamicStiffness(elastic, self.mass)
        return self._dynamic_stiffness

    def solve_static(self, force: ArrayLike, *, reuse_factor: bool = True) -> NDArray:
        """Displacement K u = f.

        Parameters
        ----------
        force : (n,) or (n, k) array [N]
        reuse_factor : bool
            False factorizes again (numeric phase), for timing a solver that meets every case afresh.

        Returns
        -------
        displacement : (n,) or (n, k) ndarray [m]

        Warns
        -----
        IllConditionedWarning
            Where rounding of the matrix alone moves the answer by more than 1e-6.

        Raises
        ------
        ValueError
            If the force has another shape, or holds NaN or infinity.
        SolverError
            If K is singular.
        """
        fresh = self._static is None
        factor = self.static_factorization
        if not (reuse_factor or fresh):
            factor.refactorize(self.stiffness)
        stiffness = self.stiffness
        return checked_solution(factor, self._field(force, "force"), lambda u: stiffness @ u, [(1.0, stiffness)])

    def harmonic_factorization(
        self, frequency: float, loss_factor: float, *, reuse_factor: bool = True
    ) -> Factorization:
        """Factor of Z; one object for all cases, so the next case overwrites this one's values.

        Parameters
        ----------
        frequency : float [Hz]
        loss_factor : float [1]
        reuse_factor : bool
            True keeps the numeric factor if frequency and loss factor are those of the last call; the
            symbolic phase is kept in any case.
        """
        case = (float(frequency), float(loss_factor))
        if self._harmonic is not None and reuse_factor and case == self._harmonic_case:
            return self._harmonic
        matrix = self.dynamic_stiffness.harmonic(*case)
        self._harmonic_case = None
        if self._harmonic is None:
            # how near a resonance is too near depends on the load: judged with the solution
            self._harmonic = factorize(matrix, backend=self.backend, singular=HOPELESS)
        else:
            try:
                self._harmonic.refactorize(matrix)
            except SolverError:
                self._harmonic = None  # it was released with the failure; the next case starts afresh
                raise
        self._harmonic_case = case
        return self._harmonic

    def solve_harmonic(
        self, force: ArrayLike, frequency: float, loss_factor: float, *, reuse_factor: bool = True
    ) -> NDArray[np.complex128]:
        """Complex amplitude of the displacement, (K (1 + i eta) + i L - omega^2 M) u = f.

        Parameters
        ----------
        force : (n,) or (n, k) array [N]
            Real or complex amplitudes.
        frequency : float [Hz]
        loss_factor : float [1]
            Of the whole body, beside the loss stiffness; 0 where that says all.
        reuse_factor : bool
            See `harmonic_factorization`.

        Returns
        -------
        displacement : (n,) or (n, k) ndarray of complex128 [m]

        Warns
        -----
        IllConditionedWarning
            Where rounding of the matrices alone moves the answer by more than 1e-6, near an undamped resonance.

        Raises
        ------
        ValueError
            If the model has no mass, or an argument is negative, not finite or of another shape.
        SolverError
            If Z is singular: an undamped resonance.
        """
        factor = self.harmonic_factorization(frequency, loss_factor, reuse_factor=reuse_factor)
        terms = [(1 + 1j * loss_factor, self.stiffness), (-((2 * math.pi * frequency) ** 2), self.mass)]
        if self.loss_stiffness is not None:
            terms.append((1j, self.loss_stiffness))
        return checked_solution(
            factor, self._field(force, "force"), lambda u: self._apply(u, frequency, loss_factor), terms)

    def natural_modes(self, count: int | None = None, below_hz: float | None = None, *, seed: int = 0) -> Modes:
        """Undamped natural modes; see `rom.fullorder.modes.natural_modes`."""
        return natural_modes(
            self.stiffness,
            self.mass,
            count=count,
            below_hz=below_hz,
            factorization=self.static_factorization,
            seed=seed,
        )

    def residual(
        self,
        displacement: ArrayLike,
        force: ArrayLike,
        frequency: float | None = None,
        loss_factor: float | None = None,
    ) -> NDArray[np.float64]:
        """Relative residual ||Z u - f|| / ||f|| of each column.

        Parameters
        ----------
        displacement, force : (n,) or (n, k) array [m], [N]
        frequency : float [Hz], optional
            None for statics, where Z = K.
        loss_factor : float [1], optional
            None for 0.

        Returns
        -------
        residual : () or (k,) ndarray [1]
            Under a zero force: 0 for zero displacement, else infinite.

        Raises
        ------
        ValueError
            If the shapes do not fit or a loss factor is given without a frequency.
        """
        u, f = self._field(displacement, "displacement"), self._field(force, "force")
        if u.shape != f.shape:
            raise ValueError(f"the displacement has shape {u.shape} and the force {f.shape}: they must be equal")
        if frequency is None and loss_factor:
            raise ValueError("a loss factor was given without a frequency: statics knows no damping")
        product = self.stiffness @ u if frequency is None else self._apply(u, frequency, loss_factor or 0.0)
        return relative_size(product - f, f)

    def dissipated_power(self, displacement: ArrayLike, frequency: float, loss_factor: float) -> NDArray[np.float64]:
        """Mean power lost to structural damping, (omega / 2) u^H (eta K + L) u >= 0.

        Parameters
        ----------
        displacement : (n,) or (n, k) array [m]
        frequency : float [Hz]
        loss_factor : float [1]

        Returns
        -------
        power : () or (k,) ndarray [W]
        """
        check_not_negative(frequency, "frequency", "Hz")
        check_not_negative(loss_factor, "loss factor", "1")
        u = self._field(displacement, "displacement")
        lost = loss_factor * real_times(self.stiffness, u)
        if self.loss_stiffness is not None:
            lost = lost + real_times(self.loss_stiffness, u)
        return math.pi * frequency * np.sum(u.conj() * lost, axis=0).real

    def input_power(self, force: ArrayLike, displacement: ArrayLike, frequency: float) -> NDArray[np.float64]:
        """Mean power that the force puts in, (1/2) Re(f^H i omega u).

        Parameters
        ----------
        force, displacement : (n,) or (n, k) array [N], [m]
        frequency : float [Hz]

        Returns
        -------
        power : () or (k,) ndarray [W]
        """
        check_not_negative(frequency, "frequency", "Hz")
        f, u = self._field(force, "force"), self._field(displacement, "displacement")
        return -math.pi * frequency * np.sum(f.conj() * u, axis=0).imag

    def _field(self, values: ArrayLike, name: str) -> NDArray:
        array = np.asarray(values)
        if array.ndim not in (1, 2) or array.shape[0] != self.n:
            raise ValueError(f"the {name} has shape {array.shape}: it must be ({self.n},) or ({self.n}, k)")
        check_finite(array, name)
        return array

    def _apply(self, u: NDArray, frequency: float, loss_factor: float) -> NDArray[np.complex128]:
        check_not_negative(frequency, "frequency", "Hz")
        check_not_negative(loss_factor, "loss factor", "1")
        inertia = (2 * math.pi * frequency) ** 2 * real_times(self.mass, u)
        elastic = (1 + 1j * loss_factor) * real_times(self.stiffness, u) - inertia
        return elastic if self.loss_stiffness is None else elastic + 1j * real_times(self.loss_stiffness, u)
