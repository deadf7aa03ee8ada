"""The modal ROM of a fingertip's surface, small enough for a file to mail.

With s = omega^2 / (1 + i eta) the answer of `modal-krylov` on the surface is

    u = 1 / (1 + i eta) * ( sum_k phi_k (phi_k^T f) / (lambda_k - s)  +  R(s) f ),

a sum of poles and a smooth remainder R, whose own poles all lie beyond the kept modes. R is kept as a power series in s
whose first term is the static correction, exact; the others are fitted to 1 / (1 - x), x = s theta, on the sector of
the complex plane that frequencies and loss factors reach, which takes half as many terms as Taylor's. All terms share
one orthogonal basis, so that a term is a small matrix (loads x basis). Numbers are 16-bit integers.

:class:`SurfaceModel` is read back from the very bytes that a browser gets, and evaluates as the browser does; so what
it deviates from `modal-krylov` is what the page deviates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.interactive.surface import Surface, surface_of
from rom.interactive.wire import decode, encode
from rom.metamodels.modal import ModalKrylov
from rom.scenes import CaseArrays

HIGHEST_HZ = 300.0
LOSS_FACTORS = (0.05, 1.0)
"""What the sector of s covers; a loss factor of zero is beside it and all but as good."""
TERMS = 6
"""Of the power series, the static one included."""
KEPT = 2e-4
"""Vectors of the common basis are left out below this share of the largest."""
LARGEST = 32767
LEVELS, FEWEST_LEVELS = 12_000, 15
"""Integers on each side of zero for the largest and for the smallest vector of the common basis."""


@dataclass(frozen=True, eq=False)
class SurfaceModel:
    """What a page needs to compute alone.

    Parameters
    ----------
    header : dict
        Names, ranges, what was measured; JSON-able.
    arrays : dict of ndarray
        See :func:`compress`.
    """

    header: dict[str, Any]
    arrays: dict[str, np.ndarray]

    def displacement(self, load: np.ndarray, force: np.ndarray, frequency: float, loss_factor: float) -> np.ndarray:
        """(n_vertex, 3) ndarray [m], complex: the surface under forces, computed as the browser does.

        Parameters
        ----------
        load : (n_force,) ndarray of int
            Positions in ``mesh.pad_nodes``.
        force : (n_force,) ndarray [N]
        frequency : float [Hz]
        loss_factor : float
        """
        vertices = np.arange(len(self.arrays["vertex_node"]))
        return np.tensordot(force, self.unit_responses(frequency, loss_factor, vertices)[load], axes=1)

    def unit_responses(self, frequency: float, loss_factor: float, vertices: np.ndarray) -> np.ndarray:
        """(n_load, n, 3) ndarray [m/N], complex: some vertices under a unit force at each pad node."""
        a = self.arrays
        complex_part = 1.0 + 1j * (loss_factor if frequency > 0 else 0.0)
        s = (2.0 * np.pi * frequency) ** 2 / complex_part
        modal = a["participation"] / (a["eigenvalue"] - s) * a["mode_factor"]
        powers = (s / self.header["s_unit"]) ** np.arange(len(a["rest_term"]))
        rest = np.tensordot(powers, a["rest_term"].astype(float), axes=1) * a["rest_factor"]
        columns = (3 * vertices[:, None] + np.arange(3)).ravel()
        u = modal @ a["mode"][:, columns].astype(float) + rest @ a["rest"][:, columns].astype(float)
        return (u / complex_part).reshape(len(u), -1, 3)


def compress(model: ModalKrylov, title: str = "") -> SurfaceModel:
    """The surface of a fitted `modal-krylov` as small integers.

    Parameters
    ----------
    model : ModalKrylov
    title : str

    Returns
    -------
    SurfaceModel
    """
    tip = model.scene.body.fingertip
    surface = surface_of(tip)
    rows = _vertex_rows(tip, surface)
    modes = _at(model.shapes.field, rows)
    own = _at(model.own_shapes.field, rows)  # (load, vector, 3 n_vertex)
    s_unit = (2.0 * np.pi * HIGHEST_HZ) ** 2
    reach = s_unit * float(model.theta.max())
    series = economised_series(reach, TERMS)
    weight = series[:, None, None] * (model.theta * s_unit) ** np.arange(TERMS)[:, None, None] * model.first
    terms = np.einsum("jlp,lpn->jln", weight, own, optimize=True)
    basis, coordinates = _common_basis(terms)
    mode, mode_factor = quantise(modes)
    rest, term, factor = quantise_product(basis, coordinates)
    header = {"title": title, "pad_center": int(tip.mesh.fingerprint_centroid), "s_unit": s_unit,
              "n_nodes": tip.mesh.n_nodes, "method": model.name, "settings": dict(model.settings)}
    return SurfaceModel(header, {
        **surface_arrays(surface),
        "eigenvalue": model.eigenvalue, "participation": model.participation,
        "mode": mode, "mode_factor": mode_factor, "rest": rest, "rest_term": term, "rest_factor": factor})


def surface_arrays(surface: Surface) -> dict[str, np.ndarray]:
    """What a picture of the surface needs, in the types that a browser gets."""
    return {"vertices": surface.vertices.astype("<f4"), "triangles": surface.triangles.astype("<u4"),
            "vertex_node": surface.vertex_node.astype("<u4"), "vertex_normal": surface.vertex_normal.astype("<f4"),
            "vertex_tissue": surface.vertex_tissue.astype("<u1"), "pad_vertex": surface.pad_vertex.astype("<u4")}


def economised_series(reach: float, terms: int) -> np.ndarray:
    """(terms,) ndarray: factors a_j of sum a_j x^j, nearly the best for 1 / (1 - x) where |x| <= reach.

    The first is one, so that statics stay exact; the phase of x runs from zero to that of 1 / (1 + i).
    """
    size = reach * np.linspace(0.0, 1.0, 61)[1:, None]
    x = (size / (1.0 + 1j * np.linspace(0.0, LOSS_FACTORS[1], 21))).ravel()
    wanted = x / (1.0 - x)
    powers = x[:, None] ** np.arange(1, terms)
    stacked, target = np.concatenate([powers.real, powers.imag]), np.concatenate([wanted.real, wanted.imag])
    weight = np.ones(len(x))
    for _ in range(40):  # Lawson: weighted least squares that tend to the least maximum
        root = np.sqrt(np.tile(weight, 2))
        factor = np.linalg.lstsq(stacked * root[:, None], target * root, rcond=None)[0]
        weight *= np.abs(powers @ factor - wanted)
        weight /= weight.sum()
    return np.concatenate([[1.0], factor])


def quantise(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """16-bit integers, and the factor of each row that turns them back."""
    factor = np.abs(rows).max(axis=1) / LARGEST
    factor[factor == 0] = 1.0
    return np.rint(rows / factor[:, None]).astype("<i2"), factor


def quantise_product(basis: np.ndarray, coordinates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integers of ``coordinates @ basis`` that round all parts of the product by about the same amount.

    What a vector adds decides how finely it is kept, so most integers are small and compress well.

    Parameters
    ----------
    basis : (r, n) ndarray
    coordinates : (terms, load, r) ndarray

    Returns
    -------
    basis : (r, n) ndarray of int16
    coordinates : (terms, load, r) ndarray of int16
    factor : (r,) ndarray
        Of each vector: the product is ``(coordinates * factor) @ basis``.
    """
    size = np.abs(coordinates).max(axis=(0, 1))
    scaled = basis * size[:, None]
    largest = np.abs(scaled).max(axis=1)
    step = largest.max() / LEVELS
    levels = np.maximum(LEVELS * largest / largest.max(), FEWEST_LEVELS)
    return np.rint(scaled / step).astype("<i2"), np.rint(coordinates / size * levels).astype("<i2"), step / levels


