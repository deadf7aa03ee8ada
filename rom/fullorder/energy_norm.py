"""Energy norms ``||e|| = sqrt(e^H K e)`` and ``||r||* = sqrt(r^H K^-1 r)`` in floating point, with what rounding adds.

Three numbers of the model carry every rounding error. With D the diagonal of K and ``|x|_D^2 = sum K_ii |x_i|^2``:

- the *spread* rho, with ``|x|^T |K| |y| <= rho |x|_D |y|_D``. For any v > 0 it is at most max (|K| v)_i / (D v)_i
  (Collatz and Wielandt); mu_M is the same of |M|.
- the *floor* mu, with ``x^T K x >= mu |x|_D^2`` for all x: K - mu D has no negative eigenvalue, which
  :func:`rom.fullorder.inertia.count_negative` proves. Then ``||r||* <= |r / D|_D / sqrt(mu)`` for any r.
- the number w of entries of the longest row. A product with K errs by at most ``gamma_w |K| |x|`` entry by entry,
  gamma_k = k u / (1 - k u) with the unit roundoff u of its precision, in any order of summation, fused or not
  (Higham, Accuracy and Stability of Numerical Algorithms, section 3.1).

So the product K x errs by at most ``(gamma_w rho + a) |x|_D / sqrt(mu)`` in the norm ||.||*, where a is what the
stored K lacks of symmetry, in units of D. Overflow and underflow are left aside: forces from 1e-100 to 1e100 N are
far from both.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rom.errors import SolverError
from rom.fullorder.dynamic_stiffness import DynamicStiffness
from rom.fullorder.inertia import count_negative
from rom.fullorder.second_order import SecondOrderModel

Floats = NDArray[np.float64]
UNIT = 2.0 ** -53
"""Unit roundoff of double precision."""
SUMS = 1.0 + 1e-9
"""Allowance for the rounding of norms and sums of positive numbers, each of relative size n u or less."""


def unit_roundoff(kind: type) -> float:
    """Unit roundoff of a floating-point type."""
    return float(np.finfo(kind).eps) / 2


def gamma(terms: float, kind: type = float) -> float:
    """Relative error of a sum of ``terms`` products, at most; infinite where there are too many."""
    share = terms * unit_roundoff(kind)
    return share / (1.0 - share) if share < 1.0 else np.inf


class EnergyNorm:
    """Norms of one model, from above and below; what costs solves is made when first needed.

    Parameters
    ----------
    model : SecondOrderModel
    """

    def __init__(self, model: SecondOrderModel) -> None:
        self.model = model
        self.diagonal: Floats = model.stiffness.diagonal()
        self.row_length = int(max(np.diff(matrix.indptr).max() for matrix in self._matrices))

    @property
    def _matrices(self) -> list[sp.csr_array]:
        return [self.model.stiffness, *([self.model.mass] if self.model.has_mass else [])]

    @cached_property
    def _long(self) -> list[sp.csr_array]:
        return [matrix.astype(np.longdouble) for matrix in self._matrices]

    def matrices(self, kind: type = float) -> list[sp.csr_array]:
        """K, and M where there is one, in double or extended precision (double where the machine has no other)."""
        return self._matrices if kind is float else self._long

    @cached_property
    def spread(self) -> float:
        """rho of K."""
        return self.spread_of(self.model.stiffness)

    @cached_property
    def mass_spread(self) -> float:
        """rho of M in units of D [s^2]."""
        return self.spread_of(self.model.mass) if self.model.has_mass else 0.0

    def spread_of(self, matrix: sp.csr_array) -> float:
        """rho of any matrix, in units of D."""
        size, vector = abs(matrix), 1.0 / np.sqrt(self.diagonal)
        ratio = np.full(len(vector), np.inf)
        for _ in range(12):  # the power method sharpens it; any vector will do
            image = size @ vector / self.diagonal
            ratio = image / vector
            vector = np.sqrt(np.maximum(image * vector, 1e-12 * vector * vector))
        return float(ratio.max()) * SUMS

    @cached_property
    def asymmetry(self) -> float:
        """Largest eigenvalue of ``|K - K^T|`` in units of D, at most."""
        stiffness, root = self.model.stiffness, np.sqrt(self.diagonal)
        return float((abs(stiffness - stiffness.T) @ (1.0 / root) / root).max()) * SUMS

    @cached_property
    def floor(self) -> float:
        """mu: proven, at most a few times below the best; 0 where K is too ill-conditioned to prove any."""
        if not (self.diagonal > 0).all():
            return 0.0
        factor, vector = self.model.static_factorization, np.random.default_rng(0).standard_normal(self.model.n)
        vector /= np.sqrt(self.diagonal)
        quotient = 0.0
        for _ in range(6):
            weighted = self.diagonal * vector
            image = factor.solve(weighted)
            energy = float(image @ weighted)
            quotient = energy / float(image @ (self.diagonal * image))
            vector = image / np.sqrt(abs(energy))
        # a Rayleigh quotient comes from above
        for mu in (0.6 * quotient, 0.1 * quotient, 1e-3 * quotient):
            if not mu > 8 * UNIT:
                break
            pencil = DynamicStiffness(self.model.stiffness, sp.diags_array(self.diagonal, format="csr"))
            try:
                if count_negative(pencil.shifted(mu), np.sqrt(self.diagonal), backend=self.model.backend) == 0:
                    return mu - 4 * UNIT - self.asymmetry
            except SolverError:
                continue
        return 0.0

    @cached_property
    def reach(self) -> float:
        """1 / sqrt(mu): ``||r||*`` of a vector r with ``|r / D|_D = 1``, at most; infinite where nothing is proven."""
        return 1.0 / np.sqrt(self.floor) if self.floor > 0 else np.inf

    # ---- sizes of fields (..., n) and residuals (..., n): along the last axis -----------------------------------

    def size(self, fields: np.ndarray) -> Floats:
        """(...) ndarray [J^1/2]: ``|x|_D``."""
        return np.sqrt(_squares(fields, self.diagonal))

    def plain_dual(self, residual: np.ndarray) -> Floats:
        """(...) ndarray [J^1/2]: a bound of ``||r||*`` without a solve."""
        return self._times_reach(np.sqrt(_squares(residual, 1.0 / self.diagonal)))

    def _times_reach(self, size: Floats) -> Floats:
        return np.where(size > 0, size * (self.reach * SUMS), 0.0)  # nothing is nothing, whatever is proven

    def product_error(self, size: Floats, stiffness: float | Floats = 1.0, mass: float | Floats = 0.0, *,
                      terms: int = 0, kind: type = float) -> Floats:
        """Bound of what rounding makes of ``stiffness K x - mass M x`` in the norm ||.||*.

        Parameters
        ----------
        size : (...) ndarray
            ``|x|_D``.
        stiffness, mass : float or (...) ndarray
            Magnitudes of the factors.
        terms : int
            Operations beside the products' own.
        kind : type
            Precision of the sums.
        """
        share = gamma(self.row_length + terms + 3, kind)
        return self._times_reach(size * (
            share * (stiffness * self.spread + mass * self.mass_spread) + stiffness * self.asymmetry))

    @cached_property
    def row_sums(self) -> Floats:
        """(n,) ndarray: sums of the magnitudes of each row of K."""
        return np.asarray(abs(self.model.stiffness).sum(axis=1)).ravel()

    def image(self, fields: np.ndarray) -> np.ndarray:
        """(k, n) ndarray: K x of the rows of ``fields``, without a complex copy of K."""
        if np.iscomplexobj(fields):
            return self.image(fields.real) + 1j * self.image(fields.imag)
        return (self.model.stiffness @ np.ascontiguousarray(fields.T)).T

    def norms(self, fields: np.ndarray, image: np.ndarray | None = None) -> tuple[Floats, Floats]:
        """Least and largest ``||x||`` that fields (k, n) may have, (k,) each [J^1/2]; ``image`` where it is there."""
        image = self.image(fields) if image is None else image
        energy = np.einsum("kn,kn->k", fields.conj(), image).real
        doubt = self.inner_doubt * SUMS * _squares(fields, self.diagonal)
        return np.sqrt(np.maximum(energy - doubt, 0.0)) / SUMS, np.sqrt(np.maximum(energy + doubt, 0.0)) * SUMS

    @cached_property
    def inner_doubt(self) -> float:
        """Rounding of a computed x^T K y, in units of ``|x|_D |y|_D``."""
        return gamma(self.row_length + len(self.diagonal) + 5) * self.spread + self.asymmetry

    def dual(self, residual: np.ndarray) -> tuple[np.ndarray, Floats, Floats]:
        """Static responses to residuals, and the norms that they prove.

        Parameters
        ----------
        residual : (k, n) ndarray [N]
            Real or complex.

        Returns
        -------
        response : (k, n) ndarray [m]
            K^-1 r as computed.
        miss : (k,) ndarray [J^1/2]
            Bound of ``||K^-1 r - response||``.
        norm : (k,) ndarray [J^1/2]
            Bound of ``||r||*``.
        """
        response = np.ascontiguousarray(self.model.static_factorization.solve(residual.T).T)
        image = self.image(response)
        miss = self.plain_dual(residual - image) + self.product_error(self.size(response), terms=2)
        miss += 2 * UNIT * self.plain_dual(residual)
        return response, miss, self.norms(response, image)[1] + miss


def block_product(rows: Floats, columns: Floats) -> tuple[Floats, int]:
    """``rows @ columns`` in blocks, and how many roundings an entry has met at most: 2 sqrt(n) in place of n."""
    n = rows.shape[1]
    block = int(np.sqrt(n)) + 1
    starts = range(0, n, block)
    total = sum(rows[:, start:start + block] @ columns[start:start + block] for start in starts)
    return np.asarray(total), block + len(starts)


def _squares(fields: np.ndarray, weight: Floats) -> Floats:
    parts = (fields.real, fields.imag) if np.iscomplexobj(fields) else (fields,)
    return np.asarray(sum((part * part) @ weight for part in parts))


def energy_norms(fields: np.ndarray, stiffness: sp.sparray) -> np.ndarray:
    """``sqrt(u^H K u)`` of the columns of ``fields`` (n, n_case), rounded as it comes: for errors that are shown.

    Returns
    -------
    (n_case,) ndarray [J^1/2]
    """
    parts = (fields.real, fields.imag) if np.iscomplexobj(fields) else (fields,)
    return np.sqrt(sum(np.einsum("ij,ij->j", part, stiffness @ part) for part in map(np.ascontiguousarray, parts)))
