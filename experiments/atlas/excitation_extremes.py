"""Extremes of the excitation: damping, frequency, distance from a resonance, clusters of modes."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import product

import numpy as np

from atlas.level import POINT, STATIC, Level, harmonic_cases, networks, static_cases
from rom.fingertip import Fingertip
from rom.fullorder import natural_modes
from rom.scenes import CaseArrays, LinearScene
from rom.vibration.parity import reflected

SCANNED = np.linspace(0.4, 2.5, 8)
"""Factors of the dermis' modulus among which two modes are sought that cross."""
LOOKED_AT = 8


def loss_factor() -> list[Level]:
    """Loss factor from none to more than any tissue's."""
    return [Level("loss factor", f"η {eta:g}", f"loss factor {eta:g} at 60 and 210 Hz", POINT,
                  harmonic_cases([60.0, 210.0], eta)) for eta in (0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.5, 0.6, 2.0, 100.0)]


def frequency() -> list[Level]:
    """Frequency from rest to far above everything that was learned."""
    levels = [Level("frequency", "static", "no frequency at all", STATIC, static_cases)]
    return levels + [Level("frequency", f"{hertz:g} Hz", f"{hertz:g} Hz at loss factor 0.1", POINT,
                           harmonic_cases(hertz)) for hertz in (0.0, 1e-3, 1.0, 100.0, 300.0, 500.0, 1e3, 5e3, 1e5)]


def resonance_distance() -> list[Level]:
    """Near the first resonance and exactly at it, without damping and nearly so."""
    levels = []
    for eta in (0.0, 1e-6):
        for distance in (1.0, 1e-3, 1e-6, 1e-9, 0.0):
            levels.append(Level("resonance distance", f"η {eta:g}, {distance:g} Hz off",
                                f"{f'{distance:g} Hz above' if distance else 'exactly at'} the first resonance, loss "
                                f"factor {eta:g}", POINT,
                                _beside_resonance(distance, eta)))
    return levels


def _beside_resonance(distance: float, eta: float):
    def cases(scene: LinearScene) -> CaseArrays:
        first = float(scene.model.natural_modes(count=3).frequency_hz[0])
        return harmonic_cases(first + distance, eta)(scene)
    return cases


def mode_clusters() -> list[Level]:
    """Two modes nearly or exactly equal, with the basis cut inside the pair too."""
    levels = []
    for gap in (1e-2, 1e-6, 1e-12):
        for eta in (0.1, 1e-6):
            levels.append(Level("mode clusters", f"gap {gap:g}, η {eta:g}",
                                f"between two modes {gap:g} apart (relative), loss factor {eta:g}", POINT,
                                _at_pair(eta), change=_crossing(gap), skip=networks()))
        levels.append(Level("mode clusters", f"gap {gap:g}, cut",
                            f"a basis that ends between two modes {gap:g} apart", POINT, _at_pair(0.1),
                            change=_crossing(gap), methods=("modal", "modal-static", "modal-krylov"),
                            settings=_cut_settings()))
    return levels


def _cut_settings() -> dict[str, dict]:
    """So few modes that the basis ends at or within the lowest pair that crosses."""
    return {"modal": {"modes": 2}, "modal-static": {"modes": 2}, "modal-krylov": {"modes": 2, "vectors": 12}}


def _at_pair(eta: float):
    def cases(scene: LinearScene) -> CaseArrays:
        hertz = scene.model.natural_modes(count=LOOKED_AT).frequency_hz
        k = int(np.argmin(np.diff(hertz) / hertz[1:]))
        return harmonic_cases([(hertz[k] + hertz[k + 1]) / 2], eta)(scene)
    return cases


def _crossing(gap: float):
    def change(tip: Fingertip) -> Fingertip:
        factor, slope = crossing_factor(tip)
        return _with_dermis(tip, factor + gap / slope)
    return change


def _with_dermis(tip: Fingertip, factor: float) -> Fingertip:
    modulus = tip.anatomy.dermis.elastic_modulus * factor
    return replace(tip, anatomy=tip.anatomy.replace_tissue("dermis", elastic_modulus=modulus))


@lru_cache(maxsize=4)
def crossing_factor(tip: Fingertip) -> tuple[float, float]:
    """Factor of the dermis' modulus at which a mode symmetric about the mid-plane crosses one that is not.

    Returns
    -------
    factor : float
    slope : float
        Relative gap of the two frequencies per unit of the factor.

    Raises
    ------
    ValueError
        Where no two of the first modes cross within `SCANNED`.
    """
    from scipy.optimize import brentq

    def gap(factor: float, i: int, j: int) -> float:
        """Relative distance of the i-th symmetric mode and the j-th of the others."""
        even, odd = frequencies_by_symmetry(_with_dermis(tip, factor))
        return float((even[i] - odd[j]) / odd[j])

    tables = [frequencies_by_symmetry(_with_dermis(tip, factor)) for factor in SCANNED]
    # each kind's last ones may leave the computed set between two scanned factors
    n_even, n_odd = (min(len(table[kind]) for table in tables) - 2 for kind in (0, 1))
    for i, j in sorted(product(range(n_even), range(n_odd)), key=sum):
        change = np.flatnonzero(np.diff(np.sign([even[i] - odd[j] for even, odd in tables])))
        if change.size:
            low, high = SCANNED[change[0]], SCANNED[change[0] + 1]
            at = float(brentq(gap, low, high, args=(i, j), xtol=1e-14, rtol=1e-14))
            return at, abs(gap(high, i, j) - gap(low, i, j)) / (high - low)
    raise ValueError(f"no two of the first {LOOKED_AT} modes cross as the dermis' modulus changes: use another mesh")


def frequencies_by_symmetry(tip: Fingertip) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] of modes symmetric about the mid-plane, and of the others."""
    # close modes of both kinds may come mixed: the reflection, seen from within their span, tells them apart
    modes = natural_modes(tip.stiffness, tip.mass, count=LOOKED_AT + 6)
    image = reflected(tip.mesh, tip.free_dofs, modes.shape)
    share, turn = np.linalg.eigh(modes.shape.T @ (tip.mass @ image))
    kinds = (turn[:, share > 0.5], turn[:, share < -0.5])
    even, odd = (np.linalg.eigvalsh(one.T @ (modes.eigenvalue[:, None] * one)) for one in kinds)
    return np.sqrt(even) / (2 * np.pi), np.sqrt(odd) / (2 * np.pi)
