"""The finger's equations on a reduced basis, compiled: residual and tangent at a trial state.

Unknowns: coordinates q of the displacement ``u = Phi q`` [mm], the out-of-plane stretch, the plate's height [mm];
beside them coordinates of the element pressures in a basis of their own, updated linearly as in the full model.

The dilatation of a quadrilateral in generalized plane strain is a quadratic polynomial of the displacement times the
out-of-plane stretch, and the pressures enter linearly: the volume terms of *all* elements are projected once and are
exact online. Only the isochoric energy is integrated at few points
(`hyper_reduction.py`). Contact and friction are those of :mod:`rom.finger_on_glass.contact`, node by node.
"""

from __future__ import annotations

from math import exp

import numba
import numpy as np

from rom.finger_on_glass.element import SMALLEST_JACOBIAN
from rom.finger_on_glass.tissue import FIBRE_CAP


@numba.njit(cache=True)
def isochoric(strain, stretch_z, fibres, weights, c, k1, k2, stress, tangent):
    """First and second derivatives of the isochoric energy at points, times their weights.

    Parameters
    ----------
    strain : (4 n,) ndarray
        Displacement gradients of the points.
    stress : (n, 5) ndarray, out
        By the in-plane deformation gradient's four entries and the out-of-plane stretch.
    tangent : (n, 5, 5) ndarray, out

    Returns
    -------
    float
        Largest lambda^2 - 1 of a fibre; NaN where a point is (nearly) turned inside out.
    """
    largest = -1.0
    usable = True
    dj = np.empty(5)
    di = np.empty(5)
    d1 = np.empty(5)
    for p in range(len(weights)):
        w = weights[p]
        f00, f01 = 1.0 + strain[4 * p], strain[4 * p + 1]
        f10, f11 = strain[4 * p + 2], 1.0 + strain[4 * p + 3]
        in_plane = f00 * f11 - f01 * f10
        jac = in_plane * stretch_z
        if not jac > SMALLEST_JACOBIAN:
            usable = False
            jac = SMALLEST_JACOBIAN
        inverse = 1.0 / jac
        scale = jac ** (-2.0 / 3.0)
        dj[0], dj[1], dj[2], dj[3] = stretch_z * f11, -stretch_z * f10, -stretch_z * f01, stretch_z * f00
        dj[4] = in_plane
        i1 = f00 * f00 + f01 * f01 + f10 * f10 + f11 * f11 + stretch_z * stretch_z
        di[0], di[1], di[2], di[3], di[4] = 2 * f00, 2 * f01, 2 * f10, 2 * f11, 2 * stretch_z
        # every term is linear in the invariants and their derivatives: all families add up before they are expanded
        first = w * c * scale
        invariant = first * i1
        diagonal = 2.0 * first
        for i in range(5):
            stress[p, i] = first * di[i]
            for j in range(5):
                tangent[p, i, j] = 0.0
        t00, t01, t11 = 0.0, 0.0, 0.0
        for n in range(fibres.shape[1]):
            a0, a1 = fibres[p, n, 0], fibres[p, n, 1]
            s0, s1 = f00 * a0 + f01 * a1, f10 * a0 + f11 * a1
            i4 = s0 * s0 + s1 * s1
            e = scale * i4 - 1.0
            largest = max(largest, e)
            if e <= 0.0:
                continue
            if e > FIBRE_CAP:  # the energy goes on quadratically, for trial states only
                growth = exp(k2 * FIBRE_CAP * FIBRE_CAP)
                w2 = k1 * growth * (1 + 2 * k2 * FIBRE_CAP * FIBRE_CAP)
                w1 = k1 * FIBRE_CAP * growth + w2 * (e - FIBRE_CAP)
            else:
                growth = exp(k2 * e * e)
                w1 = k1 * e * growth
                w2 = k1 * growth * (1 + 2 * k2 * e * e)
            w1 *= w * scale
            w2 *= w * scale * scale
            back = 2.0 / 3.0 * i4 * inverse
            d1[0], d1[1] = 2 * s0 * a0 - back * dj[0], 2 * s0 * a1 - back * dj[1]
            d1[2], d1[3] = 2 * s1 * a0 - back * dj[2], 2 * s1 * a1 - back * dj[3]
            d1[4] = -back * dj[4]
            for i in range(5):
                row = w2 * d1[i]
                for j in range(i, 5):
                    tangent[p, i, j] += row * d1[j]
            invariant += w1 * i4
            stress[p, 0] += w1 * 2 * s0 * a0
            stress[p, 1] += w1 * 2 * s0 * a1
            stress[p, 2] += w1 * 2 * s1 * a0
            stress[p, 3] += w1 * 2 * s1 * a1
            t00 += 2 * w1 * a0 * a0
            t01 += 2 * w1 * a0 * a1
            t11 += 2 * w1 * a1 * a1
        cross, second = -2.0 / 3.0 * inverse, -2.0 / 3.0 * invariant * inverse
        square = 10.0 / 9.0 * invariant * inverse * inverse
        for i in range(5):  # stress[p] still holds the sum of the invariants' own derivatives
            for j in range(i, 5):
                tangent[p, i, j] += cross * (stress[p, i] * dj[j] + dj[i] * stress[p, j]) + square * dj[i] * dj[j]
            tangent[p, i, i] += diagonal
        tangent[p, 0, 3] += second * stretch_z
        tangent[p, 1, 2] -= second * stretch_z
        tangent[p, 0, 4] += second * f11
        tangent[p, 1, 4] -= second * f10
        tangent[p, 2, 4] -= second * f01
        tangent[p, 3, 4] += second * f00
        tangent[p, 0, 0] += t00
        tangent[p, 0, 1] += t01
        tangent[p, 1, 1] += t11
        tangent[p, 2, 2] += t00
        tangent[p, 2, 3] += t01
        tangent[p, 3, 3] += t11
        for i in range(5):
            stress[p, i] += second * dj[i]
        for i in range(5):
            for j in range(i):
                tangent[p, i, j] = tangent[p, j, i]
    return largest if usable else np.nan