def _vertex_rows(tip: Any, surface: Surface) -> np.ndarray:
    """(3 n_vertex,) ndarray of int: positions among the free dofs, -1 where a vertex is held."""
    place = np.full(3 * tip.mesh.n_nodes, -1)
    place[tip.free_dofs] = np.arange(len(tip.free_dofs))
    return place[(3 * surface.vertex_node[:, None] + np.arange(3)).ravel()]


def _at(fields: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return np.where(rows < 0, 0.0, fields[..., rows])


def _common_basis(terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (r, 3 n_vertex), orthonormal, and coordinates (terms, load, r) in them."""
    flat = terms.reshape(-1, terms.shape[-1])
    values, vectors = np.linalg.eigh(flat @ flat.T if len(flat) < flat.shape[1] else flat.T @ flat)
    values, vectors = values[::-1], vectors[:, ::-1]
    kept = values > KEPT**2 * values[0]
    basis = (vectors[:, kept].T @ flat if len(flat) < flat.shape[1] else vectors[:, kept].T).astype(float)
    basis /= np.linalg.norm(basis, axis=1, keepdims=True)
    return basis, terms @ basis.T


def deviation(model: ModalKrylov, small: SurfaceModel, frequencies: np.ndarray, loss_factors: np.ndarray
              ) -> dict[str, float]:
    """How far the small model is from the model it was made of, over every pad node as load and as output.

    Parameters
    ----------
    model : ModalKrylov
    small : SurfaceModel
    frequencies : (n,) ndarray [Hz]
    loss_factors : (m,) ndarray

    Returns
    -------
    dict
        Largest ``field``: difference at any pad node over the case's largest displacement; ``norm``: of the pad's
        field, relative, Euclidean; ``probe``: normal displacement at the loaded node, relative; ``bound``: the model's
        own certified relative bound against the finite elements (energy norm).
    """
    n_load = len(model.participation)
    pad = small.arrays["pad_vertex"]
    inward = -small.arrays["vertex_normal"][pad].astype(float)
    each = np.arange(n_load)
    worst = dict.fromkeys(("field", "norm", "probe", "bound"), 0.0)
    for frequency in frequencies:
        for loss_factor in loss_factors:
            cases = CaseArrays(each[:, None], np.ones((n_load, 1)), np.full(n_load, float(frequency)),
                               np.full(n_load, float(loss_factor) if frequency > 0 else 0.0))
            whole = model.evaluate(cases, "pad").reshape(n_load, -1, 3)
            ours = small.unit_responses(frequency, loss_factor, pad)
            off = np.linalg.norm(ours - whole, axis=2)
            size = np.linalg.norm(whole, axis=2)
            probe = np.einsum("lc,lc->l", inward, whole[each, each])
            probe_off = np.einsum("lc,lc->l", inward, (ours - whole)[each, each])
            found = {"field": (off.max(axis=1) / size.max(axis=1)).max(),
                     "norm": (np.linalg.norm(off, axis=1) / np.linalg.norm(size, axis=1)).max(),
                     "probe": (np.abs(probe_off) / np.abs(probe)).max(),
                     "bound": model.indicators(cases)["relative_energy_error_bound"][1].max()}
            worst = {name: max(worst[name], float(found[name])) for name in worst}
    return worst


def to_bytes(small: SurfaceModel) -> bytes:
    """In the form of the page's messages."""
    return encode(small.header, small.arrays)


def from_bytes(data: bytes) -> SurfaceModel:
    """What :func:`to_bytes` wrote."""
    return SurfaceModel(*decode(data))
