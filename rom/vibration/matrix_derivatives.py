"""How stiffness and mass change with a parameter, seen through given vectors: V^T K_p V and V^T M_p V.

Summed over element matrices, nothing is assembled. With a tissue's property the derivative is exact, as K is linear in
shear and bulk modulus and M in density. With a length or the surfaces' shape it is a central difference of the element
matrices over moved nodes (the connectivity stays), called semi-analytic in structural optimisation (Haftka and Guerdal,
Elements of Structural Optimization, 1992).

The step is 2e-5 of the parameter. On a coarse mesh frequencies' logarithmic derivatives then differ by less than 1e-6
from those with steps from 1e-6 to 3e-5. With 1e-4 truncation reaches 1e-5 for the fingertip's length, which pulls the
skin away from the bone's end; rounding of sums over elements, some 1e-14 divided by the step, stays out of sight. The
tables of arc length that place the nodes have kinks, which move derivatives by the bone's shape by some 1e-5.

The nail ends at element edges, so on a mesh a length may shift it by a whole row of elements. The derivative is that of
a mesh whose elements keep their tissues: the step is halved until they do.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import AnatomyError
from rom.fingertip import Fingertip
from rom.fingertip.anatomy import TISSUES, Anatomy
from rom.fingertip.elasticity import GRAM_PER_CM3, MEGAPASCAL
from rom.fingertip.elements import Formulation, element_mass, element_stiffness
from rom.fingertip.mesh import FingertipMesh, build_mesh
from rom.vibration.parameters import Parameter, parameters, with_parameter

log = logging.getLogger(__name__)

Floats = NDArray[np.float64]

#: Step of a central difference, relative to the parameter's scale.
STEP = 2e-5

#: How often the step is halved before an element that still changes its tissue is refused.
HALVINGS = 6

_BLOCK = 512  # elements at a time: their matrices stay in the cache


@dataclass(frozen=True, eq=False)
class ProjectedDerivatives:
    """Derivatives of stiffness and mass by parameter, between vectors.

    Parameters
    ----------
    parameters : tuple of Parameter
        p of them.
    stiffness : (p, 6, r, r) ndarray [N/m per unit]
        V^T K_t,p V of each tissue t, in the order of `rom.fingertip.anatomy.TISSUES`, times the vectors' units.
    mass : (p, r, r) ndarray [kg per unit]
        V^T M_p V.
    tissue_stiffness : (6, r, r) ndarray [N/m]
        V^T K_t V itself.
    """

    parameters: tuple[Parameter, ...]
    stiffness: Floats
    mass: Floats
    tissue_stiffness: Floats


def projected_derivatives(
    fingertip: Fingertip, vectors: ArrayLike, names: Iterable[str] | None = None
) -> ProjectedDerivatives:
    """V^T K_p V and V^T M_p V for every parameter.

    Parameters
    ----------
    fingertip : Fingertip
    vectors : (n_free, r) array
        Real displacement fields, such as mode shapes.
    names : iterable of str, optional
        Parameters; all by default.

    Returns
    -------
    ProjectedDerivatives

    Raises
    ------
    ValueError
        For vectors of another length, an unknown name, or an element that changes its tissue with any step.
    """
    chosen, v = parameters(fingertip, names), np.asarray(vectors, dtype=np.float64)
    if v.ndim != 2 or len(v) != len(fingertip.free_dofs):
        rows = len(fingertip.free_dofs)
        raise ValueError(f"The vectors have shape {v.shape}, but they need ({rows}, r): one row a free dof.")
    mesh, anatomy = fingertip.mesh, fingertip.anatomy
    forms = _ElementForms(mesh, fingertip.formulation, fingertip.free_dofs, v)
    shear, bulk, density = _material(anatomy)
    ones, zeros = np.ones(len(TISSUES)), np.zeros(len(TISSUES))
    by_shear, by_density = forms.stiffness(mesh.nodes, ones, zeros), forms.mass(mesh.nodes, ones)
    by_bulk = forms.stiffness(mesh.nodes, zeros, ones)

    r = v.shape[1]
    stiffness, mass = np.zeros((len(chosen), len(TISSUES), r, r)), np.zeros((len(chosen), r, r))
    for i, parameter in enumerate(chosen):
        if parameter.kind == "property":
            owner, _, item = parameter.name.rpartition(".")
            t = TISSUES.index(owner)
            stiffness[i, t], mass[i] = _property(item, anatomy, t, by_shear[t], by_bulk[t], by_density[t])
        else:
            step, (low, high) = _moved(fingertip, parameter)
            ends = [forms.stiffness(nodes, shear, bulk) for nodes in (low, high)]
            stiffness[i] = (ends[1] - ends[0]) / (2 * step)
            ends = [forms.mass(nodes, density).sum(axis=0) for nodes in (low, high)]
            mass[i] = (ends[1] - ends[0]) / (2 * step)
    tissue = shear[:, None, None] * by_shear + bulk[:, None, None] * by_bulk
    return ProjectedDerivatives(chosen, stiffness, mass, tissue)


def _moved(fingertip: Fingertip, parameter: Parameter) -> tuple[float, list[Floats]]:
    """Step, and the nodes at its lower and upper end."""
    step = STEP * parameter.scale
    for _ in range(HALVINGS + 1):
        meshes = [_mesh(with_parameter(fingertip, parameter.name, parameter.value + s)) for s in (-step, step)]
        if all(np.array_equal(mesh.tissue, fingertip.mesh.tissue) for mesh in meshes):
            return step, [mesh.nodes for mesh in meshes]
        step /= 2
    raise ValueError(
        f"{parameter.name} is {parameter.value:g} {parameter.unit}, where an element's centre lies on the nail's edge: "
        "its tissue jumps, and nothing has a derivative on this mesh; change the value a little, or the mesh density."
    )


def _mesh(fingertip: Fingertip) -> FingertipMesh:
    try:
        return build_mesh(fingertip.anatomy, fingertip.density)
    except AnatomyError as error:
        raise AnatomyError(f"No derivative where a small step cannot be made: {error}") from error


def _material(anatomy: Anatomy) -> tuple[Floats, Floats, Floats]:
    """Shear and bulk modulus [Pa] and density [kg/m3] of each tissue: three (6,) ndarray."""
    tissues = [anatomy.tissue(name) for name in TISSUES]
    return (
        np.array([tissue.shear_modulus for tissue in tissues]) * MEGAPASCAL,
        np.array([tissue.bulk_modulus for tissue in tissues]) * MEGAPASCAL,
        np.array([tissue.density for tissue in tissues]) * GRAM_PER_CM3,
    )


def _property(
    item: str, anatomy: Anatomy, t: int, by_shear: Floats, by_bulk: Floats, by_density: Floats
) -> tuple[Floats, Floats]:
    """Derivatives of a tissue's stiffness and mass by one of its properties, in the tables' units."""
    tissue = anatomy.tissue(TISSUES[t])
    if item == "density":
        return np.zeros_like(by_shear), GRAM_PER_CM3 * by_density
    shear, bulk = tissue.shear_modulus * MEGAPASCAL, tissue.bulk_modulus * MEGAPASCAL
    if item == "elastic_modulus":
        return (shear * by_shear + bulk * by_bulk) / tissue.elastic_modulus, np.zeros_like(by_shear)
    nu = tissue.poisson_ratio  # mu = E / (2 (1 + nu)), kappa = E / (3 (1 - 2 nu))
    return -shear / (1 + nu) * by_shear + 2 * bulk / (1 - 2 * nu) * by_bulk, np.zeros_like(by_shear)


class _ElementForms:
    """Bilinear forms of element matrices between vectors, summed by tissue."""

    def __init__(self, mesh: FingertipMesh, formulation: Formulation, free_dofs: NDArray, vectors: Floats) -> None:
        self._formulation = formulation
        self._field = np.zeros((mesh.n_nodes, 3 * vectors.shape[1]))
        self._field.reshape(3 * mesh.n_nodes, -1)[free_dofs] = vectors
        self._count = vectors.shape[1]
        by_tissue = np.argsort(mesh.tissue, kind="stable")
        self._blocks = [
            (mesh.hexahedra[some], mesh.tissue[some])
            for some in np.split(by_tissue, range(_BLOCK, len(by_tissue), _BLOCK))
        ]

    def stiffness(self, nodes: Floats, shear: Floats, bulk: Floats) -> Floats:
        """(6, r, r) ndarray: V^T K_t V for nodes and moduli, by tissue."""
        total = np.zeros((len(TISSUES), self._count, self._count))
        for hexahedra, tissue in self._blocks:
            corners, local = _apart(nodes, hexahedra)
            matrices = element_stiffness(corners, local, shear[tissue], bulk[tissue], self._formulation)
            v = self._field[hexahedra].reshape(len(hexahedra), 24, -1)
            self._add(total, tissue, v, matrices @ v)
        return (total + total.transpose(0, 2, 1)) / 2

    def mass(self, nodes: Floats, density: Floats) -> Floats:
        """(6, r, r) ndarray: V^T M_t V, by tissue."""
        total = np.zeros((len(TISSUES), self._count, self._count))
        for hexahedra, tissue in self._blocks:
            corners, local = _apart(nodes, hexahedra)
            v = self._field[hexahedra]  # (e, 8, 3 r): the same matrix for each component
            self._add(total, tissue, v, element_mass(corners, local, density[tissue]) @ v)
        return (total + total.transpose(0, 2, 1)) / 2

    def _add(self, total: Floats, tissue: NDArray, v: Floats, product: Floats) -> None:
        for t in np.unique(tissue):
            some = tissue == t
            total[t] += v[some].reshape(-1, self._count).T @ product[some].reshape(-1, self._count)


def _apart(nodes: Floats, hexahedra: NDArray) -> tuple[Floats, NDArray]:
    """The same elements with corners of their own, and no other node."""
    return nodes[hexahedra].reshape(-1, 3), np.arange(hexahedra.size).reshape(hexahedra.shape)