@numba.njit(cache=True)
def volumes(finger, q, stretch_z):
    """Pressure modes times the change of volume, and its derivatives by q and the stretch: (m,), (m, r + 1) ndarray."""
    m, r = finger.volume_linear.shape
    bent = np.dot(finger.volume_quadratic, q).reshape(m, r)
    change, slope = np.empty(m), np.empty((m, r + 1))
    for k in range(m):
        in_plane = 0.0
        for i in range(r):
            in_plane += (finger.volume_linear[k, i] + bent[k, i]) * q[i]
            slope[k, i] = stretch_z * (finger.volume_linear[k, i] + 2.0 * bent[k, i])
        slope[k, r] = finger.volume[k] + in_plane
        change[k] = stretch_z * slope[k, r] - finger.volume[k]
    return change, slope


@numba.njit(cache=True)
def contact_tractions(finger, constants, history, q, plate_y, plate_x, predict):
    """`rom.finger_on_glass.contact.contact_response` at the skin nodes that may touch.

    Returns
    -------
    gap, relative, pressure, shear, shear_by_x, shear_by_gap : (s,) ndarray
    closed, slipping : (s,) ndarray of bool
    """
    s = len(finger.height)
    gap = finger.height + np.dot(finger.skin_y, q) - plate_y
    relative = np.dot(finger.skin_x, q) - plate_x
    pressure, shear = np.zeros(s), np.zeros(s)
    shear_by_x, shear_by_gap = np.zeros(s), np.zeros(s)
    closed, slipping = np.zeros(s, np.bool_), np.zeros(s, np.bool_)
    kn, kt, friction = constants.normal_stiffness, constants.tangential_stiffness, constants.friction
    for i in range(s):
        if not gap[i] < 0:
            continue
        closed[i] = True
        pressure[i] = -kn * gap[i]
        touching = not history.closed[i]
        travel = history.gap[i] - gap[i] if touching else 1.0
        share = -gap[i] / travel if touching else 1.0
        moved = relative[i] - history.relative[i]
        trial = history.shear[i] + kt * share * moved
        limit = friction * pressure[i]
        if predict:
            slipping[i] = history.slipping[i]
            direction = np.sign(history.shear[i])
        else:
            slipping[i] = abs(trial) > limit
            direction = np.sign(trial)
        if slipping[i]:
            shear[i] = limit * direction
            shear_by_gap[i] = -friction * kn * direction
        else:
            shear[i] = trial
            shear_by_x[i] = kt * share
            if touching:
                shear_by_gap[i] = -kt * moved * history.gap[i] / travel**2
    return gap, relative, pressure, shear, shear_by_x, shear_by_gap, closed, slipping


