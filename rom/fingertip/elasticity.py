"""From anatomy and mesh to stiffness and mass, tissue by tissue, in SI.

Kept by tissue because loss factors may differ by tissue, and because a matrix is linear in each tissue's
moduli.
"""

from __future__ import annotations

import logging

import numpy as np
from scipy import sparse

from rom.fingertip.anatomy import TISSUES, Anatomy
from rom.fingertip.elements import Formulation, assemble, check_formulation, element_mass, element_stiffness
from rom.fingertip.mesh import FingertipMesh

log = logging.getLogger(__name__)

MEGAPASCAL = 1e6  # [Pa]
GRAM_PER_CM3 = 1e3  # [kg/m3]


def stiffness_by_tissue(
    mesh: FingertipMesh, anatomy: Anatomy, formulation: Formulation = "b-bar"
) -> dict[str, sparse.csr_matrix]:
    """Stiffness of the unconstrained body, one matrix a tissue.

    Parameters
    ----------
    mesh : FingertipMesh
    anatomy : Anatomy
        Gives the moduli.
    formulation : {"b-bar", "full"}

    Returns
    -------
    stiffness : dict of (3n, 3n) csr_matrix [N/m]
        Keyed by tissue name; dof = 3 x node + component.

    Raises
    ------
    ValueError
        For an unknown formulation.
    """
    check_formulation(formulation)
    matrices = {}
    for name, hexahedra in _elements_by_tissue(mesh).items():
        tissue = anatomy.tissue(name)
        mu, kappa = tissue.shear_modulus * MEGAPASCAL, tissue.bulk_modulus * MEGAPASCAL
        local = element_stiffness(mesh.nodes, hexahedra, mu, kappa, formulation)
        matrices[name] = assemble(hexahedra, local, mesh.n_nodes)
    log.info("assembled stiffness of %d elements (%s)", len(mesh.hexahedra), formulation)
    return matrices


def mass_by_tissue(mesh: FingertipMesh, anatomy: Anatomy) -> dict[str, sparse.csr_matrix]:
    """Consistent mass of the unconstrained body, one matrix a tissue.

    Parameters
    ----------
    mesh : FingertipMesh
    anatomy : Anatomy
        Gives the densities.

    Returns
    -------
    mass : dict of (3n, 3n) csr_matrix [kg]
        Keyed by tissue name; dof = 3 x node + component.
    """
    matrices = {}
    for name, hexahedra in _elements_by_tissue(mesh).items():
        local = element_mass(mesh.nodes, hexahedra, anatomy.tissue(name).density * GRAM_PER_CM3)
        scalar = assemble(hexahedra, local, mesh.n_nodes)
        matrices[name] = sparse.kron(scalar, sparse.identity(3), format="csr")
    log.info("assembled mass of %d elements", len(mesh.hexahedra))
    return matrices


def _elements_by_tissue(mesh: FingertipMesh) -> dict[str, np.ndarray]:
    return {name: mesh.hexahedra[mesh.tissue == index] for index, name in enumerate(TISSUES)}
