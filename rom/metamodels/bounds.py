"""What a bound of an error is, and why it holds: every theorem behind the word "bound" in one place.

**Setting.** K real, symmetric, positive definite, M real, symmetric, positive semi-definite; Z = c K - w M with c = 1
+ i eta and w = omega^2, the doubles that an operating point was turned into; Z = K in statics. The load f = sum F_j
b_j is the exact sum, or any sum of it in double precision. u = Z^-1 f is the true answer, u_hat any other, e = u -
u_hat, r = f - Z u_hat. ``||e|| = sqrt(e^H K e)``, ``||r||* = sqrt(r^H K^-1 r) = max |e^H r| / ||e||``.

**1. Statics.** ``e = K^-1 r``, hence ``||e|| = ||r||*``.

**2. Split by modes.** x_k (k = 1 ... m) are any fields, theta_k any positive numbers, d_k = K x_k - theta_k M x_k.
With X = [x_k], Theta = diag(theta_k), bounds delta_k >= ``||d_k||*``,

    kappa_K >= ||Theta^-1/2 (X^T K X - Theta) Theta^-1/2||_2,   kappa_M >= ||Theta^-1/2 (X^T M X - I) Theta^-1/2||_2

and a number Lambda with v^T K v >= Lambda v^T M v wherever X^T K v = 0, let

    alpha = max_(0 <= t <= 1 / Lambda) 1 / |c - w t|,           beta = max_k 1 / |c - w / theta_k|,
    tau = sqrt(sum delta_k^2 / theta_k^3),  eps = w tau,  nu = |c| kappa_K + w kappa_M,  beta' = beta / (1 - beta nu).

If rho >= ``||r||*`` and varsigma >= ``|Theta^-1/2 X^T r|_2``, beta nu < 1 and alpha beta' eps^2 < 1, then e = X a + v
with

    ||v|| <= alpha (rho + eps beta' varsigma) / (1 - alpha beta' eps^2),
    |Theta^1/2 a|_2 <= beta' (varsigma + eps ||v||),
    ||e||^2 <= (1 + kappa_K) |Theta^1/2 a|_2^2 + ||v||^2.

*Proof.* Every e is X a + v with X^T K v = 0, and energies add: ``||e||^2 = ||X a||^2 + ||v||^2``. As K X = M X Theta
+ D, X^T M v = -Theta^-1 D^T v. The equation Z e = r tested with X and with the fields w_0 of the complement (X^T K
w_0 = 0) reads

    (c X^T K X - w X^T M X) a + w Theta^-1 D^T v = X^T r,
    c w_0^H K v - w w_0^H M v + w w_0^H D Theta^-1 a = w_0^H r.

In the inner product of K the operator of the second line is c I - w T, T self-adjoint on the complement with a
spectrum in [0, 1 / Lambda]: normal, so that its inverse has the norm alpha. The coupling is at most eps ``|Theta^1/2
a|_2`` ``||w_0||`` by the inequality of Cauchy and Schwarz. The first line, scaled by Theta^-1/2, is diagonal (of
inverse beta) but for nu, and coupled by eps ``||v||``. Insert one into the other. []

Without modes (m = 0) Lambda = 0 serves: alpha = 1 / eta for w > 0. With a loss stiffness L >= 0 beside, Z + i L, only
that is left, as Im e^H (Z + i L) e >= eta ``||e||^2``.

**3. No mode is missing.** Let a count of negative eigenvalues (:mod:`rom.fullorder.inertia`) show that K - sigma M
has n_s of them but for rounding of its entries, E, ``|E_ij| <= u (|K_ij| + 2 sigma |M_ij|)``, so that ``|x^T E x| <=
delta x^T K x`` with delta = 2 u (rho_K + sigma rho_M) / mu (:mod:`rom.fullorder.energy_norm`). Then x^T (K - sigma'
M) x >= 0 on a space of codimension n_s, sigma' = sigma / (1 + delta): K^-1 M has at most n_s eigenvalues above 1 /
sigma'. Let X hold n_s computed modes. In the inner product of K, T = K^-1 M differs from the sum of its two parts on
span X and on the complement by a symmetric coupling of norm tau' = tau / sqrt(1 - kappa_K), since T X = X Theta^-1 -
K^-1 D Theta^-1; by Weyl's inequality that sum has at most n_s eigenvalues above 1 / sigma' + tau'. If the part on
span X has n_s such by itself,

    (1 / theta_max - kappa_M) / (1 + kappa_K) > 1 / sigma' + tau',

the complement has none: Lambda = 1 / (1 / sigma' + tau'). Where only the first m of the n_s are kept, the complement
gains the others, which are at most (1 / theta_(m+1) + kappa_M + q^2 / theta_1) / (1 - kappa_K) with q = kappa_K / (1
- kappa_K), and tau' once more. []

**4. The true answer is not small.** With f = M X p + f', ``||f'||*`` from R_0 to R_1, l at least
``|Theta^-1/2 X^T f'|_2`` and ``|Theta^-1/2 (X^T f - p)|_2``, A = ``|Theta^1/2 q|_2`` for q_k = p_k / (c theta_k - w),
varpi = sum ``|p_k|`` delta_k / theta_k and s = max(``|c|``, ``|c - w / Lambda|``):

    ||u||^2 >= (1 - kappa_K) a_0^2 + v_0^2,
    a_0 = A - beta (l + nu A_1 + eps V_1),   v_0 = (R_0 - l / sqrt(1 - kappa_K) - varpi - eps A_1) / s

(zero where negative), A_1 and V_1 being the bounds of ``|Theta^1/2 a|_2`` and ``||v||`` that theorem 2 gives for f
itself, with alpha (R_1 + varpi) in place of alpha rho and A + beta l in place of beta varsigma. *Proof.* The same two
lines for u. The operator c I - w T has the norm s at most. The complement's part of K^-1 f is that of K^-1 f', less
at most varpi from the modes' (as K^-1 M X = X Theta^-1 - K^-1 D Theta^-1), and the part of K^-1 f' in span X is l /
sqrt(1 - kappa_K) at most. []

**5. Sums of stored fields.** If ``u_hat_i`` is the sum of N products y_k v_k,i in a precision of unit roundoff u_p,
in any order, it differs from the exact sum by at most gamma_(N+2) sum ``|y_k| |v_k,i|``, and fields with ``|e_i| <=
g_i`` have ``||e||^2 <= sum_i g_i^2 sum_j |K_ij|`` (from ``2 |K_ij e_i e_j| <= |K_ij| (e_i^2 + e_j^2)``). Summed in
double and rounded to single precision once, it errs by ``u_p |u_hat_i|`` besides, and ``u_hat^H diag(sum_j |K_ij|)
u_hat`` is a form of the y_k. What single precision took from the stored fields is measured, and its energy a form as
well. In single precision numbers may underflow: coefficients and products lose at most h = 2^-149 each, h (N + sum
``|v_k,i|``) in an entry.

Everything else is arithmetic: which residual a method leaves, and what its numbers are worth in floating point,
stands with the method (:mod:`rom.metamodels.residual_bound`, :mod:`rom.metamodels.modal_bound`,
:mod:`rom.metamodels.superposition`). Assumptions: IEEE 754 arithmetic, in double precision without overflow or
underflow; K and M as stored (what K lacks of symmetry counts as rounding); the inertia counts, each but for a
probability of 1e-12.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from rom.fullorder.energy_norm import UNIT


def amplification_beyond(eigenvalue_bound: float, stiffness: Any, inertia: Any) -> Any:
    """alpha of theorem 2.

    Parameters
    ----------
    eigenvalue_bound : float [rad^2/s^2]
        Lambda.
    stiffness : (n_case,) ndarray
        c = 1 + i eta.
    inertia : (n_case,) ndarray [rad^2/s^2]
        w = omega^2.

    Returns
    -------
    (n_case,) ndarray
    """
    # 1 / |1 + i eta - w t| is largest where w t comes closest to 1
    reach = inertia / eigenvalue_bound if eigenvalue_bound > 0 else np.where(inertia > 0, np.inf, 0.0)
    return 1.0 / np.abs(stiffness - np.minimum(reach, 1.0))


def split_error(beyond: Any, kept: Any, coupling: Any, deviation: Any, residual: Any, along: Any) -> tuple[Any, Any]:
    """Theorem 2: the two parts of an error.

    Parameters
    ----------
    beyond, kept : (n_case,) ndarray
        alpha and beta.
    coupling, deviation : (n_case,) ndarray
        eps and nu.
    residual, along : (n_case,) ndarray [J^1/2]
        rho and varsigma.

    Returns
    -------
    outside, inside : (n_case,) ndarray [J^1/2]
        Bounds of ``||v||`` and of ``|Theta^1/2 a|_2``; infinite where the theorem says nothing.
    """
    kept = _over(kept, 1.0 - kept * deviation)
    outside = _over(beyond * (residual + coupling * kept * along), 1.0 - beyond * kept * coupling * coupling)
    return outside, kept * (along + coupling * outside)


def _over(value: Any, rest: Any) -> Any:
    return np.where(rest > 0.0, value / np.where(rest > 0.0, rest, 1.0), np.inf)


def eigenvalue_bound(shift: float, count_error: float, eigenvalue: np.ndarray, kept: int, stiff_deviation: float,
                     mass_deviation: float, coupling: float) -> float:
    """Theorem 3: Lambda, or 0 where it proves nothing.

    Parameters
    ----------
    shift : float [rad^2/s^2]
        sigma, below which as many eigenvalues were counted as ``eigenvalue`` has.
    count_error : float
        delta.
    eigenvalue : (n_s,) ndarray [rad^2/s^2]
        theta, the kept ones first.
    kept : int
        m.
    stiff_deviation, mass_deviation, coupling : float
        kappa_K, kappa_M and tau.
    """
    if not stiff_deviation < 1.0:
        return 0.0
    coupling = coupling / np.sqrt(1.0 - stiff_deviation)
    inverse = (1.0 + count_error) / shift + coupling
    if not (1.0 / eigenvalue.max() - mass_deviation) / (1.0 + stiff_deviation) > inverse:
        return 0.0
    if kept < len(eigenvalue):
        tilt = stiff_deviation / (1.0 - stiff_deviation)
        others = (1.0 / eigenvalue[kept:].min() + mass_deviation + tilt * tilt / eigenvalue.min()) / (
            1.0 - stiff_deviation)
        inverse = max(inverse, others) + coupling
    return float((1.0 - 8 * UNIT) / inverse)


def underflow(sizes: Any, grain: float, terms: int = 1) -> Any:
    """Energy norm of what underflow may take from sums in single precision (theorem 5).

    Parameters
    ----------
    sizes : (n_case,) ndarray
        Sum of the fields' `rounding_size`.
    grain : float
        `rounding_size` of a field of ones.
    terms : int
        N; one where the sum is rounded to single precision at its end alone.
    """
    return 2.0 ** -149 * (terms * grain + sizes)


def rounding_size(stiffness: sp.sparray, fields: np.ndarray) -> np.ndarray:
    """Theorem 5's weighted 2-norm of fields (..., n) [m]: makes an error of each entry one of energy [J^1/2]."""
    weight = np.asarray(abs(stiffness).sum(axis=1)).ravel()
    return np.sqrt(np.einsum("...n,...n,n->...", fields, fields, weight, optimize=True))