@numba.njit(cache=True)
def assemble(finger, constants, history, q, stretch_z, plate_y, plate_x, s, normal_force, predict, drag, q_before):
    """Residual and condensed tangent.

    Parameters
    ----------
    finger : ReducedFinger
    constants : Constants
    history : Contact
    q : (r,) ndarray [mm]
    stretch_z, plate_y, plate_x : float
    s : (m,) ndarray
        Pressure coordinates.
    normal_force : float [N/mm]
    predict : bool
        See :func:`rom.finger_on_glass.contact.contact_response`.
    drag : float [MPa/mm]
        Viscous resistance against motion from ``q_before``.

    Returns
    -------
    own, condensed : (r + 2,) ndarray [N/mm]
        Residual with the pressures ``s``; right-hand side of Newton's step with the pressures eliminated.
    tangent : (r + 2, r + 2) ndarray
    change, slope
        As from :func:`volumes`.
    contact : tuple
        As from :func:`contact_tractions`.
    largest_fibre : float
        NaN where the state is unusable.
    """
    n, r, m = len(finger.weights), len(q), len(s)
    stress, point_tangent = np.empty((n, 5)), np.empty((n, 5, 5))
    strain = np.dot(finger.gradients, q)
    largest = isochoric(strain, stretch_z, finger.fibres, finger.weights, constants.c, constants.k1, constants.k2,
                        stress, point_tangent)
    change, slope = volumes(finger, q, stretch_z)

    # isochoric part: G^T P and G^T A G
    flat = np.empty(4 * n)
    product = np.empty((4 * n, r))
    stretch_column = np.empty(4 * n)
    force_z, tangent_zz = constants.out_of_plane * (stretch_z - 1.0), constants.out_of_plane
    for p in range(n):
        for i in range(4):
            row = 4 * p + i
            flat[row] = stress[p, i]
            stretch_column[row] = point_tangent[p, i, 4]
            a0, a1 = point_tangent[p, i, 0], point_tangent[p, i, 1]
            a2, a3 = point_tangent[p, i, 2], point_tangent[p, i, 3]
            for k in range(r):
                product[row, k] = (a0 * finger.gradients[4 * p, k] + a1 * finger.gradients[4 * p + 1, k]
                                   + a2 * finger.gradients[4 * p + 2, k] + a3 * finger.gradients[4 * p + 3, k])
        force_z += stress[p, 4]
        tangent_zz += point_tangent[p, 4, 4]
    own, tangent = np.zeros(r + 2), np.zeros((r + 2, r + 2))
    block = np.dot(finger.gradients.T, product)
    # volume part: s . change, and its second derivatives at the pressure that Newton's step uses
    bent = np.dot(s, finger.volume_quadratic.reshape(m, r * r)).reshape(r, r)
    block += 2.0 * stretch_z * bent
    in_plane = np.ascontiguousarray(slope[:, :r])
    block += constants.bulk * np.dot(in_plane.T, in_plane)
    if drag > 0:
        block += drag * finger.drag
    tangent[:r, :r] = block
    mixed = np.dot(finger.gradients.T, stretch_column)
    for k in range(m):
        rate = constants.bulk * slope[k, r] + s[k] / stretch_z
        for i in range(r):
            mixed[i] += rate * slope[k, i]
        tangent_zz += constants.bulk * slope[k, r] ** 2
    tangent[:r, r] = mixed
    tangent[r, :r] = mixed
    tangent[r, r] = tangent_zz
    own[:r] = np.dot(finger.gradients.T, flat)
    own[r] = force_z
    if drag > 0:
        own[:r] += drag * np.dot(finger.drag, q - q_before)

    contact = contact_tractions(finger, constants, history, q, plate_y, plate_x, predict)
    _add_contact(finger, constants, contact, own, tangent)
    own[r + 1] -= normal_force
    condensed = own.copy()
    own[:r + 1] += np.dot(slope.T, s)
    condensed[:r + 1] += np.dot(slope.T, constants.bulk * change)
    return own, condensed, tangent, change, slope, contact, largest


@numba.njit(cache=True)
def _add_contact(finger, constants, contact, own, tangent):
    _, _, pressure, shear, shear_by_x, shear_by_gap, closed, _ = contact
    r = len(own) - 2
    active = np.flatnonzero(closed)
    a = len(active)
    x, y = np.empty((a, r)), np.empty((a, r))
    left, right = np.empty((a, r)), np.empty((a, r))
    for j in range(a):
        i = active[j]
        w = finger.skin_length[i]
        stiff, along, across = w * constants.normal_stiffness, w * shear_by_x[i], w * shear_by_gap[i]
        push, pull = w * pressure[i], w * shear[i]
        for k in range(r):
            px, py = finger.skin_x[i, k], finger.skin_y[i, k]
            own[k] += pull * px - push * py
            x[j, k], y[j, k] = px, py
            left[j, k] = along * px + across * py
            right[j, k] = stiff * py
            tangent[k, r + 1] -= across * px + stiff * py
            tangent[r + 1, k] -= stiff * py
        own[r + 1] += push
        tangent[r + 1, r + 1] += stiff
    if a:
        tangent[:r, :r] += np.dot(x.T, left) + np.dot(y.T, right)
