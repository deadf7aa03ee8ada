"""Energy, forces and tangents of hybrid quadrilaterals in generalized plane strain, compiled.

Four corners, 2 x 2 integration points, one pressure an element that stands for the mean dilatation (Simo, Taylor and
Pister, Comput. Methods Appl. Mech. Eng. 51 (1985) 177-208). The pressure is an unknown of its own: it enters linearly
and is updated linearly, so that Newton's steps do not depend on the bulk modulus. The out-of-plane stretch is one
unknown that all elements share.
"""

from __future__ import annotations

from math import exp

import numba
import numpy as np

from rom.finger_on_glass.section import CORNERS, GAUSS
from rom.finger_on_glass.tissue import FIBRE_CAP

SMALLEST_JACOBIAN = 0.02


def shape_gradients(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the shape functions in the undeformed section, and integration weights.

    Parameters
    ----------
    corners : (n_quad, 4, 2) ndarray [mm]

    Returns
    -------
    gradients : (n_quad, 4, 4, 2) ndarray [1/mm]
        Integration point, corner, direction.
    weights : (n_quad, 4) ndarray [mm^2]

    Raises
    ------
    ValueError
        Where a quadrilateral is turned inside out.
    """
    local = np.stack([0.25 * CORNERS[None, :, 0] * (1 + GAUSS[:, 1:] * CORNERS[None, :, 1]),
                      0.25 * CORNERS[None, :, 1] * (1 + GAUSS[:, :1] * CORNERS[None, :, 0])], axis=-1)
    jacobian = np.einsum("qak,eai->eqik", local, corners)
    weights = np.linalg.det(jacobian)
    if weights.min() <= 0:
        raise ValueError(f"{int((weights <= 0).any(axis=1).sum())} elements of the section are turned inside out: "
                         "choose a rounder bone or skin, or fewer rays")
    return np.ascontiguousarray(np.einsum("qak,eqki->eqai", local, np.linalg.inv(jacobian))), weights


@numba.njit(cache=True)
def element_response(gradients, weights, fibres, displacement, stretch_z, pressure, c, k1, k2, tangent, force,
                     dilatation_force, dilatation, energy, largest_fibre):
    """Fill the element arrays; the last unknown of each element is the out-of-plane stretch.

    Parameters
    ----------
    gradients, weights, fibres
        As from :func:`shape_gradients` and :func:`rom.finger_on_glass.tissue.fibre_directions`.
    displacement : (n_quad, 8) ndarray [mm]
    stretch_z : float
    pressure : (n_quad,) ndarray [MPa]
        Positive where the element is stretched.
    c, k1, k2 : float
    tangent : (n_quad, 9, 9) ndarray, out
        Second derivatives of the energy at fixed pressure, without the dilatation's own stiffness.
    force : (n_quad, 9) ndarray, out
        First derivatives without the pressure's share.
    dilatation_force : (n_quad, 9) ndarray, out
        Derivative of the element's volume.
    dilatation : (n_quad,) ndarray, out
        Volume over initial volume, minus one.
    energy : (n_quad,) ndarray [N mm/mm], out
        Isochoric part.
    largest_fibre : (n_quad,) ndarray, out
        Largest lambda^2 - 1 of a fibre.

    Returns
    -------
    bool
        False where a point is (nearly) turned inside out: the state is unusable.
    """
    usable = True
    stress = np.empty(5)
    stiffness = np.empty((5, 5))
    dj = np.empty(5)
    d2j = np.zeros((5, 5))
    di = np.empty(5)
    d1 = np.empty(5)
    product = np.empty((4, 8))
    for e in range(len(weights)):
        for i in range(9):
            force[e, i] = 0.0
            dilatation_force[e, i] = 0.0
            for j in range(9):
                tangent[e, i, j] = 0.0
        energy[e] = 0.0
        largest_fibre[e] = -1.0
        initial, current = 0.0, 0.0
        for q in range(4):
            w = weights[e, q]
            f00, f01, f10, f11 = 1.0, 0.0, 0.0, 1.0
            for a in range(4):
                g0, g1 = gradients[e, q, a, 0], gradients[e, q, a, 1]
                u0, u1 = displacement[e, 2 * a], displacement[e, 2 * a + 1]
                f00 += u0 * g0
                f01 += u0 * g1
                f10 += u1 * g0
                f11 += u1 * g1
            in_plane = f00 * f11 - f01 * f10
            jac = in_plane * stretch_z
            if not jac > SMALLEST_JACOBIAN:
                usable = False
                jac = SMALLEST_JACOBIAN
            dj[0], dj[1], dj[2], dj[3] = stretch_z * f11, -stretch_z * f10, -stretch_z * f01, stretch_z * f00
            dj[4] = in_plane
            d2j[0, 3] = d2j[3, 0] = stretch_z
            d2j[1, 2] = d2j[2, 1] = -stretch_z
            d2j[0, 4] = d2j[4, 0] = f11
            d2j[1, 4] = d2j[4, 1] = -f10
            d2j[2, 4] = d2j[4, 2] = -f01
            d2j[3, 4] = d2j[4, 3] = f00
            scale = jac ** (-2.0 / 3.0)
            i1 = f00 * f00 + f01 * f01 + f10 * f10 + f11 * f11 + stretch_z * stretch_z
            di[0], di[1], di[2], di[3], di[4] = 2 * f00, 2 * f01, 2 * f10, 2 * f11, 2 * stretch_z
            energy[e] += w * c * (scale * i1 - 3)
            for i in range(5):
                stress[i] = c * scale * (di[i] - 2.0 / 3.0 * i1 / jac * dj[i])
                for k in range(5):
                    value = (-2.0 / 3.0 / jac * (di[i] * dj[k] + dj[i] * di[k]) - 2.0 / 3.0 * i1 / jac * d2j[i, k]
                             + 10.0 / 9.0 * i1 / jac / jac * dj[i] * dj[k])
                    if i == k:
                        value += 2.0
                    stiffness[i, k] = c * scale * value + pressure[e] * d2j[i, k]
            for n in range(fibres.shape[2]):
                a0, a1 = fibres[e, q, n, 0], fibres[e, q, n, 1]
                s0, s1 = f00 * a0 + f01 * a1, f10 * a0 + f11 * a1
                i4 = s0 * s0 + s1 * s1
                strain = scale * i4 - 1.0
                largest_fibre[e] = max(largest_fibre[e], strain)
                if strain <= 0.0:
                    continue
                if strain > FIBRE_CAP:  # the energy goes on quadratically, for trial states only
                    growth = exp(k2 * FIBRE_CAP * FIBRE_CAP)
                    w2 = k1 * growth * (1 + 2 * k2 * FIBRE_CAP * FIBRE_CAP)
                    w1 = k1 * FIBRE_CAP * growth + w2 * (strain - FIBRE_CAP)
                    at_cap = k1 * FIBRE_CAP * growth
                    energy[e] += w * (k1 / (2 * k2) * (growth - 1) + 0.5 * (w1 + at_cap) * (strain - FIBRE_CAP))
                else:
                    growth = exp(k2 * strain * strain)
                    w1 = k1 * strain * growth
                    w2 = k1 * growth * (1 + 2 * k2 * strain * strain)
                    energy[e] += w * k1 / (2 * k2) * (growth - 1)
                di[0], di[1], di[2], di[3], di[4] = 2 * s0 * a0, 2 * s0 * a1, 2 * s1 * a0, 2 * s1 * a1, 0.0
                for i in range(5):
                    d1[i] = scale * (di[i] - 2.0 / 3.0 * i4 / jac * dj[i])
                    stress[i] += w1 * d1[i]
                for i in range(5):
                    for k in range(5):
                        value = (-2.0 / 3.0 / jac * (di[i] * dj[k] + dj[i] * di[k]) - 2.0 / 3.0 * i4 / jac * d2j[i, k]
                                 + 10.0 / 9.0 * i4 / jac / jac * dj[i] * dj[k])
                        stiffness[i, k] += w2 * d1[i] * d1[k] + w1 * scale * value
                # second derivatives of F a . F a
                for row in range(2):
                    stiffness[2 * row, 2 * row] += w1 * scale * 2 * a0 * a0
                    stiffness[2 * row, 2 * row + 1] += w1 * scale * 2 * a0 * a1
                    stiffness[2 * row + 1, 2 * row] += w1 * scale * 2 * a0 * a1
                    stiffness[2 * row + 1, 2 * row + 1] += w1 * scale * 2 * a1 * a1
            initial += w
            current += w * in_plane * stretch_z
            for a in range(4):
                g0, g1 = gradients[e, q, a, 0], gradients[e, q, a, 1]
                for i in range(2):
                    force[e, 2 * a + i] += w * (stress[2 * i] * g0 + stress[2 * i + 1] * g1)
                    dilatation_force[e, 2 * a + i] += w * (dj[2 * i] * g0 + dj[2 * i + 1] * g1)
                    for m in range(4):
                        product[m, 2 * a + i] = w * (stiffness[m, 2 * i] * g0 + stiffness[m, 2 * i + 1] * g1)
                    tangent[e, 2 * a + i, 8] += w * (stiffness[2 * i, 4] * g0 + stiffness[2 * i + 1, 4] * g1)
            force[e, 8] += w * stress[4]
            dilatation_force[e, 8] += w * dj[4]
            tangent[e, 8, 8] += w * stiffness[4, 4]
            for a in range(4):
                g0, g1 = gradients[e, q, a, 0], gradients[e, q, a, 1]
                for i in range(2):
                    for m in range(2 * a + i, 8):
                        tangent[e, 2 * a + i, m] += g0 * product[2 * i, m] + g1 * product[2 * i + 1, m]
        for i in range(9):
            for j in range(i):
                tangent[e, i, j] = tangent[e, j, i]
        dilatation[e] = current / initial - 1.0
    return usable
