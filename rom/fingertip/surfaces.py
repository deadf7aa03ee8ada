"""The fingertip's two surfaces, exterior and bone, over one disk.

Both surfaces are functions of the same logical point: disk coordinates (p, q), p lateral and q dorsal, with
the tip at the centre and the nail root's section on the unit circle, and a rear coordinate that runs from 0
at the nail root to 1 at the joint.  Exterior, front: ((x - x_r)/l_n)^e + |2y/w_f|^e = r^e with r^n +
(|z|/c)^n = 1, e of the equator, n and c of the upper or the lower half; rear: the section at x_r, extruded.
Bone: superelliptic sections about an axis, constant base, neck, tuft, and a quarter superellipse as its end.

Everything is in mm; the arithmetic is odd in p, so that meshes are mirror-symmetric to the last bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rom.fingertip.anatomy import Anatomy

Array = NDArray[np.float64]

# Transverse change counts this much more than axial in spacing nodes over the bone: nodes crowd at its round end, and
# lines from the skin do not slip behind the tuft (worst scaled Jacobian .36, the best that any weight gives)
_BONE_CROWDING = 2.5
_SAMPLES = 4001  # of arc length tables; their small error only shifts nodes along the surface


def exterior(anatomy: Anatomy, disk: Array, rear: Array) -> tuple[Array, Array]:
    """Points on the skin and their outward normals.

    Parameters
    ----------
    anatomy : Anatomy
    disk : (n, 2) ndarray [-]
        Disk coordinates, norm at most one.
    rear : (n,) ndarray [-]
        0 on the front surface, up to 1 at the joint; greater than zero only where the disk's norm is one.

    Returns
    -------
    points : (n, 3) ndarray [mm]
    normals : (n, 3) ndarray [-]
        Unit length, from the gradient of the implicit surface.
    """
    x_root, half_length, half_width = anatomy.nail_root, anatomy.nail_length, anatomy.fingertip_width / 2
    radius, direction = _polar(disk)
    along, across = _meridian(radius, half_length, (half_width + anatomy.fingertip_height / 2) / 2)
    across = across[:, None] * direction
    upper = direction[:, 1] >= 0
    n = np.where(upper, anatomy.upper_exponent, anatomy.shape.lower_exponent)
    height = np.where(upper, anatomy.dorsal_height, anatomy.palmar_height)

    e = anatomy.shape.equator_exponent
    scale = (_norm(along, across[:, 0], e) ** n + np.abs(across[:, 1]) ** n) ** (-1 / n)
    x_front = half_length * scale * along
    y, z = half_width * scale * across[:, 0], height * scale * across[:, 1]
    x = np.where(rear > 0, x_root * (1 - rear), x_root + x_front)

    equatorial = _norm(x_front / half_length, y / half_width, e)
    weight = np.where(equatorial > 0, np.where(equatorial > 0, equatorial, 1.0) ** (n - e), 0.0)
    gradient = np.stack(
        [
            weight * (x_front / half_length) ** (e - 1) / half_length,
            weight * np.sign(y) * np.abs(y / half_width) ** (e - 1) / half_width,
            np.sign(z) * np.abs(z / height) ** (n - 1) / height,
        ],
        axis=1,
    )
    return np.stack([x, y, z], axis=1), gradient / np.linalg.norm(gradient, axis=1, keepdims=True)


def bone(anatomy: Anatomy, disk: Array, rear: Array) -> Array:
    """Points on the bone.

    Parameters
    ----------
    anatomy, disk, rear
        As in `exterior`.

    Returns
    -------
    points : (n, 3) ndarray [mm]
    """
    radius, direction = _polar(disk)
    stations = _bone_stations(anatomy)
    half_width, half_height = bone_half_sizes(anatomy, stations)
    transverse = _BONE_CROWDING * (half_width + half_height) / 2
    x = np.interp(radius, _arc_fraction(stations, transverse), stations)
    x = np.where(rear > 0, anatomy.nail_root * (1 - rear), x)
    half_width, half_height = bone_half_sizes(anatomy, x)
    axis = anatomy.bone_axis_height + anatomy.shape.bone_axis_rise * x / anatomy.bone_length
    norm = _norm(direction[:, 0], direction[:, 1], anatomy.shape.bone_section_exponent)
    direction = direction / np.where(norm > 0, norm, 1.0)[:, None]
    return np.stack([x, half_width * direction[:, 0], axis + half_height * direction[:, 1]], axis=1)


def bone_half_sizes(anatomy: Anatomy, x: Array) -> tuple[Array, Array]:
    """Half width and half height of the bone's section at `x` : (n,) ndarray [mm]."""
    neck, tuft = anatomy.neck_position, anatomy.tuft_position
    to_neck = _smoothstep((x - anatomy.shape.bone_base_length) / (neck - anatomy.shape.bone_base_length))
    to_tuft = _smoothstep((x - neck) / (tuft - neck))
    e = anatomy.shape.bone_end_exponent
    end = (1 - np.clip((x - tuft) / (anatomy.bone_length - tuft), 0, 1) ** e) ** (1 / e)

    def half(proximal: float, at_neck: float, distal: float) -> Array:
        return (proximal + (at_neck - proximal) * to_neck + (distal - at_neck) * to_tuft) * end / 2

    return (
        half(anatomy.bone_proximal_width, anatomy.bone_neck_width, anatomy.bone_distal_width),
        half(anatomy.bone_proximal_height, anatomy.bone_neck_height, anatomy.bone_distal_height),
    )


def _norm(a: Array, b: Array, exponent: float) -> Array:
    """Length of (a, b) in the norm whose unit circle is a superellipse; even in both."""
    return (np.abs(a) ** exponent + np.abs(b) ** exponent) ** (1 / exponent)


def _polar(disk: Array) -> tuple[Array, Array]:
    """Radius, at most one, and unit direction; at the centre, where none exists, the direction is zero."""
    radius = np.hypot(disk[:, 0], disk[:, 1])
    direction = disk / np.where(radius > 0, radius, 1.0)[:, None]
    return np.minimum(radius, 1.0), direction


def _meridian(fraction: Array, length: float, width: float) -> tuple[Array, Array]:
    """Cosine and sine of the meridian angle at an arc fraction of a quarter ellipse, exact at both ends."""
    angle = np.linspace(0, np.pi / 2, _SAMPLES)
    arc = _arc_fraction(length * np.cos(angle), width * np.sin(angle))
    found = np.interp(fraction, arc, angle)
    return np.where(fraction >= 1, 0.0, np.cos(found)), np.sin(found)


def _bone_stations(anatomy: Anatomy) -> Array:
    """Stations from the bone's tip back to the nail root, denser at the round end: (m,) ndarray [mm]."""
    tuft = anatomy.tuft_position
    end = tuft + (anatomy.bone_length - tuft) * np.cos(np.linspace(0, np.pi / 2, _SAMPLES))
    return np.concatenate([end, np.linspace(tuft, anatomy.nail_root, _SAMPLES)[1:]])


def _arc_fraction(x: Array, y: Array) -> Array:
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return arc / arc[-1]


def _smoothstep(t: Array) -> Array:
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)
